//! Counts events and formats counters and gauges for Prometheus.
//!
//! Counters are kept here and updated by [`super::journal`]. Gauges are taken from the controller at each request,
//! in [`super::service`].

use crate::printable::escape_line;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use ts3100_controller::input::Input;
use ts3100_controller::output::{Event, Output, Verdict};
use ts3100_controller::port::Port;

/// Most series of one family; the rest is counted as [`OTHER`]. Hosts can send arbitrary commands, so labels must be
/// bounded.
const MAX_SERIES: usize = 256;
/// Label value for everything beyond [`MAX_SERIES`].
const OTHER: &str = "other";

/// A family of counters.
#[derive(Debug, Clone, Copy)]
enum Family {
    Refusals,
    Bytes,
    Texts,
    Commands,
    Dropped,
    Connections,
    Alarms,
    Findings,
    Faults,
}

/// What is printed of a family.
struct Description {
    name: &'static str,
    help: &'static str,
    labels: &'static [&'static str],
}

/// Number of families.
const FAMILIES: usize = 9;

/// The families, in the order of [`Family`].
const DESCRIPTIONS: [Description; FAMILIES] = [
    Description {
        name: "ts3100_refusals_total",
        help: "Texts answered NG, by their first letters.",
        labels: &["port", "command"],
    },
    Description {
        name: "ts3100_bytes_total",
        help: "Bytes on a port, by direction.",
        labels: &["port", "direction"],
    },
    Description {
        name: "ts3100_texts_total",
        help: "Whole texts on a protocol port, by direction.",
        labels: &["port", "direction"],
    },
    Description {
        name: "ts3100_commands_total",
        help: "Commands of the permission tables, by outcome.",
        labels: &["port", "command", "outcome"],
    },
    Description {
        name: "ts3100_dropped_bytes_total",
        help: "Bytes that belonged to no text or to one that was given up.",
        labels: &["port"],
    },
    Description {
        name: "ts3100_connections_total",
        help: "Peers that connected.",
        labels: &["port"],
    },
    Description {
        name: "ts3100_alarms_total",
        help: "Alarms raised.",
        labels: &["number"],
    },
    Description {
        name: "ts3100_findings_total",
        help: "Findings about hosts.",
        labels: &["rule"],
    },
    Description {
        name: "ts3100_faults_total",
        help: "Faults that were applied, by kind.",
        labels: &["kind"],
    },
];

