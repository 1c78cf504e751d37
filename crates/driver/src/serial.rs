//! The serial ports HOST and COM1 seen from outside: a pseudo terminal, a real port, or a TCP port with or without
//! RFC 2217. Here only bytes are carried and events reported; how long characters take and what wrong settings do to them
//! is decided by the controller.
//!
//! The driver owns [`SerialLines`] and polls each line in its own task. `pty`, `device` and `tcp` are the three kinds of
//! lines; `terminal` reads and writes for the first two.

mod device;
mod parmrk;
#[cfg(unix)]
mod pty;
pub mod rfc2217;
mod tcp;
#[cfg(unix)]
mod terminal;
#[cfg(not(unix))]
#[path = "serial/terminal_threads.rs"]
mod terminal;
mod unsent;

use crate::tcp::LinkOptions;
use serialport::{ClearBuffer, DataBits, FlowControl, SerialPort, StopBits};
use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::task::{Context, Poll};
use std::time::Duration;
use tracing::info;
use ts3100_controller::{Controller, HostEnd, HostSettings, Input, Port};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Endpoint at which hosts reach a serial port of the robot.
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
        "another running ts3100 has its serial lines in {}; end it, or give each its own --serial-dir",
        path.display()
    )]
    InUse {
        /// Path of the directory.
        path: PathBuf,
    },
    /// The path of a link is a file or directory.
    #[error("{port}: {} is not a symbolic link; remove it, or choose another --serial-dir", path.display())]
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

/// Opens a real port with these settings, for this process alone; it forgets what it received before.
fn open_port(
    path: &Path,
    settings: SerialSettings,
    timeout: Duration,
) -> serialport::Result<Box<dyn SerialPort>> {
    let port = serialport::new(path.to_string_lossy(), settings.speed)
        .data_bits(DataBits::try_from(settings.length).unwrap_or(DataBits::Eight))
        .parity(match settings.parity {
            Parity::None => serialport::Parity::None,
            Parity::Odd => serialport::Parity::Odd,
            Parity::Even => serialport::Parity::Even,
        })
        .stop_bits(StopBits::try_from(settings.stop).unwrap_or(StopBits::One))
        .flow_control(FlowControl::None)
        .timeout(timeout)
        .open()?;
    // What is in the buffers was sent before the robot listened.
    port.clear(ClearBuffer::All)?;
    Ok(port)
}

/// One end of a serial line.
trait Line: Send {
    /// The inputs of the controller that result from the next event; at most `most` bytes are read. Without a context
    /// the system itself is asked, whatever the runtime knows of the line.
    fn poll(&mut self, most: usize, context: Option<&mut Context<'_>>) -> Poll<Vec<Input>>;
    /// Sends bytes from the line to the host. Bytes that it does not take are lost, as in the buffer of a port.
    fn send(&mut self, bytes: &[u8]);
    /// Changes the settings of the robot.
    fn set_robot(&mut self, robot: SerialSettings);
}

struct OpenLine {
    line: Box<dyn Line>,
    endpoint: SerialEndpoint,
    peer: Option<String>,
    host: HostEnd,
}

/// Both serial lines.
pub struct SerialLines {
    endpoints: BTreeMap<Port, SerialEndpoint>,
    options: LinkOptions,
    open: BTreeMap<Port, OpenLine>,
    #[cfg(unix)]
    locks: pty::DirectoryLocks,
}

impl SerialLines {
    /// Creates both lines; none is open yet.
    pub fn new(ends: BTreeMap<Port, SerialEndpoint>, options: LinkOptions) -> SerialLines {
        SerialLines {
            endpoints: ends,
            options,
            open: BTreeMap::new(),
            #[cfg(unix)]
            locks: pty::DirectoryLocks::default(),
        }
    }

    /// Opens every line with the robot's settings.
    ///
    /// # Errors
    /// The first line that cannot be opened; those before it are closed when this value is dropped.
    pub fn open(&mut self, robot: &Controller) -> Result<(), SerialError> {
        for (port, requested) in self.endpoints.clone() {
            let Some(settings) = robot.serial_line(port) else {
                continue;
            };
            let (endpoint, line) = self.open_line(port, requested, settings)?;
            info!(port = port.name(), "{port} is {endpoint}");
            let line = OpenLine {
                line,
                endpoint,
                peer: None,
                host: HostEnd::default(),
            };
            self.open.insert(port, line);
        }
        Ok(())
    }

