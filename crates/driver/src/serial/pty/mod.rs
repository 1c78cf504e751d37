//! A pseudo terminal with a stable name. It lives as long as the daemon, however often hosts open and close it. Its
//! settings are read back, as far as the system reports them, so that wrong settings of a host have their effect.
//!
//! Linux keeps of a pseudo terminal's settings the speed, the stop bits and whether the parity is odd, but neither the
//! character length nor whether parity is enabled at all; those count as matching. `directory` manages the names.

mod directory;

use super::task::{DriverGone, SerialTask, TaskCommand, WriteBuffer};
use super::{SerialError, SerialEvent, io_error};
pub(super) use directory::DirectoryLocks;
use directory::Link;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{
    ControlModes, InputModes, OptionalActions, QueueSelector, Termios, tcflush, tcgetattr, tcsetattr,
};
use std::ffi::OsStr;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{Interest, Ready};
use tokio::net::unix::pipe;
use tokio::sync::Semaphore;
use tokio::task::coop::consume_budget;
use tokio::time::{MissedTickBehavior, interval};
use tracing::{debug, warn};
use ts3100_controller::{HostSettings, Port};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Interval of polling whether a host has opened the terminal; the system sends no event.
const OPEN_POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Interval of reading the settings of an open terminal, in addition to before every read.
const SETTINGS_POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A pseudo terminal and its name.
pub(super) struct Pty {
    port: Port,
    master: OwnedFd,
    /// The system's name for the end of the host.
    slave: PathBuf,
    link: Link,
    robot_settings: SerialSettings,
    /// Settings that this emulator has applied.
    initial_settings: Option<SerialSettings>,
    /// A host has changed the settings since; they are never overwritten again.
    set_by_host: bool,
}

impl Pty {
    /// Makes one and puts a link to it at `path`, whose directory is locked; what an ended daemon left there is
    /// replaced.
    pub(super) fn open(port: Port, path: &Path, robot: SerialSettings) -> Result<Pty, SerialError> {
        let (master, slave) =
            create().map_err(io_error(port, "make a pseudo terminal for", path.display()))?;
        let link = Link::create(port, path, &slave)?;
        let mut pty = Pty {
            port,
            master,
            slave,
            link,
            robot_settings: robot,
            initial_settings: None,
            set_by_host: false,
        };
        let set_up = io_error(port, "set up the pseudo terminal of", path.display());
        pty.reset().map_err(set_up)?;
        Ok(pty)
    }

    /// Ready for the next host: what the last one did not read is forgotten, what it has set stays, as on a real
    /// port; what nobody has set follows [U06].
    fn reset(&mut self) -> io::Result<()> {
        let slave = open_slave(&self.slave)?;
        let mut termios = tcgetattr(&slave)?;
        let is_ours = |given: SerialSettings| {
            !self.set_by_host && given != self.robot_settings && has_settings(&termios, given)
        };
        if self.initial_settings.is_none_or(is_ours) {
            apply_settings(&mut termios, self.robot_settings)?;
            tcsetattr(&slave, OptionalActions::Now, &termios)?;
            self.initial_settings = Some(self.robot_settings);
        }
        tcflush(&slave, QueueSelector::IFlush)?;
        Ok(())
    }

    /// Ready for the next host, unless it is there already. One that took the terminal for itself alone
    /// (TIOCEXCL) has left it so: then there is a new one under the same name.
    fn renew(&mut self) {
        if self.is_open() {
            return;
        }
        let renewed = match self.reset() {
            Ok(()) => Ok(()),
            Err(_) => self.replace(),
        };
        if let Err(error) = renewed {
            warn!(
                port = self.port.name(),
                "{}: no new pseudo terminal: {error}", self.port
            );
        }
    }

    fn replace(&mut self) -> io::Result<()> {
        let termios = tcgetattr(&self.master)?;
        let (master, slave) = create()?;
        tcsetattr(open_slave(&slave)?, OptionalActions::Now, &termios)?;
        self.link.point_to(&slave)?;
        (self.master, self.slave) = (master, slave);
        self.reset()
    }

    /// Whether a host has it open, or has left bytes in it.
    fn is_open(&self) -> bool {
        self.poll_master()
            .is_some_and(|found| !found.contains(PollFlags::HUP) || found.contains(PollFlags::IN))
    }

    /// Whether a host has it open now.
    fn has_host(&self) -> bool {
        self.poll_master()
            .is_some_and(|found| !found.contains(PollFlags::HUP))
    }

    fn poll_master(&self) -> Option<PollFlags> {
        let mut fds = [PollFd::new(&self.master, PollFlags::IN)];
        poll(&mut fds, Some(&Timespec::default())).ok()?;
        fds.first().map(PollFd::revents)
    }

