//! The port: connections with limits, with or without TLS, each answered by the routes.

use std::convert::Infallible;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use axum::Router;
use axum::http::header::CONTENT_TYPE;
use hyper::Request;
use hyper::body::{Body as _, Incoming};
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use rustls::ServerConfig;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use socket2::{Domain, Protocol, Socket, Type};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio_rustls::TlsAcceptor;

use crate::guests::{Guest, Guests};
use crate::routes;
use crate::server::Site;
use crate::stream;

/// Connections at a time.
const CONNECTIONS: usize = 256;
/// Connections that may wait to be taken; the standard library has 128, and who finds no room tries again a second later.
const QUEUE: i32 = 4096;
/// How long a request's head may take to arrive, and how long TLS may take to begin.
const HEAD_TIME: Duration = Duration::from_secs(10);
/// How long to wait when connections cannot be taken.
const PAUSE: Duration = Duration::from_millis(100);

/// Opens the port; of another address than this machine's own only where there is TLS.
///
/// # Errors
/// When the address can be reached from elsewhere in the clear, or cannot be used.
pub fn listen(address: SocketAddr, tls: bool) -> Result<std::net::TcpListener> {
    ensure!(
        address.ip().is_loopback() || tls,
        "{address} can be reached from other machines: that needs --tls-cert, --tls-key and tokens \
         (swath console token add), or listen on 127.0.0.1 and use `ssh -L`"
    );
    let open = || -> std::io::Result<Socket> {
        let socket = Socket::new(Domain::for_address(address), Type::STREAM, Some(Protocol::TCP))?;
        // As the standard library does: a port is free again at once.
        socket.set_reuse_address(true)?;
        socket.bind(&address.into())?;
        socket.listen(QUEUE)?;
        socket.set_nonblocking(true)?;
        Ok(socket)
    };
    Ok(open().with_context(|| format!("cannot listen on {address}"))?.into())
}

/// TLS with a certificate and its key, both in PEM.
///
/// # Errors
/// When a file cannot be read, or the two do not belong together.
pub fn tls(certificate: &Path, key: &Path) -> Result<Arc<ServerConfig>> {
    let unreadable = |path: &Path| format!("cannot read {}", path.display());
    let chain: Vec<_> = CertificateDer::pem_file_iter(certificate)
        .and_then(Iterator::collect::<Result<_, _>>)
        .with_context(|| unreadable(certificate))?;
    ensure!(!chain.is_empty(), "{} holds no certificate", certificate.display());
    let key = PrivateKeyDer::from_pem_file(key).with_context(|| unreadable(key))?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = ServerConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .context("no version of TLS")?
        .with_no_client_auth()
        .with_single_cert(chain, key)
        .context("certificate and key do not belong together")?;
    Ok(Arc::new(config))
}

/// Answers until the process ends.
///
/// # Errors
/// When the runtime cannot start.
pub fn serve(listener: std::net::TcpListener, tls: Option<Arc<ServerConfig>>, site: Site) -> Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().context("no runtime")?;
    runtime.block_on(async move {
        let listener = TcpListener::from_std(listener).context("cannot listen")?;
        accept(&listener, tls.map(TlsAcceptor::from), &routes::router(site)).await;
        Ok(())
    })
}

async fn accept(listener: &TcpListener, tls: Option<TlsAcceptor>, router: &Router) {
    let guests = Guests::new(CONNECTIONS);
    loop {
        match listener.accept().await {
            Ok((stream, _)) => guests.welcome(|guest| greet(stream, tls.clone(), router.clone(), guest)).await,
            // Out of file descriptors, for one: others may close theirs.
            Err(error) => {
                tracing::warn!("a connection was not taken: {error}");
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

async fn greet(stream: TcpStream, tls: Option<TlsAcceptor>, router: Router, guest: Arc<Guest>) {
    let Some(tls) = tls else { return converse(stream, router, guest).await };
    match tokio::time::timeout(HEAD_TIME, tls.accept(stream)).await {
        Ok(Ok(stream)) => converse(stream, router, guest).await,
        Ok(Err(error)) => tracing::debug!("a connection without TLS: {error}"),
        Err(_) => tracing::debug!("a connection that did not begin TLS"),
    }
}

async fn converse<S>(stream: S, router: Router, guest: Arc<Guest>)
where
    S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
{
    let router = TowerToHyperService::new(router);
    let answer = service_fn(move |mut request: Request<Incoming>| {
        // While a body is under way it waits; whoever reads it says when it has come.
        if request.body().is_end_stream() {
            guest.busy();
        }
        request.extensions_mut().insert(Arc::clone(&guest));
        let (answer, guest) = (router.call(request), Arc::clone(&guest));
        async move {
            let answer = answer.await?;
            // A stream of events goes on for as long as its reader does.
            if answer.headers().get(CONTENT_TYPE).is_none_or(|it| it != stream::MEDIA_TYPE) {
                guest.waits();
            }
            Ok::<_, Infallible>(answer)
        }
    });
    let conversation = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .serve_connection(TokioIo::new(stream), answer);
    if let Err(error) = conversation.await {
        tracing::debug!("a connection has ended: {error}");
    }
}
