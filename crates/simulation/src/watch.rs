//! The edge of a robot of a cell: hosts, disk and connections around it, and the rules about its state.
//!
//! The state is looked at after every input. What concerns an exchange is judged in `cell.rs`, when a host reads its answer.

use crate::figures::Figures;
use crate::host::Host;
use crate::manual;
use crate::plan::RobotPlan;
use crate::rules::{Rule, Violation};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Duration;
use ts3100_controller::alarm::AlarmCode;
use ts3100_controller::model::{Axis, Joints};
use ts3100_controller::{
    Bytes, ControlRight, Controller, Dialect, Event, Input, KeySwitch, Output, PersistError, Port, Time,
    Verdict,
};
use ts3100_driver::seat::Effects;
use ts3100_proto::status::ExecutionStatus;

/// How long a DO shows RUN at least.
const SHORTEST_DO: Duration = Duration::from_millis(200);
/// How long the arm may take to brake, once servo power is off: more than any axis needs from its full speed.
const BRAKING: Duration = Duration::from_secs(1);
/// Rounding of an axis value.
const ROUNDING: f64 = 1e-6;
/// The text of an SP.
const SP: &[u8] = b"\x02SP\r\x03";
/// The end of a text.
const ETX: &[u8] = b"\x03";
/// Commands that neither stop a program nor change how it runs.
const QUERIES: [&str; 16] = [
    "RN", "SU", "SF", "SM", "CA", "EU", "MR", "VR", "AC", "AH", "IO", "PR", "VL", "MN", "PS", "ZC",
];

/// The content of a file that says of itself whether it is whole.
pub(crate) fn whole_file(name: &str, version: u32, lines: u32) -> Vec<u8> {
    let mut content = format!("PROGRAM {name}\nREMARK {version} {lines}\n");
    for line in 1..=lines {
        content.push_str(&format!("REMARK {version} {line}\n"));
    }
    content.push_str("END\n");
    content.into_bytes()
}

fn is_whole(name: &str, content: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(content) else {
        return false;
    };
    let numbers = text.lines().nth(1).and_then(|line| line.strip_prefix("REMARK "));
    let Some((version, lines)) = numbers.and_then(|numbers| numbers.split_once(' ')) else {
        return false;
    };
    let (Ok(version), Ok(lines)) = (version.parse(), lines.parse()) else {
        return false;
    };
    whole_file(name, version, lines) == content
}

/// A change of a file on its way to the disk.
type Change = (String, Option<Bytes>);

/// Files as the disk has them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Disk {
    files: BTreeMap<String, Bytes>,
    /// It refuses changes.
    pub refuses: bool,
    /// It answers later.
    pub slow: bool,
    /// The change that it has not answered yet.
    pending: Option<Change>,
}

impl Disk {
    pub fn of(controller: &Controller) -> Disk {
        let files = controller.files();
        Disk {
            files: files
                .map(|(name, content)| (name.to_owned(), Bytes::copy_from_slice(content)))
                .collect(),
            ..Disk::default()
        }
    }

    fn apply(&mut self, (name, content): Change) -> Result<(), PersistError> {
        if self.refuses {
            return Err(PersistError::Refused("no space left".to_owned()));
        }
        match content {
            Some(content) => self.files.insert(name, content),
            None => self.files.remove(&name),
        };
        Ok(())
    }

    /// Answers what is pending.
    pub fn answer(&mut self) -> Option<Result<(), PersistError>> {
        let change = self.pending.take()?;
        Some(self.apply(change))
    }
}

/// The state that the rules look at.
#[derive(Debug, Clone)]
struct Observation {
    at: Time,
    powered: bool,
    servo: bool,
    emergency_stop: bool,
    safety_open: bool,
    joints: Joints,
    active: Vec<AlarmCode>,
    status: ExecutionStatus,
    runs: bool,
}

