//! The current position file of the SCARA edition (S28).
//!
//! The manual lists its 20 items but not the letters that ask for it, so no command answers with it. The controller
//! supplies the values.

use super::ExecutionStatus;
use crate::prelude::*;

/// Axes in each of its groups.
pub const POSITION_AXES: usize = 6;

/// The items, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CurrentPosition {
    /// Motion status, as in SF.
    pub status: ExecutionStatus,
    /// Execution line.
    pub line: u16,
    /// Joints 1 to 6 as integer parts, degrees or mm.
    pub joints: [i32; POSITION_AXES],
    /// The same again; as measured (assumed: the manual only repeats the group).
    pub measured: [i32; POSITION_AXES],
    /// Motor torques 1 to 6, in percent (assumed).
    pub torques: [i32; POSITION_AXES],
}

impl CurrentPosition {
    /// The content: whole numbers with commas between them, CR at the end (assumed, as the files of its kind have it).
    pub fn encode(&self) -> Vec<u8> {
        let head = [i32::from(self.status.code()), i32::from(self.line)];
        let groups = [self.joints, self.measured, self.torques];
        let items = head.into_iter().chain(groups.into_iter().flatten());
        let items: Vec<String> = items.map(|item| item.to_string()).collect();
        (items.join(",") + "\r").into_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: CurrentPosition = CurrentPosition {
        status: ExecutionStatus::Running,
        line: 12,
        joints: [-30, 78, 0, -48, 0, 0],
        measured: [-30, 78, 0, -48, 0, 0],
        torques: [100, 25, 0, 3, 0, 0],
    };

    // clause: S28
    #[test]
    fn twenty_items() {
        let content = SAMPLE.encode();
        assert_eq!(
            content,
            b"1,12,-30,78,0,-48,0,0,-30,78,0,-48,0,0,100,25,0,3,0,0\r"
        );
        assert_eq!(content.split(|byte| *byte == b',').count(), 20);
    }
}
