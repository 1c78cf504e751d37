//! The limits of the controller by name: sizes, times and counts, with their source.
//!
//! A limit that belongs to one format is defined with that format in `ts3100_proto`.

use core::time::Duration;

/// Most bytes in one [`crate::output::Output::Send`]: the packet size of ETH-02.
pub const MAX_SEND: usize = 512;
/// Ring buffer of a SCOL channel, in bytes (D10, INP-13).
pub const RING_BUFFER: usize = 256;
/// Most bytes on a serial line towards the robot, those the host's port still holds included.
pub const LINE_QUEUE: usize = 4_096;
/// How long the bytes of a host that has gone may keep the next one waiting: the longest text takes about half of it at
/// 9600 baud. A longer rest is dropped (assumed).
pub const DEPARTED_LINE_TIME: Duration = Duration::from_millis(500);
/// Most bytes the robot holds for a serial line; PRINT waits for room (assumed).
pub const MAX_LINE_OUTPUT: usize = 1_024;
/// Most characters of a serial line delivered at once: the depth of a common UART's buffer.
pub const UART_FIFO: usize = 16;
/// Longest pause between the characters of a text, and longest wait for the host's answer (SER-06, SER-08).
pub const HOST_TIMEOUT: Duration = Duration::from_secs(10);
/// How long a bare text that has its CR waits for ETX (option `text.end`, T6). A host writes both in one call; where its
/// stack parts them, ETX follows after a delayed acknowledge of 200 ms at most. Hosts that send no ETX ask every 500 ms.
pub const TEXT_END_WAIT: Duration = Duration::from_millis(250);
/// Latest time of the unsolicited SP after its stop, unless an exchange is open then (D7).
pub const MAX_SP_DELAY: Duration = Duration::from_millis(200);
/// Default capacity of the RAM drive in bytes (D13, RAM-15).
pub const DRIVE_CAPACITY: usize = 1024 * 1024;
/// Largest file: its size has five digits in the directory (RAM-03).
pub const MAX_FILE: usize = 99_999;
/// Most files on the RAM drive.
pub const MAX_FILES: usize = 1_000;
/// Error history entries kept (EU-06).
pub const MAX_HISTORY: usize = 99;
/// Current alarms kept; ten of them are shown by SF (SF-23).
pub const MAX_ALARMS: usize = 32;
/// Statements a program may run before it yields to the rest of the controller.
pub const STATEMENTS_PER_SCAN: u32 = 100;
/// Pause between two scans of a program that never waits, and of a WAIT on a changing quantity (scol.md 3.6).
pub const SCAN: Duration = Duration::from_millis(10);
/// How long before its end a motion counts as arrived under ACCUR = COARSE (assumed).
pub const COARSE_LEAD: Duration = Duration::from_millis(50);
/// Shortest time a DO motion shows RUN (D7, option `do.min_run`).
pub const DO_MIN_RUN: Duration = Duration::from_millis(200);
/// Difference of two reals that a SCARA controller counts as equal (hosts.md 8.13, option `scol.equal_within`).
pub const SCARA_EQUAL_WITHIN: f32 = 0.001;
/// Speed of the tool point in TEACHING, in mm/s (PRM-SPD-01).
pub const TEACHING_SPEED: f64 = 250.0;
/// Teach pendant screen: characters of PRINT kept.
pub const PENDANT_TEXT: usize = 4_096;
/// Length of the pulses ACK and CYC_END (SF-39; assumed).
pub const PULSE: Duration = Duration::from_millis(100);
/// Every servo-on of this number is delayed, by the option `servo.interval` (S41).
pub const SERVO_ONS: u8 = 3;
/// The delay on a TSL3000E (S41).
pub const SERVO_INTERVAL: Duration = Duration::from_secs(7);
/// Speed under LOW_SPD in percent (assumed; option `sig.low_speed`).
pub const LOW_SPEED: u8 = 10;
/// Speed of jogging at the rates slow, mid, fast, in percent (assumed).
pub const JOG_SPEED: [f64; 3] = [2.0, 10.0, 30.0];
/// Step of inching at the rates slow, mid, fast, in mm or degrees (assumed).
pub const INCHING_STEP: [f64; 3] = [0.1, 1.0, 10.0];
/// Longest jog of the tool point, in mm; the limit of the reach usually ends it earlier.
pub const MAX_JOG_DISTANCE: f64 = 2_000.0;
/// Longest jog that turns the tool, in degrees.
pub const MAX_JOG_ANGLE: f64 = 170.0;
/// Steps of a mm or degree in which a position is taught: those of a teach pendant.
pub const TAUGHT_STEPS: f64 = 1_000.0;
/// Breakpoints of a file.
pub const MAX_BREAKPOINTS: usize = 1_000;
/// Bytes of the condition of a breakpoint, or of its message.
pub const MAX_BREAKPOINT_TEXT: usize = 1_000;
/// Bisection steps in the search for the limit of the reach when jogging.
pub const JOG_BISECTIONS: u32 = 16;
/// Faults that can be armed, those that have fired included.
pub const MAX_FAULTS: usize = 256;
/// Times kept of each fault.
pub const MAX_FAULT_TIMES: usize = 100;
/// Faults that have fired and can still cause findings.
pub const MAX_FAULT_EFFECTS: usize = 64;
/// Actions of faults that can wait for their time.
pub const MAX_SCHEDULED_ACTIONS: usize = 256;
/// Most bytes that wait on a port because a fault or a variation delays them.
pub const MAX_QUEUED_BYTES: usize = 65_536;
/// Segments that can wait on a port: at least one byte each, and a few without bytes.
pub const MAX_QUEUED_SEGMENTS: usize = MAX_QUEUED_BYTES + 1_024;
/// Most writes in which a text leaves under variation.
pub const MAX_VARIED_PIECES: u64 = 4;
/// Longest pause between two of them, in ms.
pub const MAX_VARIED_GAP_MS: u64 = 15;
/// Latest answer under variation, in ms: a host that asks directly after the OK of a DO still sees RUN (`do.min_run`).
pub const MAX_VARIED_REPLY_MS: u64 = 100;
/// Most by which variation delays the unsolicited SP, in ms; [`MAX_SP_DELAY`] holds all the same.
pub const MAX_VARIED_SP_MS: u64 = 200;
/// Fewest data bytes of a text under variation that is not the last of its file.
pub const MIN_VARIED_TEXT: u64 = 128;
/// Most blanks between name and size in CA under variation.
pub const MAX_VARIED_BLANKS: u64 = 3;
/// Longest DELAY or pulse in seconds: a hundred years. A longer one counts as this long.
pub const LONGEST_DELAY: f64 = 3_155_760_000.0;
