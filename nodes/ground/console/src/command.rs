//! `swath console`.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::{Args, Subcommand};
use rustls::ServerConfig;
use swath_mission::file::Mission;
use swath_mission::time_text;
use swath_node::out;
use swath_ros::{Node, RosArgs, Shutdown, Signal, graph};
use swath_sim::config::SimConfig;

use crate::desks::{self, Counter, Desks};
use crate::guard::Guard;
use crate::http;
use crate::live::{Ear, catch_up};
use crate::replay;
use crate::server::Site;
use crate::shared::Shared;
use crate::tokens::{Role, Tokens, now_ns, usual_file};

/// `swath console`.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  swath console\n  swath console --bag bags/samples/mission\n  \
        swath console token add alice --role operator --expires 30d"
)]
pub struct ConsoleArgs {
    #[command(subcommand)]
    command: Option<ConsoleCommand>,
    #[command(flatten)]
    show: ShowArgs,
}

#[derive(Debug, Subcommand)]
enum ConsoleCommand {
    /// Say who may look and command from other machines.
    #[command(subcommand)]
    Token(TokenCommand),
}

#[derive(Debug, Args)]
struct ShowArgs {
    /// Show this bag instead of the mission that flies.
    #[arg(long)]
    bag: Option<PathBuf>,
    /// Namespace of the mission's nodes, such as /sat2 [default: /swath]
    #[arg(long)]
    namespace: Option<String>,
    /// Address and port; one that other machines reach needs TLS and tokens.
    #[arg(long, default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// File of the mission that flies: its name, its least elevation and its limits.
    #[arg(long, conflicts_with = "bag")]
    mission: Option<PathBuf>,
    /// What the page calls the mission; its name, or its namespace and domain without this.
    #[arg(long)]
    title: Option<String>,
    /// Certificate chain (PEM).
    #[arg(long, requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Its private key (PEM).
    #[arg(long, requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Name or address under which other machines know this one, as often as needed; the one of --listen without this.
    #[arg(long, requires = "tls_cert")]
    host: Vec<String>,
    /// File of tokens [default: swath/tokens.toml in the configuration folder].
    #[arg(long, requires = "tls_cert")]
    tokens: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
enum TokenCommand {
    /// Add a token and print its secret, which is not kept.
    Add {
        /// Whose it is; the trail says so.
        name: String,
        /// What its bearer may do.
        #[arg(long, value_enum)]
        role: Role,
        /// When it ends: after so many days or hours (30d, 8h), or a time (2027-01-01T00:00:00Z).
        #[arg(long)]
        expires: String,
        #[command(flatten)]
        file: TokensFile,
    },
    /// List tokens.
    List {
        #[command(flatten)]
        file: TokensFile,
    },
    /// Take a token away; it ends at once.
    Revoke {
        /// Whose it is.
        name: String,
        #[command(flatten)]
        file: TokensFile,
    },
}

#[derive(Debug, Args)]
struct TokensFile {
    /// File of tokens [default: swath/tokens.toml in the configuration folder].
    #[arg(long)]
    tokens: Option<PathBuf>,
}

impl TokensFile {
    fn path(&self) -> Result<PathBuf> {
        self.tokens.clone().map_or_else(usual_file, Ok)
    }
}

/// Shows a mission until Ctrl-C, or changes tokens.
///
/// # Errors
/// When the bag or a file cannot be read, the address cannot be used, or DDS fails.
pub fn run(args: &ConsoleArgs, ros: &RosArgs) -> Result<()> {
    match &args.command {
        Some(ConsoleCommand::Token(command)) => change_tokens(command),
        None => Door::open(&args.show)?.show(&args.show, ros),
    }
}

fn change_tokens(command: &TokenCommand) -> Result<()> {
    match command {
        TokenCommand::Add { name, role, expires, file } => {
            let path = file.path()?;
            let mut tokens = Tokens::read(&path)?;
            let secret = tokens.add(name, *role, end(expires, now_ns())?)?;
            tokens.write(&path)?;
            out::print_line(secret)?;
        }
        TokenCommand::List { file } => {
            for token in Tokens::read(&file.path()?)?.tokens {
                out::print_line(format_args!("{}  {:?}  until {}", token.name, token.role, token.expires))?;
            }
        }
        TokenCommand::Revoke { name, file } => {
            let path = file.path()?;
            let mut tokens = Tokens::read(&path)?;
            tokens.revoke(name)?;
            tokens.write(&path)?;
        }
    }
    Ok(())
}

/// When a token ends [ns since 1970-01-01 UTC], of a time or of a duration from now.
fn end(text: &str, now_ns: u64) -> Result<u64> {
    let number = |unit: char| text.strip_suffix(unit).and_then(|it| it.parse::<u64>().ok());
    let hours = number('h').or(number('d').and_then(|days| days.checked_mul(24)));
    let end = match hours {
        Some(hours) => hours.checked_mul(3_600_000_000_000).and_then(|it| it.checked_add(now_ns)),
        None => Some(time_text::parse(text).map_err(|why| anyhow::anyhow!("{why}, nor a duration such as 30d or 8h"))?),
    };
    let end = end.filter(|end| *end <= i64::MAX as u64).with_context(|| format!("{text} is too far away"))?;
    ensure!(end > now_ns, "{text} is over");
    Ok(end)
}

/// Checks a name under which other machines know this one: the port is that of --listen.
fn check_host(name: &str) -> Result<()> {
    let v6 = name.starts_with('[') && name.ends_with(']');
    ensure!(
        !name.is_empty() && (v6 || !name.contains([':', '/'])),
        "--host {name}: expected a name or an address, without scheme and port; IPv6 in brackets"
    );
    Ok(())
}

/// The open port, and who is let in by it.
struct Door {
    listener: std::net::TcpListener,
    tls: Option<Arc<ServerConfig>>,
    guard: Guard,
    url: String,
}

impl Door {
    fn open(args: &ShowArgs) -> Result<Self> {
        let tls = args.tls_cert.as_ref().zip(args.tls_key.as_ref());
        let tls = tls.map(|(certificate, key)| http::tls(certificate, key)).transpose()?;
        let listener = http::listen(args.listen, tls.is_some())?;
        let address = listener.local_addr().context("the port has no address")?;
        if tls.is_none() {
            let guard = Guard::of_this_machine(address.port());
            return Ok(Self { listener, tls, guard, url: format!("http://{address}/") });
        }
        let mut names = args.host.clone();
        if names.is_empty() {
            ensure!(!address.ip().is_unspecified(), "--host is missing: under which names is {address} known?");
            names.push(match address {
                SocketAddr::V4(it) => it.ip().to_string(),
                SocketAddr::V6(it) => format!("[{}]", it.ip()),
            });
        }
        names.iter().try_for_each(|name| check_host(name))?;
        let path = args.tokens.clone().map_or_else(usual_file, Ok)?;
        let tokens = Tokens::read(&path)?.tokens.len();
        ensure!(tokens > 0, "{} holds no tokens: nobody could look (swath console token add)", path.display());
        let url = format!("https://{}:{}/", names[0], address.port());
        let guard = Guard::of_the_network(&names, address.port(), path);
        Ok(Self { listener, tls, guard, url })
    }

