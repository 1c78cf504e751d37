//! The pages \[ETHER\] of the teach pendant as lines of text: addresses, peers and states of the Ethernet channels
//! (UI-ETHER-01 to UI-ETHER-07).
//!
//! The emulator shows them.

use crate::Controller;
use crate::network::ChannelConfig;
use crate::port::Port;
use crate::prelude::*;
use ts3100_proto::parameter::OpenMode;

/// Version of the Ethernet unit's firmware as shown; ours.
const FIRMWARE: &str = concat!("V", env!("CARGO_PKG_VERSION"));
/// Hardware address as shown: the manual's form, a locally administered address of ours.
const MAC_ADDRESS: &str = "020031:003100";
/// Pages of the display.
pub const PAGES: usize = 3;

/// One page: its heading and its lines.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PendantPage {
    /// `ETHERNET STATUS [1/3]`.
    pub heading: String,
    /// The lines below it.
    pub lines: Vec<String>,
}

impl Controller {
    /// The three pages \[ETHER\] of the teach pendant.
    pub fn ethernet_pages(&self) -> [PendantPage; PAGES] {
        let rows = |row: fn(&Controller, Port, &ChannelConfig) -> String| {
            let channels = Port::ETHERNET.iter().zip(&self.network().channels);
            channels.map(|(port, plan)| row(self, *port, plan)).collect()
        };
        let page = |number: usize, lines| PendantPage {
            heading: format!("ETHERNET STATUS [{number}/{PAGES}]"),
            lines,
        };
        let dotted = |[a, b, c, d]: [u8; 4]| format!("{a}.{b}.{c}.{d}");
        let own = Vec::from([
            format!("IP ADDRESS  {}", dotted(self.robot.parameters.ethernet().address)),
            format!("SUBNET MASK {}", dotted(self.robot.parameters.ethernet().mask)),
            format!("MAC ADDRESS {MAC_ADDRESS}"),
            format!("FIRMWARE    {FIRMWARE}"),
        ]);
        [page(1, own), page(2, rows(peer_row)), page(3, rows(state_row))]
    }
}

/// OwnPort, Port, Connect IP; zeros where the channel is not used or nobody is connected (UI-ETHER-04).
fn peer_row(controller: &Controller, port: Port, plan: &ChannelConfig) -> String {
    let own = if plan.mode == OpenMode::NotUsed {
        0
    } else {
        plan.own_port
    };
    let peer = controller.peer(port).unwrap_or_default();
    let (address, number) = peer.rsplit_once(':').unwrap_or(("0.0.0.0", "0"));
    format!("{port} {own:05} {number:0>5} {address}")
}

/// App., Mode, Status (UI-ETHER-05 to UI-ETHER-07); the transient states of TCP are the edge's.
fn state_row(controller: &Controller, port: Port, plan: &ChannelConfig) -> String {
    let application = match port {
        Port::Ip0 | Port::Host => "HOST",
        Port::Ip1 | Port::Ip2 | Port::Com1 => "SCOL",
        Port::Ip3 => "SYSTEM",
    };
    let mode = if plan.mode == OpenMode::Client {
        "TCP/C"
    } else {
        "TCP/S"
    };
    let state = match (plan.mode, controller.peer(port)) {
        (OpenMode::NotUsed, _) => "CLOSED",
        (OpenMode::Server | OpenMode::Client, Some(_)) => "ESTABLISHED",
        (OpenMode::Server, None) => "LISTEN",
        (OpenMode::Client, None) => "SYN SENT",
    };
    format!("{port} {application:<6} {mode} {state}")
}
