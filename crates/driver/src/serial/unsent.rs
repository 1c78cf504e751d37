//! Bytes that came off a serial line and that the host has not taken yet.

#[cfg(unix)]
use crate::portion::log_bytes;
use std::collections::VecDeque;
#[cfg(unix)]
use std::io;
use tracing::debug;
use ts3100_controller::Port;

/// Bytes that are kept for a host that does not read; further bytes are lost.
const MAX_UNSENT: usize = 16 * 1_024;

/// Bytes for a host, as many as a port's buffer holds.
pub(super) struct Unsent {
    port: Port,
    bytes: VecDeque<u8>,
}

impl Unsent {
    pub(super) fn new(port: Port) -> Unsent {
        let bytes = VecDeque::new();
        Unsent { port, bytes }
    }

    /// Appends bytes up to the limit; drops the rest.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        let room = MAX_UNSENT.saturating_sub(self.bytes.len());
        if bytes.len() > room {
            let (port, lost) = (self.port, bytes.len() - room);
            debug!(
                port = port.name(),
                "{port}: {lost} bytes lost: the host does not read"
            );
        }
        self.bytes.extend(bytes.iter().take(room));
    }

    #[cfg(unix)]
    pub(super) fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Writes until nothing is left or the system takes no more; whether something is left. What cannot be written
    /// because of an error is lost. Only terminals take bytes this way.
    #[cfg(unix)]
    pub(super) fn write(&mut self, mut write: impl FnMut(&[u8]) -> io::Result<usize>) -> bool {
        while !self.bytes.is_empty() {
            match write(self.bytes.make_contiguous()) {
                Ok(count) => {
                    let written: Vec<u8> = self.bytes.drain(..count.min(self.bytes.len())).collect();
                    log_bytes(self.port, '>', &written);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return true,
                Err(error) => {
                    debug!(port = self.port.name(), "{}: writing ended: {error}", self.port);
                    self.bytes.clear();
                }
            }
        }
        false
    }

    /// Takes all bytes.
    pub(super) fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.bytes).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_buffer_keeps_what_it_has() {
        let mut unsent = Unsent::new(Port::Com1);
        unsent.push(&[b'1'; MAX_UNSENT - 1]);
        unsent.push(b"234");
        unsent.push(b"5");
        let bytes = unsent.take();
        assert_eq!(bytes.len(), MAX_UNSENT);
        assert!(bytes.ends_with(b"12"));
    }
}
