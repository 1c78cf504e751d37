//! A real serial port, opened with the robot's settings ([U06]); timing and settings are those of the real wire.
//!
//! Threads read and write the port, because not every system can wait for it asynchronously. A port that disappears (an
//! unplugged adapter) is reopened as soon as it is back.

use super::parmrk::{CharacterRun, MarkDecoder};
use super::task::{DriverGone, READ_BUFFER, SerialTask, TaskCommand};
use super::{SerialError, SerialEvent, io_error};
#[cfg(unix)]
use rustix::fs::{Mode, OFlags};
#[cfg(unix)]
use rustix::termios::{InputModes, OptionalActions, tcgetattr, tcsetattr};
use serialport::{ClearBuffer, DataBits, FlowControl, SerialPort, StopBits};
use std::io::{self, Read as _, Write as _};
#[cfg(unix)]
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::sync::{mpsc, oneshot};
use tracing::{debug, info, warn};
use ts3100_controller::{HostEnd, Port};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// How long the reading thread waits for bytes before it looks whether it is still wanted.
const READ_TIMEOUT: Duration = Duration::from_millis(50);
/// Writes that may wait for the port.
const WRITE_QUEUE: usize = 256;

/// An open port.
pub(super) type Device = Box<dyn SerialPort>;

/// Opens the port with the robot's settings.
pub(super) fn open(port: Port, path: &Path, line: SerialSettings) -> Result<Device, SerialError> {
    try_open(path, line).map_err(io_error(port, "open", path.display()))
}

fn try_open(path: &Path, line: SerialSettings) -> io::Result<Device> {
    #[cfg(unix)]
    let marker = open_second_handle(path)?;
    let device = serialport::new(path.to_string_lossy(), line.speed)
        .data_bits(match line.length {
            7 => DataBits::Seven,
            _ => DataBits::Eight,
        })
        .parity(match line.parity {
            Parity::None => serialport::Parity::None,
            Parity::Odd => serialport::Parity::Odd,
            Parity::Even => serialport::Parity::Even,
        })
        .stop_bits(match line.stop {
            2 => StopBits::Two,
            _ => StopBits::One,
        })
        .flow_control(FlowControl::None)
        .timeout(READ_TIMEOUT)
        .open()?;
    // What lay in the buffers was said before the robot listened.
    device.clear(ClearBuffer::All)?;
    #[cfg(unix)]
    enable_parmrk(&marker)?;
    Ok(device)
}

/// Another descriptor of the port: the library takes the port for itself alone, and has no word for marks.
#[cfg(unix)]
fn open_second_handle(path: &Path) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    Ok(rustix::fs::open(path, flags, Mode::empty())?)
}

/// Has the driver check the parity and mark what is bad, a break too, in place of passing it on as it is.
#[cfg(unix)]
fn enable_parmrk(port: &OwnedFd) -> io::Result<()> {
    let mut termios = tcgetattr(port)?;
    termios.input_modes |= InputModes::INPCK | InputModes::PARMRK;
    termios.input_modes -= InputModes::IGNPAR | InputModes::IGNBRK | InputModes::BRKINT | InputModes::ISTRIP;
    Ok(tcsetattr(port, OptionalActions::Now, &termios)?)
}

/// The threads of an open port; they end when this is dropped.
struct PortThreads {
    ended: Arc<AtomicBool>,
    writes: mpsc::Sender<Vec<u8>>,
    reads: mpsc::Receiver<Vec<u8>>,
    lost: oneshot::Receiver<()>,
}

impl Drop for PortThreads {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}

/// Carries bytes until the driver is gone.
pub(super) async fn serve(path: PathBuf, device: Device, mut task: SerialTask, pause: Duration) {
    let mut device = Some(device);
    loop {
        let opened = match device.take() {
            Some(device) => Some(device),
            None => try_open(&path, task.settings).ok(),
        };
        let served = match opened.map(spawn_threads) {
            Some(Ok(running)) => match carry(&path, running, &mut task).await {
                // One that can be opened and is lost at once is not looked for without pause.
                Ok(CarryEnd::Lost) => wait(&mut task, pause).await,
                Ok(CarryEnd::Reset) => Ok(()),
                Err(error) => Err(error),
            },
            Some(Err(error)) => {
                warn!(
                    port = task.port.name(),
                    "{}: {}: {error}",
                    task.port,
                    path.display()
                );
                wait(&mut task, pause).await
            }
            None => wait(&mut task, pause).await,
        };
        if served.is_err() {
            return;
        }
    }
}

