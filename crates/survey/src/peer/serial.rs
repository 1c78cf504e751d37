//! A controller behind a serial port of this computer, at its port HOST.

use super::{Line, Peer, PeerError};
use serialport::{DataBits, SerialPort, StopBits};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Bytes read at once.
const READ_BUFFER: usize = 256;
/// Shortest wait for bytes.
const SHORTEST: Duration = Duration::from_millis(1);

/// A controller at a serial port.
#[derive(Debug)]
pub struct SerialPeer {
    device: String,
    settings: SerialSettings,
    start: Instant,
    port: Option<Box<dyn SerialPort>>,
}

impl SerialPeer {
    /// The controller at this port, such as `/dev/ttyUSB0` or `COM3`, with the settings of its `[U06]`. Nothing is opened
    /// yet.
    pub fn new(device: &str, settings: SerialSettings) -> SerialPeer {
        SerialPeer {
            device: device.to_owned(),
            settings,
            start: Instant::now(),
            port: None,
        }
    }

    fn port(&mut self, line: Line) -> Result<&mut Box<dyn SerialPort>, PeerError> {
        match line {
            Line::Commands => self.port.as_mut().ok_or(PeerError::Closed),
            Line::Second | Line::Channel => Err(PeerError::Absent),
        }
    }
}

impl Peer for SerialPeer {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn open(&mut self, line: Line) -> Result<(), PeerError> {
        if line != Line::Commands {
            return Err(PeerError::Absent);
        }
        self.close(line);
        let settings = &self.settings;
        let parity = match settings.parity {
            Parity::None => serialport::Parity::None,
            Parity::Odd => serialport::Parity::Odd,
            Parity::Even => serialport::Parity::Even,
        };
        let port = serialport::new(&self.device, settings.speed)
            .parity(parity)
            .stop_bits(StopBits::try_from(settings.stop).unwrap_or(StopBits::One))
            .data_bits(DataBits::try_from(settings.length).unwrap_or(DataBits::Eight))
            .open()
            .map_err(|error| PeerError::Unreachable(format!("cannot open the serial port: {error}")))?;
        self.port = Some(port);
        Ok(())
    }

    fn close(&mut self, line: Line) {
        if line == Line::Commands {
            self.port = None;
        }
    }

    fn send(&mut self, line: Line, bytes: &[u8]) -> Result<(), PeerError> {
        self.port(line)?.write_all(bytes).map_err(|_| PeerError::Closed)
    }

    fn receive(&mut self, line: Line, until: Duration) -> Result<Vec<u8>, PeerError> {
        let wait = until.saturating_sub(self.now()).max(SHORTEST);
        let port = self.port(line)?;
        port.set_timeout(wait).map_err(|_| PeerError::Closed)?;
        let mut buffer = [0; READ_BUFFER];
        match port.read(&mut buffer) {
            Ok(length) => Ok(buffer.get(..length).unwrap_or_default().to_vec()),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(_) => Err(PeerError::Closed),
        }
    }

    fn is_serial(&self) -> bool {
        true
    }
}
