//! ETHERNET.PAR, sections \[E00\] to \[E10\] (manual 3.3): values, reader and writer.
//!
//! It checks values one by one and against each other (PAR-E00-03, PAR-E05-02). Opening the channels is left to the
//! emulator. The syntax of the file is in `reader.rs`.

use super::{
    LineEnd, ParameterFile, ParameterProblem, Problems, SectionValues, check_size, join_lines, number,
    split_words,
};
use crate::status::AlarmLevel;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;

/// How a channel is opened (\[E00\]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum OpenMode {
    /// 0: the channel is closed.
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

/// The values of ETHERNET.PAR. Arrays are in the order IP0, IP1, IP2, IP3.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
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
    #[must_use]
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
    #[must_use]
    pub fn factory_file(open: [OpenMode; 4], line_end: LineEnd) -> Vec<u8> {
        EthernetParameters {
            open_mode: open,
            ..EthernetParameters::factory()
        }
        .encode(line_end)
    }

    /// These values as a file, comments and `[END]` included, EOF not.
    #[must_use]
    pub fn encode(&self, line_end: LineEnd) -> Vec<u8> {
        let quad = |[a, b, c, d]: [u8; 4]| format!("= {a}.{b}.{c}.{d}");
        let four = |[a, b, c, d]: [u8; 4]| format!("= {a} {b} {c} {d}");
        let line = |text: &str| text.to_string();
        let mut lines = vec![
            line("[E00] Open mode of IP0 IP1 IP2 IP3"),
            line("{0: not used, 1: controller is TCP server, 2: controller is TCP client}"),
            four(self.open_mode.map(OpenMode::number)),
            line("[E01] IP address of the controller"),
            quad(self.address),
            line("[E02] Name of the controller (without effect)"),
            format!("= \"{}\"", self.name),
            line("[E03] Subnet mask"),
            quad(self.mask),
            line("[E04] Default gateway"),
            quad(self.gateway),
            line("[E05] Own ports, each number once"),
        ];
        let keyed = |channel: &str, value: String| format!("{{{channel}}} {value}");
        let ports = |ports: [u16; 4]| {
            CHANNELS
                .into_iter()
                .zip(ports)
                .map(|(key, port)| keyed(key, format!("= {port}")))
        };
        lines.extend(ports(self.own_port));
        lines.push(line("[E06] Ports of the peers, for clients"));
        lines.extend(ports(self.peer_port));
        lines.push(line("[E07] IP addresses of the peers, for clients"));
        lines.extend(
            CHANNELS
                .into_iter()
                .zip(self.peer_address)
                .map(|(key, address)| keyed(key, quad(address))),
        );
        lines.extend([
            line("[E08] Community name (without effect)"),
            format!("= \"{}\"", self.community),
            line("[E09] DHCP (without effect)"),
            format!("= {}", self.dhcp),
            line("[E10] Alarm when a connection drops while a program runs: IP0 IP1 IP2 IP3"),
            line("{0: none, 1 2 4 8: level of the alarm}"),
            four(self.alarm_level.map(|level| level.map_or(0, AlarmLevel::number))),
            line("[END]"),
        ]);
        join_lines(&lines, line_end)
    }

    /// Reads a file. A value that is bad or missing stays as in `previous`; each is a problem, and so are
    /// IP0 as a client (becomes a server, PAR-E00-03), one own port for two channels (if both are in use the
    /// later one becomes not used, PAR-E05-02), sections or keys unknown or twice, and a missing `[END]`.
    #[must_use]
    pub fn parse(
        content: &[u8],
        previous: &EthernetParameters,
    ) -> (EthernetParameters, Vec<ParameterProblem>) {
        let file = ParameterFile::parse(content);
        let mut problems = Problems::default();
        let mut next = previous.clone();
        check_sections(&file, &mut problems);
        next.open_mode = four(&file, "E00", "0, 1 or 2", next.open_mode, &mut problems, |word| {
            [OpenMode::NotUsed, OpenMode::Server, OpenMode::Client]
                .into_iter()
                .find(|mode| is(mode.number(), word))
        });
        SectionValues::new(&file, "E01", &mut problems).read_single(&mut next.address, ADDRESS, address);
        SectionValues::new(&file, "E02", &mut problems).read_single(&mut next.name, NAME, name);
        SectionValues::new(&file, "E03", &mut problems).read_single(&mut next.mask, ADDRESS, address);
        SectionValues::new(&file, "E04", &mut problems).read_single(&mut next.gateway, ADDRESS, address);
        each(
            SectionValues::new(&file, "E05", &mut problems),
            &mut next.own_port,
            PORT,
            port,
        );
        each(
            SectionValues::new(&file, "E06", &mut problems),
            &mut next.peer_port,
            PORT,
            port,
        );
        each(
            SectionValues::new(&file, "E07", &mut problems),
            &mut next.peer_address,
            ADDRESS,
            address,
        );
        SectionValues::new(&file, "E08", &mut problems).read_single(&mut next.community, NAME, name);
        let dhcp = |value: &str| number(value).filter(|dhcp| *dhcp <= 1);
        SectionValues::new(&file, "E09", &mut problems).read_single(&mut next.dhcp, "0 or 1", dhcp);
        let expected = "0, 1, 2, 4 or 8";
        next.alarm_level = four(
            &file,
            "E10",
            expected,
            next.alarm_level,
            &mut problems,
            |word| match word {
                "0" => Some(None),
                word => AlarmLevel::ALL
                    .into_iter()
                    .find(|level| is(level.number(), word))
                    .map(Some),
            },
        );
        next.resolve_conflicts(&file, &mut problems);
        (next, problems.0)
    }

    /// Resolves values that are allowed one by one but not together.
    fn resolve_conflicts(&mut self, file: &ParameterFile, problems: &mut Problems) {
        let line = |tag: &str, key: &str| {
            let section = file.sections.iter().find(|section| section.tag == tag);
            let mut assignments = section.into_iter().flat_map(|section| &section.assignments);
            assignments
                .find(|assignment| key.is_empty() || assignment.key == key)
                .map_or(0, |found| found.line)
        };
        if self.open_mode[0] == OpenMode::Client {
            self.open_mode[0] = OpenMode::Server;
            problems.add(
                "E00",
                CHANNELS[0],
                "0 or 1, IP0 is no client",
                "2",
                line("E00", ""),
            );
        }
        for (later, key) in CHANNELS.into_iter().enumerate() {
            let port = self.own_port[later];
            let same_port: Vec<usize> = (0..later)
                .filter(|earlier| self.own_port[*earlier] == port)
                .collect();
            let Some(first) = same_port.first() else { continue };
            let expected = format!("another port than that of {}", CHANNELS[*first]);
            problems.add("E05", key, &expected, &port.to_string(), line("E05", key));
            if same_port
                .iter()
                .any(|earlier| self.open_mode[*earlier] != OpenMode::NotUsed)
            {
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

fn check_sections(file: &ParameterFile, problems: &mut Problems) {
    check_size(file, problems);
    for section in file
        .sections
        .iter()
        .filter(|section| !SECTIONS.contains(&section.tag.as_str()))
    {
        let found = format!("[{}]", section.tag);
        problems.add("", "", "a section [E00] to [E10]", &found, section.line);
    }
    if file.end.is_none() {
        problems.add("", "", "[END] at the end", "", 0);
    }
}

/// Four values on one line. A wrong number of them leaves all, a bad one its own channel.
fn four<T: Copy>(
    file: &ParameterFile,
    name: &'static str,
    expected: &str,
    mut values: [T; 4],
    problems: &mut Problems,
    parse: impl Fn(&str) -> Option<T>,
) -> [T; 4] {
    let four = format!("four values for IP0 IP1 IP2 IP3, each {expected}");
    let mut found = [""; 4].map(String::from);
    SectionValues::new(file, name, problems).read_single(&mut found, &four, |value| {
        split_words(value).map(|words| words.map(String::from))
    });
    let section = file.sections.iter().find(|section| section.tag == name);
    let line = section
        .and_then(|section| section.assignments.first())
        .map_or(0, |assignment| assignment.line);
    for ((target, word), channel) in values.iter_mut().zip(&found).zip(CHANNELS) {
        match parse(word) {
            Some(value) => *target = value,
            // Empty only if the number of values was wrong, which is reported already.
            None if word.is_empty() => {}
            None => problems.add(name, channel, expected, word, line),
        }
    }
    values
}

/// One value per channel.
fn each<T>(
    mut section: SectionValues<'_>,
    targets: &mut [T; 4],
    expected: &str,
    parse: impl Fn(&str) -> Option<T>,
) {
    for (target, key) in targets.iter_mut().zip(CHANNELS) {
        section.read_keyed(key, target, expected, &parse);
    }
    section.refuse_other_keys(&CHANNELS);
}

fn is(known: u8, word: &str) -> bool {
    number(word) == Some(known)
}

fn port(value: &str) -> Option<u16> {
    number(value).filter(|port| *port != 0)
}

fn address(value: &str) -> Option<[u8; 4]> {
    let mut parts = value.split('.');
    let mut address = [0; 4];
    for part in &mut address {
        *part = number(parts.next()?)?;
    }
    parts.next().is_none().then_some(address)
}

fn name(value: &str) -> Option<String> {
    let inner = value.strip_prefix('"')?.strip_suffix('"')?;
    let fits = inner.len() <= MAX_NAME && inner.chars().all(|char| matches!(char, ' '..='~') && char != '"');
    fits.then(|| inner.to_string())
}

#[cfg(test)]
mod tests;