/// The port is not there: what the robot sends is heard by nobody.
async fn wait(task: &mut SerialTask, pause: Duration) -> Result<(), DriverGone> {
    let over = tokio::time::sleep(pause);
    tokio::pin!(over);
    loop {
        tokio::select! {
            command = task.commands.recv() => match command.ok_or(DriverGone)? {
                TaskCommand::Send(_) => {}
                TaskCommand::Settings(robot) => task.settings = robot,
            },
            () = &mut over => return Ok(()),
        }
    }
}

/// Why an open port is left.
enum CarryEnd {
    /// It is to be opened with other settings.
    Reset,
    /// It is gone.
    Lost,
}

async fn carry(path: &Path, mut running: PortThreads, task: &mut SerialTask) -> Result<CarryEnd, DriverGone> {
    let port = task.port;
    let peer = path.display().to_string();
    task.send_event(SerialEvent::Opened { peer }).await?;
    task.send_event(SerialEvent::Settings(HostEnd::Wire)).await?;
    let mut decoder = MarkDecoder::default();
    let left = loop {
        tokio::select! {
            command = task.commands.recv() => match command.ok_or(DriverGone)? {
                TaskCommand::Send(bytes) => if running.writes.try_send(bytes).is_err() {
                    debug!(port = port.name(), "{port}: bytes lost, the port does not take them");
                },
                TaskCommand::Settings(robot) if robot != task.settings => {
                    info!(port = port.name(), "{port}: {} is opened anew as [U06] says", path.display());
                    task.settings = robot;
                    break CarryEnd::Reset;
                }
                TaskCommand::Settings(_) => {}
            },
            bytes = running.reads.recv() => match bytes {
                Some(bytes) => send_received(task, &mut decoder, &bytes).await?,
                None => break CarryEnd::Lost,
            },
            _ = &mut running.lost => {
                warn!(port = port.name(), "{port}: {} is gone; it is looked for again", path.display());
                break CarryEnd::Lost;
            }
        }
    };
    task.send_event(SerialEvent::Closed).await?;
    Ok(left)
}

/// Tells the driver what the port delivered, good and bad.
async fn send_received(task: &SerialTask, decoder: &mut MarkDecoder, bytes: &[u8]) -> Result<(), DriverGone> {
    for run in decoder.push(bytes) {
        match run {
            CharacterRun::Good(bytes) => task.send_received(bytes).await?,
            CharacterRun::Bad(bytes) => task.send_event(SerialEvent::Faults(bytes)).await?,
        }
    }
    Ok(())
}

fn spawn_threads(device: Device) -> io::Result<PortThreads> {
    let writer = device.try_clone()?;
    let ended = Arc::new(AtomicBool::new(false));
    let (tell_lost, lost) = oneshot::channel();
    let (writes, queued) = mpsc::channel(WRITE_QUEUE);
    let (read, reads) = mpsc::channel(1);
    let seen = Arc::clone(&ended);
    spawn("ts3100-serial-in", move || {
        let error = read_all(device, &seen, &read);
        debug!("reading a serial port ended: {error:?}");
        // Fails only when nobody waits for it.
        let _ = tell_lost.send(());
    })?;
    spawn("ts3100-serial-out", move || write_all(writer, queued))?;
    Ok(PortThreads {
        ended,
        writes,
        reads,
        lost,
    })
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> io::Result<()> {
    std::thread::Builder::new().name(name.to_owned()).spawn(work)?;
    Ok(())
}

fn read_all(mut device: Device, ended: &AtomicBool, to: &mpsc::Sender<Vec<u8>>) -> Option<io::Error> {
    let mut buffer = [0; READ_BUFFER];
    while !ended.load(Ordering::Relaxed) {
        match device.read(&mut buffer) {
            Ok(0) => return None,
            Ok(count) => {
                let bytes = buffer.get(..count).unwrap_or_default().to_vec();
                if to.blocking_send(bytes).is_err() {
                    return None;
                }
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => {}
            Err(error) => return Some(error),
        }
    }
    None
}

fn write_all(mut device: Device, mut queued: mpsc::Receiver<Vec<u8>>) {
    while let Some(bytes) = queued.blocking_recv() {
        let mut rest = bytes.as_slice();
        while !rest.is_empty() {
            match device.write(rest) {
                Ok(0) => return,
                Ok(count) => rest = rest.get(count..).unwrap_or_default(),
                Err(error)
                    if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) =>
                {
                    if queued.is_closed() {
                        return;
                    }
                }
                Err(_) => return,
            }
        }
    }
}
