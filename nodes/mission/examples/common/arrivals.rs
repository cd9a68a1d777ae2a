//! Orders that come at any time of a day, over radios that are compared.

use anyhow::Result;
use rand::RngExt as _;
use swath_mission::file::Mission;
use swath_mission::orders::action::{Act, Action};
use swath_mission::orders::order::Order;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

/// About a day.
const ORBITS: f64 = 15.0;
/// Orders a day.
pub const ORDERS: usize = 1000;
/// Links that are compared: name, and what `[link]` says.
pub const LINKS: [(&str, &str); 4] = [
    ("always", "mode = \"always\""),
    (
        "7 stations",
        "stations = [\"boulder\", \"merritt\", \"singapore\", \"weilheim\", \"santiago\", \"dongara\", \"hawaii\"]",
    ),
    ("3 stations", "stations = [\"puertollano\", \"awarua\", \"punta-arenas\"]"),
    ("1 station", "stations = [\"puertollano\"]"),
];

/// A mission of a seed with a `[link]`.
///
/// # Errors
/// When it is not valid.
pub fn mission(seed: u64, link: &str) -> Result<Mission> {
    let text = format!("seed = {seed}\norbits = {ORBITS}\n[link]\n{link}\n");
    let mission: Mission = toml::from_str(&text)?;
    mission.validate()?;
    Ok(mission.resolved())
}

/// Orders that come at any time of the mission, the same for every link.
///
/// # Errors
/// When the mission is not valid.
pub fn arrivals(mission: &Mission) -> Result<Vec<Action>> {
    let horizon = mission.horizon(&mission.model()?);
    let mut rng = rng::stream(mission.seed, rng::ARRIVALS);
    let requests = ScenarioConfig::default().generate(&mut rng, ORDERS, mission.sim.earth.radius_m);
    let mut actions: Vec<Action> = (1..)
        .zip(requests)
        .map(|(number, request)| {
            let order = Order::new(format!("order-{number}"), format!("order {number}"), request);
            let at = Tick(rng.random_range(0..horizon.0));
            let act = Act::Submit(StripId(0), Box::new(order));
            Action { at, initial: false, actor: "operator".to_owned(), reason: String::new(), act }
        })
        .collect();
    actions.sort_by_key(|action| action.at);
    Ok(actions)
}
