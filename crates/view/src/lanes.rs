//! What a timeline shows: lanes of marks, at which something happened, and of spans, in which something was so.
//!
//! Marks come from events, spans from the controller after each step. Nothing here replays or decides.

use serde::ser::{Serialize, SerializeSeq as _, SerializeStruct as _, Serializer};
use std::collections::BTreeMap;
use ts3100_control::event::JournalEvent;
use ts3100_controller::findings::Severity;
use ts3100_controller::output::Verdict;
use ts3100_controller::signals::Signals;
use ts3100_controller::{Controller, Event, Port, Time};
use ts3100_proto::escape::Escaped;
use ts3100_proto::status::io::LineWords;
use ts3100_proto::words::shortened;

/// Most marks and spans of a lane. Beyond them every second one of those that are ordinary is left out.
pub const MAX_ITEMS: usize = 20_000;
/// Most lanes; further lines and tasks have none.
pub const MAX_LANES: usize = 96;
/// Most characters of a label.
const MAX_LABEL: usize = 80;

/// How much attention a mark asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Nothing special.
    Plain,
    /// A note, or an effect of a fault that a test has armed.
    Note,
    Warning,
    Error,
}

impl From<Severity> for Level {
    fn from(severity: Severity) -> Level {
        match severity {
            Severity::Note => Level::Note,
            Severity::Warning => Level::Warning,
            Severity::Error => Level::Error,
        }
    }
}

impl Level {
    const fn word(self) -> &'static str {
        match self {
            Level::Plain => "",
            Level::Note => "note",
            Level::Warning => "warning",
            Level::Error => "error",
        }
    }
}

/// A mark, or a span that ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// The last event that had happened then.
    pub event: u64,
    pub at: Time,
    /// The event and the time at which a span has ended; a mark has none.
    pub until: Option<(u64, Time)>,
    pub level: Level,
    pub label: String,
}

/// As `[event, t, level, label]` with times in microseconds, and of a span `end event, end t` after them.
impl Serialize for Item {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut items = serializer.serialize_seq(None)?;
        items.serialize_element(&self.event)?;
        items.serialize_element(&self.at)?;
        items.serialize_element(self.level.word())?;
        items.serialize_element(&self.label)?;
        if let Some((event, at)) = &self.until {
            items.serialize_element(event)?;
            items.serialize_element(at)?;
        }
        items.end()
    }
}

/// A lane.
#[derive(Debug, Clone, Default)]
pub struct Lane {
    /// Its title, such as `IP0` or `Dout5`.
    pub title: String,
    pub items: Vec<Item>,
    /// The span that has not ended.
    open: Option<Item>,
    /// Items that were left out.
    pub left_out: u64,
}

impl Lane {
    fn mark(&mut self, item: Item) {
        self.items.push(item);
        if self.items.len() <= MAX_ITEMS {
            return;
        }
        let (before, mut place) = (self.items.len(), 0_u64);
        self.items.retain(|item| {
            place += 1;
            item.level > Level::Plain || place % 2 == 1
        });
        // A lane of errors alone is no timeline any more: its first tell what the others would.
        self.items.truncate(MAX_ITEMS);
        self.left_out += (before - self.items.len()) as u64;
    }

    /// Sets what is so from now on; an empty label is nothing.
    fn set(&mut self, place: Place, level: Level, label: &str) {
        if self.open.as_ref().map_or("", |open| open.label.as_str()) == label {
            return;
        }
        if let Some(mut open) = self.open.take() {
            open.until = Some((place.event, place.at));
            self.mark(open);
        }
        if !label.is_empty() {
            self.open = Some(place.item(level, label));
        }
    }

    /// The marks and spans, the open one until `end`.
    fn all(&self, end: Place) -> impl Iterator<Item = Item> {
        let open = self.open.clone().map(|open| Item {
            until: Some((end.event, end.at)),
            ..open
        });
        self.items.iter().cloned().chain(open)
    }
}

/// Where something happens: after the event of this number, at this time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Place {
    pub event: u64,
    pub at: Time,
}

