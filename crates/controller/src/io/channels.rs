//! The buffers of PRINT and INPUT: the ring buffer of each channel, the figures typed at the teach pendant, and the text
//! shown on it.
//!
//! `channel` has a single ring buffer with its values; `robot::requests` uses them for PRINT and INPUT.

use super::channel::Channel;
use crate::limits::PENDANT_TEXT;
use crate::port::Port;
use crate::prelude::*;
use alloc::collections::BTreeMap;

/// The channels at power-on, and the changes since.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Channels {
    /// COM1, IP1 and IP2. IP3 has one for the name of its peer only: its data is discarded.
    ports: BTreeMap<Port, Channel>,
    /// Figures typed at the teach pendant.
    keys: Channel,
    /// Text that PRINT has shown on the teach pendant, the last of it.
    pendant: String,
}

impl Default for Channels {
    fn default() -> Channels {
        let ports = [Port::Com1, Port::Ip1, Port::Ip2, Port::Ip3];
        Channels {
            ports: ports.map(|port| (port, Channel::default())).into(),
            keys: Channel::default(),
            pendant: String::new(),
        }
    }
}

impl Channels {
    /// The ring buffer of a port; `None` for HOST and IP0.
    pub(crate) fn get(&self, port: Port) -> Option<&Channel> {
        self.ports.get(&port)
    }

    pub(crate) fn get_mut(&mut self, port: Port) -> Option<&mut Channel> {
        self.ports.get_mut(&port)
    }

    /// The buffer from which INPUT reads.
    pub(crate) fn input(&mut self, channel: scol_mini::Channel) -> Option<&mut Channel> {
        match Port::from_channel(channel) {
            Some(port) => self.ports.get_mut(&port),
            None => Some(&mut self.keys),
        }
    }

    /// Figures are typed at the teach pendant.
    pub(crate) fn type_keys(&mut self, figures: &str) {
        self.keys.push(figures.as_bytes());
    }

    /// Shows a text on the teach pendant.
    pub(crate) fn show(&mut self, text: &str) {
        self.pendant.push_str(text);
        let surplus = self.pendant.len().saturating_sub(PENDANT_TEXT);
        let cut = (surplus..=self.pendant.len()).find(|&at| self.pendant.is_char_boundary(at));
        self.pendant.drain(..cut.unwrap_or(0));
    }

    pub(crate) fn pendant(&self) -> &str {
        &self.pendant
    }

    /// Drops the bytes that wait for an INPUT; returns how many, by port.
    pub(crate) fn clear(&mut self) -> Vec<(Port, Vec<u8>)> {
        self.keys.clear();
        let full = self.ports.iter_mut().filter(|(_, channel)| !channel.is_empty());
        let cleared = full.map(|(port, channel)| {
            let held = channel.bytes();
            channel.clear();
            (*port, held)
        });
        cleared.collect()
    }

    /// The parts as a snapshot has them: ports, keys, pendant.
    pub(crate) fn saved(&self) -> (&BTreeMap<Port, Channel>, &Channel, &String) {
        (&self.ports, &self.keys, &self.pendant)
    }

    /// The channels of a snapshot.
    pub(crate) fn restored(ports: BTreeMap<Port, Channel>, keys: Channel, pendant: String) -> Channels {
        Channels { ports, keys, pendant }
    }
}
