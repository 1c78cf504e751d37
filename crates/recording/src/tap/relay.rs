//! One connection of a tap: forwards bytes, the close of one half, and resets in both directions. Bytes are recorded before
//! they are forwarded.

use super::TapLog;
use crate::transcript::{EndReason, PeerId, RecordKind, Side};
use socket2::SockRef;
use std::io;
use std::net::Shutdown;
use std::pin::pin;
use std::time::Duration;
use tokio::io::Interest;
use tokio::net::TcpStream;
use tracing::{debug, info};
use ts3100_driver::socket;

/// Bytes read at once; no more of one direction is ever held.
const READ_BUFFER: usize = 4_096;

/// Who has reset the connection.
struct ResetBy(Side);

/// Carries both directions until both sides have ended, or one has reset the connection.
pub(super) async fn relay(line: PeerId, host: &TcpStream, robot: &TcpStream, log: &TapLog) {
    for stream in [host, robot] {
        // A text that waits for the next one would change the times.
        if let Err(error) = stream.set_nodelay(true) {
            debug!("{line}: cannot set TCP_NODELAY: {error}");
        }
    }
    if let Err(ResetBy(by)) = carry(line, host, robot, log).await {
        let word = side_name(by);
        info!(event = "tap-reset", %line, "{line}: the {word} has reset the connection");
        log.ended(line, by, EndReason::Reset);
        reset(host);
        reset(robot);
    }
}

async fn carry(line: PeerId, host: &TcpStream, robot: &TcpStream, log: &TapLog) -> Result<(), ResetBy> {
    let mut to_robot = pin!(forward(line, Side::Host, host, robot, log));
    let mut to_host = pin!(forward(line, Side::Robot, robot, host, log));
    let first = tokio::select! {
        done = &mut to_robot => done.map(|()| Side::Host)?,
        done = &mut to_host => done.map(|()| Side::Robot)?,
    };
    // Nobody reads from a side that has closed its half; that it resets the rest has to be seen otherwise.
    let (closed, rest) = match first {
        Side::Host => (host, to_host),
        Side::Robot => (robot, to_robot),
    };
    tokio::select! {
        biased;
        done = rest => done,
        () = until_failed(closed) => Err(ResetBy(first)),
    }
}

/// One direction until its sender has closed it.
async fn forward(
    line: PeerId,
    by: Side,
    from: &TcpStream,
    to: &TcpStream,
    log: &TapLog,
) -> Result<(), ResetBy> {
    let mut buffer = [0; READ_BUFFER];
    loop {
        let ready = socket::ready(from, Interest::READABLE).await;
        ready.map_err(|_| ResetBy(by))?;
        match from.try_read(&mut buffer) {
            Ok(0) => break,
            Ok(length) => {
                let bytes = buffer.get(..length).unwrap_or_default();
                let sent = bytes.to_vec().into();
                log.record(match by {
                    Side::Host => RecordKind::FromHost { line, bytes: sent },
                    Side::Robot => RecordKind::FromRobot { line, bytes: sent },
                });
                socket::write_all(to, bytes)
                    .await
                    .map_err(|_| ResetBy(by.other()))?;
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(_) => return Err(ResetBy(by)),
        }
    }
    info!(event = "tap-closed", %line, "{line}: the {} has closed", side_name(by));
    log.ended(line, by, EndReason::Closed);
    // Fails when the other side was faster; its own end is seen by the other direction.
    let _ = SockRef::from(to).shutdown(Shutdown::Write);
    Ok(())
}

/// Ready when the connection has failed.
async fn until_failed(stream: &TcpStream) {
    // An error of the waiting itself comes to the same.
    let _ = socket::ready(stream, Interest::ERROR).await;
}

/// Has the connection end by a reset when it is dropped.
pub(super) fn reset(stream: &TcpStream) {
    // Fails when the connection is gone, which comes to the same.
    let _ = SockRef::from(stream).set_linger(Some(Duration::ZERO));
}

const fn side_name(side: Side) -> &'static str {
    match side {
        Side::Host => "host",
        Side::Robot => "controller",
    }
}