    fn show(self, args: &ShowArgs, ros: &RosArgs) -> Result<()> {
        let Some(bag) = &args.bag else { return self.show_live(args, ros) };
        let namespace = args.namespace.as_deref().unwrap_or(graph::NAMESPACE);
        let shared = Shared::default();
        let recording = shared.update(|ledger| replay::read(bag, namespace, ledger))?;
        let title = args.title.clone().unwrap_or(recording.title);
        let elevation_min_deg = recording.elevation_min_deg;
        let site = Site { shared, counter: None, title, elevation_min_deg, guard: self.guard };
        start(self.listener, self.tls, site)?;
        announce(&self.url)?;
        wait_for_the_end()
    }

    fn show_live(self, args: &ShowArgs, ros: &RosArgs) -> Result<()> {
        let ros = args.namespace.as_ref().map_or_else(|| ros.clone(), |namespace| ros.clone().in_namespace(namespace));
        let node = Node::start(graph::CONSOLE, &ros)?;
        let shutdown = Shutdown::on_signals(node.signal())?;
        let shared = Shared::default();
        let mut ear = Ear::new(&node)?;
        let desks = Desks::new(&node)?;
        let (counter, handed_in) = Counter::new();
        let place = || format!("{} in domain {}", node.names().namespace(), node.environment().domain);
        let mission = args.mission.as_deref().map(Mission::read).transpose()?;
        let named = mission.as_ref().map(|mission| mission.name.clone());
        let title = args.title.clone().or(named).unwrap_or_else(place);
        let imaging = mission.as_ref().map_or_else(|| SimConfig::default().imaging, |it| it.sim.imaging.clone());
        let elevation_min_deg = imaging.elevation_min_deg;
        shared.update(|ledger| mission.iter().for_each(|mission| ledger.know(mission)));
        let told = Some(counter.clone());
        let site = Site { shared: shared.clone(), counter: told, title, elevation_min_deg, guard: self.guard };
        start(self.listener, self.tls, site)?;
        announce(&self.url)?;
        let list = node.client(&graph::LIST_STRIPS)?;
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

fn start(listener: std::net::TcpListener, tls: Option<Arc<ServerConfig>>, site: Site) -> Result<()> {
    let serve = move || {
        if let Err(error) = http::serve(listener, tls, site) {
            tracing::error!("the console's server has ended: {error:#}");
        }
    };
    std::thread::Builder::new().name("http".to_owned()).spawn(serve).context("no thread for the server")?;
    Ok(())
}

fn announce(url: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{url}")?;
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

#[cfg(test)]
mod tests {
    use super::{check_host, end};

    #[test]
    fn tokens_end_at_a_time_or_after_a_while() {
        let day = 24 * 3_600_000_000_000;
        assert_eq!(end("2d", 5).unwrap(), 2 * day + 5);
        assert_eq!(end("8h", 0).unwrap(), day / 3);
        assert_eq!(end("1970-01-02T00:00:00Z", 0).unwrap(), day);
        for wrong in ["", "d", "-1d", "0d", "1970-01-01T00:00:00Z", "99999999999d", "soon"] {
            assert!(end(wrong, 0).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_host_is_a_name_without_a_port() {
        for name in ["ops.example", "192.0.2.7", "[2001:db8::1]"] {
            check_host(name).unwrap();
        }
        for wrong in ["", "ops.example:8443", "https://ops.example", "2001:db8::1", "ops.example/"] {
            assert!(check_host(wrong).is_err(), "{wrong}");
        }
    }
}
