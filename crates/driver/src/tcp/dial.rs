//! Client channels (ETH-04, ETH-05): dialled at power-on, and again after each lost connection.
//! [`super::Channels`] starts one dialling task for each client channel.

use super::NewConnection;
use super::connection::prepare;
use std::net::SocketAddr;
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot};
use tokio::time::{sleep, timeout};
use tracing::debug;
use ts3100_controller::port::Port;

/// Timeout of one connection attempt.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);

/// Dials until the driver ends, with `pause` after each failure and each lost connection.
pub(super) async fn dial(
    port: Port,
    peer: SocketAddr,
    pause: Duration,
    dialled: mpsc::Sender<NewConnection>,
) {
    loop {
        match timeout(CONNECT_TIMEOUT, TcpStream::connect(peer)).await {
            Ok(Ok(stream)) => {
                prepare(port, &stream);
                let (on_drop, lost) = oneshot::channel();
                if dialled.send((stream, peer, Some(on_drop))).await.is_err() {
                    return;
                }
                // Completes with an error when the connection is dropped.
                let _ = lost.await;
            }
            Ok(Err(error)) => debug!(port = port.name(), "{port}: {peer} does not answer: {error}"),
            Err(_) => debug!(
                port = port.name(),
                "{port}: {peer} does not answer within {CONNECT_TIMEOUT:?}"
            ),
        }
        sleep(pause).await;
    }
}
