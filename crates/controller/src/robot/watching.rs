//! The present value of something that is watched.

use super::Robot;
use crate::action::IoKind;
use crate::listed::listed;
use crate::prelude::*;
use crate::watched::Watched;
use scol_mini::Memory;

impl Robot {
    /// The value in words; empty where there is none.
    pub(crate) fn read_watched(&self, watched: &Watched) -> String {
        let on = |on: bool| if on { "on" } else { "off" }.to_string();
        match watched {
            Watched::Variable(name, subscripts) => {
                let (memory, program) = (self.executor.memory(), self.executor.program());
                let read = if name.contains('.') {
                    Memory::local
                } else {
                    Memory::global
                };
                let Ok(value) = read(memory, program, name, subscripts) else {
                    return String::new();
                };
                let numbers: Vec<String> = listed(&value, self.arm.kind())
                    .iter()
                    .map(ToString::to_string)
                    .collect();
                numbers.join(",")
            }
            Watched::Line(IoKind::Input, line) => on(self.signals.input(*line)),
            Watched::Line(IoKind::Output, line) => on(self.signals.output(*line)),
            Watched::Override => self.panel.state().override_percent.to_string(),
            Watched::Mode => self.panel.state().master_mode().as_str().to_string(),
            Watched::Servo => on(self.panel.state().servo),
        }
    }
}
