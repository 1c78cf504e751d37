//! Conditions: events and states of the robot that scenarios, waits of the control interface and tests can name, and
//! their detection.
//!
//! Their words are read and written by `condition_text`. Whoever observes a controller shows a [`ConditionWatch`] every
//! input and output in order; a caller that waits asks [`Condition::holds`] besides.

use crate::action::IoKind;
use crate::controller::Controller;
use crate::input::Input;
use crate::output::{Event, Output};
use crate::port::Port;
use crate::prelude::*;
use ts3100_proto::status::ExecutionStatus;

/// Something that may happen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Condition {
    /// A host sends a text that begins so.
    Command(Vec<u8>),
    /// The robot sends a text that begins so.
    Answer(Vec<u8>),
    /// A command with these letters gets NG.
    Refused(String),
    /// A program prints something that contains this.
    Printed {
        /// Channel; `None` is the teach pendant.
        port: Option<Port>,
        /// Not empty.
        text: Vec<u8>,
    },
    /// A peer sends something that contains this.
    Received {
        /// COM1, IP1 or IP2.
        port: Port,
        /// Not empty.
        text: Vec<u8>,
    },
    /// A peer connects.
    Connected(Port),
    /// A peer disconnects.
    Disconnected(Port),
    /// This alarm is raised; any alarm for `None`.
    Alarm(Option<String>),
    /// Alarms are reset.
    AlarmsReset,
    /// The execution status becomes this.
    Status(ExecutionStatus),
    /// Servo power goes on or off.
    Servo(bool),
    /// This file is selected; no file for an empty name.
    Selected(String),
    /// This file is stored on the RAM drive.
    Stored(String),
    /// This file is erased.
    Erased(String),
    /// A host breaks the rule with this name.
    Finding(String),
    /// A digital line goes on or off.
    Signal {
        /// Whether it is an input or an output.
        side: IoKind,
        /// Its number.
        line: u16,
        /// Its new state.
        on: bool,
    },
    /// A statement in this line (from 1) of the selected file begins. Its events need
    /// [`Controller::trace`](crate::Controller::trace).
    Statement(u32),
    /// No program runs, nothing moves and no exchange is open.
    Idle,
}

impl Condition {
    /// Whether the state that the condition is about holds now; `None` for a momentary event.
    pub fn holds(&self, controller: &Controller) -> Option<bool> {
        Some(match self {
            Condition::Command(_)
            | Condition::Answer(_)
            | Condition::Refused(_)
            | Condition::Printed { .. }
            | Condition::Received { .. }
            | Condition::AlarmsReset
            | Condition::Stored(_)
            | Condition::Erased(_)
            | Condition::Finding(_)
            | Condition::Statement(_) => return None,
            Condition::Connected(port) => controller.peer(*port).is_some(),
            Condition::Disconnected(port) => controller.peer(*port).is_none(),
            Condition::Alarm(None) => !controller.alarms().active().is_empty(),
            Condition::Alarm(Some(number)) => {
                let mut active = controller.alarms().active().iter();
                active.any(|alarm| alarm.code.number() == *number)
            }
            Condition::Status(status) => controller.status() == *status,
            Condition::Servo(on) => controller.state().servo == *on,
            Condition::Selected(name) => controller.selected() == name,
            Condition::Signal { side, line, on } => {
                let signals = controller.signals();
                *on == match side {
                    IoKind::Input => signals.input(*line),
                    IoKind::Output => signals.output(*line),
                }
            }
            Condition::Idle => controller.is_idle(),
        })
    }
}

/// A condition and its observations.
#[derive(Debug, Clone)]
pub struct ConditionWatch {
    condition: Condition,
    /// Whether the state held at the last observation.
    held: bool,
    /// The end of the printed or received bytes: too short for the text, but maybe its beginning.
    tail: Vec<u8>,
}

impl ConditionWatch {
    /// Nothing has been observed yet.
    pub fn new(condition: Condition) -> ConditionWatch {
        ConditionWatch {
            condition,
            held: false,
            tail: Vec::new(),
        }
    }

    pub fn condition(&self) -> &Condition {
        &self.condition
    }

    /// Whether it happens by this input.
    pub fn input(&mut self, input: &Input) -> bool {
        match (&self.condition, input) {
            (Condition::Connected(expected), Input::Connected { port, .. })
            | (Condition::Disconnected(expected), Input::Disconnected { port }) => expected == port,
            (Condition::Received { port: expected, text }, Input::Received { port, bytes })
                if expected == port =>
            {
                continues_to(&mut self.tail, bytes, text)
            }
            _ => false,
        }
    }

    /// Whether it happens by this output.
    pub fn output(&mut self, output: &Output) -> bool {
        match (&self.condition, output) {
            (Condition::Printed { port: expected, text }, Output::Send { port, bytes })
                if *expected == Some(*port) =>
            {
                continues_to(&mut self.tail, bytes, text)
            }
            (Condition::Printed { port: None, text }, Output::Pendant(shown)) => {
                continues_to(&mut self.tail, shown.as_bytes(), text)
            }
            (Condition::Stored(expected), Output::Stored { name, .. })
            | (Condition::Erased(expected), Output::Erased { name }) => expected == name,
            (condition, Output::Event(event)) => is_event(condition, event),
            _ => false,
        }
    }

