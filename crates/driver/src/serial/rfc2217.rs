//! An RFC 2217 access server without sockets: client bytes in, line bytes and settings out. The line is the robot's; its
//! modem signals are wired so that a client may always send. `telnet` decodes the stream; `serial::tcp` owns the socket.

mod telnet;

use std::collections::BTreeMap;
use telnet::{DO, DONT, Decoder, Telnet, WILL, WONT, escape, negotiate, subnegotiate};
use ts3100_controller::HostSettings;
use ts3100_proto::parameter::{Parity, SerialSettings};

/// Eight bits of every byte, in RFC 856.
const BINARY: u8 = 0;
/// No "go ahead", in RFC 858.
const SUPPRESS_GO_AHEAD: u8 = 3;
/// COM-PORT-OPTION.
const COM_PORT: u8 = 44;

/// Offset of the numbers of answers from those of commands.
const ANSWER: u8 = 100;
const SIGNATURE: u8 = 0;
const SET_BAUDRATE: u8 = 1;
const SET_DATASIZE: u8 = 2;
const SET_PARITY: u8 = 3;
const SET_STOPSIZE: u8 = 4;
const SET_CONTROL: u8 = 5;
const NOTIFY_LINESTATE: u8 = 6;
const NOTIFY_MODEMSTATE: u8 = 7;
const FLOWCONTROL_SUSPEND: u8 = 8;
const FLOWCONTROL_RESUME: u8 = 9;
const SET_LINESTATE_MASK: u8 = 10;
const SET_MODEMSTATE_MASK: u8 = 11;
const PURGE_DATA: u8 = 12;

/// Signature of this access server.
const NAME: &[u8] = b"ts3100";
/// Highest accepted speed in bit/s; speeds that no UART of the time has are refused.
const HIGHEST_SPEED: u32 = 4_000_000;
/// Carrier, data set ready and clear to send: a cable with its handshake lines bridged.
const MODEM_STATE: u8 = 0x80 | 0x20 | 0x10;
/// "Transfer shift register empty" and "transfer holding register empty".
const LINE_STATE: u8 = 0x40 | 0x20;

/// Request of the client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// Bytes for the line.
    Data(Vec<u8>),
    /// Sets the settings of the client's port.
    Settings(HostSettings),
    /// Bytes that are not on the line yet are to be forgotten.
    PurgeToRobot,
    /// Bytes that came off the line and have not been sent to the client are to be forgotten.
    PurgeToClient,
    /// The line is held low: the robot sees a character without a stop bit.
    Break,
    /// The client takes no bytes for a while (true), or takes them again.
    Suspended(bool),
}

/// Access server for one client.
#[derive(Debug, Clone)]
pub struct Server {
    decoder: Decoder,
    /// Options in use by us and by the client.
    ours: BTreeMap<u8, bool>,
    theirs: BTreeMap<u8, bool>,
    robot: SerialSettings,
    settings: HostSettings,
    control: Control,
    line_state_mask: u8,
    modem_state_mask: u8,
    out: Vec<u8>,
}

/// State that SET-CONTROL sets, as its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Control {
    outbound: u8,
    inbound: u8,
    in_break: bool,
    dtr: bool,
    rts: bool,
}

impl Server {
    /// Creates the server of a client that has just connected; a setting that the client has not made is the robot's.
    pub fn new(robot: SerialSettings) -> Server {
        Server {
            decoder: Decoder::default(),
            ours: BTreeMap::new(),
            theirs: BTreeMap::new(),
            robot,
            settings: HostSettings::default(),
            control: Control {
                outbound: 1,
                inbound: 14,
                in_break: false,
                dtr: true,
                rts: true,
            },
            line_state_mask: 0,
            modem_state_mask: u8::MAX,
            out: Vec::new(),
        }
    }

    /// The robot's settings have changed.
    pub fn set_robot(&mut self, robot: SerialSettings) {
        self.robot = robot;
    }

    /// Bytes off the line, for the client.
    pub fn send(&mut self, bytes: &[u8]) {
        escape(bytes, &mut self.out);
    }

    /// Takes the bytes to send to the client.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// Bytes of the client, cut anywhere.
    pub fn receive(&mut self, bytes: &[u8]) -> Vec<Event> {
        let mut events = Vec::new();
        for part in self.decoder.push(bytes) {
            match part {
                Telnet::Data(bytes) => events.push(Event::Data(bytes)),
                Telnet::Negotiation(verb, option) => self.negotiated(verb, option),
                Telnet::Subnegotiation(COM_PORT, data) => self.com_port(&data, &mut events),
                Telnet::Subnegotiation(..) => {}
            }
        }
        events
    }

