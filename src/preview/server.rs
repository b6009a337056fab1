//! Connections: accepted one by one, bounded in number, in how long a head may take and in how long an answer may wait.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, oneshot};

use super::hub::Hub;
use super::patience::Patient;
use super::routes;

/// Most connections at a time.
const MOST: usize = 64;
/// Largest head, bytes.
const HEAD_BYTES: usize = 64 << 10;
/// How often those who listen for events are told that all is well.
const PULSE: Duration = Duration::from_secs(15);

/// Binds, and serves in a thread of its own until `stopped`. `patience` is how long a request's head may take, and how
/// long a connection may be idle; as much again for its body, and twice as much for an answer to be taken.
pub(super) fn start(
    listen: SocketAddr,
    hub: Arc<Hub>,
    patience: Duration,
    stopped: oneshot::Receiver<()>,
) -> io::Result<(SocketAddr, JoinHandle<()>)> {
    let listener = std::net::TcpListener::bind(listen)?;
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let thread = std::thread::Builder::new().name("preview".to_owned()).spawn(move || {
        runtime.block_on(async move {
            if let Ok(listener) = TcpListener::from_std(listener) {
                tokio::select! {
                    () = serve(listener, address, patience, hub.clone()) => {}
                    () = pulse(&hub) => {}
                    _ = stopped => {}
                }
            }
        });
        runtime.shutdown_background();
    })?;
    Ok((address, thread))
}

async fn pulse(hub: &Hub) {
    loop {
        tokio::time::sleep(PULSE).await;
        hub.listeners.pulse();
    }
}

async fn serve(listener: TcpListener, address: SocketAddr, patience: Duration, hub: Arc<Hub>) {
    let router = routes::router(hub, address, patience);
    let places = Arc::new(Semaphore::new(MOST));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // Out of open files, most likely: those that end make room.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        // One too many is let go at once, so that it can come again; waiting here would keep all others waiting.
        let Ok(place) = places.clone().try_acquire_owned() else { continue };
        let _ = stream.set_nodelay(true);
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let mut http = http1::Builder::new();
            http.timer(TokioTimer::new()).header_read_timeout(patience).max_buf_size(HEAD_BYTES);
            // A client that breaks off is nobody's error.
            let _ = http.serve_connection(TokioIo::new(Patient::new(stream, patience * 2)), service).await;
            drop(place);
        });
    }
}
