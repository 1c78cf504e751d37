//! A controller at a serial port of this computer, with its port HOST.

use super::{LONGEST_WAIT, Transport, is_timeout};
use serialport::{DataBits, SerialPort, StopBits};
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Bytes read at once.
const READ_BUFFER: usize = 256;
/// Shortest wait for bytes.
const SHORTEST: Duration = Duration::from_millis(1);

/// A serial line to HOST of a controller.
#[derive(Debug)]
pub struct SerialTransport {
    port: Box<dyn SerialPort>,
    start: Instant,
}

impl SerialTransport {
    /// Opens this port, such as `/dev/ttyUSB0` or `COM3`, with the settings of the controller's `[U06]`.
    ///
    /// # Errors
    /// The port is missing, in use, or does not take the settings.
    pub fn open(device: &str, settings: &SerialSettings) -> io::Result<SerialTransport> {
        let parity = match settings.parity {
            Parity::None => serialport::Parity::None,
            Parity::Odd => serialport::Parity::Odd,
            Parity::Even => serialport::Parity::Even,
        };
        let port = serialport::new(device, settings.speed)
            .parity(parity)
            .stop_bits(StopBits::try_from(settings.stop).unwrap_or(StopBits::One))
            .data_bits(DataBits::try_from(settings.length).unwrap_or(DataBits::Eight))
            .open()?;
        Ok(SerialTransport {
            port,
            start: Instant::now(),
        })
    }
}

impl Transport for SerialTransport {
    fn now(&self) -> Duration {
        self.start.elapsed()
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }

    fn receive(&mut self, until: Duration) -> io::Result<Vec<u8>> {
        let wait = until.saturating_sub(self.now());
        self.port.set_timeout(wait.clamp(SHORTEST, LONGEST_WAIT))?;
        let mut buffer = [0; READ_BUFFER];
        match self.port.read(&mut buffer) {
            Ok(length) => Ok(buffer.get(..length).unwrap_or_default().to_vec()),
            Err(error) if is_timeout(&error) => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
}
