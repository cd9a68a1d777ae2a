//! What was told last of the radio, of the ground's plan and of resources: kept, and a fact when it is news.

use swath_mission::file::Mission;
use swath_msgs::swath_msgs as msg;

use crate::facts::Fact;
use crate::telemetry::{self, Link, Plan, Resources};
use crate::ticks::milliseconds;

/// Tasks of all plans that are told, some 100 MB of them; plans of afterwards are told without.
const PLANNED_IN_ALL: usize = 1_000_000;

/// The newest of each, with its time [ms].
#[derive(Default)]
pub struct Newest {
    /// The radio; none in a mission without.
    pub link: Option<(f64, Link)>,
    /// The plan; none where nothing is predicted.
    pub plan: Option<(f64, Plan)>,
    /// Resources; none in a mission without.
    pub resources: Option<(f64, Resources)>,
    momentum_max_nms: Option<f64>,
    /// Tasks of plans that were told.
    planned: usize,
}

impl Newest {
    /// What the mission says of itself.
    pub fn know(&mut self, mission: &Mission) {
        let config = mission.sim.resources.as_ref().or(mission.resources.as_ref());
        self.momentum_max_nms = config.map(|config| config.wheel_momentum_max_nms);
    }

    /// How the radio stands, if that is news.
    pub fn take_link(&mut self, status: &msg::LinkStatus) -> Option<Fact> {
        let link = telemetry::link(status);
        let news = (milliseconds(&status.header.stamp), link.clone());
        (self.link.as_ref() != Some(&news)).then(|| {
            self.link = Some(news);
            Fact::Link(link)
        })
    }

    /// What is predicted, if that is news.
    pub fn take_plan(&mut self, message: &msg::PredictedPlan) -> Option<Fact> {
        let t = milliseconds(&message.header.stamp);
        let mut plan = telemetry::plan(message);
        let news = (t, plan.clone());
        (self.plan.as_ref() != Some(&news)).then(|| {
            self.plan = Some(news);
            if self.planned + plan.tasks.len() > PLANNED_IN_ALL {
                plan.left_out += plan.tasks.len() as u64;
                plan.tasks.clear();
            }
            self.planned += plan.tasks.len();
            Fact::Plan(plan)
        })
    }

    /// How power, data and momentum stand, unless it is no number.
    pub fn take_resources(&mut self, state: &msg::ResourceState) -> Option<Fact> {
        let resources = telemetry::resources(state, self.momentum_max_nms)?;
        self.resources = Some((milliseconds(&state.header.stamp), resources.clone()));
        Some(Fact::Resources(resources))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};
    use swath_msgs::builtin_interfaces::Time;

    use super::*;
    use crate::ledger::Ledger;
    use crate::telemetry::PLANNED;

    const EPOCH_S: i32 = 1_767_225_600;

    fn at(seconds: i32) -> Time {
        Time { sec: EPOCH_S + seconds, nanosec: 0 }
    }

    fn ms(seconds: i32) -> f64 {
        f64::from(EPOCH_S + seconds) * 1000.0
    }

    fn told(ledger: &Ledger, kind: &str) -> Vec<Value> {
        let facts = ledger.after(0, usize::MAX).iter().map(|line| serde_json::from_str::<Value>(line).unwrap());
        facts.filter(|fact| fact["kind"] == kind).collect()
    }

    fn status(seconds: i32, open: bool) -> msg::LinkStatus {
        let pass = |rise, set, elevation| msg::RadioPass {
            station: "awarua".to_owned(),
            rise: at(rise),
            set: at(set),
            elevation,
            ..Default::default()
        };
        let passes = vec![pass(100, 700, 0.5), pass(6000, 6500, f64::NAN)];
        let mut status = msg::LinkStatus { open, waiting_orders: 3, on_board: 40, passes, ..Default::default() };
        status.tick = u64::from(seconds.unsigned_abs()) * 2;
        status.header.stamp = at(seconds);
        status
    }

    #[test]
    fn the_radio_is_told_when_it_is_news() {
        let mut ledger = Ledger::default();
        assert_eq!(ledger.newest().link, None);
        ledger.link(&status(10, false));
        // A latched message comes again to who comes again.
        ledger.link(&status(10, false));
        let heard = msg::LinkStatus { has_housekeeping: true, housekeeping_tick: 220, ..status(120, true) };
        ledger.link(&heard);
        let facts = told(&ledger, "link");
        assert_eq!(facts.iter().map(|it| it["t"].as_f64().unwrap()).collect::<Vec<_>>(), [ms(10), ms(120)]);
        assert_eq!((&facts[0]["open"], &facts[0]["housekeeping"]), (&json!(false), &Value::Null));
        assert_eq!((&facts[1]["open"], &facts[1]["housekeeping"]), (&json!(true), &json!(220)));
        assert_eq!((&facts[1]["waiting_orders"], &facts[1]["on_board"]), (&json!(3), &json!(40)));
        // An elevation that is none has no form in JSON.
        let pass = json!({ "station": "awarua", "rise_ms": ms(100), "set_ms": ms(700),
            "elevation_deg": 0.5_f64.to_degrees() });
        assert_eq!(facts[1]["passes"], json!([pass]));
        assert_eq!(ledger.newest().link.as_ref().map(|(t, link)| (*t, link.open)), Some((ms(120), true)));
        assert_eq!(told(&ledger, "clock").last().map(|clock| clock["epoch_ms"].clone()), Some(json!(ms(0))));
    }

