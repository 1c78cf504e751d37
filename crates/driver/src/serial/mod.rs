//! The serial ports HOST and COM1 seen from outside: a pseudo terminal, a real port, or a TCP port with or without
//! RFC 2217. Each open line is a task that carries bytes and reports events; how long characters take and what wrong
//! settings do to them is decided by the controller.
//!
//! The driver owns [`SerialLines`] and is the only one that changes it. `task` has what every line task shares; `pty`,
//! `device` and `tcp` are the three kinds.

mod device;
mod parmrk;
#[cfg(unix)]
mod pty;
mod rfc2217;
mod task;
mod tcp;

use crate::port_queues::{PortQueues, SplitPortion, split_bytes};
use crate::tcp::LinkOptions;
use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::task::{Context, Poll};
use task::{SerialTask, TaskCommand};
use tokio::sync::{Semaphore, mpsc};
use tokio::task::JoinHandle;
use tracing::{info, warn};
use ts3100_controller::{Controller, HostEnd, Input, Port};
use ts3100_proto::parameter::SerialSettings;

/// Queued commands of a line task; a slower task loses bytes, as a real port does.
const COMMAND_QUEUE: usize = 256;

/// How hosts reach a serial port of the robot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SerialEndpoint {
    /// A pseudo terminal under this name, a symbolic link (`--serial-dir`). Unix only.
    Pty(PathBuf),
    /// A real port (`--serial-host`, `--serial-com1`): `/dev/ttyUSB0`, `COM3`.
    Device(PathBuf),
    /// An access server of RFC 2217 (`--serial-host-rfc2217`, `--serial-com1-rfc2217`).
    Rfc2217(SocketAddr),
    /// Bytes as they are over TCP (`--serial-host-tcp`, `--serial-com1-tcp`).
    Tcp(SocketAddr),
}

impl fmt::Display for SerialEndpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SerialEndpoint::Pty(path) | SerialEndpoint::Device(path) => path.display().fmt(f),
            SerialEndpoint::Rfc2217(address) => write!(f, "rfc2217://{address}"),
            SerialEndpoint::Tcp(address) => write!(f, "socket://{address}"),
        }
    }
}

/// Why a serial line cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum SerialError {
    /// Another emulator uses the directory of the links.
    #[error(
        "{} holds the serial lines of another running ts3100; end that one, or give each its own --serial-dir",
        path.display()
    )]
    InUse {
        /// Path of the directory.
        path: PathBuf,
    },
    /// The path of a link is a file or directory.
    #[error("{port}: {} is no symbolic link; remove it, or choose another --serial-dir", path.display())]
    Occupied {
        /// Port of the line.
        port: Port,
        /// Path of that file.
        path: PathBuf,
    },
    /// An error of the operating system.
    #[error("{port}: cannot {action} {place}: {reason}")]
    Io {
        /// Port of the line.
        port: Port,
        /// The operation that failed.
        action: &'static str,
        /// The path or address.
        place: String,
        /// Error of the operating system.
        reason: io::Error,
    },
    /// This system has no pseudo terminals.
    #[error(
        "{port}: pseudo terminals need a Unix system; use --{}-rfc2217 or a pair of virtual COM ports",
        port.name().to_ascii_lowercase()
    )]
    NoPty {
        /// Port of the line.
        port: Port,
    },
}

/// A message of a line task to the driver.
#[derive(Debug)]
pub struct SerialMessage {
    port: Port,
    id: u64,
    event: SerialEvent,
}

/// An event on a line.
#[derive(Debug)]
enum SerialEvent {
    /// A host has opened the line.
    Opened { peer: String },
    /// Settings of the host's port.
    Settings(HostEnd),
    /// Bytes of the host.
    Received(Vec<u8>),
    /// Characters with a parity or framing error, as read.
    Faults(Vec<u8>),
    /// The host discards bytes that are not yet on the line.
    Purged,
    /// The host has closed the line.
    Closed,
}

impl SerialMessage {
    /// Port that the message concerns.
    #[must_use]
    pub fn port(&self) -> Port {
        self.port
    }
}

