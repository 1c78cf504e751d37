//! Counts events and formats counters and gauges for Prometheus.
//!
//! Counters are kept here and updated by [`super::journal`]. They count by the values of an event and never need its form.
//! Gauges are taken from the controller at each request, in [`super::service`].

use crate::printable::escape_line;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use ts3100_controller::findings::Finding;
use ts3100_controller::{Event, Input, Output, Port, Verdict};

/// Most series of one family; the rest is counted as [`OTHER`]. Hosts can send arbitrary commands, so labels must be
/// bounded.
const MAX_SERIES: usize = 256;
/// Label value for everything beyond [`MAX_SERIES`].
const OTHER: &str = "other";

/// A family of counters.
struct Family {
    name: &'static str,
    help: &'static str,
    labels: &'static [&'static str],
    series: fn(&Metrics) -> Series,
}

const FAMILIES: [Family; 9] = [
    Family {
        name: "ts3100_refusals_total",
        help: "Texts answered NG, by their first letters.",
        labels: &["port", "command"],
        series: |metrics| metrics.refusals.clone(),
    },
    Family {
        name: "ts3100_bytes_total",
        help: "Bytes on a port, by direction.",
        labels: &["port", "direction"],
        series: |metrics| metrics.by_direction(|counters| counters.bytes),
    },
    Family {
        name: "ts3100_texts_total",
        help: "Whole texts on a protocol port, by direction.",
        labels: &["port", "direction"],
        series: |metrics| metrics.by_direction(|counters| counters.texts),
    },
    Family {
        name: "ts3100_commands_total",
        help: "Commands of the permission tables, by outcome.",
        labels: &["port", "command", "outcome"],
        series: Metrics::commands,
    },
    Family {
        name: "ts3100_dropped_bytes_total",
        help: "Bytes that belonged to no text or to one that was given up.",
        labels: &["port"],
        series: |metrics| metrics.dropped.clone(),
    },
    Family {
        name: "ts3100_connections_total",
        help: "Peers that connected.",
        labels: &["port"],
        series: |metrics| metrics.connections.clone(),
    },
    Family {
        name: "ts3100_alarms_total",
        help: "Alarms raised.",
        labels: &["number"],
        series: |metrics| metrics.alarms.clone(),
    },
    Family {
        name: "ts3100_findings_total",
        help: "Findings about hosts, without those that faults caused.",
        labels: &["rule"],
        series: Metrics::findings,
    },
    Family {
        name: "ts3100_faults_total",
        help: "Faults that were applied, by kind.",
        labels: &["kind"],
        series: |metrics| metrics.faults.clone(),
    },
];

/// Counts by the values of their labels.
type Series = BTreeMap<Labels, u64>;

