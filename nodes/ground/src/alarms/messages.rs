//! Alarms and what happened to them as messages, and the names of their numbers.

use swath_msgs::swath_msgs as msg;
use swath_node::stamp::Stamper;

use swath_mission::alarms::{Entry, Event, Severity, Standing, State};

/// An alarm as it stands.
#[must_use]
pub fn alarm(stamper: &Stamper, standing: &Standing) -> msg::Alarm {
    let Standing { key, severity, alarm, text } = standing;
    let until = alarm.shelved_until();
    msg::Alarm {
        node: key.node.clone(),
        name: key.name.clone(),
        severity: severity_number(*severity),
        state: state_number(alarm.state()),
        beneath: state_number(alarm.beneath()),
        text: text.clone(),
        sequence: alarm.sequence,
        raised_tick: alarm.raised.0,
        raised: stamper.time(alarm.raised),
        shelved_until_tick: until.map_or(0, |tick| tick.0),
        shelved_until: until.map(|tick| stamper.time(tick)).unwrap_or_default(),
    }
}

/// A line of the journal.
#[must_use]
pub fn event(stamper: &Stamper, entry: &Entry) -> msg::AlarmEvent {
    msg::AlarmEvent {
        header: stamper.header(entry.tick, ""),
        tick: entry.tick.0,
        number: entry.number,
        node: entry.key.node.clone(),
        name: entry.key.name.clone(),
        severity: severity_number(entry.severity),
        event: Event::ALL.iter().position(|it| *it == entry.event).unwrap_or(0) as u8,
        state: state_number(entry.state),
        sequence: entry.sequence,
        actor: entry.actor.clone(),
        text: entry.text.clone(),
    }
}

fn severity_number(severity: Severity) -> u8 {
    Severity::ALL.iter().position(|it| *it == severity).unwrap_or(0) as u8 + 1
}

fn state_number(state: State) -> u8 {
    State::ALL.iter().position(|it| *it == state).unwrap_or(0) as u8
}

/// Name of a severity by its number.
#[must_use]
pub fn severity_name(number: u8) -> &'static str {
    Severity::ALL.get(usize::from(number.wrapping_sub(1))).map_or("unknown", |it| it.name())
}

/// Name of a state by its number.
#[must_use]
pub fn state_name(number: u8) -> &'static str {
    State::ALL.get(usize::from(number)).map_or("unknown", |it| it.name())
}

/// Name of an event by its number.
#[must_use]
pub fn event_name(number: u8) -> &'static str {
    Event::ALL.get(usize::from(number)).map_or("unknown", |it| it.name())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_interface() {
        use msg::{Alarm, AlarmEvent};
        let severities = [Alarm::SEVERITY_WARN, Alarm::SEVERITY_ERROR, Alarm::SEVERITY_CRITICAL];
        assert_eq!(severities.map(severity_name), ["warn", "error", "critical"]);
        assert_eq!(Severity::ALL.map(severity_number), severities);
        let states = [
            Alarm::STATE_NORMAL,
            Alarm::STATE_UNACKNOWLEDGED,
            Alarm::STATE_ACKNOWLEDGED,
            Alarm::STATE_RETURNED_UNACKNOWLEDGED,
            Alarm::STATE_SHELVED,
        ];
        assert_eq!(State::ALL.map(state_number), states);
        assert_eq!(state_name(Alarm::STATE_RETURNED_UNACKNOWLEDGED), "returned unacknowledged");
        let events = [
            AlarmEvent::EVENT_RAISED,
            AlarmEvent::EVENT_RETURNED,
            AlarmEvent::EVENT_ACKNOWLEDGED,
            AlarmEvent::EVENT_SHELVED,
            AlarmEvent::EVENT_UNSHELVED,
        ];
        assert_eq!(events.map(event_name), ["raised", "returned", "acknowledged", "shelved", "unshelved"]);
        assert_eq!((severity_name(0), state_name(9), event_name(9)), ("unknown", "unknown", "unknown"));
    }
}