impl Observation {
    fn of(controller: &Controller) -> Observation {
        let state = controller.state();
        Observation {
            at: controller.now(),
            powered: state.powered,
            servo: state.servo,
            emergency_stop: state.emergency_stop,
            safety_open: state.safety_open,
            joints: controller.arm_pose().joints,
            active: controller
                .alarms()
                .active()
                .iter()
                .map(|alarm| alarm.code)
                .collect(),
            status: controller.status(),
            runs: controller.program_runs(),
        }
    }
}

/// Who may command the robot, and whether it runs, before an input.
#[derive(Debug, Clone, Copy, Default)]
struct Rights {
    key: KeySwitch,
    right: ControlRight,
    /// Not known while a DO is under way, or shown after its end: the tables are about programs.
    running: Option<bool>,
}

impl Rights {
    fn of(controller: &Controller) -> Rights {
        let state = controller.state();
        Rights {
            key: state.key,
            right: state.control_right,
            running: match (controller.program_runs(), controller.status()) {
                (true, _) => Some(true),
                (false, ExecutionStatus::Running) => None,
                (false, ExecutionStatus::Reset | ExecutionStatus::Retry | ExecutionStatus::Continue) => {
                    Some(false)
                }
            },
        }
    }
}

/// The edge of a robot.
pub(crate) struct Watch {
    robot: usize,
    canary: Option<Rule>,
    table: Vec<(&'static str, &'static str, &'static str)>,
    axes: Vec<Axis>,
    has_shortest_do: bool,
    always_sp: bool,
    /// Answers leave at once.
    pub is_prompt: bool,
    pub hosts: BTreeMap<Port, Host>,
    /// Channels of programs with a partner.
    pub partners: BTreeSet<Port>,
    pub disk: Disk,
    before: Rights,
    last: Option<Observation>,
    /// An input has been handled since the last observation.
    is_stale: bool,
    /// Alarms were reset, or the power went, since the last observation.
    is_reset: bool,
    /// A file was stored or erased since the last comparison with the disk.
    has_changed_files: bool,
    /// A host has asked for a stop since the program began.
    is_stop_wanted: bool,
    do_since: Option<Time>,
    /// When servo power went off.
    servo_off: Time,
    digest: DefaultHasher,
    /// Texts of the robot.
    texts: u64,
    pub figures: Figures,
    pub violation: Option<Violation>,
}

impl Watch {
    pub fn new(robot: usize, plan: &RobotPlan, controller: &Controller, canary: Option<Rule>) -> Watch {
        let model = &controller.config().model;
        let is_scara = plan.model != "ts3100-tv800";
        Watch {
            robot,
            canary,
            table: manual::tables(is_scara, plan.dialect),
            axes: model.axes.clone(),
            has_shortest_do: plan.dialect == Dialect::Field,
            always_sp: plan.always_sp,
            is_prompt: plan.variation.is_none(),
            hosts: [Port::Ip0, Port::Host].map(|port| (port, Host::new())).into(),
            partners: BTreeSet::new(),
            disk: Disk::of(controller),
            before: Rights::default(),
            last: None,
            is_stale: true,
            is_reset: false,
            has_changed_files: false,
            is_stop_wanted: false,
            do_since: None,
            servo_off: Time::ZERO,
            digest: DefaultHasher::new(),
            texts: 0,
            figures: Figures::default(),
            violation: None,
        }
    }

    pub fn digest(&self) -> u64 {
        self.digest.finish()
    }

    /// Another controller has taken over.
    pub fn begin_again(&mut self, controller: &Controller) {
        self.last = None;
        self.is_stop_wanted = true;
        self.do_since = None;
        self.servo_off = controller.now();
        let (refuses, slow) = (self.disk.refuses, self.disk.slow);
        self.disk = Disk {
            refuses,
            slow,
            ..Disk::of(controller)
        };
        for host in self.hosts.values_mut() {
            if host.is_connected {
                // Its bytes have told the robot its framing, whatever takes over.
                let is_spoiled = host.is_spoiled;
                host.connect();
                host.is_spoiled = is_spoiled;
            }
        }
    }

    pub fn is_canary(&self, rule: Rule) -> bool {
        self.canary == Some(rule)
    }

