//! What a line task has of the driver: where to tell, what it is told, how much it may read; and what it still has
//! to write.

use super::{SerialEvent, SerialMessage, SerialSettings};
use crate::log::Escaped;
use std::collections::VecDeque;
use std::sync::Arc;
use tokio::sync::{Semaphore, mpsc};
use tracing::{debug, trace};
use ts3100_controller::{HostEnd, HostSettings, Port};

/// Bytes read at once.
pub(super) const READ_BUFFER: usize = 1_024;
/// Bytes that may wait for a host that does not read; of more, the newest are lost.
const WRITE_BUFFER: usize = 16 * 1_024;

/// What the driver tells a line task.
#[derive(Debug)]
pub(super) enum TaskCommand {
    /// Bytes off the line, for the host.
    Send(Vec<u8>),
    /// The robot's settings are these from now on.
    Settings(SerialSettings),
}

/// The driver's end of a line task.
pub(super) struct SerialTask {
    pub(super) port: Port,
    pub(super) id: u64,
    pub(super) driver: mpsc::Sender<SerialMessage>,
    pub(super) commands: mpsc::Receiver<TaskCommand>,
    pub(super) credit: Arc<Semaphore>,
    pub(super) settings: SerialSettings,
}

/// The driver is gone, and nobody wants to know any more.
pub(super) struct DriverGone;

impl SerialTask {
    /// Tells the driver.
    pub(super) async fn send_event(&self, event: SerialEvent) -> Result<(), DriverGone> {
        let (port, id) = (self.port, self.id);
        let message = SerialMessage { port, id, event };
        self.driver.send(message).await.map_err(|_| DriverGone)
    }

    /// Tells it how the host's port is set.
    pub(super) async fn send_host_settings(&self, settings: HostSettings) -> Result<(), DriverGone> {
        self.send_event(SerialEvent::Settings(HostEnd::Modelled(settings)))
            .await
    }

    /// Tells it of bytes of the host; of those it was allowed, the rest may be read later.
    pub(super) async fn send_received(&self, bytes: Vec<u8>) -> Result<(), DriverGone> {
        if bytes.is_empty() {
            return Ok(());
        }
        log_bytes(self.port, '<', &bytes);
        self.credit.forget_permits(bytes.len());
        self.send_event(SerialEvent::Received(bytes)).await
    }

    /// Waits until bytes may be read; returns how many. Cancel safe.
    pub(super) async fn readable_bytes(credit: &Semaphore) -> usize {
        // Never closed, so an error cannot be.
        let permit = credit.acquire().await;
        drop(permit);
        credit.available_permits().min(READ_BUFFER)
    }
}

/// Bytes for the host.
#[derive(Default)]
pub(super) struct WriteBuffer {
    bytes: VecDeque<u8>,
}

impl WriteBuffer {
    /// Puts bytes in, as many as there is room for.
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

    /// Whether so much waits that nothing more is to be asked for.
    pub(super) fn is_full(&self) -> bool {
        self.bytes.len() >= WRITE_BUFFER
    }

    /// The bytes to be written next.
    pub(super) fn as_slice(&mut self) -> &[u8] {
        self.bytes.make_contiguous()
    }

    /// So many have been written.
    pub(super) fn consume(&mut self, port: Port, count: usize) {
        let bytes: Vec<u8> = self.bytes.drain(..count.min(self.bytes.len())).collect();
        log_bytes(port, '>', &bytes);
    }

    /// All bytes, to be put elsewhere.
    pub(super) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes).into()
    }

    /// Puts bytes in that were counted before.
    pub(super) fn append(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    pub(super) fn clear(&mut self) {
        self.bytes.clear();
    }
}

/// On a channel without texts the bytes are all there is to show.
fn log_bytes(port: Port, direction: char, bytes: &[u8]) {
    let text = Escaped(bytes);
    if port.protocol().is_some() {
        trace!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    } else {
        debug!(event = "bytes", port = port.name(), %text, "{port} {direction} {text}");
    }
}
