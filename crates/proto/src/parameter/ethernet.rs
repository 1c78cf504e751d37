//! ETHERNET.PAR, sections \[E00\] to \[E10\] (manual 3.3): values, reader and writer.
//!
//! It checks values one by one and against each other (PAR-E00-03, PAR-E05-02). Opening the channels is left to the
//! emulator. The syntax of the file is in `reader.rs`.

use super::{
    FileValues, LineEnd, ParameterFile, ParameterProblem, SectionValues, split_words, with_line_end,
};
use crate::codes::codes;
use crate::prelude::*;
use crate::status::AlarmLevel;
use crate::words::number;

codes! {
    /// How a channel is opened (\[E00\]).
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    pub enum OpenMode {
        /// 0: the channel is closed.
        NotUsed = 0,
        /// 1: the controller is the TCP server.
        Server = 1,
        /// 2: the controller is the TCP client.
        Client = 2,
    }
    /// The number in the file.
    fn number -> u8;
    /// The mode of this number.
    fn from_number;
}

/// The values of ETHERNET.PAR. Arrays are in the order IP0, IP1, IP2, IP3.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EthernetParameters {
    /// \[E00\] open mode; IP0 is never a client (PAR-E00-02).
    pub open_mode: [OpenMode; 4],
    /// \[E01\] address of the controller.
    pub address: [u8; 4],
    /// \[E02\] name of the controller, without its quotes; has no effect.
    pub name: String,
    /// \[E03\] subnet mask.
    pub mask: [u8; 4],
    /// \[E04\] default gateway.
    pub gateway: [u8; 4],
    /// \[E05\] own ports, 1 to 65535.
    pub own_port: [u16; 4],
    /// \[E06\] ports of the peers, 1 to 65535; for clients.
    pub peer_port: [u16; 4],
    /// \[E07\] addresses of the peers; for clients.
    pub peer_address: [[u8; 4]; 4],
    /// \[E08\] community name, without its quotes; has no effect.
    pub community: String,
    /// \[E09\] DHCP, 0 or 1; has no effect.
    pub dhcp: u8,
    /// \[E10\] level of the alarm when a connection drops while a program runs.
    pub alarm_level: [Option<AlarmLevel>; 4],
}

impl EthernetParameters {
    /// The values the manual lists.
    pub fn factory() -> EthernetParameters {
        EthernetParameters {
            open_mode: [
                OpenMode::Server,
                OpenMode::NotUsed,
                OpenMode::NotUsed,
                OpenMode::NotUsed,
            ],
            address: [192, 168, 0, 124],
            name: String::from("NO1-TS3K"),
            mask: [255, 255, 255, 0],
            gateway: [192, 168, 0, 1],
            own_port: [1000, 1001, 1002, 1003],
            peer_port: [1000, 1001, 1002, 1003],
            peer_address: [
                [192, 168, 0, 150],
                [192, 168, 0, 151],
                [192, 168, 0, 152],
                [192, 168, 0, 153],
            ],
            community: String::from("NO1-TS3K"),
            dhcp: 0,
            alarm_level: [None; 4],
        }
    }

    /// The file of a fresh RAM drive: [`EthernetParameters::factory`] with another \[E00\].
    pub fn factory_file(open: [OpenMode; 4], line_end: LineEnd) -> Vec<u8> {
        EthernetParameters {
            open_mode: open,
            ..EthernetParameters::factory()
        }
        .encode(line_end)
    }