    /// A rule is broken; the first one counts.
    pub fn report(&mut self, rule: Rule, at: Time, seen: impl Into<String>) {
        if self.violation.is_none() {
            self.violation = Some(Violation {
                rule,
                robot: self.robot,
                at,
                seen: seen.into(),
            });
        }
    }

    fn hold(&mut self, rule: Rule, at: Time, holds: bool, seen: impl FnOnce() -> String) {
        self.figures.check(rule);
        if !holds {
            self.report(rule, at, seen());
        }
    }

    fn observe(&mut self, controller: &Controller) {
        let mut now = Observation::of(controller);
        self.plant(&mut now);
        self.compare_files(controller);
        if let Some(last) = self.last.take() {
            self.compare(&last, &now);
        }
        self.is_reset = false;
        self.is_stale = false;
        self.last = Some(now);
    }

    /// Plants the defect that a canary is.
    fn plant(&self, now: &mut Observation) {
        let turn = (self.texts % 2) as f64;
        match self.canary {
            // Too little to be a matter of speed.
            Some(Rule::StillWithoutServo) if !now.servo && now.at.since(self.servo_off) > BRAKING => {
                now.joints[0] += turn * 0.5 * ROUNDING;
            }
            Some(Rule::AlarmsLatch) if turn > 0.0 => now.active.truncate(0),
            Some(Rule::ShortestDo) if self.do_since.is_some() => now.status = ExecutionStatus::Reset,
            Some(Rule::AxisLimits) if now.runs => now.joints[0] += 1_000.0,
            Some(Rule::AxisSpeeds) if now.servo => now.joints[0] += turn * 30.0,
            _ => {}
        }
    }

    fn compare(&mut self, last: &Observation, now: &Observation) {
        let at = now.at;
        let passed = now.at.since(last.at).as_secs_f64();
        if now.servo || last.servo {
            self.servo_off = at;
        }
        let is_braking = last.at.since(self.servo_off) < BRAKING;
        let is_still = now.servo || is_braking || last.joints == now.joints;
        self.hold(Rule::StillWithoutServo, at, is_still, || {
            format!(
                "without servo power the axes went from {:?} to {:?}",
                last.joints, now.joints
            )
        });
        let is_stopped = now.powered && (now.emergency_stop || now.safety_open);
        self.hold(Rule::StillWithoutServo, at, !is_stopped || !now.servo, || {
            "servo power is on in an emergency or safety stop".to_owned()
        });
        let lost = last.active.iter().find(|code| !now.active.contains(code));
        let is_latched = lost.is_none() || self.is_reset;
        self.hold(Rule::AlarmsLatch, at, is_latched, || {
            let number = lost.map(AlarmCode::number).unwrap_or_default();
            format!("alarm {number} has gone without a reset")
        });
        for (number, axis) in self.axes.clone().iter().enumerate() {
            let (from, to) = (last.joints[number], now.joints[number]);
            let is_within = to >= axis.min - ROUNDING && to <= axis.max + ROUNDING;
            self.hold(Rule::AxisLimits, at, is_within, || {
                format!("axis {} is at {to}", number + 1)
            });
            let most = axis.max_speed * passed * (1.0 + ROUNDING) + ROUNDING;
            self.hold(Rule::AxisSpeeds, at, (to - from).abs() <= most, || {
                format!(
                    "axis {} went from {from} to {to} in {passed} s, at most {most}",
                    number + 1
                )
            });
        }
        self.follow_do(now);
        self.follow_stop(last, now);
        if last.powered && now.powered {
            let requests = [
                now.emergency_stop && !last.emergency_stop,
                now.safety_open && !last.safety_open,
            ];
            for host in self.hosts.values_mut() {
                for (unseen, requested) in host.unseen.iter_mut().zip(requests) {
                    *unseen |= requested;
                }
            }
        }
    }

    fn follow_do(&mut self, now: &Observation) {
        let Some(since) = self.do_since else { return };
        if now.at >= since + SHORTEST_DO {
            self.do_since = None;
            return;
        }
        self.hold(
            Rule::ShortestDo,
            now.at,
            now.status == ExecutionStatus::Running,
            || format!("{} after a DO that began at {since}", now.status.as_str()),
        );
    }

