//! Which faults have fired and can still cause findings.
//!
//! [`FaultEffects`] notes what fired where, and forgets it as soon as the host can do everything right again.
//! `Context::report` asks it for each finding. What each kind can cause is the table in `causes`.

use super::Fault;
use super::causes::{CAUSES, CauseRow, Reach};
use super::kind::{Effect, FaultKind, FaultSite, InjectionPoint, ReplyArrival};
use crate::finding::FaultCause;
use crate::finding::{Rule, rules};
use crate::limits::MAX_FAULT_EFFECTS;
use crate::panel::KeySwitch;
use crate::port::Port;
use crate::prelude::*;
use crate::segment::{Departure, Segment};
use crate::snapshot_error::{SnapshotError, check};
use crate::time::Time;
use core::time::Duration;
use ts3100_proto::reply::Reply;

/// A reply that is whole within this time is in time for every host; one that takes longer can end its exchange (ours).
const PATIENCE: Duration = Duration::from_millis(500);
/// Commands after which a host that drops unexpected bytes is in step with the robot again.
const COMMANDS: u8 = 2;
/// The same for a channel: two records, and two outputs of PRINT.
const RECORDS_AND_PRINTS: u8 = 4;

/// State that has to return to its previous value before a fault counts as ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MachineState {
    pub(crate) powered: bool,
    pub(crate) servo: bool,
    pub(crate) key: KeySwitch,
    pub(crate) alarms: usize,
    pub(crate) program: bool,
}

/// Effect of a fault on the machine, at once or later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineEffect {
    /// When its first action is due.
    from: Time,
    /// When its last one is.
    until: Time,
    /// The state right before the first; `None`: it has not happened yet.
    before: Option<MachineState>,
}

/// A fault that has fired, as long as it can cause findings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FaultEffect {
    fault: u32,
    #[serde(with = "kind_name")]
    kind: &'static FaultKind,
    port: Port,
    /// Letters of the command in whose exchange it fired.
    command: String,
    /// Number of the FL text, as [`FaultSite::block`].
    block: u32,
    /// See [`Reach::Exchange`] and [`Reach::Silence`].
    exchange: bool,
    /// Time until which the bytes of hosts wait, and a little longer: connections that were made after a stalled one
    /// are served one after the other when it is reset.
    stalled_until: Option<Time>,
    /// Steps until [`Reach::Following`] or [`Reach::Channel`] ends.
    steps: u8,
    /// A text of the robot was changed, which has obeyed the command already.
    obeyed: bool,
    /// The host has sent nothing but `command` since, and the robot has not obeyed it again.
    repeats: bool,
    /// See [`Reach::Belief`].
    misled: bool,
    /// See [`Reach::Input`].
    input: bool,
    /// See [`Reach::Link`].
    link: bool,
    /// See [`Reach::Machine`].
    machine: Option<MachineEffect>,
}

/// The faults that can cause findings now.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct FaultEffects(Vec<FaultEffect>);

impl FaultEffect {
    fn new(now: Time, fault: &Fault, site: &FaultSite<'_>, effect: &Effect) -> FaultEffect {
        let kind = fault.kind.name;
        let is_text = site.point == InjectionPoint::Reply;
        let on_protocol = site.port.protocol().is_some();
        let on_channel = !on_protocol && site.port != Port::Ip3;
        let changes = *effect != Effect::Unchanged;
        let is_sp = site.command == "SP" && is_text;
        let segments = if let Effect::ReplaceOutput(segments) = effect {
            segments.as_slice()
        } else {
            &[]
        };
        let delay: Duration = segments.iter().map(|segment| segment.delay).sum();
        let in_time = match fault.kind.reply {
            ReplyArrival::InTime => true,
            ReplyArrival::Delayed => delay < PATIENCE,
            ReplyArrival::Missing => false,
        };
        let disconnects = |segment: &Segment| matches!(segment.departure, Departure::Disconnect(_));
        let ends = segments.iter().any(disconnects) || kind == "power-loss";
        let link = ends && site.port.ethernet_index().is_some();
        let came_in = matches!(site.point, InjectionPoint::Bytes | InjectionPoint::Character);
        FaultEffect {
            fault: fault.id,
            kind: fault.kind,
            port: site.port,
            command: site.command.to_string(),
            block: site.block,
            stalled_until: (kind == "half-open").then(|| now + delay + PATIENCE),
            exchange: on_protocol && !is_sp && (kind == "drive-full" || changes && !in_time),
            steps: match changes {
                true if on_protocol => COMMANDS,
                true if on_channel => RECORDS_AND_PRINTS,
                _ => 0,
            },
            obeyed: is_text && !is_sp,
            repeats: is_text && !is_sp && changes && !site.command.is_empty(),
            misled: is_text && changes && site.data != Reply::Ok.encode(),
            input: on_protocol && changes && (came_in || kind == "power-loss"),
            link,
            machine: None,
        }
    }

