//! A terminal that is read and written without blocking: our end of a pseudo terminal, or a real port. `pty` and
//! `device` own and configure it.

use super::open_port;
use super::unsent::Unsent;
use crate::portion::{log_bytes, take_portion};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::termios::{ControlModes, InputModes, OptionalActions, Termios, tcgetattr, tcsetattr};
use serialport::SerialPort;
use std::io;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::task::{Context, Poll, ready};
use std::time::Duration;
use tokio::net::unix::pipe;
use tracing::debug;
use ts3100_controller::Port;
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Most bytes per read.
const READ_BUFFER: usize = 1_024;

/// An open terminal.
pub(super) struct Terminal {
    port: Port,
    fd: OwnedFd,
    watch: Watch,
    unsent: Unsent,
    /// Bytes that were read and exceed a portion.
    rest: Vec<u8>,
    /// A real port as the library has opened it, for this process alone as long as it is kept.
    _owner: Option<Box<dyn SerialPort>>,
}

/// Two further descriptors of the terminal, to be waited for. The runtime has no type for terminals; the one for
/// pipes reads, writes and waits for any descriptor. It keeps the end of one for good, and hosts come back: then there
/// are new ones.
struct Watch {
    reading: pipe::Receiver,
    writing: pipe::Sender,
}

impl Watch {
    fn new(fd: &OwnedFd) -> io::Result<Watch> {
        Ok(Watch {
            reading: pipe::Receiver::from_owned_fd_unchecked(fd.try_clone()?)?,
            writing: pipe::Sender::from_owned_fd_unchecked(fd.try_clone()?)?,
        })
    }
}

impl Terminal {
    /// Reads and writes another descriptor of this terminal.
    pub(super) fn new(port: Port, fd: &OwnedFd) -> io::Result<Terminal> {
        Ok(Terminal {
            port,
            fd: fd.try_clone()?,
            watch: Watch::new(fd)?,
            unsent: Unsent::new(port),
            rest: Vec::new(),
            _owner: None,
        })
    }

    /// Opens a real port with these settings, for this process alone.
    pub(super) fn open(port: Port, path: &Path, settings: SerialSettings) -> io::Result<Terminal> {
        // First: the library takes the port for itself alone. It does not wait asynchronously, and knows no marks.
        let fd = open_terminal(path)?;
        let owner = open_port(path, settings, Duration::ZERO)?;
        let mut termios = tcgetattr(&fd)?;
        // The system checks the parity and marks what is bad, a break too, instead of passing it on as it is.
        termios.input_modes |= InputModes::INPCK | InputModes::PARMRK;
        termios.input_modes -=
            InputModes::IGNPAR | InputModes::IGNBRK | InputModes::BRKINT | InputModes::ISTRIP;
        tcsetattr(&fd, OptionalActions::Now, &termios)?;
        let terminal = Terminal::new(port, &fd)?;
        Ok(Terminal {
            _owner: Some(owner),
            ..terminal
        })
    }

    /// Writes what is unsent, and returns the next portion of at most `most` bytes that were received; `None` when the
    /// other end is gone. Without a context the system itself is asked, whatever the runtime knows of the terminal.
    pub(super) fn poll(
        &mut self,
        most: usize,
        mut context: Option<&mut Context<'_>>,
    ) -> Poll<Option<Vec<u8>>> {
        if let Some(context) = &mut context {
            self.poll_write(context);
        }
        if self.rest.is_empty() {
            if most == 0 {
                return Poll::Pending;
            }
            let mut buffer = [0; READ_BUFFER];
            let (buffer, _) = buffer.split_at_mut(most.min(READ_BUFFER));
            match ready!(self.poll_read(buffer, context)) {
                Ok(count) if count > 0 => self.rest = buffer.get(..count).unwrap_or_default().to_vec(),
                Ok(_) => return Poll::Ready(None),
                Err(error) => {
                    debug!(port = self.port.name(), "{}: reading ended: {error}", self.port);
                    return Poll::Ready(None);
                }
            }
            log_bytes(self.port, '<', &self.rest);
        }
        Poll::Ready(Some(take_portion(self.port, &mut self.rest)))
    }

