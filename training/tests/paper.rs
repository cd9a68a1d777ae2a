//! `docs/paper-comparison.md` says what the configurations say.

use std::path::Path;

use swath_sim::config::SimConfig;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_training::config::{EnvironmentConfig, PpoConfig, RunConfig};
use swath_training::environment::Environment;
use swath_training::network::{Network, NetworkConfig};
use swath_training::strips::Strips;

fn run(file: &str) -> RunConfig {
    RunConfig::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(file)).unwrap()
}

fn page() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/paper-comparison.md")).unwrap()
}

fn has_rows(rows: &[String]) {
    let page = page();
    let missing: Vec<&String> = rows.iter().filter(|row| !page.contains(row.as_str())).collect();
    assert!(
        missing.is_empty(),
        "not on the page:\n{}",
        missing.iter().map(|row| row.trim()).collect::<Vec<_>>().join("\n")
    );
}

/// A number as the page prints it, with a space between thousands.
fn digits(number: u64) -> String {
    let text = number.to_string();
    let groups: Vec<&str> = text.as_bytes().rchunks(3).rev().map(|it| std::str::from_utf8(it).unwrap()).collect();
    if text.len() > 4 { groups.join(" ") } else { text }
}

fn exponent(number: f64) -> String {
    format!("{number:e}").replace('e', " · 10^")
}

const METHODS: [(&str, &str); 6] = [
    ("HOP-PPO", "hop_ppo.toml"),
    ("HOP-PPO MLP", "hop_ppo_mlp.toml"),
    ("H-PPO", "h_ppo.toml"),
    ("Discrete PPO, 15 s", "discrete_ppo_15.toml"),
    ("Discrete PPO, 30 s", "discrete_ppo_30.toml"),
    ("Discrete PPO, 60 s", "discrete_ppo_60.toml"),
];

/// What all runs of a folder have in common.
fn common(folder: &str) -> RunConfig {
    let first = run(&format!("{folder}/hop_ppo.toml"));
    for (_, file) in METHODS {
        let other = run(&format!("{folder}/{file}"));
        assert_eq!((&other.ppo, &other.rollout), (&first.ppo, &first.rollout), "{folder}/{file}");
    }
    first
}

#[test]
fn the_page_sets_every_hyperparameter_beside_table_3() {
    let (paper, compact) = (common("paper"), common("compact"));
    let row = |name: &str, table: &str, of: &dyn Fn(&RunConfig) -> String| {
        format!("\n| {name} | {table} | {} | {} |", of(&paper), of(&compact))
    };
    let optional = |number: Option<f64>| number.map_or_else(|| "none".to_owned(), |number| number.to_string());
    let rate = |it: &RunConfig| match (it.ppo.learning_rate, it.ppo.learning_rate_end) {
        (start, end) if start == end => exponent(start),
        (start, end) => format!("{}, falling to {}", exponent(start), exponent(end)),
    };
    let penalty = |it: &RunConfig| {
        it.ppo.kl_penalty.map_or_else(|| "none".to_owned(), |kl| format!("{}, target {}", kl.coefficient, kl.target))
    };
    has_rows(&[
        row("environments stepped at a time", "32 workers", &|it| it.rollout.environments.to_string()),
        row("first episodes cut off after at most", "-", &|it| match it.rollout.stagger {
            0 => "not cut".to_owned(),
            decisions => format!("{decisions} decisions"),
        }),
        row("learning rate", "3 · 10^-5", &rate),
        row("discount γ, per second", "0.999", &|it| it.ppo.gamma.to_string()),
        row("GAE parameter λ", "0.95", &|it| it.ppo.lambda.to_string()),
        row("training batch size", "3000", &|it| it.ppo.batch.to_string()),
        row("minibatch", "- (128)", &|it| it.ppo.minibatch.to_string()),
        row("SGD iterations", "10", &|it| it.ppo.epochs.to_string()),
        row("PPO clipping", "0.5", &|it| it.ppo.clip.to_string()),
        row("gradient clipping", "0.2", &|it| it.ppo.gradient_norm.to_string()),
        row("value coefficient", "- (1)", &|it| it.ppo.value_coefficient.to_string()),
        row("clamp of the squared value error", "- (10)", &|it| optional(it.ppo.value_clamp)),
        row("entropy coefficient, choice", "- (0)", &|it| it.ppo.entropy_coefficient.to_string()),
        row("entropy coefficient, transition", "- (0)", &|it| it.ppo.transition_entropy_coefficient.to_string()),
        row("KL penalty", "- (0.2, target 0.01)", &penalty),
        row("KL limit of a batch's passes", "-", &|it| optional(it.ppo.kl_stop)),
        row("candidates N", "40", &|it| match &it.environment {
            EnvironmentConfig::Strips(strips) => strips.simulation.planning.candidates.to_string(),
            EnvironmentConfig::Toy(_) => unreachable!(),
        }),
        row("steps, all but Discrete PPO", "3 million", &|it| format!("{} million", it.steps / 1_000_000)),
        format!(
            "\n| steps, Discrete PPO | 5 million | {} million | {} million |",
            run("paper/discrete_ppo_60.toml").steps / 1_000_000,
            run("compact/discrete_ppo_60.toml").steps / 1_000_000
        ),
    ]);
    let defaults = PpoConfig::default();
    assert_eq!((defaults.clip, defaults.gradient_norm), (0.2, 0.5), "as the page says of the defaults");
    let warm = run("compact/hop_ppo_warm.toml");
    assert_eq!((warm.ppo.learning_rate, warm.steps), (3e-4, 500_000), "as the page says of the warm start");
}

