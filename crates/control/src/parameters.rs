//! `/parameters`: the values of USER.PAR and ETHERNET.PAR that were read when the power last came on.
//!
//! To change them, write the files to the RAM drive and cycle the power, as on the real controller.

use super::resource::{Serialize, View};
use std::net::Ipv4Addr;
use ts3100_controller::port::Port;
use ts3100_proto::parameter::SerialSettings;
use ts3100_proto::status::AlarmLevel;

/// Parameters in effect.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct Parameters {
    /// ETHERNET.PAR.
    ethernet: EthernetParameters,
    /// USER.PAR [U06] of HOST.
    host: SerialParameters,
    /// USER.PAR [U06] of COM1.
    com1: SerialParameters,
}

/// ETHERNET.PAR.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Ethernet))]
pub struct EthernetParameters {
    /// [E01] address of the controller.
    address: String,
    /// [E02] name of the controller.
    name: String,
    /// [E03] subnet mask.
    mask: String,
    /// [E04] default gateway.
    gateway: String,
    /// [E08] community name.
    community: String,
    /// [E09] DHCP, 0 or 1.
    dhcp: u8,
    /// IP0 to IP3.
    channels: Vec<EthernetChannel>,
}

/// One channel in ETHERNET.PAR.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema))]
pub struct EthernetChannel {
    /// Name of the channel.
    port: &'static str,
    /// [E00] 0 not used, 1 server, 2 client.
    open_mode: u8,
    /// [E05] own port.
    own_port: u16,
    /// [E06] port of the peer, for a client.
    peer_port: u16,
    /// [E07] address of the peer, for a client.
    peer_address: String,
    /// [E10] level of the alarm when the connection drops while a program runs; absent for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    alarm_level: Option<u8>,
}

/// A serial line.
#[derive(Debug, Clone, Copy, Serialize)]
#[cfg_attr(test, derive(utoipa::ToSchema), schema(as = Serial))]
pub struct SerialParameters {
    /// Speed in bit/s.
    speed: u32,
    /// Character length in bits.
    length: u8,
    /// 0 none, otherwise as the manual numbers odd and even.
    parity: u8,
    /// Stop bits.
    stop: u8,
}

impl SerialParameters {
    fn new(line: SerialSettings) -> SerialParameters {
        SerialParameters {
            speed: line.speed,
            length: line.length,
            parity: line.parity.number(),
            stop: line.stop,
        }
    }
}

impl Parameters {
    /// Reads the values of the last power-on.
    pub fn new(view: &View<'_>) -> Parameters {
        let (ethernet, user) = (view.controller.ethernet(), view.controller.user());
        let channels = Port::ETHERNET.into_iter().enumerate();
        let channels = channels.map(|(index, port)| EthernetChannel {
            port: port.name(),
            open_mode: ethernet.open_mode[index].number(),
            own_port: ethernet.own_port[index],
            peer_port: ethernet.peer_port[index],
            peer_address: Ipv4Addr::from(ethernet.peer_address[index]).to_string(),
            alarm_level: ethernet.alarm_level[index].map(AlarmLevel::number),
        });
        Parameters {
            ethernet: EthernetParameters {
                address: Ipv4Addr::from(ethernet.address).to_string(),
                name: ethernet.name.clone(),
                mask: Ipv4Addr::from(ethernet.mask).to_string(),
                gateway: Ipv4Addr::from(ethernet.gateway).to_string(),
                community: ethernet.community.clone(),
                dhcp: ethernet.dhcp,
                channels: channels.collect(),
            },
            host: SerialParameters::new(user.host),
            com1: SerialParameters::new(user.com1),
        }
    }
}
