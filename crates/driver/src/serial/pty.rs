//! A pseudo terminal with a stable name. It lives as long as the daemon, however often hosts open and close it. Its
//! settings are read back, as far as the system reports them, so that wrong settings of a host have their effect.
//!
//! Linux keeps of a pseudo terminal's settings the speed, the stop bits and whether the parity is odd, but neither the
//! character length nor whether parity is enabled at all; those count as matching. `directory` manages the names.

mod directory;

use super::terminal::{Terminal, apply_settings, open_terminal, poll_master};
use super::{Line, SerialError, io_error, opened};
pub(super) use directory::DirectoryLocks;
use directory::Link;
use rustix::event::PollFlags;
use rustix::fs::OFlags;
use rustix::io::FdFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{ControlModes, OptionalActions, QueueSelector, Termios, tcflush, tcgetattr, tcsetattr};
use std::ffi::OsStr;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::time::{Interval, MissedTickBehavior, interval};
use tracing::warn;
use ts3100_controller::{HostSettings, Input, Port};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Interval of polling whether a host has opened the terminal; the system sends no event.
const OPEN_POLL_INTERVAL: Duration = Duration::from_millis(10);
/// Interval of reading the settings of an open terminal, in addition to after every read.
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
    /// While a host has it open.
    terminal: Option<Terminal>,
    /// The settings of the host that the controller knows.
    notified: Option<HostSettings>,
    look: Interval,
}