    /// Whether this row of the table holds now, for a finding of this rule on this port.
    fn reaches(&self, row: &CauseRow, rule: &Rule, port: Option<Port>) -> bool {
        let here = port == Some(self.port);
        match row.reach {
            Reach::Exchange => here && self.exchange,
            Reach::Silence => self.exchange,
            // Only a text of a file is sent again into a download that is over.
            Reach::Following if *rule == rules::FILE_WITHOUT_DOWNLOAD => {
                here && self.steps > 0 && self.obeyed && self.block > 0
            }
            Reach::Following => here && self.steps > 0 && self.port.protocol().is_some(),
            Reach::Repetition => here && self.repeats,
            Reach::Belief => here && self.steps > 0 && self.misled,
            Reach::Input => here && self.input,
            Reach::Link => here && self.link,
            Reach::Channel => here && self.steps > 0 && self.port.protocol().is_none(),
            Reach::Machine => self.machine.is_some_and(|machine| machine.before.is_some()),
        }
    }

    /// Whether a command that comes now was sent before the host could know of the fault: it is the changed text
    /// itself, or has waited for a stalled connection.
    fn precedes_command(&self, now: Time) -> bool {
        let is_changed = self.input && matches!(self.kind.name, "flipped-bit" | "parity-error");
        is_changed || self.stalled_until.is_some_and(|until| now <= until)
    }

    fn is_over(&self) -> bool {
        let reaches = self.exchange || self.repeats || self.input || self.link || self.steps > 0;
        !reaches && self.machine.is_none()
    }
}

impl FaultEffects {
    /// A fault has fired. `actions` are the delays of its first and its last action on the machine.
    pub(super) fn note(
        &mut self,
        now: Time,
        fault: &Fault,
        site: &FaultSite<'_>,
        effect: &Effect,
        actions: Option<(Duration, Duration)>,
    ) {
        let mut new = FaultEffect::new(now, fault, site, effect);
        new.machine = actions.map(|(first, last)| MachineEffect {
            from: now + first,
            until: now + last,
            before: None,
        });
        self.push(new);
    }

    fn push(&mut self, new: FaultEffect) {
        if new.is_over() {
            return;
        }
        if self.0.len() >= MAX_FAULT_EFFECTS {
            self.0.remove(0);
        }
        self.0.push(new);
    }

    /// The fault that has caused a finding; the latest, if several can have.
    pub(crate) fn cause_of(&self, rule: &'static Rule, port: Option<Port>) -> Option<FaultCause> {
        let caused = |effect: &&FaultEffect| {
            CAUSES.iter().any(|row| {
                row.kinds.contains(&effect.kind.name)
                    && (row.rules.is_empty() || row.rules.contains(&rule))
                    && effect.reaches(row, rule, port)
            })
        };
        let effect = self.0.iter().rev().find(caused)?;
        Some(FaultCause {
            id: effect.fault,
            kind: effect.kind.name,
        })
    }

    /// The host's next command comes; `busy`: texts wait to leave on its port.
    pub(crate) fn next_command(&mut self, port: Port, letters: &str, busy: bool, now: Time) {
        let here = self.0.iter_mut().filter(|effect| effect.port == port);
        for effect in here.filter(|effect| !effect.precedes_command(now)) {
            // A host reads what leaves now as the reply to this command.
            effect.exchange = busy && effect.steps > 0;
            effect.repeats &= effect.command == letters;
            if !busy {
                effect.steps = effect.steps.saturating_sub(1);
            }
        }
        self.drop_ended();
    }

