//! What someone who holds the controller may see of a run: where the program stands, what it waits for, where the
//! arm is. Nothing is changed here but whether statements are told.

use crate::Controller;
use crate::signals::Signals;
use alloc::vec::Vec;
use scol_mini::{Arm, Channel, LanguageOptions};

/// The highest number of an output.
const LAST_OUTPUT: u16 = 264;

/// Where the arm is.
#[derive(Debug, Clone, PartialEq)]
pub struct Whereabouts {
    /// Joint values: degrees, of the SCARA's third axis mm.
    pub joints: Vec<f64>,
    /// The tool point in world: X Y Z A B C U V, of a SCARA X Y Z C T; mm and degrees.
    pub world: Vec<f64>,
    /// The digits of the configuration.
    pub configuration: [u8; 5],
}

impl Controller {
    /// From now on every statement of the program is told by
    /// [`Event::Statement`](crate::output::Event::Statement), or no longer.
    pub fn trace(&mut self, on: bool) {
        self.traced = on;
    }

    /// The options with which this controller compiles a file.
    #[must_use]
    pub fn language(&self) -> LanguageOptions {
        self.config.language()
    }

    /// Whether an input is on.
    #[must_use]
    pub fn is_input_on(&self, line: u16) -> bool {
        self.signals.input(line)
    }

    /// Whether an output is on.
    #[must_use]
    pub fn is_output_on(&self, line: u16) -> bool {
        self.signals.output(line)
    }

    /// Whether texts have a checksum.
    #[must_use]
    pub fn checksum(&self) -> ts3100_proto::text::Checksum {
        self.config.options.text.checksum
    }

    /// The files of the RAM drive in alphabetical order, each with its content without EOF.
    pub fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.drive.files()
    }

    /// Whether a program runs in automatic operation.
    #[must_use]
    pub fn program_runs(&self) -> bool {
        self.executor.program_runs()
    }

    /// File line at which the program stands; 0 when no file is selected.
    #[must_use]
    pub fn line(&self) -> u32 {
        self.executor.line()
    }

    /// The channel from which an INPUT waits for values.
    #[must_use]
    pub fn waits_for(&self) -> Option<Channel> {
        self.executor.reading().next()
    }

    /// User outputs that are on, in the order of their numbers.
    #[must_use]
    pub fn outputs_on(&self) -> Vec<u16> {
        let lines = (1..=LAST_OUTPUT).filter(|line| Signals::is_user_output(*line));
        lines.filter(|line| self.signals.output(*line)).collect()
    }

    /// Where the arm is now.
    #[must_use]
    pub fn whereabouts(&self) -> Whereabouts {
        let shown = self.arm.shown(self.now, self.executor.memory().conditions());
        let ([x, y, z], [a, b, c], [u, v]) = (shown.world.xyz, shown.world.abc, shown.world.uv);
        let axes = self.arm.model().axes.len();
        let world = match self.arm.kind() {
            Arm::SixAxis => Vec::from([x, y, z, a, b, c, u, v]),
            Arm::Scara => Vec::from([x, y, z, c, u]),
        };
        Whereabouts {
            joints: shown.joint.iter().take(axes).copied().collect(),
            world,
            configuration: self.arm.configuration(self.now),
        }
    }
}
