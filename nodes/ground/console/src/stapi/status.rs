//! How states of requests are told as statuses of orders.

use swath_mission::requests::lifecycle::State;
use swath_mission::time_text;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::nanoseconds;

use super::models::Status;

/// The status code of a state, and the reason where the state says more than the code.
#[must_use]
pub fn code(state: State) -> (&'static str, Option<&'static str>) {
    match state {
        State::Received => ("received", None),
        State::Rejected => ("rejected", None),
        State::Held => ("held", None),
        State::Accepted => ("accepted", None),
        // Not `scheduled`, which can no longer be cancelled.
        State::Scheduled => ("tasked", Some("slewing")),
        State::Executing => ("tasked", Some("imaging")),
        State::Completed => ("completed", None),
        State::CancelledByUser => ("user_cancelled", None),
        State::CancelledBySystem => ("cancelled", None),
        State::Expired => ("expired", None),
        State::Failed => ("failed", None),
        State::Superseded => ("cancelled", Some("superseded")),
        State::FulfilledByLink => ("completed", Some("fulfilled_by_link")),
    }
}

/// A state with its reason, as a status.
#[must_use]
pub fn status(state: u8, reason_code: u16, reason: &str, stamp_ns: u64) -> Status {
    let (status_code, says) = code(State::from_number(state).unwrap_or(State::Received));
    let number = (reason_code != 0).then(|| reason_code.to_string());
    Status {
        timestamp: time_text::format(stamp_ns),
        status_code: status_code.to_owned(),
        reason_code: says.map(str::to_owned).or(number),
        reason_text: (!reason.is_empty()).then(|| reason.to_owned()),
        links: Vec::new(),
    }
}

/// The strips of an order as one: a strip and its twin count once.
#[must_use]
pub fn of_all(strips: &[&msg::StripStatus]) -> Status {
    let known = |strip: &msg::StripStatus| State::from_number(strip.state).unwrap_or(State::Received);
    // What counts of a strip and its twin, and of an order's strips while some are under way.
    let rank = |state: State| match state {
        State::Executing => 0,
        State::Scheduled => 1,
        State::Completed => 2,
        State::FulfilledByLink => 3,
        State::Held => 4,
        State::Accepted => 5,
        State::Received => 6,
        _ => 7,
    };
    let best = |one: &&msg::StripStatus| {
        let twin = strips.iter().find(|it| it.strip.id == one.linked_to);
        let states = [Some(known(one)), twin.map(|it| known(it))];
        states.into_iter().flatten().min_by_key(|state| rank(*state)).unwrap_or(State::Received)
    };
    let firsts: Vec<_> = strips.iter().filter(|it| it.linked_to == 0 || it.strip.id < it.linked_to).collect();
    let states: Vec<_> = firsts.iter().map(|it| best(it)).collect();
    let newest = strips.iter().max_by_key(|it| nanoseconds(&it.header.stamp));
    let stamp = newest.map_or(0, |it| nanoseconds(&it.header.stamp));
    if let ([first], [state]) = (&firsts[..], &states[..]) {
        // The reason is that of the way that counts.
        let twin = strips.iter().find(|it| it.strip.id == first.linked_to);
        let counts = [Some(**first), twin.copied()].into_iter().flatten().find(|it| known(it) == *state);
        let counts = counts.unwrap_or(first);
        return status(counts.state, counts.reason_code, &counts.reason, nanoseconds(&counts.header.stamp));
    }
    let imaged = states.iter().filter(|it| matches!(it, State::Completed | State::FulfilledByLink)).count();
    let open = states.iter().filter(|it| rank(**it) != 2 && rank(**it) != 3 && rank(**it) != 7).copied();
    let state = match (open.min_by_key(|state| rank(*state)), imaged) {
        (Some(state), _) => state,
        (None, 1..) => State::Completed,
        (None, 0) => states.first().copied().unwrap_or(State::Received),
    };
    let (status_code, says) = code(state);
    Status {
        timestamp: time_text::format(stamp),
        status_code: status_code.to_owned(),
        reason_code: says.map(str::to_owned),
        reason_text: Some(format!("{imaged} of {} strips are imaged", states.len())),
        links: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The codes that the specification knows.
    const KNOWN: [&str; 13] = [
        "received",
        "accepted",
        "rejected",
        "completed",
        "cancelled",
        "scheduled",
        "held",
        "processing",
        "reserved",
        "tasked",
        "user_cancelled",
        "expired",
        "failed",
    ];

    fn strip(id: u64, state: State, linked_to: u64) -> msg::StripStatus {
        let mut status = msg::StripStatus { state: state as u8, linked_to, ..Default::default() };
        status.strip.id = id;
        status
    }

    fn told(strips: &[msg::StripStatus]) -> (String, Option<String>) {
        let all: Vec<_> = strips.iter().collect();
        let status = of_all(&all);
        (status.status_code, status.reason_text)
    }

    #[test]
    fn every_state_has_a_code_of_the_specification() {
        assert!(State::ALL.into_iter().all(|state| KNOWN.contains(&code(state).0)));
    }

    #[test]
    fn a_strip_and_its_twin_are_one() {
        let pair = [strip(1, State::FulfilledByLink, 2), strip(2, State::Completed, 1)];
        assert_eq!(told(&pair), ("completed".to_owned(), None));
        let pair = [strip(1, State::Expired, 2), strip(2, State::Accepted, 1)];
        assert_eq!(told(&pair), ("accepted".to_owned(), None));
        assert_eq!(told(&[strip(1, State::Failed, 0)]), ("failed".to_owned(), None));
    }

    #[test]
    fn several_strips_stand_where_the_busiest_does() {
        let several =
            |states: &[State]| told(&(1..).zip(states).map(|(id, state)| strip(id, *state, 0)).collect::<Vec<_>>());
        let text = |text: &str| Some(text.to_owned());
        assert_eq!(
            several(&[State::Completed, State::Executing]),
            ("tasked".to_owned(), text("1 of 2 strips are imaged"))
        );
        assert_eq!(
            several(&[State::Completed, State::Accepted]),
            ("accepted".to_owned(), text("1 of 2 strips are imaged"))
        );
        assert_eq!(
            several(&[State::Completed, State::Failed]),
            ("completed".to_owned(), text("1 of 2 strips are imaged"))
        );
        assert_eq!(several(&[State::Failed, State::Failed]), ("failed".to_owned(), text("0 of 2 strips are imaged")));
    }
}
