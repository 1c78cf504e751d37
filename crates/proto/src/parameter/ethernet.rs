//! ETHERNET.PAR: sections [E00] to [E10] (manual 3.3). Opening the channels is the edge's business.

use super::{LineEnd, ParameterProblem};
use crate::status::AlarmLevel;
use alloc::string::String;
use alloc::vec::Vec;

/// How a channel is opened ([E00]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OpenMode {
    /// 0: not used.
    NotUsed,
    /// 1: the controller is the TCP server.
    Server,
    /// 2: the controller is the TCP client.
    Client,
}

impl OpenMode {
    /// The number in the file.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            OpenMode::NotUsed => 0,
            OpenMode::Server => 1,
            OpenMode::Client => 2,
        }
    }
}

/// What ETHERNET.PAR holds. Arrays are in the order IP0, IP1, IP2, IP3.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EthernetParameters {
    /// [E00] open mode; IP0 is never a client (PAR-E00-02).
    pub open_mode: [OpenMode; 4],
    /// [E01] address of the controller.
    pub address: [u8; 4],
    /// [E02] name of the controller, without its quotes; has no effect.
    pub name: String,
    /// [E03] subnet mask.
    pub mask: [u8; 4],
    /// [E04] default gateway.
    pub gateway: [u8; 4],
    /// [E05] own ports, 1 to 65535.
    pub own_port: [u16; 4],
    /// [E06] ports of the peers, 1 to 65535; for clients.
    pub peer_port: [u16; 4],
    /// [E07] addresses of the peers; for clients.
    pub peer_address: [[u8; 4]; 4],
    /// [E08] community name, without its quotes; has no effect.
    pub community: String,
    /// [E09] DHCP, 0 or 1; has no effect.
    pub dhcp: u8,
    /// [E10] level of the alarm when a connection drops while a program runs.
    pub alarm_level: [Option<AlarmLevel>; 4],
}

impl EthernetParameters {
    /// The values the manual lists.
    #[must_use]
    pub fn factory() -> EthernetParameters {
        EthernetParameters {
            open_mode: [OpenMode::Server, OpenMode::NotUsed, OpenMode::NotUsed, OpenMode::NotUsed],
            address: [192, 168, 0, 124],
            name: String::from("NO1-TS3K"),
            mask: [255, 255, 255, 0],
            gateway: [192, 168, 0, 1],
            own_port: [1000, 1001, 1002, 1003],
            peer_port: [1000, 1001, 1002, 1003],
            peer_address: [[192, 168, 0, 150], [192, 168, 0, 151], [192, 168, 0, 152], [192, 168, 0, 153]],
            community: String::from("NO1-TS3K"),
            dhcp: 0,
            alarm_level: [None; 4],
        }
    }

    /// The file of a fresh RAM drive: [`EthernetParameters::factory`] with another [E00].
    #[must_use]
    pub fn factory_text(open: [OpenMode; 4], line_end: LineEnd) -> Vec<u8> {
        EthernetParameters { open_mode: open, ..EthernetParameters::factory() }.text(line_end)
    }

    /// These values as a file, comments and `[END]` included, EOF not.
    #[must_use]
    pub fn text(&self, line_end: LineEnd) -> Vec<u8> {
        let _ = line_end;
        Vec::new()
    }

    /// Reads a file. A value that is bad or missing stays as in `previous`; each is a problem, and so are
    /// IP0 as a client (stays a server, PAR-E00-03), one own port for two channels in use (the later one is
    /// not used, PAR-E05-02), sections unknown or twice, and a missing `[END]`.
    #[must_use]
    pub fn parse(content: &[u8], previous: &EthernetParameters) -> (EthernetParameters, Vec<ParameterProblem>) {
        let _ = content;
        (previous.clone(), Vec::new())
    }
}