/// Weights of a run's network.
fn weights(run: &RunConfig) -> u64 {
    let EnvironmentConfig::Strips(strips) = &run.environment else { unreachable!() };
    let environment = Strips::new(strips).unwrap();
    let (_, layout) = Network::new(&run.network, environment.shape(), environment.parameter_scale_s()).unwrap();
    layout.count() as u64
}

fn sizes(network: &NetworkConfig) -> String {
    match network {
        NetworkConfig::HopPpo(it) => format!(
            "{} wide, {} heads, {} layers, feed-forward {}; {:?}, {:?}, {:?}",
            it.dim, it.heads, it.layers, it.feed_forward, it.discrete, it.continuous, it.critic
        ),
        NetworkConfig::HopPpoMlp(it) => {
            format!("{:?}; {:?}, {:?}, {:?}", it.encoder, it.discrete, it.continuous, it.critic)
        }
        NetworkConfig::HPpo(it) => format!("{:?}; {:?}, {:?}, {:?}", it.encoder, it.discrete, it.continuous, it.critic),
        NetworkConfig::DiscretePpo(it) => format!("{:?}, {:?}", it.discrete, it.critic),
    }
}

#[test]
fn the_page_sets_every_network_beside_table_3() {
    let mut ratios = Vec::new();
    let rows = METHODS.map(|(name, file)| {
        let (paper, compact) = (run(&format!("paper/{file}")), run(&format!("compact/{file}")));
        let ratio = weights(&paper) as f64 / weights(&compact) as f64;
        ratios.push(ratio.round());
        format!(
            "\n| {name} | {} | {} | {} | {} | {ratio:.0} |",
            sizes(&paper.network),
            digits(weights(&paper)),
            sizes(&compact.network),
            digits(weights(&compact))
        )
    });
    has_rows(&rows);
    let (least, most) = ratios.iter().fold((f64::MAX, 0.0f64), |(least, most), it| (least.min(*it), most.max(*it)));
    assert!(page().contains(&format!("{least} to {most} times as many weights")), "{least} to {most}");
}

#[test]
fn the_page_sets_every_setting_of_table_2_beside_its_default() {
    let sim = SimConfig::default();
    let scenario = ScenarioConfig::default();
    let (s, c) = (&sim.spacecraft, &sim.control);
    let row = |name: &str, table: &str, ours: String| format!("\n| {name} | {table} | {ours} |");
    has_rows(&[
        row(
            "altitude, inclination",
            "520 km, 45°",
            format!("{} km, {}°", sim.orbit.altitude_km, sim.orbit.inclination_deg),
        ),
        row("mass", "330 kg", format!("{} kg", s.mass_kg)),
        row("inertia", "[82.1, 98.4, 121.0] kg m²", format!("{:?} kg m²", s.inertia_kg_m2)),
        row("wheel torque u_max", "0.3 N m", format!("{} N m", s.wheel_torque_max_nm)),
        row("K1, K3", "0.25, 3", format!("{}, {}", c.k1, c.k3)),
        row("ω_max", "5 rad/s", format!("{} deg/s", c.omega_max_deg_s)),
        row("K_i, P of the servo", "5.0, 30", format!("{:?}, {}", c.servo_ki, c.servo_p)),
        row("σ_max", "0.1", sim.imaging.sigma_max.to_string()),
        row("θ_min", "10°", format!("{}°", sim.imaging.elevation_min_deg)),
        row(
            "length of random strips",
            "100 to 500 km",
            format!("{} to {} km", scenario.length_km[0], scenario.length_km[1]),
        ),
        row(
            "length that may be asked for",
            "100 to 500 km",
            format!("{} to {} km", sim.requests.length_min_km, sim.requests.length_max_km),
        ),
        row(
            "acquisition speed",
            "2 to 4 km/s",
            format!("{} to {} km/s", scenario.speed_m_s[0] / 1e3, scenario.speed_m_s[1] / 1e3),
        ),
        row("strips in training", "1000 to 5000", format!("{} to {}", scenario.count[0], scenario.count[1])),
    ]);
}