impl Place {
    fn item(self, level: Level, label: &str) -> Item {
        let label = shortened(label, MAX_LABEL).into_owned();
        let (event, at, until) = (self.event, self.at, None);
        Item {
            event,
            at,
            until,
            level,
            label,
        }
    }
}

/// The name of a lane, in the order in which they are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LaneId {
    /// Refused commands and findings.
    Faulty,
    Alarms,
    /// Commands and answers of a protocol port, or data of a channel.
    Port(Port),
    /// Mode, servo power, and what is done at the panel.
    Panel,
    /// The line that a task is at.
    Task(u16),
    Motion,
    Input(u16),
    Output(u16),
    /// Faults that a test has armed.
    Faults,
    /// Resets, restored snapshots and power.
    Clock,
}

impl LaneId {
    fn task(self) -> Option<u16> {
        if let LaneId::Task(task) = self {
            Some(task)
        } else {
            None
        }
    }

    fn title(self) -> String {
        match self {
            LaneId::Faulty => "NG and findings".to_owned(),
            LaneId::Alarms => "Alarms".to_owned(),
            LaneId::Port(port) => port.to_string(),
            LaneId::Panel => "Mode and panel".to_owned(),
            LaneId::Task(0) => "DO".to_owned(),
            LaneId::Task(1) => "Program line".to_owned(),
            LaneId::Task(task) => format!("Task {task}"),
            LaneId::Motion => "Motion".to_owned(),
            LaneId::Input(line) => format!("Din{line}"),
            LaneId::Output(line) => format!("Dout{line}"),
            LaneId::Faults => "Faults".to_owned(),
            LaneId::Clock => "Clock and power".to_owned(),
        }
    }

    /// Its word in documents: `ng`, `alarms`, `ip0`, `din3`.
    fn word(self) -> String {
        match self {
            LaneId::Faulty => "ng".to_owned(),
            LaneId::Alarms => "alarms".to_owned(),
            LaneId::Port(port) => port.to_string().to_lowercase(),
            LaneId::Panel => "panel".to_owned(),
            LaneId::Task(task) => format!("task{task}"),
            LaneId::Motion => "motion".to_owned(),
            LaneId::Input(line) => format!("din{line}"),
            LaneId::Output(line) => format!("dout{line}"),
            LaneId::Faults => "faults".to_owned(),
            LaneId::Clock => "clock".to_owned(),
        }
    }
}

/// All lanes of a run.
#[derive(Debug, Clone, Default)]
pub struct Lanes {
    lanes: BTreeMap<LaneId, Lane>,
    lines: LineWords,
    /// The end of the run so far.
    end: Place,
}

impl Lanes {
    fn lane(&mut self, id: LaneId) -> Option<&mut Lane> {
        let is_new = !self.lanes.contains_key(&id);
        if is_new && self.lanes.len() >= MAX_LANES {
            return None;
        }
        let lane = self.lanes.entry(id).or_insert_with(|| Lane {
            title: id.title(),
            ..Lane::default()
        });
        Some(lane)
    }

    fn mark(&mut self, id: LaneId, place: Place, level: Level, label: &str) {
        if let Some(lane) = self.lane(id) {
            lane.mark(place.item(level, label));
        }
    }

    /// Sets what a lane shows from now on. A lane on which nothing has been shown yet is made by the first label.
    fn set(&mut self, id: LaneId, place: Place, level: Level, label: &str) {
        if label.is_empty() && !self.lanes.contains_key(&id) {
            return;
        }
        if let Some(lane) = self.lane(id) {
            lane.set(place, level, label);
        }
    }

