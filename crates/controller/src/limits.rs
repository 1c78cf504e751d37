//! Every bound of the controller by name. A bound that belongs to one format stands with that format.

use core::time::Duration;

/// Most bytes handed to the edge in one [`crate::output::Output::Send`]: the ETHER packet size of ETH-02.
pub const MAX_SEND: usize = 512;
/// Ring buffer of a SCOL channel, in bytes (D10, INP-13).
pub const RING_BUFFER: usize = 256;
/// Most bytes on a serial line towards the robot, those the host's port still holds included.
pub const LINE_QUEUE: usize = 4_096;
/// Most bytes the robot holds for a serial line; PRINT waits for room (assumed).
pub const LINE_SENDING: usize = 1_024;
/// Most characters of a serial line handed over at once: the depth of a common UART's buffer.
pub const LINE_PORTION: usize = 16;
/// Longest pause between the characters of a text, and longest wait for the host's answer (SER-06, SER-08).
pub const HOST_TIMEOUT: Duration = Duration::from_secs(10);
/// Advised pause of a host before its next text (TRN-04).
pub const HOST_DELAY: Duration = Duration::from_millis(50);
/// Latest time of the unsolicited SP after its stop, unless an exchange is open then (D7).
pub const SP_LATEST: Duration = Duration::from_millis(200);
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
/// Of so many servo-ons the last comes later, by the option `servo.interval` (S41).
pub const SERVO_ONS: u8 = 3;
/// By how much it comes later on a TSL3000E (S41).
pub const SERVO_INTERVAL: Duration = Duration::from_secs(7);
/// Speed under LOW_SPD in percent (assumed; option `sig.low_speed`).
pub const LOW_SPEED: u8 = 10;
/// Speed of guidance by hand at the rates slow, mid, fast, in percent (assumed).
pub const JOG_SPEED: [f64; 3] = [2.0, 10.0, 30.0];
/// Step of inching at the rates slow, mid, fast, in mm or degrees (assumed).
pub const INCH: [f64; 3] = [0.1, 1.0, 10.0];
/// Farthest a guided tool point is sent in one go, in mm; it stops before at the limit of its reach.
pub const GUIDE_REACH: f64 = 2_000.0;
/// Farthest a guided tool is turned in one go, in degrees.
pub const GUIDE_TURN: f64 = 170.0;
/// How often the way of a guided motion is halved in search of the limit of the reach.
pub const GUIDE_HALVINGS: u32 = 16;
/// Faults that can be armed, those that have fired included.
pub const MAX_FAULTS: usize = 256;
/// Moments kept of each fault.
pub const MAX_FAULT_TIMES: usize = 100;
/// Actions of faults that can wait for their time.
pub const MAX_SCHEDULED_ACTIONS: usize = 256;
/// Most bytes that wait on a port because a fault or a variation delays them.
pub const OUTBOX: usize = 65_536;
/// Parcels that can wait on a port: more of them than bytes there are none, and few that hold no bytes.
pub const MAX_PARCELS: usize = OUTBOX + 1_024;
/// Most writes in which a text leaves under variation.
pub const VARY_PIECES: u64 = 4;
/// Longest pause between two of them, in ms.
pub const VARY_GAP: u64 = 15;
/// Latest answer under variation, in ms: a host that asks right behind the OK of a DO still finds RUN (`do.min_run`).
pub const VARY_REPLY: u64 = 100;
/// How much later the unsolicited SP comes at most under variation, in ms; [`SP_LATEST`] holds all the same.
pub const VARY_SP: u64 = 200;
/// Most blanks between name and size in CA under variation.
pub const VARY_BLANKS: u64 = 3;
/// Longest DELAY or pulse that is told apart from one without end, in seconds: a hundred years.
pub const LONGEST_DELAY: f64 = 3_155_760_000.0;
