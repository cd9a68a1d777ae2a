//! `swath bridge`.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::channel;

use anyhow::{Context as _, Result, ensure};
use clap::Args;
use foxglove::websocket::Capability;
use foxglove::{Context, WebSocketServer, WebSocketServerHandle};
use swath_bags::{Bag, TopicPattern};
use swath_ros::{Node, RosArgs, graph};
use tokio::runtime::{Builder, Runtime};

use crate::channels::Channels;
use crate::latched::Kept;
use crate::listener::Listener;
use crate::{live, playback};

/// `swath bridge`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath bridge\n  swath bridge --bag bags/samples/mission\n  \
    swath bridge --services --publish --topics '/swath/.*'")]
pub struct BridgeArgs {
    /// Play this bag instead of listening to the mission that flies.
    #[arg(long, conflicts_with_all = ["services", "publish"])]
    bag: Option<PathBuf>,
    /// Namespace of the mission's nodes, such as /sat2 [default: /swath]
    #[arg(long)]
    namespace: Option<String>,
    /// Address and port; nobody is asked who they are.
    #[arg(long, default_value = "127.0.0.1:8765")]
    listen: SocketAddr,
    /// Only topics whose whole name matches this regular expression.
    #[arg(long)]
    topics: Option<String>,
    /// Let clients call the mission's services.
    #[arg(long)]
    services: bool,
    /// Let clients publish.
    #[arg(long)]
    publish: bool,
}

/// Messages that wait for a slow client; older ones are dropped.
const BACKLOG: usize = 1024;

/// Serves until a signal ends it.
///
/// # Errors
/// When the address cannot be used, the bag not be read, or DDS fails.
pub fn run(args: &BridgeArgs, ros: &RosArgs) -> Result<()> {
    let commands = args.services || args.publish;
    ensure!(
        args.listen.ip().is_loopback() || !commands,
        "{} can be reached from other machines, and nobody is asked who they are: --services and --publish need an \
         address of this machine, such as 127.0.0.1, and `ssh -L`",
        args.listen
    );
    let topics = TopicPattern::new(&[], args.topics.as_deref(), None)?;
    let runtime = Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("foxglove")
        .enable_all()
        .build()
        .context("no runtime")?;
    let context = Context::new();
    let kept = Arc::new(Kept::default());
    let (wishes, heard) = channel();
    let listener = Arc::new(Listener::new(Arc::clone(&kept), wishes));
    let server = server(args, &context).listener(listener);
    let start = |server: WebSocketServer| start(&runtime, server, args.listen);
    let Some(path) = &args.bag else {
        let ros = args.namespace.as_ref().map_or_else(|| ros.clone(), |it| ros.clone().in_namespace(it));
        let node = Node::start(graph::BRIDGE, &ros)?;
        let channels = Channels::new(&context, kept, node.names().namespace());
        let allowed = live::Allowed { services: args.services, publish: args.publish };
        return live::run(node, |services| start(server.services(services)), channels, &heard, topics, allowed);
    };
    let namespace = args.namespace.as_deref().unwrap_or(graph::NAMESPACE);
    let channels = Channels::new(&context, kept, namespace);
    let bag = Bag::open(path)?;
    let (first, last) = bag.time_range().with_context(|| format!("{} holds no messages", path.display()))?;
    let handle = start(server.playback_time_range(first, last))?;
    playback::run(&bag, channels, &handle, &heard, topics)
}

fn server(args: &BridgeArgs, context: &Arc<Context>) -> WebSocketServer {
    let mut capabilities = vec![Capability::Time];
    if args.services {
        capabilities.push(Capability::Services);
    }
    if args.publish {
        capabilities.push(Capability::ClientPublish);
    }
    WebSocketServer::new()
        .name("swath")
        .bind(args.listen.ip().to_string(), args.listen.port())
        .capabilities(capabilities)
        .supported_encodings(["cdr"])
        .message_backlog_size(BACKLOG)
        .context(context)
}

/// Starts the server and says where it is.
fn start(runtime: &Runtime, server: WebSocketServer, listen: SocketAddr) -> Result<WebSocketServerHandle> {
    let handle = runtime.block_on(server.start()).with_context(|| format!("cannot listen on {listen}"))?;
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "ws://{}", SocketAddr::new(listen.ip(), handle.port()))?;
    stdout.flush()?;
    Ok(handle)
}