    /// Takes an event, with its number and its time.
    pub fn event(&mut self, place: Place, event: &JournalEvent) {
        match event {
            JournalEvent::Connected { port, peer } => {
                self.mark(
                    LaneId::Port(*port),
                    place,
                    Level::Plain,
                    &format!("connected {peer}"),
                );
            }
            JournalEvent::Disconnected { port } => {
                self.mark(LaneId::Port(*port), place, Level::Plain, "disconnected");
            }
            JournalEvent::Closed { port } => {
                self.mark(LaneId::Port(*port), place, Level::Plain, "closed by the robot");
            }
            JournalEvent::Stalled { port } => {
                self.mark(LaneId::Port(*port), place, Level::Note, "stalled");
            }
            JournalEvent::Received { port, data } if port.protocol().is_none() => {
                let label = format!("> {}", Escaped::for_reading(data));
                self.mark(LaneId::Port(*port), place, Level::Plain, &label);
            }
            JournalEvent::Sent { port, data } if port.protocol().is_none() => {
                let label = format!("< {}", Escaped::for_reading(data));
                self.mark(LaneId::Port(*port), place, Level::Plain, &label);
            }
            JournalEvent::PowerOn => self.mark(LaneId::Clock, place, Level::Plain, "power on"),
            JournalEvent::PowerOff => self.mark(LaneId::Clock, place, Level::Plain, "power off"),
            JournalEvent::Restored => self.mark(LaneId::Clock, place, Level::Plain, "snapshot restored"),
            JournalEvent::Reset => self.mark(LaneId::Clock, place, Level::Plain, "reset"),
            JournalEvent::Controller(event) => self.controller_event(place, event),
            JournalEvent::Received { .. }
            | JournalEvent::Sent { .. }
            | JournalEvent::Keep
            | JournalEvent::Stored { .. }
            | JournalEvent::Erased { .. }
            | JournalEvent::Pendant { .. } => {}
        }
    }

    fn controller_event(&mut self, place: Place, event: &Event) {
        match event {
            Event::Answered {
                port, row, verdict, ..
            } => {
                let level = match verdict {
                    Verdict::Served => Level::Plain,
                    Verdict::NotValid | Verdict::Refused => Level::Error,
                };
                self.mark(LaneId::Port(*port), place, level, row);
            }
            Event::Refused {
                port,
                command,
                reason,
            } => {
                self.mark(
                    LaneId::Faulty,
                    place,
                    Level::Error,
                    &format!("NG {command}: {reason}"),
                );
                self.mark(LaneId::Port(*port), place, Level::Error, command);
            }
            Event::Finding(finding) => {
                let level = finding.severity().into();
                let label = format!("{}: {}", finding.rule.id, finding.message);
                self.mark(LaneId::Faulty, place, level, &label);
            }
            Event::Dropped { port, bytes, reason } => {
                let label = format!("{bytes} bytes dropped: {reason}");
                self.mark(LaneId::Port(*port), place, Level::Warning, &label);
            }
            Event::ActionRefused(reason) => {
                self.mark(LaneId::Panel, place, Level::Warning, &reason.to_string());
            }
            Event::Fault {
                fired, kind, message, ..
            } => {
                let label = if *fired {
                    format!("{kind}: {message}")
                } else {
                    message.clone()
                };
                self.mark(LaneId::Faults, place, Level::Note, &label);
            }
            Event::TextIn { .. }
            | Event::TextOut { .. }
            | Event::Alarm { .. }
            | Event::AlarmsReset
            | Event::Status { .. }
            | Event::Statement { .. }
            | Event::Breakpoint { .. }
            | Event::Servo(_)
            | Event::ServoDelayed(_)
            | Event::Selected(_) => {}
        }
    }

    /// Takes what was done at the panel or on the controller.
    pub fn action(&mut self, place: Place, action: &str) {
        self.mark(LaneId::Panel, place, Level::Plain, action);
    }

    /// What was done at the panel or on the controller.
    pub fn actions(&self) -> Vec<Item> {
        let panel = self.lanes.get(&LaneId::Panel);
        let items = panel.into_iter().flat_map(|lane| &lane.items);
        items.filter(|item| item.until.is_none()).cloned().collect()
    }