    /// These values as a file, comments and `[END]` included, EOF not.
    pub fn encode(&self, line_end: LineEnd) -> Vec<u8> {
        let quad = |[a, b, c, d]: [u8; 4]| format!("{a}.{b}.{c}.{d}");
        let four = |[a, b, c, d]: [u8; 4]| format!("{a} {b} {c} {d}");
        let each = |values: [String; 4]| {
            let lines = CHANNELS.iter().zip(values);
            let lines = lines.map(|(key, value)| format!("{{{key}}} = {value}\n"));
            lines.collect::<String>()
        };
        let ports = |ports: [u16; 4]| each(ports.map(|port| port.to_string()));
        let text = format!(
            "[E00] Open mode of IP0 IP1 IP2 IP3\n\
             {{0: not used, 1: controller is TCP server, 2: controller is TCP client}}\n= {}\n\
             [E01] IP address of the controller\n= {}\n\
             [E02] Name of the controller (without effect)\n= \"{}\"\n\
             [E03] Subnet mask\n= {}\n\
             [E04] Default gateway\n= {}\n\
             [E05] Own ports, each number once\n{}\
             [E06] Ports of the peers, for clients\n{}\
             [E07] IP addresses of the peers, for clients\n{}\
             [E08] Community name (without effect)\n= \"{}\"\n\
             [E09] DHCP (without effect)\n= {}\n\
             [E10] Alarm when a connection drops while a program runs: IP0 IP1 IP2 IP3\n\
             {{0: none, 1 2 4 8: level of the alarm}}\n= {}\n\
             [END]\n",
            four(self.open_mode.map(OpenMode::number)),
            quad(self.address),
            self.name,
            quad(self.mask),
            quad(self.gateway),
            ports(self.own_port),
            ports(self.peer_port),
            each(self.peer_address.map(quad)),
            self.community,
            self.dhcp,
            four(self.alarm_level.map(|level| level.map_or(0, AlarmLevel::number))),
        );
        with_line_end(&text, line_end)
    }

    /// Reads a file. A value that is bad or missing stays as in `previous`; each is a problem, and so are
    /// IP0 as a client (becomes a server, PAR-E00-03), one own port for two channels (if both are in use the
    /// later one becomes not used, PAR-E05-02), sections or keys unknown or twice, and a missing `[END]`.
    pub fn parse(
        content: &[u8],
        previous: &EthernetParameters,
    ) -> (EthernetParameters, Vec<ParameterProblem>) {
        let file = ParameterFile::parse(content);
        let mut values = FileValues::new(&file);
        let mut next = previous.clone();
        check_sections(&mut values);
        let mode = |word: &str| number(word).and_then(OpenMode::from_number);
        four(values.section("E00"), &mut next.open_mode, "0, 1 or 2", mode);
        values.read("E01", &mut next.address, ADDRESS, address);
        values.read("E02", &mut next.name, NAME, name);
        values.read("E03", &mut next.mask, ADDRESS, address);
        values.read("E04", &mut next.gateway, ADDRESS, address);
        each(values.section("E05"), &mut next.own_port, PORT, port);
        each(values.section("E06"), &mut next.peer_port, PORT, port);
        each(values.section("E07"), &mut next.peer_address, ADDRESS, address);
        values.read("E08", &mut next.community, NAME, name);
        let dhcp = |value: &str| number(value).filter(|dhcp| *dhcp <= 1);
        values.read("E09", &mut next.dhcp, "0 or 1", dhcp);
        let level = |word: &str| match word {
            "0" => Some(None),
            word => number(word).and_then(AlarmLevel::from_number).map(Some),
        };
        let section = values.section("E10");
        four(section, &mut next.alarm_level, "0, 1, 2, 4 or 8", level);
        next.resolve_conflicts(&mut values);
        (next, values.problems.0)
    }