    /// The host has read a text that did not wait for a stalled connection.
    pub(crate) fn acknowledged(&mut self, port: Port) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.stalled_until = None;
        }
    }

    /// The robot obeys the command that is served now.
    pub(crate) fn obeyed(&mut self, port: Port) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.repeats = false;
        }
        self.drop_ended();
    }

    /// A record has come on a channel, or PRINT sends.
    pub(crate) fn next_record(&mut self, port: Port) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.steps = effect.steps.saturating_sub(1);
        }
        self.drop_ended();
    }

    /// Every byte that came on a port has been read into whole texts.
    pub(crate) fn input_read(&mut self, port: Port) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.input = false;
        }
        self.drop_ended();
    }

    /// A finding with a cause has lost part of the bytes of the host on a port.
    pub(crate) fn input_lost(&mut self, port: Port, cause: FaultCause) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.input |= effect.fault == cause.id;
        }
    }

    /// A peer has connected.
    pub(crate) fn connected(&mut self, port: Port) {
        for effect in self.0.iter_mut().filter(|effect| effect.port == port) {
            effect.link = false;
        }
        self.drop_ended();
    }

    /// A program has started and emptied the buffers of the channels.
    pub(crate) fn program_started(&mut self) {
        for effect in &mut self.0 {
            if effect.port.protocol().is_none() {
                effect.steps = 0;
            }
            if let Some(MachineEffect {
                before: Some(before), ..
            }) = &mut effect.machine
            {
                before.program = false;
            }
        }
        self.drop_ended();
    }

    /// An action of a fault is about to be done to a machine in this state.
    pub(crate) fn begin_action(&mut self, now: Time, state: MachineState) {
        let machines = self.0.iter_mut().filter_map(|effect| effect.machine.as_mut());
        for machine in machines.filter(|machine| machine.from <= now) {
            machine.before.get_or_insert(state);
        }
    }

    /// An alarm follows from a finding that a fault has caused.
    pub(crate) fn alarm_follows(&mut self, now: Time, cause: FaultCause, state: MachineState) {
        let effect = self.0.iter_mut().rev().find(|effect| effect.fault == cause.id);
        if let Some(effect) = effect {
            effect.machine.get_or_insert(MachineEffect {
                from: now,
                until: now,
                before: Some(state),
            });
        }
    }

    /// Ends the effects on a machine that has its previous state again.
    pub(crate) fn end_actions(&mut self, now: Time, state: MachineState) {
        for effect in &mut self.0 {
            let is_whole = |machine: &MachineEffect| {
                machine.until < now
                    && machine.before.is_some_and(|before| {
                        state.powered
                            && (state.servo || !before.servo)
                            && state.key == before.key
                            && state.alarms <= before.alarms
                            && !before.program
                    })
            };
            effect.machine = effect.machine.filter(|machine| !is_whole(machine));
        }
        self.drop_ended();
    }

    /// Whether no fault can cause a finding.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn drop_ended(&mut self) {
        self.0.retain(|effect| !effect.is_over());
    }

    /// Checks the values read from a snapshot.
    ///
    /// # Errors
    /// The field, what was expected, and what was found.
    pub(crate) fn validate(&self) -> Result<(), SnapshotError> {
        let (place, found) = ("fault_effects", self.0.len());
        let expected = format!("at most {MAX_FAULT_EFFECTS}");
        check(found <= MAX_FAULT_EFFECTS, place, &expected, found)?;
        let most = COMMANDS.max(RECORDS_AND_PRINTS);
        for effect in &self.0 {
            let expected = format!("0 to {most}");
            check(
                effect.steps <= most,
                "fault_effects.steps",
                &expected,
                effect.steps,
            )?;
        }
        Ok(())
    }
}

/// A kind of fault as its name.
mod kind_name {
    use super::FaultKind;
    use crate::faults::KINDS;
    use crate::prelude::*;
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(kind: &&'static FaultKind, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(kind.name)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<&'static FaultKind, D::Error> {
        let found = String::deserialize(from)?;
        let kind = KINDS.iter().copied().find(|kind| kind.name == found);
        kind.ok_or_else(|| D::Error::custom(format!("expected the name of a kind of fault, found `{found}`")))
    }
}
