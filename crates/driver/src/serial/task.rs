//! What every serial line task has: the channels to and from the driver, the read credit, and the buffer of unwritten
//! bytes. The kinds of lines are in `pty`, `device` and `tcp`.

use super::{SerialEvent, SerialMessage, SerialSettings};
use std::collections::VecDeque;
use std::sync::Arc;
use tokio::sync::{Semaphore, mpsc};
use tracing::{debug, trace};
use ts3100_controller::{HostEnd, HostSettings, Port};
use ts3100_proto::escape::Escaped;

/// Bytes per read.
pub(super) const READ_BUFFER: usize = 1_024;
/// Bytes buffered for a host that does not read; further bytes are lost.
const WRITE_BUFFER: usize = 16 * 1_024;

/// A command of the driver to a line task.
#[derive(Debug)]
pub(super) enum TaskCommand {
    /// Send these bytes to the host.
    Send(Vec<u8>),
    /// The robot now uses these settings.
    Settings(SerialSettings),
}

/// The state that a line task shares with the driver.
pub(super) struct SerialTask {
    pub(super) port: Port,
    pub(super) id: u64,
    pub(super) driver: mpsc::Sender<SerialMessage>,
    pub(super) commands: mpsc::Receiver<TaskCommand>,
    pub(super) credit: Arc<Semaphore>,
    pub(super) settings: SerialSettings,
}

/// The driver has ended, so the task ends too.
pub(super) struct DriverGone;

impl SerialTask {
    /// Sends an event to the driver.
    pub(super) async fn send_event(&self, event: SerialEvent) -> Result<(), DriverGone> {
        let (port, id) = (self.port, self.id);
        let message = SerialMessage { port, id, event };
        self.driver.send(message).await.map_err(|_| DriverGone)
    }

    /// Reports the settings of the host's port.
    pub(super) async fn send_host_settings(&self, settings: HostSettings) -> Result<(), DriverGone> {
        self.send_event(SerialEvent::Settings(HostEnd::Modelled(settings)))
            .await
    }

    /// Delivers received bytes and consumes that much read credit.
    pub(super) async fn send_received(&self, bytes: Vec<u8>) -> Result<(), DriverGone> {
        if bytes.is_empty() {
            return Ok(());
        }
        log_bytes(self.port, '<', &bytes);
        self.credit.forget_permits(bytes.len());
        self.send_event(SerialEvent::Received(bytes)).await
    }

    /// Waits for read credit; returns how many bytes may be read. Cancel safe.
    pub(super) async fn readable_bytes(credit: &Semaphore) -> usize {
        // The semaphore is never closed, so this cannot fail.
        let permit = credit.acquire().await;
        drop(permit);
        credit.available_permits().min(READ_BUFFER)
    }
}

/// Bytes that wait to be written to the host.
#[derive(Default)]
pub(super) struct WriteBuffer {
    bytes: VecDeque<u8>,
}

impl WriteBuffer {
    /// Appends bytes up to the limit; drops the rest.
    pub(super) fn push(&mut self, port: Port, bytes: &[u8]) {
        let room = WRITE_BUFFER.saturating_sub(self.bytes.len());
        if bytes.len() > room {
            debug!(
                port = port.name(),
                "{port}: {} bytes lost, the host does not read",
                bytes.len() - room
            );
        }
        self.bytes.extend(bytes.iter().take(room));
    }

    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Whether the buffer is full, so that nothing more should be read.
    pub(super) fn is_full(&self) -> bool {
        self.bytes.len() >= WRITE_BUFFER
    }

    /// The bytes to be written next.
    pub(super) fn as_slice(&mut self) -> &[u8] {
        self.bytes.make_contiguous()
    }

    /// Removes `count` bytes that were written.
    pub(super) fn consume(&mut self, port: Port, count: usize) {
        let bytes: Vec<u8> = self.bytes.drain(..count.min(self.bytes.len())).collect();
        log_bytes(port, '>', &bytes);
    }

    /// Takes all bytes.
    pub(super) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes).into()
    }

    /// Appends bytes without a limit; the caller has applied it before.
    pub(super) fn append(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    pub(super) fn clear(&mut self) {
        self.bytes.clear();
    }
}

/// On a channel without texts nothing else is logged, so log at a higher level.
fn log_bytes(port: Port, direction: char, bytes: &[u8]) {
    let text = Escaped::for_reading(bytes);
    if port.protocol().is_some() {
        trace!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    } else {
        debug!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    }
}