/// Values of the labels of a series, empty where its family has fewer. Most are names that the program knows.
type Labels = [Cow<'static, str>; 3];

/// Directions on a port, as labels.
const DIRECTIONS: [&str; 2] = ["in", "out"];
const IN: usize = 0;
const OUT: usize = 1;

/// Counters of a port. Every text changes some, so names are not compared.
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
    /// Counters of each port, in the order of [`Port::ALL`].
    ports: [PortCounters; Port::ALL.len()],
    /// Numbers of findings by their rules.
    findings: Names,
    refusals: Series,
    dropped: Series,
    connections: Series,
    alarms: Series,
    faults: Series,
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

/// The labels of a series, of which there may be fewer than three.
fn labels<const N: usize>(values: [Cow<'static, str>; N]) -> Labels {
    let mut labels = Labels::default();
    for (label, value) in labels.iter_mut().zip(values) {
        *label = value;
    }
    labels
}

fn count<const N: usize>(series: &mut Series, values: [Cow<'static, str>; N], by: usize) {
    let mut key = labels(values);
    if series.len() >= MAX_SERIES && !series.contains_key(&key) {
        let used = key.iter_mut().filter(|label| !label.is_empty());
        used.for_each(|label| *label = Cow::Borrowed(OTHER));
    }
    *series.entry(key).or_default() += by as u64;
}

impl Metrics {
    fn port(&mut self, port: Port) -> &mut PortCounters {
        &mut self.ports[port as usize]
    }

    fn by_direction(&self, of_port: fn(&PortCounters) -> [u64; 2]) -> Series {
        let counted = Port::ALL
            .into_iter()
            .zip(&self.ports)
            .flat_map(|(port, counters)| {
                let counts = DIRECTIONS.into_iter().zip(of_port(counters));
                counts.map(move |(direction, count)| (labels([port.name().into(), direction.into()]), count))
            });
        counted.filter(|(_, count)| *count > 0).collect()
    }

    fn commands(&self) -> Series {
        let mut series = Series::new();
        for (port, counters) in Port::ALL.into_iter().zip(&self.ports) {
            for (verdict, rows) in Verdict::ALL.into_iter().zip(&counters.commands) {
                let labels = |row: &'static str| [port.name().into(), row.into(), verdict.as_str().into()];
                series.extend(rows.iter().map(|(row, count)| (labels(row), *count)));
            }
        }
        series
    }

    fn findings(&self) -> Series {
        let rules = self.findings.iter();
        rules
            .map(|(rule, count)| (labels([(*rule).into()]), *count))
            .collect()
    }

    /// Counts an input of the controller.
    pub fn count_input(&mut self, input: &Input) {
        if let Input::Received { port, bytes } = input {
            self.port(*port).bytes[IN] += bytes.len() as u64;
        } else if let Input::Connected { port, .. } = input {
            count(&mut self.connections, [port.name().into()], 1);
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
            Event::Dropped { port, bytes, .. } => count(&mut self.dropped, [port.name().into()], *bytes),
            Event::Answered {
                port, row, verdict, ..
            } => count_name(&mut self.port(*port).commands[*verdict as usize], row),
            Event::Refused { port, command, .. } => {
                count(
                    &mut self.refusals,
                    [port.name().into(), command.clone().into()],
                    1,
                );
            }
            // One that a fault has caused says nothing of the host.
            Event::Finding(Finding {
                caused_by: Some(_), ..
            }) => {}
            Event::Finding(finding) => count_name(&mut self.findings, finding.rule.id),
            Event::Alarm { number, .. } => count(&mut self.alarms, [number.clone().into()], 1),
            Event::Fault {
                kind, fired: true, ..
            } => count(&mut self.faults, [(*kind).into()], 1),
            Event::ActionRefused(_)
            | Event::AlarmsReset
            | Event::Fault { fired: false, .. }
            | Event::Status { .. }
            | Event::Statement { .. }
            | Event::Breakpoint { .. }
            | Event::Servo(_)
            | Event::ServoDelayed(_)
            | Event::Selected(_) => {}
        }
    }
}

/// State of a robot at one moment.
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
pub fn to_prometheus(samples: &[Sample]) -> String {
    let mut text = String::new();
    for family in &FAMILIES {
        write_header(&mut text, family.name, family.help, "counter");
        for sample in samples {
            for (labels, value) in (family.series)(&sample.counters) {
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
    use crate::every_event::{bless, compare, inputs, outputs};

    const GOLDEN: &str = "metrics.prom";

    /// The counters after every event of the samples.
    fn counted() -> String {
        let mut counters = Metrics::default();
        inputs().iter().for_each(|input| counters.count_input(input));
        outputs().iter().for_each(|output| counters.count_output(output));
        to_prometheus(&[Sample {
            robot: None,
            counters,
            gauges: Vec::new(),
        }])
    }

    #[test]
    fn every_event_is_counted() {
        compare(GOLDEN, &counted());
    }

    #[test]
    #[ignore = "writes fixtures/golden/events anew; review the difference"]
    fn bless_metrics() {
        bless(GOLDEN, &counted());
    }

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
