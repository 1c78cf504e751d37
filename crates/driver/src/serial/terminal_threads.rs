//! A real serial port on a system that cannot wait for it asynchronously: two threads read and write it.

use super::open_port;
use crate::portion::{log_bytes, take_portion};
use serialport::SerialPort;
use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::task::{Context, Poll, Waker, ready};
use std::time::Duration;
use tokio::sync::mpsc;
use tracing::debug;
use ts3100_controller::Port;
use ts3100_proto::parameter::SerialSettings;

/// Time for which the reading thread waits for bytes before it checks whether it is still wanted.
const READ_TIMEOUT: Duration = Duration::from_millis(50);
/// Most bytes per read.
const READ_BUFFER: usize = 1_024;
/// Writes that may wait for the port.
const WRITE_QUEUE: usize = 256;

/// An open port; its threads end after this is dropped.
pub(super) struct Terminal {
    port: Port,
    writes: mpsc::Sender<Vec<u8>>,
    /// Ends when the port is lost.
    reads: mpsc::Receiver<Vec<u8>>,
    /// Bytes that were read and exceed a portion.
    rest: Vec<u8>,
}

impl Terminal {
    /// Opens a real port with these settings, for this process alone.
    pub(super) fn open(port: Port, path: &Path, settings: SerialSettings) -> io::Result<Terminal> {
        let device = open_port(path, settings, READ_TIMEOUT)?;
        let writer = device.try_clone()?;
        let (writes, queued) = mpsc::channel(WRITE_QUEUE);
        let (read, reads) = mpsc::channel(1);
        spawn("ts3100-serial-in", move || read_all(device, &read))?;
        spawn("ts3100-serial-out", move || write_all(writer, queued))?;
        Ok(Terminal {
            port,
            writes,
            reads,
            rest: Vec::new(),
        })
    }

    /// The next portion that was received; `None` when the port is lost. Nothing is taken while `most` is 0.
    pub(super) fn poll(&mut self, most: usize, context: Option<&mut Context<'_>>) -> Poll<Option<Vec<u8>>> {
        if self.rest.is_empty() {
            if most == 0 {
                return Poll::Pending;
            }
            let mut unheard = Context::from_waker(Waker::noop());
            let context = context.unwrap_or(&mut unheard);
            match ready!(self.reads.poll_recv(context)) {
                Some(bytes) => self.rest = bytes,
                None => return Poll::Ready(None),
            }
            log_bytes(self.port, '<', &self.rest);
        }
        Poll::Ready(Some(take_portion(self.port, &mut self.rest)))
    }

    /// Has the thread write these bytes.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        log_bytes(self.port, '>', bytes);
        if self.writes.try_send(bytes.to_vec()).is_err() {
            let port = self.port;
            debug!(
                port = port.name(),
                "{port}: bytes lost: the port does not accept them"
            );
        }
    }
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work)?;
    Ok(())
}

/// Whether the port only had nothing to do in [`READ_TIMEOUT`].
fn has_waited(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn read_all(mut device: Box<dyn SerialPort>, to: &mpsc::Sender<Vec<u8>>) {
    let mut buffer = [0; READ_BUFFER];
    while !to.is_closed() {
        let bytes = match device.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => buffer.get(..count).unwrap_or_default().to_vec(),
            Err(error) if has_waited(&error) => continue,
            Err(error) => {
                debug!("reading a serial port ended: {error}");
                return;
            }
        };
        if to.blocking_send(bytes).is_err() {
            return;
        }
    }
}

fn write_all(mut device: Box<dyn SerialPort>, mut queued: mpsc::Receiver<Vec<u8>>) {
    while let Some(bytes) = queued.blocking_recv() {
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            match device.write(rest) {
                Ok(0) => return,
                Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                Err(error) if has_waited(&error) && !queued.is_closed() => {}
                Err(_) => return,
            }
        }
    }
}
