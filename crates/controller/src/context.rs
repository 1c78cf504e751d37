//! The context of every part of a controller, of the ports as well as of the robot: the configuration, the present
//! moment, the outputs, and the faults that excuse findings.

pub(crate) mod checks;

use crate::faults::effects::FaultEffects;
use crate::finding::{Finding, MAX_BYTES, Message, Rule};
use crate::options::Config;
use crate::output::Event;
use crate::outputs::Outputs;
use crate::port::Port;
use crate::time::Time;
use bytes::Bytes;
use ts3100_proto::calendar::CalendarTime;

/// The surroundings of the parts of a controller. It knows neither ports nor robot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Context {
    pub(crate) config: Config,
    pub(crate) now: Time,
    pub(crate) outputs: Outputs,
    /// Faults that can cause findings.
    pub(crate) fault_effects: FaultEffects,
}

impl Context {
    /// The surroundings when the power comes on.
    pub(crate) fn new(config: Config) -> Context {
        Context {
            config,
            now: Time::ZERO,
            outputs: Outputs::default(),
            fault_effects: FaultEffects::default(),
        }
    }

    /// Bytes of a port go no further.
    pub(crate) fn dropped(&mut self, port: Port, bytes: usize, reason: &'static str) {
        self.outputs.event(Event::Dropped { port, bytes, reason });
    }

    /// A rule was broken.
    pub(crate) fn report(
        &mut self,
        rule: &'static Rule,
        port: impl Into<Option<Port>>,
        bytes: &[u8],
        message: impl Into<Message>,
    ) {
        let bytes = Bytes::copy_from_slice(bytes.get(..MAX_BYTES).unwrap_or(bytes));
        self.report_shared(rule, port.into(), bytes, message.into());
    }

    /// A rule was broken by these bytes, which others keep too.
    pub(crate) fn report_shared(
        &mut self,
        rule: &'static Rule,
        port: Option<Port>,
        mut bytes: Bytes,
        message: Message,
    ) {
        bytes.truncate(MAX_BYTES);
        let caused_by = self.fault_effects.cause_of(rule, port);
        self.outputs.event(Event::Finding(Finding {
            rule,
            port,
            at: self.now,
            bytes,
            message,
            caused_by,
        }));
    }

    /// Date and time now, for the error history.
    pub(crate) fn calendar(&self) -> CalendarTime {
        let seconds = self.now.as_micros() / 1_000_000;
        self.config.calendar.plus_seconds(seconds)
    }
}