    /// Resolves values that are allowed one by one but not together.
    fn resolve_conflicts(&mut self, values: &mut FileValues<'_>) {
        let FileValues { file, problems } = values;
        let line = |tag: &str, key: &str| {
            let section = file.sections.iter().find(|section| section.tag == tag);
            let mut assignments = section.into_iter().flat_map(|section| &section.assignments);
            let named = assignments.find(|assignment| key.is_empty() || assignment.key == key);
            named.map_or(0, |named| named.line)
        };
        if self.open_mode[0] == OpenMode::Client {
            self.open_mode[0] = OpenMode::Server;
            let expected = "0 or 1; IP0 is never a client";
            problems.add("E00", CHANNELS[0], expected, "2", line("E00", ""));
        }
        for (later, key) in CHANNELS.into_iter().enumerate() {
            let port = self.own_port[later];
            let same_port: Vec<usize> = (0..later)
                .filter(|earlier| self.own_port[*earlier] == port)
                .collect();
            let Some(first) = same_port.first() else { continue };
            let expected = format!("another port than that of {}", CHANNELS[*first]);
            problems.add("E05", key, &expected, &port.to_string(), line("E05", key));
            let mut modes = same_port.iter().map(|earlier| self.open_mode[*earlier]);
            if modes.any(|mode| mode != OpenMode::NotUsed) {
                self.open_mode[later] = OpenMode::NotUsed;
            }
        }
    }
}

/// Names of the channels, the keys of \[E05\] to \[E07\].
const CHANNELS: [&str; 4] = ["IP0", "IP1", "IP2", "IP3"];

/// The sections of the file.
const SECTIONS: [&str; 11] = [
    "E00", "E01", "E02", "E03", "E04", "E05", "E06", "E07", "E08", "E09", "E10",
];

/// Longest name in \[E02\] and \[E08\], in characters; the manual gives no limit.
const MAX_NAME: usize = 64;

const ADDRESS: &str = "four numbers 0 to 255 with dots";
const PORT: &str = "a port number 1 to 65535";
const NAME: &str = "a name in quotes, 64 ASCII characters at most";

fn check_sections(values: &mut FileValues<'_>) {
    let FileValues { file, problems } = values;
    let sections = file.sections.iter();
    for section in sections.filter(|section| !SECTIONS.contains(&section.tag.as_str())) {
        let found = format!("[{}]", section.tag);
        problems.add("", "", "a section [E00] to [E10]", &found, section.line);
    }
    if file.end.is_none() {
        problems.add("", "", "[END] at the end", "", 0);
    }
}

/// Four values on one line. A wrong number of them leaves all, a bad one its own channel.
fn four<T>(
    mut section: SectionValues<'_>,
    targets: &mut [T; 4],
    expected: &str,
    parse: impl Fn(&str) -> Option<T>,
) {
    let four = format!("four values for IP0 IP1 IP2 IP3, each {expected}");
    let line = section.assignments().first().map_or(0, |first| first.line);
    let mut words = None;
    section.read(None, &mut words, &four, |value| {
        split_words(value).map(|words: [&str; 4]| Some(words.map(String::from)))
    });
    for ((target, word), channel) in targets.iter_mut().zip(words.iter().flatten()).zip(CHANNELS) {
        match parse(word) {
            Some(value) => *target = value,
            None => section.problems.add(section.name, channel, expected, word, line),
        }
    }
}

/// One value per channel.
fn each<T>(
    mut section: SectionValues<'_>,
    targets: &mut [T; 4],
    expected: &str,
    parse: impl Fn(&str) -> Option<T>,
) {
    for (target, key) in targets.iter_mut().zip(CHANNELS) {
        section.read(Some(key), target, expected, &parse);
    }
    section.refuse_other_keys(&CHANNELS);
}

fn port(value: &str) -> Option<u16> {
    number(value).filter(|port| *port != 0)
}

fn address(value: &str) -> Option<[u8; 4]> {
    let parts: Option<Vec<u8>> = value.split('.').map(number).collect();
    parts?.try_into().ok()
}

fn name(value: &str) -> Option<String> {
    let inner = value.strip_prefix('"')?.strip_suffix('"')?;
    let fits = inner.len() <= MAX_NAME && inner.chars().all(|char| matches!(char, ' '..='~') && char != '"');
    fits.then(|| inner.to_string())
}

#[cfg(test)]
mod tests;