    fn predicted(seconds: i32, tasks: usize) -> msg::PredictedPlan {
        let task = |number: u64| msg::PredictedTask {
            task: number,
            strip_id: number + 1,
            start_tick: number * 100,
            imaging_tick: number * 100 + 40,
            end_tick: number * 100 + 60,
            success: true,
            ..Default::default()
        };
        let tasks = (0..tasks as u64).map(task).collect::<Vec<_>>();
        let mut plan = msg::PredictedPlan { tasks, compared: 12, equal: 11, partings: 1, ..Default::default() };
        plan.parted_reason = "task 7 was decided otherwise".to_owned();
        plan.header.stamp = at(seconds);
        plan
    }

    #[test]
    fn a_plan_is_told_once_and_no_longer_than_there_is_room() {
        let mut ledger = Ledger::default();
        ledger.plan(&predicted(10, 2));
        ledger.plan(&predicted(10, 2));
        ledger.plan(&predicted(20, PLANNED + 5));
        let facts = told(&ledger, "plan");
        assert_eq!(facts.len(), 2);
        let task =
            json!({ "task": 1, "strip": 2, "start": 100, "imaging": 140, "end": 160, "success": true, "known": 0 });
        assert_eq!((&facts[0]["tasks"][1], &facts[0]["left_out"]), (&task, &json!(0)));
        assert_eq!(
            (&facts[0]["equal"], &facts[0]["compared"], &facts[0]["partings"]),
            (&json!(11), &json!(12), &json!(1))
        );
        assert_eq!(facts[0]["parted_reason"], "task 7 was decided otherwise");
        assert_eq!((facts[1]["tasks"].as_array().map(Vec::len), &facts[1]["left_out"]), (Some(PLANNED), &json!(5)));
        // However many plans there are: the newest is known as a whole, and the log ends somewhere.
        let mut newest = Newest { planned: PLANNED_IN_ALL - 1, ..Newest::default() };
        let Some(Fact::Plan(plan)) = newest.take_plan(&predicted(30, 2)) else { panic!("it is news") };
        assert_eq!((plan.tasks.len(), plan.left_out), (0, 2));
        assert_eq!(newest.plan.map(|(_, plan)| plan.tasks.len()), Some(2));
    }

    fn state(momentum: f64) -> msg::ResourceState {
        let mut state =
            msg::ResourceState { charge: 30.0, capacity: 40.0, wheel_momentum: momentum, ..Default::default() };
        (state.stored_bits, state.storage_bits) = (200, 800);
        state.header.stamp = at(10);
        state
    }

    #[test]
    fn resources_are_shares_and_momentum_where_its_limit_is_known() {
        let mut ledger = Ledger::default();
        ledger.resources(&state(5.0));
        let mission: Mission = toml::from_str("[resources]\nwheel_momentum_max_nms = 20.0").unwrap();
        ledger.know(&mission);
        ledger.resources(&msg::ResourceState { safe_mode: msg::ResourceState::SAFE_MODE_BATTERY_EMPTY, ..state(5.0) });
        let facts = told(&ledger, "resources");
        let of = |name: &str| facts.iter().map(|fact| fact[name].clone()).collect::<Vec<_>>();
        assert_eq!((of("battery"), of("storage")), (vec![json!(0.75); 2], vec![json!(0.25); 2]));
        assert_eq!((of("momentum"), of("momentum_nms")), (vec![Value::Null, json!(0.25)], vec![json!(5.0); 2]));
        assert_eq!(of("safe_mode"), ["none", "battery_empty"]);
    }

    #[test]
    fn resources_that_are_no_numbers_are_not_told() {
        let mut ledger = Ledger::default();
        ledger.resources(&state(f64::NAN));
        ledger.resources(&msg::ResourceState { capacity: 0.0, charge: 0.0, ..state(1.0) });
        assert_eq!(told(&ledger, "resources"), Vec::<Value>::new());
        assert_eq!(ledger.newest().resources, None);
        // Without a storage nothing is stored.
        ledger.resources(&msg::ResourceState { storage_bits: 0, ..state(1.0) });
        assert_eq!(told(&ledger, "resources")[0]["storage"], json!(0.0));
    }
}