    fn open_line(
        &mut self,
        port: Port,
        requested: SerialEndpoint,
        settings: SerialSettings,
    ) -> Result<(SerialEndpoint, Box<dyn Line>), SerialError> {
        Ok(match requested {
            #[cfg(unix)]
            SerialEndpoint::Pty(path) => {
                self.locks.take(port, &path)?;
                let line = pty::Pty::open(port, &path, settings)?;
                (SerialEndpoint::Pty(path), Box::new(line))
            }
            #[cfg(not(unix))]
            SerialEndpoint::Pty(_) => return Err(SerialError::NoPty { port }),
            SerialEndpoint::Device(path) => {
                let line = device::Device::open(port, &path, settings, self.options.redial)?;
                (SerialEndpoint::Device(path), Box::new(line))
            }
            SerialEndpoint::Rfc2217(address) => {
                let (line, actual) = tcp::TcpLine::open(port, address, self.options.second, Some(settings))?;
                (SerialEndpoint::Rfc2217(actual), Box::new(line))
            }
            SerialEndpoint::Tcp(address) => {
                let (line, actual) = tcp::TcpLine::open(port, address, self.options.second, None)?;
                (SerialEndpoint::Tcp(actual), Box::new(line))
            }
        })
    }

    /// Closes every line; links are removed.
    pub fn close(&mut self) {
        self.open.clear();
        #[cfg(unix)]
        {
            self.locks = pty::DirectoryLocks::default();
        }
    }

    /// Endpoint of a port's line, if one is open.
    pub fn endpoint(&self, port: Port) -> Option<&SerialEndpoint> {
        self.open.get(&port).map(|line| &line.endpoint)
    }

    /// Endpoint of each open line: link, device or address.
    pub fn endpoints(&self) -> BTreeMap<Port, SerialEndpoint> {
        let places = self.open.iter();
        places
            .map(|(port, line)| (*port, line.endpoint.clone()))
            .collect()
    }

    /// The inputs of the controller that result from the next event on a port's line. A host that sends without pause
    /// waits: no more is read than the controller has room for. Without a context the system itself is asked,
    /// whatever the runtime knows of the line.
    pub fn poll(
        &mut self,
        port: Port,
        robot: &Controller,
        context: Option<&mut Context<'_>>,
    ) -> Poll<Vec<Input>> {
        let room = robot.line_room(port).unwrap_or(0);
        let open = self.open.get_mut(&port);
        open.map_or(Poll::Pending, |open| open.poll(room, context))
    }

    /// Opens lines without a host at which one has arrived: a host that opened its line before it sent a command on
    /// another port is known before the command.
    pub fn open_arrived(&mut self) -> Vec<Input> {
        let without_host = self.open.values_mut().filter(|open| open.peer.is_none());
        let polled = without_host.map(|open| open.poll(0, None));
        let arrived = polled.flat_map(|polled| match polled {
            Poll::Ready(inputs) => inputs,
            Poll::Pending => Vec::new(),
        });
        arrived.collect()
    }

    /// Sends bytes that came off the line to the host.
    pub fn send(&mut self, port: Port, bytes: &[u8]) {
        if let Some(open) = self.open.get_mut(&port) {
            open.line.send(bytes);
        }
    }

    /// Applies the settings of the robot's \[U06\].
    pub fn set_robot(&mut self, robot: &Controller) {
        for (&port, open) in &mut self.open {
            if let Some(settings) = robot.serial_line(port) {
                open.line.set_robot(settings);
            }
        }
    }

    /// Handles power-on: \[U06\] may have changed, and the controller has to learn its peers again.
    pub fn power_cycled(&mut self, robot: &Controller) -> Vec<Input> {
        self.set_robot(robot);
        let mut inputs = Vec::new();
        for (&port, open) in &self.open {
            if let Some(peer) = open.peer.clone() {
                let host = open.host;
                inputs.push(Input::Connected { port, peer });
                inputs.push(Input::SerialOpened { port, host });
            }
        }
        inputs
    }
}

impl OpenLine {
    fn poll(&mut self, most: usize, context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        let polled = self.line.poll(most, context);
        if let Poll::Ready(inputs) = &polled {
            inputs.iter().for_each(|input| self.note(input));
        }
        polled
    }

    /// Notes the facts about the host in an input.
    fn note(&mut self, input: &Input) {
        // A TCP channel says itself who comes and goes.
        let is_terminal = matches!(self.endpoint, SerialEndpoint::Pty(_) | SerialEndpoint::Device(_));
        if let Input::Connected { port, peer } = input {
            if is_terminal {
                info!(port = port.name(), "{port}: {peer} connected");
            }
            self.peer = Some(peer.clone());
            self.host = HostEnd::default();
        } else if let Input::SerialOpened { host, .. } = input {
            self.host = *host;
        } else if let Input::Disconnected { port } = input
            && let Some(peer) = self.peer.take()
            && is_terminal
        {
            info!(port = port.name(), "{port}: {peer} disconnected");
        }
    }
}

/// The settings of the host's port, as far as they are known.
fn opened(port: Port, settings: HostSettings) -> Input {
    let host = HostEnd::Modelled(settings);
    Input::SerialOpened { port, host }
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