    /// Takes the controller as it is after a step.
    pub fn state(&mut self, place: Place, controller: &Controller) {
        self.end = place;
        let panel = controller.state();
        let mode = if !panel.powered {
            "power off".to_owned()
        } else {
            let mut words = vec![panel.master_mode().as_str()];
            words.extend(panel.servo.then_some("servo on"));
            words.extend(panel.emergency_stop.then_some("EMERGENCY STOP"));
            words.extend(panel.safety_open.then_some("safety switch open"));
            words.extend(panel.feed_hold.then_some("feed hold"));
            words.extend(panel.machine_lock.then_some("machine lock"));
            words.join(", ")
        };
        let level = match panel.powered && !panel.emergency_stop && !panel.safety_open {
            true => Level::Plain,
            false => Level::Warning,
        };
        self.set(LaneId::Panel, place, level, &mode);
        let alarm = controller.alarms().active().first();
        let alarm = alarm.map(|alarm| format!("{} {}", alarm.code.number(), alarm.code.text));
        self.set(LaneId::Alarms, place, Level::Error, &alarm.unwrap_or_default());
        let motion = match (controller.is_arm_moving(), panel.feed_hold) {
            (false, _) => "",
            (true, false) => "moves",
            (true, true) => "held",
        };
        self.set(LaneId::Motion, place, Level::Plain, motion);
        self.tasks(place, controller);
        let lines = controller.signals().line_words();
        if lines != self.lines {
            self.lines = lines;
            for line in Signals::numbers() {
                let on = |on: bool| if on { "on" } else { "" };
                self.set(
                    LaneId::Input(line),
                    place,
                    Level::Plain,
                    on(controller.signals().input(line)),
                );
                self.set(
                    LaneId::Output(line),
                    place,
                    Level::Plain,
                    on(controller.signals().output(line)),
                );
            }
        }
    }

    /// Takes what a status of a real robot tells: mode, alarm, and the numbers of the inputs and outputs that are on.
    pub fn observed(&mut self, place: Place, mode: &str, alarm: &str, (inputs, outputs): (&[u16], &[u16])) {
        self.end = place;
        self.set(LaneId::Panel, place, Level::Plain, mode);
        self.set(LaneId::Alarms, place, Level::Error, alarm);
        for line in Signals::numbers() {
            let on = |lines: &[u16]| if lines.contains(&line) { "on" } else { "" };
            self.set(LaneId::Input(line), place, Level::Plain, on(inputs));
            self.set(LaneId::Output(line), place, Level::Plain, on(outputs));
        }
    }

    /// Takes the line that a status of a real robot tells, while a program runs.
    pub fn observed_line(&mut self, place: Place, line: Option<u16>) {
        let label = line.map(|line| format!("line {line}")).unwrap_or_default();
        self.set(LaneId::Task(1), place, Level::Plain, &label);
    }

    fn tasks(&mut self, place: Place, controller: &Controller) {
        let runs = controller.program_runs();
        let (executed, _) = controller.steps();
        let mut present = BTreeMap::new();
        for task in controller.tasks() {
            // The main program reads ahead of the arm: what counts is the line that is executed.
            let line = if task.id == 1 && executed > 0 {
                executed
            } else {
                task.line
            };
            present.insert(task.id, line);
        }
        let mut known: Vec<u16> = present.keys().copied().collect();
        let lanes = self.lanes.keys().filter_map(|id| id.task());
        known.extend(lanes);
        for task in known {
            let line = present.get(&task).filter(|line| runs && **line > 0);
            let label = line.map(|line| format!("line {line}")).unwrap_or_default();
            self.set(LaneId::Task(task), place, Level::Plain, &label);
        }
    }
}

impl Serialize for Lanes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.lanes.iter().map(|(id, lane)| LaneForm {
            id: *id,
            lane,
            end: self.end,
        }))
    }
}

/// A lane in a document.
struct LaneForm<'a> {
    id: LaneId,
    lane: &'a Lane,
    end: Place,
}

impl Serialize for LaneForm<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut form = serializer.serialize_struct("Lane", 4)?;
        form.serialize_field("id", &self.id.word())?;
        form.serialize_field("title", &self.lane.title)?;
        form.serialize_field("left_out", &self.lane.left_out)?;
        form.serialize_field("items", &self.lane.all(self.end).collect::<Vec<_>>())?;
        form.end()
    }
}