impl Pty {
    /// Makes one and puts a link to it at `path`, whose directory is locked; a link of an ended process is replaced.
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
            terminal: None,
            notified: None,
            look: look_every(OPEN_POLL_INTERVAL),
        };
        let set_up = io_error(port, "set up the pseudo terminal of", path.display());
        pty.reset().map_err(set_up)?;
        Ok(pty)
    }

    /// Prepares for the next host: drops unread output; keeps the settings of the last host, as a real port does;
    /// settings that no host has made follow [U06].
    fn reset(&mut self) -> io::Result<()> {
        let slave = open_terminal(&self.slave)?;
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
        if let Err(error) = self.reset().or_else(|_| self.replace()) {
            warn!(
                port = self.port.name(),
                "{}: no new pseudo terminal: {error}", self.port
            );
        }
    }

    fn replace(&mut self) -> io::Result<()> {
        let termios = tcgetattr(&self.master)?;
        let (master, slave) = create()?;
        tcsetattr(open_terminal(&slave)?, OptionalActions::Now, &termios)?;
        self.link.point_to(&slave)?;
        (self.master, self.slave) = (master, slave);
        self.reset()
    }

    /// Whether a host has it open, or has left bytes in it.
    fn is_open(&self) -> bool {
        let found = poll_master(&self.master);
        !found.contains(PollFlags::HUP) || found.contains(PollFlags::IN)
    }

    /// A host that has opened it.
    fn host_opened(&mut self) -> Poll<Vec<Input>> {
        let port = self.port;
        match Terminal::new(port, &self.master) {
            Ok(terminal) => self.terminal = Some(terminal),
            Err(error) => {
                warn!(
                    port = port.name(),
                    "{port}: the pseudo terminal cannot be watched: {error}"
                );
                return Poll::Pending;
            }
        }
        self.look = look_every(SETTINGS_POLL_INTERVAL);
        self.notified = None;
        let peer = self.link.path().display().to_string();
        let mut inputs = vec![Input::Connected { port, peer }];
        inputs.extend(self.new_settings());
        Poll::Ready(inputs)
    }

    /// Every host has closed it.
    fn host_left(&mut self) -> Vec<Input> {
        self.terminal = None;
        self.look = look_every(OPEN_POLL_INTERVAL);
        // At once: the next host may be about to set the terminal.
        self.renew();
        vec![Input::Disconnected { port: self.port }]
    }

    /// The settings, if the controller knows others.
    fn new_settings(&mut self) -> Option<Input> {
        let settings = self.settings();
        let known = self.notified.replace(settings);
        (known != Some(settings)).then(|| opened(self.port, settings))
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
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    // Not with the opening, which macOS does not know.
    rustix::io::fcntl_setfd(&master, FdFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let flags = rustix::fs::fcntl_getfl(&master)?;
    rustix::fs::fcntl_setfl(&master, flags | OFlags::NONBLOCK)?;
    let name = ptsname(&master, Vec::new())?;
    Ok((master, PathBuf::from(OsStr::from_bytes(name.to_bytes()))))
}

/// Whether a terminal still has these settings, as far as it shows.
fn has_settings(termios: &Termios, line: SerialSettings) -> bool {
    let modes = termios.control_modes;
    termios.output_speed() == line.speed
        && modes.contains(ControlModes::CSTOPB) == (line.stop == 2)
        && modes.contains(ControlModes::PARODD) == (line.parity == Parity::Odd)
}

/// Settings a host gave a pseudo terminal, as far as it shows them.
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

impl Line for Pty {
    fn poll(&mut self, most: usize, mut context: Option<&mut Context<'_>>) -> Poll<Vec<Input>> {
        let mut is_time = context.is_none();
        // Until it is pending, which registers the waker for the next look.
        while let Some(context) = context.as_deref_mut()
            && self.look.poll_tick(context).is_ready()
        {
            is_time = true;
        }
        let Some(terminal) = &mut self.terminal else {
            if is_time && self.is_open() {
                return self.host_opened();
            }
            return Poll::Pending;
        };
        let received = terminal.poll(most, context);
        if received.is_pending() && !is_time && self.notified.is_some() {
            return Poll::Pending;
        }
        // How the port is set when the bytes are there is how they were sent.
        let mut inputs: Vec<Input> = self.new_settings().into_iter().collect();
        match received {
            Poll::Ready(Some(bytes)) => inputs.push(Input::received(self.port, bytes)),
            Poll::Ready(None) => inputs = self.host_left(),
            Poll::Pending if inputs.is_empty() => return Poll::Pending,
            Poll::Pending => {}
        }
        Poll::Ready(inputs)
    }

    fn send(&mut self, bytes: &[u8]) {
        if let Some(terminal) = &mut self.terminal {
            terminal.send(bytes);
        }
    }

    fn set_robot(&mut self, robot: SerialSettings) {
        self.robot_settings = robot;
        self.notified = None;
        if self.terminal.is_none() {
            self.renew();
        }
    }
}

fn look_every(period: Duration) -> Interval {
    let mut look = interval(period);
    look.set_missed_tick_behavior(MissedTickBehavior::Delay);
    look
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
        let slave = open_terminal(&pty.slave).unwrap();
        let mut termios = tcgetattr(&slave).unwrap();
        apply_settings(&mut termios, line(speed)).unwrap();
        tcsetattr(&slave, OptionalActions::Now, &termios).unwrap();
    }

    fn speed(pty: &Pty) -> u32 {
        tcgetattr(&pty.master).unwrap().output_speed()
    }

    /// The next host may be there before the last one is seen to have gone: it has set the terminal as we once had.
    #[tokio::test]
    async fn what_hosts_have_set_is_theirs_from_then_on() {
        let directory = TempDir::new("pty");
        let mut pty = Pty::open(Port::Host, &directory.path().join("host"), line(9_600)).unwrap();
        set_by_host(&pty, 115_200);
        assert_eq!(pty.settings().speed, Some(115_200));
        pty.robot_settings = line(38_400);
        set_by_host(&pty, 9_600);
        pty.reset().unwrap();
        assert_eq!(speed(&pty), 9_600);
    }

    #[tokio::test]
    async fn what_nobody_has_set_follows_the_robot() {
        let directory = TempDir::new("pty");
        let mut pty = Pty::open(Port::Host, &directory.path().join("host"), line(9_600)).unwrap();
        assert_eq!(pty.settings().speed, Some(9_600));
        pty.robot_settings = line(38_400);
        pty.reset().unwrap();
        assert_eq!((speed(&pty), pty.settings().speed), (38_400, Some(38_400)));
    }

    #[tokio::test]
    async fn a_terminal_receives_whatever_its_modem_lines_say() {
        let directory = TempDir::new("pty");
        let pty = Pty::open(Port::Host, &directory.path().join("host"), line(9_600)).unwrap();
        let mut termios = tcgetattr(&pty.master).unwrap();
        let receives = ControlModes::CREAD | ControlModes::CLOCAL;
        termios.control_modes -= receives;
        apply_settings(&mut termios, line(9_600)).unwrap();
        assert!(termios.control_modes.contains(receives));
    }
}