    fn poll_read(&mut self, buffer: &mut [u8], context: Option<&mut Context<'_>>) -> Poll<io::Result<usize>> {
        let Some(context) = context else {
            return match rustix::io::read(&self.fd, buffer) {
                Err(Errno::AGAIN) => Poll::Pending,
                read => Poll::Ready(read.map_err(io::Error::from)),
            };
        };
        // Twice: the second call registers for waking after a terminal that was thought to be readable was not.
        for _ in 0..2 {
            ready!(self.watch.reading.poll_read_ready(context))?;
            match self.watch.reading.try_read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                read => return Poll::Ready(read),
            }
        }
        // One host has closed it and another has opened it since; whose bytes are whose cannot be told, so they are
        // one host.
        self.watch = Watch::new(&self.fd)?;
        context.waker().wake_by_ref();
        Poll::Pending
    }

    /// Writes what is unsent if the terminal is writable; registers for waking otherwise.
    fn poll_write(&mut self, context: &mut Context<'_>) {
        for _ in 0..2 {
            let writing = &self.watch.writing;
            if self.unsent.is_empty() || writing.poll_write_ready(context).is_pending() {
                return;
            }
            self.unsent.write(|bytes| writing.try_write(bytes));
        }
        // A terminal that its host has closed counts as writable for ever, and takes nothing when it is full.
        if !self.unsent.is_empty() {
            match has_host(&self.fd).then(|| Watch::new(&self.fd)) {
                Some(Ok(watch)) => self.watch = watch,
                Some(Err(_)) | None => drop(self.unsent.take()),
            }
            context.waker().wake_by_ref();
        }
    }

    /// Writes at once what the system takes; the rest waits until the terminal is writable.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.unsent.push(bytes);
        self.unsent.write(|bytes| Ok(rustix::io::write(&self.fd, bytes)?));
    }
}

/// Opens a terminal without blocking.
pub(super) fn open_terminal(name: &Path) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    Ok(rustix::fs::open(name, flags, Mode::empty())?)
}

/// State of our end of a pseudo terminal, as the system reports it.
pub(super) fn poll_master(fd: &OwnedFd) -> PollFlags {
    let mut fds = [PollFd::new(fd, PollFlags::IN)];
    // Nothing is known of one that cannot be asked: it counts as closed.
    match poll(&mut fds, Some(&Timespec::default())) {
        Ok(_) => fds.first().map_or(PollFlags::HUP, PollFd::revents),
        Err(_) => PollFlags::HUP,
    }
}

/// Whether a host has it open now.
fn has_host(fd: &OwnedFd) -> bool {
    !poll_master(fd).contains(PollFlags::HUP)
}

/// Sets a terminal to bytes as they are, with these settings.
pub(super) fn apply_settings(termios: &mut Termios, line: SerialSettings) -> io::Result<()> {
    termios.make_raw();
    termios.input_modes -= InputModes::INPCK | InputModes::IGNPAR | InputModes::IXOFF;
    termios.set_speed(line.speed)?;
    let modes = &mut termios.control_modes;
    *modes -= ControlModes::CSIZE | ControlModes::PARENB | ControlModes::PARODD | ControlModes::CSTOPB;
    *modes |= ControlModes::CREAD | ControlModes::CLOCAL;
    *modes |= match line.length {
        7 => ControlModes::CS7,
        _ => ControlModes::CS8,
    };
    *modes |= match line.parity {
        Parity::None => ControlModes::empty(),
        Parity::Odd => ControlModes::PARENB | ControlModes::PARODD,
        Parity::Even => ControlModes::PARENB,
    };
    if line.stop == 2 {
        *modes |= ControlModes::CSTOPB;
    }
    Ok(())
}