impl SplitPortion for SerialMessage {
    fn split_portion(&mut self, port: Port) -> Option<SerialMessage> {
        let SerialEvent::Received(bytes) = &mut self.event else {
            return None;
        };
        let event = SerialEvent::Received(split_bytes(port, bytes)?);
        Some(SerialMessage { event, ..*self })
    }
}

struct OpenSerialLine {
    id: u64,
    task: JoinHandle<()>,
    commands: mpsc::Sender<TaskCommand>,
    /// Read credit of the task, in bytes.
    credit: Arc<Semaphore>,
    /// Credit that was granted and is not used yet, in bytes.
    outstanding: usize,
    peer: Option<String>,
    host: HostEnd,
    /// Bytes were lost because the task was too slow, and this was logged.
    overrun: bool,
    endpoint: SerialEndpoint,
}

/// Both serial lines.
pub struct SerialLines {
    endpoints: BTreeMap<Port, SerialEndpoint>,
    options: LinkOptions,
    open: BTreeMap<Port, OpenSerialLine>,
    #[cfg(unix)]
    locks: pty::DirectoryLocks,
    next_id: u64,
    messages: PortQueues<SerialMessage>,
}

impl SerialLines {
    /// No line is open yet.
    #[must_use]
    pub fn new(ends: BTreeMap<Port, SerialEndpoint>, options: LinkOptions) -> SerialLines {
        SerialLines {
            endpoints: ends,
            options,
            open: BTreeMap::new(),
            #[cfg(unix)]
            locks: pty::DirectoryLocks::default(),
            next_id: 0,
            messages: PortQueues::default(),
        }
    }

    /// Opens every line with the robot's settings.
    ///
    /// # Errors
    /// The first line that cannot be opened; those before it are closed when this value is dropped.
    pub fn open(&mut self, robot: &Controller) -> Result<(), SerialError> {
        for (port, requested) in self.endpoints.clone() {
            let Some(line) = robot.serial_line(port) else {
                continue;
            };
            #[cfg(unix)]
            if let SerialEndpoint::Pty(link) = &requested {
                self.locks.take(port, link)?;
            }
            self.next_id += 1;
            let (commands, waiting) = mpsc::channel(COMMAND_QUEUE);
            let credit = Arc::new(Semaphore::new(0));
            let task = SerialTask {
                port,
                id: self.next_id,
                driver: self.messages.sender(port),
                commands: waiting,
                credit: Arc::clone(&credit),
                settings: line,
            };
            let (place, task) = start(requested, task, self.options)?;
            info!(port = port.name(), "{port} is {place}");
            self.open.insert(
                port,
                OpenSerialLine {
                    id: self.next_id,
                    task,
                    commands,
                    credit,
                    outstanding: 0,
                    peer: None,
                    host: HostEnd::default(),
                    overrun: false,
                    endpoint: place,
                },
            );
        }
        self.grant_read_credit(robot);
        Ok(())
    }

    /// Closes every line; links are removed.
    pub async fn close(&mut self) {
        for line in std::mem::take(&mut self.open).into_values() {
            line.task.abort();
            // Links and ports are free only after the task has ended.
            let _ = line.task.await;
        }
        #[cfg(unix)]
        {
            self.locks = pty::DirectoryLocks::default();
        }
    }

    /// Endpoint of a port's line, if one is open.
    #[must_use]
    pub fn endpoint(&self, port: Port) -> Option<&SerialEndpoint> {
        self.open.get(&port).map(|line| &line.endpoint)
    }

    /// Endpoint of each open line: link, device or address.
    #[must_use]
    pub fn endpoints(&self) -> BTreeMap<Port, SerialEndpoint> {
        let places = self.open.iter();
        places
            .map(|(port, line)| (*port, line.endpoint.clone()))
            .collect()
    }

    /// Returns the next message of a line task, taking the lines in rotation.
    pub fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SerialMessage> {
        self.messages.poll_next(context)
    }

