//! Every exit code of `ts3100`; docs/reference/exit-codes.md has the same table for users.
//!
//! `exec` passes on the code of its command, so its own codes keep out of the way of those that programs use.

pub(super) use ts3100_recording::reports::BELOW_COVERAGE;

/// A negative result: NG, a refused call, differences, errors in a program, an alarm in `run`.
pub(super) const NEGATIVE: u8 = 1;
/// Wrong usage, a file that cannot be read or written, or the emulator could not start; `exec` has [`EMULATOR_FAILED`].
pub(super) const UNUSABLE: u8 = 2;
/// `host`, `ctl`, `ready`: no answer, or one that is late, incomplete or of another program.
pub(super) const NO_ANSWER: u8 = 3;
/// `ctl`, `ready`: what was waited for did not happen in its time.
pub(super) const NOT_REACHED: u8 = 4;
/// `serve`: an expectation of the scenario was not met.
pub(super) const SCENARIO_FAILED: u8 = 5;
/// `exec`: added as a bit when `serve` would end with a code for its reports.
pub(super) const REPORTS_FAILED: u8 = 64;
/// `exec`: wrong usage, the emulator could not start, or a report could not be written.
pub(super) const EMULATOR_FAILED: u8 = 125;
/// `exec`: the command cannot be executed, as in shells.
pub(super) const NOT_EXECUTABLE: u8 = 126;
/// `exec`: there is no such command, as in shells.
pub(super) const NOT_FOUND: u8 = 127;
/// `exec`: added to the number of the signal that ended the command, as in shells.
pub(super) const BY_SIGNAL: i32 = 128;

/// Those that do not depend on a signal.
pub const ALL: [u8; 10] = [
    0,
    NEGATIVE,
    UNUSABLE,
    NO_ANSWER,
    NOT_REACHED,
    SCENARIO_FAILED,
    REPORTS_FAILED,
    EMULATOR_FAILED,
    NOT_EXECUTABLE,
    NOT_FOUND,
];