    fn follow_stop(&mut self, last: &Observation, now: &Observation) {
        if now.runs && !last.runs {
            self.is_stop_wanted = false;
            self.hosts.values_mut().for_each(|host| host.owed = None);
        }
        if last.runs && !now.runs {
            self.figures.stops += 1;
            if self.always_sp && !self.is_stop_wanted && now.powered {
                for host in self.hosts.values_mut().filter(|host| host.is_connected) {
                    host.owed = Some(now.at);
                }
            }
        }
    }

    fn compare_files(&mut self, controller: &Controller) {
        if !std::mem::take(&mut self.has_changed_files) || self.disk.pending.is_some() {
            return;
        }
        let differs = controller
            .files()
            .find(|(name, content)| self.disk.files.get(*name).is_none_or(|kept| kept != content));
        let count = controller.files().count();
        let holds = differs.is_none() && count == self.disk.files.len();
        let name = differs.map(|(name, _)| name.to_owned());
        let kept = self.disk.files.len();
        self.hold(Rule::WholeFiles, controller.now(), holds, || match name {
            Some(name) => format!("{name} differs between drive and disk"),
            None => format!("the drive has {count} files, its disk {kept}"),
        });
    }

    /// All connections end, as with the power. Returns what the controller is told.
    fn end_connections(&mut self) -> Vec<Input> {
        let hosts = self.hosts.iter_mut().filter(|(_, host)| host.is_connected);
        let mut ended: Vec<Port> = Vec::new();
        for (port, host) in hosts {
            host.leave();
            ended.push(*port);
        }
        ended.extend(std::mem::take(&mut self.partners));
        ended
            .into_iter()
            .map(|port| Input::Disconnected { port })
            .collect()
    }

    fn answered(&mut self, at: Time, port: Port, row: &str, verdict: Verdict, controller: &Controller) {
        if verdict == Verdict::Served && !QUERIES.contains(&row) {
            self.is_stop_wanted = true;
            self.do_since = (row == "DO" && self.has_shortest_do).then_some(at);
        }
        if verdict == Verdict::Served && row == "RN" {
            // From now on the program is shown, which may end at once.
            self.do_since = None;
        }
        let now = Rights::of(controller);
        let valid = |rights: Rights| {
            let valid =
                |running| manual::is_valid(&self.table, row, port, (rights.key, rights.right), running);
            match rights.running {
                Some(running) => valid(running),
                None => valid(true).filter(|_| valid(true) == valid(false)),
            }
        };
        let (before, after) = (valid(self.before), valid(now));
        // A change in this moment may have come before or after the command.
        let sure = before.filter(|_| before == after);
        if sure == Some(true) && verdict == Verdict::NotValid {
            self.report(
                Rule::Permissions,
                at,
                format!("{row} on {port} is not valid for the controller"),
            );
        }
        if let Some(host) = self.hosts.get_mut(&port) {
            host.is_valid = sure;
            if row == "SM" && verdict == Verdict::Served {
                host.unseen = [false; 2];
            }
        }
    }

    fn event(&mut self, at: Time, event: &Event, controller: &Controller) {
        match event {
            Event::TextIn { .. } | Event::TextOut { .. } => return,
            Event::Statement { .. } => {
                self.figures.statements += 1;
                return;
            }
            Event::Answered {
                port, row, verdict, ..
            } => self.answered(at, *port, row, *verdict, controller),
            Event::Alarm { .. } => self.figures.alarms += 1,
            Event::AlarmsReset => self.is_reset = true,
            Event::Fault {
                fired: true, port, ..
            } => {
                self.figures.faults += 1;
                self.do_since = None;
                for (own, host) in &mut self.hosts {
                    host.is_spoiled |= port.is_none_or(|port| port == *own);
                }
            }
            // Its bytes are lost on a line that carries one direction at a time.
            Event::Finding(finding) if finding.rule.id == "half-duplex" => {
                if let Some(host) = finding.port.and_then(|port| self.hosts.get_mut(&port)) {
                    host.is_spoiled = true;
                }
            }
            Event::Dropped { .. }
            | Event::Refused { .. }
            | Event::Finding(_)
            | Event::ActionRefused(_)
            | Event::Status { .. }
            | Event::Breakpoint { .. }
            | Event::Servo(_)
            | Event::ServoDelayed(_)
            | Event::Selected(_)
            | Event::Fault { .. } => {}
        }
        format!("{event:?}").hash(&mut self.digest);
    }

