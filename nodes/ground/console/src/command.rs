//! `swath console`.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use swath_ros::{Node, RosArgs, Shutdown, Signal};
use swath_sim::config::SimConfig;

use crate::desks::{self, Counter, Desks};
use crate::http::{self, Site};
use crate::live::{Ear, catch_up};
use crate::replay;
use crate::shared::Shared;

/// Name of the console's node.
const NODE: &str = "console";

/// `swath console`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath console\n  swath console --bag bags/samples/mission")]
pub struct ConsoleArgs {
    /// Show this bag instead of the mission that flies.
    #[arg(long)]
    bag: Option<PathBuf>,
    /// Namespace of the mission's nodes, such as /sat2.
    #[arg(long, default_value = swath_ros::graph::NAMESPACE)]
    namespace: String,
    /// Address and port; an address of this machine's own.
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
}

/// Shows a mission until Ctrl-C.
///
/// # Errors
/// When the bag cannot be read, the address cannot be used, or DDS fails.
pub fn run(args: &ConsoleArgs, ros: &RosArgs) -> Result<()> {
    let listener = http::listen(args.listen)?;
    let address = listener.local_addr().context("the port has no address")?;
    match &args.bag {
        Some(bag) => {
            let shared = Shared::default();
            let recording = shared.update(|ledger| replay::read(bag, &args.namespace, ledger))?;
            let site =
                Site { shared, counter: None, title: recording.title, elevation_min_deg: recording.elevation_min_deg };
            start(listener, site)?;
            announce(address)?;
            wait_for_the_end()
        }
        None if args.namespace == swath_ros::graph::NAMESPACE => show_live(ros, listener, address),
        None => show_live(&ros.clone().in_namespace(&args.namespace), listener, address),
    }
}

fn show_live(ros: &RosArgs, listener: std::net::TcpListener, address: SocketAddr) -> Result<()> {
    let node = Node::start(NODE, ros)?;
    let shutdown = Shutdown::on_signals(node.signal())?;
    let shared = Shared::default();
    let mut ear = Ear::new(&node)?;
    let desks = Desks::new(&node)?;
    let (counter, handed_in) = Counter::new();
    let title = format!("{} in domain {}", node.names().namespace(), node.environment().domain);
    let elevation_min_deg = SimConfig::default().imaging.elevation_min_deg;
    start(listener, Site { shared: shared.clone(), counter: Some(counter.clone()), title, elevation_min_deg })?;
    announce(address)?;
    let list = node.client(&swath_ros::graph::LIST_STRIPS)?;
    let (desks, asked) = (&desks, &shutdown);
    std::thread::scope(|scope| {
        scope.spawn(move || desks::serve(desks, &handed_in, asked));
        let outcome = follow(&node, &mut ear, &shared, &shutdown, || {
            list.matched().then(|| catch_up(&counter, &shared)).is_some()
        });
        shutdown.ask();
        outcome
    })
}

/// Listens until the console ends; `begin` is tried until it succeeds.
fn follow(node: &Node, ear: &mut Ear, shared: &Shared, shutdown: &Shutdown, begin: impl Fn() -> bool) -> Result<()> {
    let mut begun = false;
    while !shutdown.asked() {
        ear.listen(node, shared)?;
        begun = begun || begin();
    }
    Ok(())
}

fn start(listener: std::net::TcpListener, site: Site) -> Result<()> {
    let serve = move || {
        if let Err(error) = http::serve(listener, site) {
            tracing::error!("the console's server has ended: {error:#}");
        }
    };
    std::thread::Builder::new().name("http".to_owned()).spawn(serve).context("no thread for the server")?;
    Ok(())
}

fn announce(address: SocketAddr) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "http://{address}/")?;
    Ok(stdout.flush()?)
}

fn wait_for_the_end() -> Result<()> {
    let signal = Signal::new();
    let shutdown = Shutdown::on_signals(&signal)?;
    while !shutdown.asked() {
        signal.wait(Duration::from_secs(3600));
    }
    Ok(())
}