    /// Whether a state of which no event tells has begun since the last call: lines and `idle`. To be called after an input
    /// and all its outputs.
    pub fn settled(&mut self, controller: &Controller) -> bool {
        if !matches!(self.condition, Condition::Signal { .. } | Condition::Idle) {
            return false;
        }
        let holds = self.condition.holds(controller) == Some(true);
        !core::mem::replace(&mut self.held, holds) && holds
    }
}

fn is_event(condition: &Condition, event: &Event) -> bool {
    match (condition, event) {
        (Condition::Command(text), Event::TextIn { data, .. })
        | (Condition::Answer(text), Event::TextOut { data, .. }) => data.starts_with(text),
        (Condition::Refused(letters), Event::Refused { command, .. }) => letters == command,
        (Condition::Alarm(expected), Event::Alarm { number, .. }) => {
            expected.as_ref().is_none_or(|expected| expected == number)
        }
        (Condition::AlarmsReset, Event::AlarmsReset) => true,
        (Condition::Status(expected), Event::Status { status, .. }) => expected == status,
        (Condition::Servo(expected), Event::Servo(on)) => expected == on,
        (Condition::Selected(expected), Event::Selected(file)) => {
            expected == file.as_deref().unwrap_or_default()
        }
        (Condition::Finding(expected), Event::Finding(finding)) => {
            finding.caused_by.is_none() && expected == finding.rule.id
        }
        (Condition::Statement(expected), Event::Statement { line, .. }) => expected == line,
        _ => false,
    }
}

/// Whether the earlier bytes and these contain the text. Bytes of one occurrence do not count for the next.
fn continues_to(tail: &mut Vec<u8>, bytes: &[u8], text: &[u8]) -> bool {
    tail.extend_from_slice(bytes);
    let found = tail.windows(text.len().max(1)).any(|window| window == text);
    let kept = if found { 0 } else { text.len().saturating_sub(1) };
    tail.drain(..tail.len().saturating_sub(kept));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::Action;
    use crate::time::Time;
    use crate::{CONDITION_FORMS, Config, Dialect, PanelAction};
    use bytes::Bytes;

    #[test]
    fn a_text_is_found_across_prints_and_counted_once() {
        let mut watch = ConditionWatch::new("printed IP1 DONE".parse().unwrap());
        let mut print = |port, text: &'static str| {
            let bytes = Bytes::from_static(text.as_bytes());
            watch.output(&Output::Send { port, bytes })
        };
        assert!(!print(Port::Ip1, "xDO"));
        assert!(!print(Port::Ip2, "NE"), "another channel");
        assert!(print(Port::Ip1, "NE\r"));
        assert!(!print(Port::Ip1, "NE"));
        assert!(print(Port::Ip1, "DONE"));
        let mut watch = ConditionWatch::new("received COM1 12".parse().unwrap());
        let port = Port::Com1;
        assert!(!watch.input(&Input::received(port, b"01".to_vec())));
        assert!(watch.input(&Input::received(port, b"2".to_vec())));
    }

    #[test]
    fn a_state_without_an_event_begins_once_and_holds_on() {
        let mut controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let mut watch = ConditionWatch::new("input 9 on".parse().unwrap());
        let mut line = |on| {
            let input = Input::by_hand(PanelAction::InputLine { line: 9, on });
            let _ = controller.feed(Time::ZERO, input);
            (watch.settled(&controller), watch.condition().holds(&controller))
        };
        assert_eq!(line(false), (false, Some(false)));
        assert_eq!(line(true), (true, Some(true)));
        assert_eq!(line(true), (false, Some(true)));
        assert_eq!(line(false), (false, Some(false)));
        assert_eq!(line(true), (true, Some(true)));
    }

    #[test]
    fn power_off_resets_the_alarms() {
        let mut controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let mut happens = |words: &str| {
            let action: Action = words.parse().unwrap();
            let mut watch = ConditionWatch::new(Condition::AlarmsReset);
            let outputs = controller.feed(Time::ZERO, Input::by_owner(action));
            outputs.iter().any(|output| watch.output(output))
        };
        assert!(!happens("power cycle"), "there was none");
        for off in ["power cycle", "power off"] {
            assert!(!happens("alarms raise 1-102"));
            assert!(happens(off), "{off}");
        }
    }

    #[test]
    fn the_forms_say_which_conditions_are_a_state() {
        let controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        for row in CONDITION_FORMS {
            let condition: Condition = row.example.parse().unwrap();
            let is_state = condition.holds(&controller).is_some();
            assert_eq!(is_state, row.is_state, "{}", row.form);
        }
    }
}