    /// Bytes for a host, with the defect that a canary is.
    fn send(&mut self, port: Port, bytes: &[u8]) {
        self.texts += 1;
        let turn = self.texts.is_multiple_of(40);
        let canary = self.canary;
        let Some(host) = self.hosts.get_mut(&port) else {
            return;
        };
        host.is_mid_text = !bytes.ends_with(ETX);
        match canary {
            Some(Rule::StopsReported) if bytes == SP => return,
            Some(Rule::SpOutsideExchanges) if turn && host.asked.is_some() => host.incoming.extend(SP),
            Some(Rule::OneAnswer) if turn => host.incoming.extend(bytes),
            Some(Rule::Permissions) if host.is_valid == Some(false) && bytes == b"\x02NG\r\x03" => {
                host.incoming.extend(b"\x02OK\r\x03");
                return;
            }
            _ => {}
        }
        host.incoming.extend(bytes);
    }
}

impl Effects for Watch {
    fn input(&mut self, _at: Time, input: &Input, controller: &Controller) {
        if self.is_stale {
            self.observe(controller);
        }
        self.is_stale = true;
        self.before = Rights::of(controller);
        if matches!(input, Input::Action { .. }) {
            self.do_since = None;
        }
    }

    fn persist(&mut self, at: Time, name: &str, content: Option<Bytes>) -> Option<Result<(), PersistError>> {
        if name.starts_with('S') && name.len() == 2 {
            let whole = content.as_ref().is_none_or(|content| is_whole(name, content));
            self.hold(Rule::WholeFiles, at, whole, || {
                format!("half of {name} is stored")
            });
        }
        self.figures.disk_errors += u64::from(self.disk.refuses);
        let content = match content {
            Some(content) if self.is_canary(Rule::WholeFiles) => Some(content.slice(..content.len() / 2)),
            other => other,
        };
        let change = (name.to_owned(), content);
        if self.disk.slow {
            self.disk.pending = Some(change);
            return None;
        }
        Some(self.disk.apply(change))
    }

    fn is_storing(&self) -> bool {
        self.disk.pending.is_some()
    }

    fn perform(&mut self, at: Time, output: Output, controller: &Controller) -> Vec<Input> {
        match &output {
            Output::Event(event) => {
                self.event(at, event, controller);
                return Vec::new();
            }
            Output::Send { port, bytes } => {
                if !self.is_canary(Rule::SameBytes) {
                    (at.as_micros(), port, bytes).hash(&mut self.digest);
                }
                self.send(*port, bytes);
            }
            Output::Stored { .. } | Output::Erased { .. } => self.has_changed_files = true,
            Output::Disconnect { port, .. } => {
                let port = *port;
                self.partners.remove(&port);
                if let Some(host) = self.hosts.get_mut(&port) {
                    host.leave();
                }
                return vec![Input::Disconnected { port }];
            }
            Output::Stall { port } => {
                if let Some(host) = self.hosts.get_mut(port) {
                    host.is_spoiled = true;
                }
            }
            Output::PowerOff | Output::PowerCycled => {
                self.is_reset = true;
                self.is_stop_wanted = true;
                self.figures.power_cycles += u64::from(output == Output::PowerCycled);
                return self.end_connections();
            }
            Output::Persist { .. } | Output::Pendant(_) => {}
        }
        Vec::new()
    }

    fn settled(&mut self, controller: &Controller) -> Option<bool> {
        self.observe(controller);
        None
    }
}