    /// Writes what goes. Returns whether another host than the one waited for has it open now.
    fn write(
        &self,
        writing: &pipe::Sender,
        ready: io::Result<Ready>,
        write_buffer: &mut WriteBuffer,
    ) -> bool {
        let was_closed = ready.as_ref().is_ok_and(|ready| ready.is_write_closed());
        match ready.and_then(|_| writing.try_write(write_buffer.as_slice())) {
            Ok(count) => write_buffer.consume(self.port, count),
            // A terminal that its host has closed counts as writable for ever, and takes nothing when it is full.
            Err(error) if error.kind() == io::ErrorKind::WouldBlock && was_closed => {
                if self.has_host() {
                    return true;
                }
                write_buffer.clear();
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
            Err(error) => {
                debug!(port = self.port.name(), "{}: writing ended: {error}", self.port);
                write_buffer.clear();
            }
        }
        false
    }

    fn settings(&mut self) -> HostSettings {
        let Ok(termios) = tcgetattr(&self.master) else {
            return HostSettings::default();
        };
        self.set_by_host |= self
            .initial_settings
            .is_some_and(|given| !has_settings(&termios, given));
        host_settings(&termios, self.robot_settings)
    }
}

/// A new pseudo terminal: our end, and the name of the host's.
fn create() -> io::Result<(OwnedFd, PathBuf)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let flags = rustix::fs::fcntl_getfl(&master)?;
    rustix::fs::fcntl_setfl(&master, flags | OFlags::NONBLOCK)?;
    let name = ptsname(&master, Vec::new())?;
    Ok((master, PathBuf::from(OsStr::from_bytes(name.to_bytes()))))
}

/// Opens the host's end for a moment.
fn open_slave(name: &Path) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    Ok(rustix::fs::open(name, flags, Mode::empty())?)
}

/// Whether a terminal is still set so, as far as it shows.
fn has_settings(termios: &Termios, line: SerialSettings) -> bool {
    let modes = termios.control_modes;
    termios.output_speed() == line.speed
        && modes.contains(ControlModes::CSTOPB) == (line.stop == 2)
        && modes.contains(ControlModes::PARODD) == (line.parity == Parity::Odd)
}

fn apply_settings(termios: &mut Termios, line: SerialSettings) -> io::Result<()> {
    termios.make_raw();
    termios.input_modes -= InputModes::INPCK;
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

/// What a pseudo terminal shows of the settings a host gave it.
fn host_settings(termios: &Termios, robot: SerialSettings) -> HostSettings {
    let modes = termios.control_modes;
    let parity = match (modes.contains(ControlModes::PARODD), robot.parity) {
        (true, _) => Some(Parity::Odd),
        // Even, or none at all: not odd in any case.
        (false, Parity::Odd) => Some(Parity::None),
        (false, Parity::None | Parity::Even) => None,
    };
    HostSettings {
        speed: Some(termios.output_speed()),
        length: None,
        parity,
        stop: Some(1 + u8::from(modes.contains(ControlModes::CSTOPB))),
    }
}

/// Carries bytes until the driver is gone.
pub(super) async fn serve(mut pty: Pty, mut task: SerialTask) {
    // The only error is that the driver is gone.
    while let Ok(()) = serve_one(&mut pty, &mut task).await {}
}

async fn serve_one(pty: &mut Pty, task: &mut SerialTask) -> Result<(), DriverGone> {
    wait_for_host(pty, task).await?;
    let peer = pty.link.path().display().to_string();
    task.send_event(SerialEvent::Opened { peer }).await?;
    let carried = carry(pty, task).await;
    carried?;
    // At once: the next host may be about to set the terminal.
    pty.renew();
    task.send_event(SerialEvent::Closed).await
}

async fn wait_for_host(pty: &mut Pty, task: &mut SerialTask) -> Result<(), DriverGone> {
    let mut look = interval(OPEN_POLL_INTERVAL);
    look.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            command = task.commands.recv() => match command.ok_or(DriverGone)? {
                // Nobody is connected to hear it.
                TaskCommand::Send(_) => {}
                TaskCommand::Settings(robot) => {
                    pty.robot_settings = robot;
                    pty.renew();
                }
            },
            _ = look.tick() => if pty.is_open() {
                return Ok(());
            },
        }
    }
}