    /// Answers a change of state and nothing else, so that two servers cannot talk for ever (RFC 1143).
    fn negotiated(&mut self, verb: u8, option: u8) {
        let served = matches!(option, BINARY | SUPPRESS_GO_AHEAD | COM_PORT);
        let (sides, requested, yes, no) = match verb {
            DO => (&mut self.ours, true, WILL, WONT),
            DONT => (&mut self.ours, false, WILL, WONT),
            WILL => (&mut self.theirs, true, DO, DONT),
            _ => (&mut self.theirs, false, DO, DONT),
        };
        let on = requested && served;
        let before = sides.insert(option, on).unwrap_or(false);
        if on != before || (requested && !served) {
            negotiate(if on { yes } else { no }, option, &mut self.out);
            if on && option == COM_PORT && verb == WILL {
                self.notify(NOTIFY_MODEMSTATE, MODEM_STATE & self.modem_state_mask);
            }
        }
    }

    fn notify(&mut self, command: u8, state: u8) {
        if state != 0 {
            self.answer(command, &[state]);
        }
    }

    fn answer(&mut self, command: u8, value: &[u8]) {
        let data: Vec<u8> = std::iter::once(command + ANSWER)
            .chain(value.iter().copied())
            .collect();
        subnegotiate(COM_PORT, &data, &mut self.out);
    }

    /// Carries out a command. A setting that cannot be had is not taken: the answer is the one that holds.
    fn com_port(&mut self, data: &[u8], events: &mut Vec<Event>) {
        let Some((&command, value)) = data.split_first() else {
            return;
        };
        let before = self.settings;
        match (command, value) {
            (SIGNATURE, []) => self.answer(SIGNATURE, NAME),
            (SET_BAUDRATE, &[a, b, c, d]) => {
                let speed = u32::from_be_bytes([a, b, c, d]);
                // 0 asks for the speed that holds, here as in the other settings.
                let taken = (1..=HIGHEST_SPEED).contains(&speed).then_some(speed);
                self.settings.speed = taken.or(before.speed);
                self.answer(SET_BAUDRATE, &self.current().speed.to_be_bytes());
            }
            (SET_DATASIZE, &[length]) => {
                let taken = (5..=8).contains(&length).then_some(length);
                self.settings.length = taken.or(before.length);
                self.answer(SET_DATASIZE, &[self.current().length]);
            }
            (SET_PARITY, &[parity]) => {
                // Mark and space parity are not supported.
                let number = parity.checked_sub(1);
                self.settings.parity = number.and_then(Parity::from_number).or(before.parity);
                self.answer(SET_PARITY, &[self.current().parity.number() + 1]);
            }
            (SET_STOPSIZE, &[stop]) => {
                // One and a half stop bits are not supported.
                let taken = matches!(stop, 1 | 2).then_some(stop);
                self.settings.stop = taken.or(before.stop);
                self.answer(SET_STOPSIZE, &[self.current().stop]);
            }
            (SET_CONTROL, &[value]) => events.extend(self.set_control(value)),
            (FLOWCONTROL_SUSPEND, []) => events.push(Event::Suspended(true)),
            (FLOWCONTROL_RESUME, []) => events.push(Event::Suspended(false)),
            (SET_LINESTATE_MASK, &[mask]) => {
                self.line_state_mask = mask;
                self.answer(SET_LINESTATE_MASK, &[mask]);
                self.notify(NOTIFY_LINESTATE, LINE_STATE & mask);
            }
            (SET_MODEMSTATE_MASK, &[mask]) => {
                self.modem_state_mask = mask;
                self.answer(SET_MODEMSTATE_MASK, &[mask]);
                self.notify(NOTIFY_MODEMSTATE, MODEM_STATE & mask);
            }
            (PURGE_DATA, &[which @ 1..=3]) => {
                if which & 1 != 0 {
                    events.push(Event::PurgeToClient);
                }
                if which & 2 != 0 {
                    events.push(Event::PurgeToRobot);
                }
                self.answer(PURGE_DATA, &[which]);
            }
            // What is asked in no form we know is not answered: the client sees that it was not done.
            _ => {}
        }
        if before != self.settings {
            events.push(Event::Settings(self.settings));
        }
    }

    /// The settings that hold: the client's, where it has set any.
    fn current(&self) -> SerialSettings {
        self.settings.or_robot(self.robot)
    }

    /// Flow control is stored as requested but not used: the robot never stops the client.
    fn set_control(&mut self, value: u8) -> Option<Event> {
        let mut event = None;
        match value {
            1..=3 | 17 | 19 => self.control.outbound = value,
            5 => {
                event = (!self.control.in_break).then_some(Event::Break);
                self.control.in_break = true;
            }
            6 => self.control.in_break = false,
            8 | 9 => self.control.dtr = value == 8,
            11 | 12 => self.control.rts = value == 11,
            14..=16 | 18 => self.control.inbound = value,
            _ => {}
        }
        // RFC 2217 numbers a question and its two answers in a row: 4 asks for BREAK, 5 is on and 6 off; 7 to 9 is DTR,
        // 10 to 12 RTS. 0 asks for outbound flow control, 13 for inbound.
        let now = match value {
            4..=6 => 6 - u8::from(self.control.in_break),
            7..=9 => 9 - u8::from(self.control.dtr),
            10..=12 => 12 - u8::from(self.control.rts),
            13..=16 | 18 => self.control.inbound,
            _ => self.control.outbound,
        };
        self.answer(SET_CONTROL, &[now]);
        event
    }
}

#[cfg(test)]
mod tests;