/// Values of the labels of a series, empty where its family has fewer. Most are names that the program knows.
type Labels = [Cow<'static, str>; 3];

/// Directions on a port, as labels.
const DIRECTIONS: [&str; 2] = ["in", "out"];
const IN: usize = 0;
const OUT: usize = 1;

/// What every text counts, without comparing names.
#[derive(Debug, Clone, Default)]
struct PortCounters {
    /// By direction.
    bytes: [u64; 2],
    texts: [u64; 2],
    /// Rows of the permission tables, by the verdict.
    commands: [Names; Verdict::ALL.len()],
}

/// Names of a table, with how often each was met. There are few, and hosts repeat them.
type Names = Vec<(&'static str, u64)>;

fn count_name(names: &mut Names, name: &'static str) {
    // A name comes from one place of the table: its address tells most of them without a look at their letters.
    let same = |counted: &str| std::ptr::eq(counted, name) || counted == name;
    if let Some((_, count)) = names.iter_mut().find(|(counted, _)| same(counted)) {
        *count += 1;
    } else {
        names.push((name, 1));
    }
}

/// Counters of everything that happened since the start.
#[derive(Debug, Clone, Default)]
pub struct Metrics {
    /// In the order of [`Port::ALL`]. The series of [`Family::Bytes`], [`Family::Texts`] and [`Family::Commands`] are made
    /// of them.
    ports: [PortCounters; Port::ALL.len()],
    /// By their rules: the series of [`Family::Findings`].
    findings: Names,
    /// The series of each other family.
    counters: [BTreeMap<Labels, u64>; FAMILIES],
}

/// A value that goes up and down.
#[derive(Debug, Clone)]
pub struct Gauge {
    /// Name of the metric.
    pub name: &'static str,
    /// Help text of the metric.
    pub help: &'static str,
    /// Present value.
    pub value: f64,
}

impl Metrics {
    fn port(&mut self, port: Port) -> &mut PortCounters {
        &mut self.ports[port as usize]
    }

    /// The series of a family, in the order of their labels.
    fn series(&self, family: usize) -> BTreeMap<Labels, u64> {
        let ports = Port::ALL.into_iter().zip(&self.ports);
        let directions = |of_port: fn(&PortCounters) -> [u64; 2]| {
            let counted = ports.clone().flat_map(|(port, counters)| {
                let counts = DIRECTIONS.into_iter().zip(of_port(counters));
                counts.map(move |(direction, count)| {
                    ([port.name().into(), direction.into(), Cow::default()], count)
                })
            });
            counted.filter(|(_, count)| *count > 0).collect()
        };
        match family {
            _ if family == Family::Bytes as usize => directions(|counters| counters.bytes),
            _ if family == Family::Texts as usize => directions(|counters| counters.texts),
            _ if family == Family::Commands as usize => ports
                .flat_map(|(port, counters)| {
                    let verdicts = Verdict::ALL.into_iter().zip(&counters.commands);
                    verdicts.flat_map(move |(verdict, rows)| {
                        let labels = move |row: &'static str| {
                            [port.name().into(), row.into(), verdict.as_str().into()]
                        };
                        rows.iter().map(move |(row, count)| (labels(row), *count))
                    })
                })
                .collect(),
            _ if family == Family::Findings as usize => {
                let rules = self.findings.iter();
                rules
                    .map(|(rule, count)| ([(*rule).into(), Cow::default(), Cow::default()], *count))
                    .collect()
            }
            _ => self.counters.get(family).cloned().unwrap_or_default(),
        }
    }

    fn count<const N: usize>(&mut self, family: Family, labels: [&'static str; N], by: usize) {
        let mut key = Labels::default();
        for (value, label) in key.iter_mut().zip(labels) {
            *value = Cow::Borrowed(label);
        }
        self.count_labels(family, key, by);
    }

    fn count_labels(&mut self, family: Family, key: Labels, by: usize) {
        let Some(series) = self.counters.get_mut(family as usize) else {
            return;
        };
        if let Some(count) = series.get_mut(&key) {
            *count += by as u64;
            return;
        }
        let key = if series.len() < MAX_SERIES {
            key
        } else {
            key.map(|label| match label.is_empty() {
                true => label,
                false => Cow::Borrowed(OTHER),
            })
        };
        *series.entry(key).or_default() += by as u64;
    }

    /// Counts an input of the controller.
    pub fn count_input(&mut self, input: &Input) {
        if let Input::Received { port, bytes } = input {
            self.port(*port).bytes[IN] += bytes.len() as u64;
        } else if let Input::Connected { port, .. } = input {
            self.count(Family::Connections, [port.name()], 1);
        }
    }

    /// Counts an output of the controller.
    pub fn count_output(&mut self, output: &Output) {
        if let Output::Send { port, bytes } = output {
            self.port(*port).bytes[OUT] += bytes.len() as u64;
        } else if let Output::Event(event) = output {
            self.count_event(event);
        }
    }

    fn count_event(&mut self, event: &Event) {
        match event {
            Event::TextIn { port, .. } => self.port(*port).texts[IN] += 1,
            Event::TextOut { port, .. } => self.port(*port).texts[OUT] += 1,
            Event::Dropped { port, bytes, .. } => self.count(Family::Dropped, [port.name()], *bytes),
            Event::Answered {
                port, row, verdict, ..
            } => count_name(&mut self.port(*port).commands[*verdict as usize], row),
            Event::Refused { port, command, .. } => {
                let command = Cow::Owned(command.clone());
                self.count_labels(Family::Refusals, [port.name().into(), command, Cow::default()], 1);
            }
            Event::Finding { rule, .. } => count_name(&mut self.findings, rule),
            Event::Alarm { number, .. } => {
                let number = Cow::Owned(number.clone());
                self.count_labels(Family::Alarms, [number, Cow::default(), Cow::default()], 1);
            }
            Event::Fault {
                kind, fired: true, ..
            } => self.count(Family::Faults, [kind], 1),
            Event::ActionRefused(_)
            | Event::AlarmsReset
            | Event::Fault { fired: false, .. }
            | Event::Status { .. }
            | Event::Statement { .. }
            | Event::Servo(_)
            | Event::ServoDelayed(_)
            | Event::Selected(_) => {}
        }
    }
}

/// What is known of a robot at one moment.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Its name, if there are several.
    pub robot: Option<String>,
    /// Everything that was counted.
    pub counters: Metrics,
    /// Everything that goes up and down.
    pub gauges: Vec<Gauge>,
}

impl Sample {
    /// Labels in braces; the name of the robot is the first.
    fn labels(&self, pairs: impl Iterator<Item = (&'static str, impl AsRef<str>)>) -> String {
        let robot = self.robot.iter().map(|name| format!("robot=\"{name}\""));
        let pairs = pairs.map(|(name, value)| format!("{name}=\"{}\"", escape_label(value.as_ref())));
        let labels: Vec<String> = robot.chain(pairs).collect();
        match labels.is_empty() {
            true => String::new(),
            false => format!("{{{}}}", labels.join(",")),
        }
    }
}

/// Formats counters and gauges in the text format of Prometheus, version 0.0.4.
#[must_use]
pub fn to_prometheus(samples: &[Sample]) -> String {
    let mut text = String::new();
    for (index, family) in DESCRIPTIONS.iter().enumerate() {
        write_header(&mut text, family.name, family.help, "counter");
        for sample in samples {
            for (labels, value) in sample.counters.series(index) {
                let labels = sample.labels(family.labels.iter().copied().zip(&labels));
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{}{labels} {value}", family.name);
            }
        }
    }
    let mut written = BTreeSet::new();
    for gauge in samples.iter().flat_map(|sample| &sample.gauges) {
        if !written.insert(gauge.name) {
            continue;
        }
        write_header(&mut text, gauge.name, gauge.help, "gauge");
        for sample in samples {
            let labels = sample.labels(std::iter::empty::<(_, &str)>());
            for same in sample.gauges.iter().filter(|same| same.name == gauge.name) {
                let _ = writeln!(text, "{}{labels} {}", same.name, same.value);
            }
        }
    }
    text
}

fn write_header(text: &mut String, name: &str, help: &str, kind: &str) {
    let _ = writeln!(text, "# HELP {name} {help}\n# TYPE {name} {kind}");
}

fn escape_label(value: &str) -> String {
    escape_line(value).replace('\\', "\\\\").replace('"', "\\\"")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hosts_make_up_does_not_grow_without_end() {
        let mut metrics = Metrics::default();
        for number in 0..1_000 {
            let command = format!("{number}\"\n");
            let reason = String::new();
            metrics.count_output(&Output::Event(Event::Refused {
                port: Port::Ip0,
                command,
                reason,
            }));
        }
        let counters = metrics;
        let sample = Sample {
            robot: None,
            counters,
            gauges: Vec::new(),
        };
        let text = to_prometheus(&[sample]);
        let lines = text
            .lines()
            .filter(|line| line.starts_with("ts3100_refusals_total{"));
        assert_eq!(lines.count(), MAX_SERIES + 1);
        assert!(text.contains("command=\"0\\\"<LF>\"} 1\n"));
        let rest = "ts3100_refusals_total{port=\"other\",command=\"other\"} 744\n";
        assert!(text.contains(rest), "{text}");
    }
}