    /// Handles a message and returns the resulting input of the controller.
    pub fn handle_message(&mut self, message: SerialMessage) -> Option<Input> {
        let SerialMessage { port, id, event } = message;
        let line = self.open.get_mut(&port).filter(|line| line.id == id)?;
        Some(match event {
            SerialEvent::Opened { peer } => {
                info!(port = port.name(), "{port}: {peer} connected");
                line.peer = Some(peer.clone());
                line.host = HostEnd::default();
                Input::Connected { port, peer }
            }
            SerialEvent::Settings(host) => {
                line.host = host;
                Input::SerialOpened { port, host }
            }
            SerialEvent::Received(bytes) => {
                line.outstanding = line.outstanding.saturating_sub(bytes.len());
                Input::received(port, bytes)
            }
            SerialEvent::Faults(bytes) => Input::SerialErrors { port, bytes },
            SerialEvent::Purged => Input::SerialPurged { port },
            SerialEvent::Closed => {
                if let Some(peer) = line.peer.take() {
                    info!(port = port.name(), "{port}: {peer} disconnected");
                }
                Input::Disconnected { port }
            }
        })
    }

    /// Grants the tasks as much read credit as the controller has room.
    pub fn grant_read_credit(&mut self, robot: &Controller) {
        for (port, line) in &mut self.open {
            let room = robot.line_room(*port).unwrap_or(0);
            let more = room.saturating_sub(line.outstanding);
            line.outstanding += more;
            line.credit.add_permits(more);
        }
    }

    /// Whether any line is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// Whether the port has an open serial line.
    #[must_use]
    pub fn has(&self, port: Port) -> bool {
        self.open.contains_key(&port)
    }

    /// Sends bytes that came off the line to the host.
    pub fn send(&mut self, port: Port, bytes: Vec<u8>) {
        let Some(line) = self.open.get_mut(&port) else {
            return;
        };
        if line.commands.try_send(TaskCommand::Send(bytes)).is_err() && !line.overrun {
            line.overrun = true;
            warn!(
                port = port.name(),
                "{port}: the host does not read; bytes are lost, as in the buffer of a port"
            );
        }
    }

    /// Handles power-on: \[U06\] may have changed, and the controller has to learn its peers again.
    pub fn power_cycled(&mut self, robot: &Controller) -> Vec<Input> {
        let mut inputs = Vec::new();
        for (&port, line) in &mut self.open {
            if let Some(settings) = robot.serial_line(port) {
                // Fails only if the task has ended or is so slow that it loses bytes too.
                let _ = line.commands.try_send(TaskCommand::Settings(settings));
            }
            if let Some(peer) = line.peer.clone() {
                let host = line.host;
                inputs.push(Input::Connected { port, peer });
                inputs.push(Input::SerialOpened { port, host });
            }
        }
        inputs
    }
}

fn start(
    requested: SerialEndpoint,
    task: SerialTask,
    options: LinkOptions,
) -> Result<(SerialEndpoint, JoinHandle<()>), SerialError> {
    match requested {
        #[cfg(unix)]
        SerialEndpoint::Pty(path) => {
            let pty = pty::Pty::open(task.port, &path, task.settings)?;
            Ok((SerialEndpoint::Pty(path), tokio::spawn(pty::serve(pty, task))))
        }
        #[cfg(not(unix))]
        SerialEndpoint::Pty(_) => Err(SerialError::NoPty { port: task.port }),
        SerialEndpoint::Device(path) => {
            let device = device::open(task.port, &path, task.settings)?;
            let task = tokio::spawn(device::serve(path.clone(), device, task, options.redial));
            Ok((SerialEndpoint::Device(path), task))
        }
        SerialEndpoint::Rfc2217(address) => {
            let (listener, actual) = tcp::bind(task.port, address)?;
            let task = tokio::spawn(tcp::serve(listener, tcp::TcpMode::Rfc2217, task, options.second));
            Ok((SerialEndpoint::Rfc2217(actual), task))
        }
        SerialEndpoint::Tcp(address) => {
            let (listener, actual) = tcp::bind(task.port, address)?;
            let task = tokio::spawn(tcp::serve(listener, tcp::TcpMode::Raw, task, options.second));
            Ok((SerialEndpoint::Tcp(actual), task))
        }
    }
}

/// An error of the system while a line was opened.
fn io_error(
    port: Port,
    action: &'static str,
    place: impl fmt::Display,
) -> impl FnOnce(io::Error) -> SerialError {
    let place = place.to_string();
    move |reason| SerialError::Io {
        port,
        action,
        place,
        reason,
    }
}
