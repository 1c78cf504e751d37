//! A program without sockets as a debugger runs it: the run of [`crate::headless`], taken step by step.

use crate::headless::{HeadlessRun, KeptEvent, RunEnd, RunError, RunRequest};
use std::time::Duration;
use ts3100_controller::inspection::Inspection;
use ts3100_controller::{Controller, Input, PanelAction};
use ts3100_workbench::dap::{Afterwards, Change, Course, Ending, Refusal, Said};

/// A program that runs without sockets. A copy goes its own way.
#[derive(Clone)]
pub struct ProgramRun {
    run: HeadlessRun,
    /// It prints on several channels.
    names_channels: bool,
    /// Longest run before a stop, in virtual time.
    max_time: Duration,
}

impl ProgramRun {
    /// The program before its first statement.
    ///
    /// # Errors
    /// [`RunError`]: the file is not taken, or does not compile.
    pub fn new(request: RunRequest) -> Result<ProgramRun, RunError> {
        let source = String::from_utf8_lossy(&request.source).into_owned();
        Ok(ProgramRun {
            names_channels: scol_mini::print_channels(&source).len() > 1,
            max_time: request.max_time,
            run: HeadlessRun::new(request)?,
        })
    }

    fn text(&self, event: &KeptEvent) -> Option<String> {
        match event {
            KeptEvent::Printed { channel, bytes } => {
                let text = String::from_utf8_lossy(bytes).replace('\r', "\n");
                Some(match self.names_channels {
                    true => format!("{channel}: {text}"),
                    false => text,
                })
            }
            KeptEvent::Refused { reason, .. } => Some(format!("warning: {reason}\n")),
            KeptEvent::Statement { .. } => None,
        }
    }
}

impl Course for ProgramRun {
    fn controller(&self) -> &Controller {
        self.run.controller()
    }

    fn inspect(&mut self, inspection: Inspection) {
        self.run.controller_mut().inspect(inspection);
    }

    fn take_inspection(&mut self) -> Option<Inspection> {
        self.run.controller_mut().take_inspection()
    }

    fn step(&mut self) -> Option<Ending> {
        let end = match self.run.step() {
            Ok(end) => end?,
            Err(error) => {
                return Some(Ending {
                    code: 1,
                    words: error.to_string(),
                    then: Afterwards::Over,
                });
            }
        };
        let after = self.run.passed().as_secs_f64();
        let then = match &end {
            // Whatever it waits for can still be given to it.
            RunEnd::Stopped { .. }
            | RunEnd::Blocked { .. }
            | RunEnd::NoInput { .. }
            | RunEnd::OutOfInput { .. } => Afterwards::Stays,
            RunEnd::TimeUp { .. } => {
                self.run.extend(self.max_time);
                Afterwards::Continues
            }
            RunEnd::End | RunEnd::PowerOff | RunEnd::Alarm { .. } => Afterwards::Over,
        };
        let remedy = match &end {
            RunEnd::Blocked { .. } => "; change a variable or an input, or plan the input with `at`",
            RunEnd::NoInput { .. } | RunEnd::OutOfInput { .. } => "; give it records with `input`",
            RunEnd::TimeUp { .. } => {
                ", since `maxTime` is over; continue runs for as long again, a larger `maxTime` stops later"
            }
            RunEnd::Stopped { .. } => "; to continue is START",
            RunEnd::End | RunEnd::PowerOff | RunEnd::Alarm { .. } => "",
        };
        let mut words = format!("after {after:.3} s: {}{remedy}", end.sentence());
        let mut has_failed = !matches!(end, RunEnd::End | RunEnd::Stopped { .. });
        if then == Afterwards::Over {
            for unmet in self.run.unmet() {
                words.push_str("\nscenario: ");
                words.push_str(&unmet);
                has_failed = true;
            }
        }
        Some(Ending {
            code: u8::from(has_failed),
            words,
            then,
        })
    }

    fn take_said(&mut self) -> Vec<Said> {
        let events = self.run.take_events();
        let texts = events.iter().filter_map(|(_, event)| self.text(event));
        texts.map(|text| Said { line: None, text }).collect()
    }

    fn may_change(&self) -> bool {
        true
    }

    fn waits_for_start(&self) -> bool {
        self.run.waits_for_start()
    }

    fn change(&mut self, change: &Change) -> Result<(), Refusal> {
        match change {
            Change::Start => {
                self.run.wake(Input::by_hand(PanelAction::Start));
                Ok(())
            }
            Change::Assignment(assignment) => {
                let assigned = self.run.controller_mut().assign(assignment);
                self.run.wake(Input::Tick);
                assigned.map_err(Refusal::new)
            }
        }
    }
}