/// Carries bytes while a host is there.
async fn carry(pty: &mut Pty, task: &mut SerialTask) -> Result<(), DriverGone> {
    let mut write_buffer = WriteBuffer::default();
    let mut notified = None;
    let mut look = interval(SETTINGS_POLL_INTERVAL);
    look.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let port = task.port;
    let Some((mut reading, mut writing)) = register(port, &pty.master) else {
        return Ok(());
    };
    loop {
        // Whatever the system says of readiness, the other tasks get their turn.
        consume_budget().await;
        let settings = pty.settings();
        if notified != Some(settings) {
            notified = Some(settings);
            task.send_host_settings(settings).await?;
        }
        let credit = Arc::clone(&task.credit);
        tokio::select! {
            command = task.commands.recv() => match command.ok_or(DriverGone)? {
                TaskCommand::Send(bytes) => write_buffer.push(port, &bytes),
                TaskCommand::Settings(robot) => {
                    pty.robot_settings = robot;
                    notified = None;
                }
            },
            ready = writing.ready(Interest::WRITABLE), if !write_buffer.is_empty() => {
                if pty.write(&writing, ready, &mut write_buffer) {
                    let Some(ends) = register(port, &pty.master) else {
                        return Ok(());
                    };
                    (reading, writing) = ends;
                }
            },
            (ready, most) = readable(&reading, &credit) => {
                // How the port is set when the bytes are there is how they were sent.
                let settings = pty.settings();
                let mut buffer = vec![0; most];
                let was_closed = ready.as_ref().is_ok_and(|ready| ready.is_read_closed());
                match ready.and_then(|_| reading.try_read(&mut buffer)) {
                    Ok(count) if count > 0 => {
                        if notified != Some(settings) {
                            notified = Some(settings);
                            task.send_host_settings(settings).await?;
                        }
                        buffer.truncate(count);
                        task.send_received(buffer).await?;
                    }
                    // One host has closed it and another has opened it since; whose bytes are whose cannot be told,
                    // so they are one host.
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock && was_closed => {
                        let Some(ends) = register(port, &pty.master) else {
                            return Ok(());
                        };
                        (reading, writing) = ends;
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    // Every host has closed it.
                    Ok(_) => return Ok(()),
                    Err(error) if error.raw_os_error() == Some(Errno::IO.raw_os_error()) => return Ok(()),
                    Err(error) => {
                        debug!(port = port.name(), "{port}: reading ended: {error}");
                        return Ok(());
                    }
                }
            },
            _ = look.tick() => {}
        }
    }
}

/// Two further descriptors of the terminal, to be waited for. The runtime has no type for terminals; the one for
/// pipes reads, writes and waits for any descriptor. It keeps the end of one for good, and hosts come back: so
/// each host has its own.
fn register(port: Port, master: &OwnedFd) -> Option<(pipe::Receiver, pipe::Sender)> {
    let registered = || -> io::Result<(pipe::Receiver, pipe::Sender)> {
        let reading = pipe::Receiver::from_owned_fd_unchecked(master.try_clone()?)?;
        let writing = pipe::Sender::from_owned_fd_unchecked(master.try_clone()?)?;
        Ok((reading, writing))
    };
    registered()
        .map_err(|error| {
            warn!(
                port = port.name(),
                "{port}: the pseudo terminal cannot be watched: {error}"
            );
        })
        .ok()
}

/// Ready to be read, and how much of it.
async fn readable(reading: &pipe::Receiver, credit: &Semaphore) -> (io::Result<Ready>, usize) {
    let most = SerialTask::readable_bytes(credit).await;
    (reading.ready(Interest::READABLE).await, most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempDir;

    fn line(speed: u32) -> SerialSettings {
        SerialSettings {
            speed,
            length: 8,
            parity: Parity::None,
            stop: 1,
        }
    }

    /// As a host sets it, and how it then is.
    fn set_by_host(pty: &Pty, speed: u32) {
        let slave = open_slave(&pty.slave).unwrap();
        let mut termios = tcgetattr(&slave).unwrap();
        apply_settings(&mut termios, line(speed)).unwrap();
        tcsetattr(&slave, OptionalActions::Now, &termios).unwrap();
    }

    fn speed(pty: &Pty) -> u32 {
        tcgetattr(&pty.master).unwrap().output_speed()
    }

    /// The next host may be there before the last one is seen to have gone: it has set the terminal as we once had.
    #[test]
    fn what_hosts_have_set_is_theirs_from_then_on() {
        let directory = TempDir::new("pty");
        let mut pty = Pty::open(Port::Host, &directory.path().join("host"), line(9_600)).unwrap();
        set_by_host(&pty, 115_200);
        assert_eq!(pty.settings().speed, Some(115_200));
        pty.robot_settings = line(38_400);
        set_by_host(&pty, 9_600);
        pty.reset().unwrap();
        assert_eq!(speed(&pty), 9_600);
    }

    #[test]
    fn what_nobody_has_set_follows_the_robot() {
        let directory = TempDir::new("pty");
        let mut pty = Pty::open(Port::Host, &directory.path().join("host"), line(9_600)).unwrap();
        assert_eq!(pty.settings().speed, Some(9_600));
        pty.robot_settings = line(38_400);
        pty.reset().unwrap();
        assert_eq!((speed(&pty), pty.settings().speed), (38_400, Some(38_400)));
    }
}
