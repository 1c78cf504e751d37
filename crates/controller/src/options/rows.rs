//! The options of the controller as a table: one row each.
//!
//! [`for_each_option`](crate::for_each_option) hands the rows to a macro. [`super`] makes the struct and the presets of the
//! dialects of them; who reads options by their key makes its table. A row has what the option decides, the key, the field and its type,
//! how its values are read, and the value in each dialect.

/// Hands the rows to a macro: those of [`TextOptions`](ts3100_proto::text::TextOptions), which are the field `text` of
/// [`Options`](crate::options::Options), and those of its other fields.
#[macro_export]
macro_rules! for_each_option {
    ($each:ident) => {
        $each! {
            text {
                /// Whether a checksum follows ETX, in both directions.
                "text.checksum" checksum: Checksum, Words { Checksum: None "none", Sum "sum" },
                    field Checksum::None, manual Checksum::None;
                /// What ends a text without STX.
                "text.end" end: EndRule, Words { EndRule: Etx "etx", Cr "cr", Detect "detect" },
                    field EndRule::Detect, manual EndRule::Etx;
                /// How a text without STX is treated.
                "text.stx" stx: StxRule, Words { StxRule: Detect "detect", Required "required" },
                    field StxRule::Detect, manual StxRule::Required;
            }
            own {
                /// Whether a command without CR before ETX gets NG.
                "text.require_cr" require_cr: bool, Field (),
                    field false, manual true;
                /// In how many texts a six-axis arm sends SF.
                "sf.split" sf_texts: SfTexts, Words { SfTexts: One "one", Several "several" },
                    field SfTexts::One, manual SfTexts::Several;
                /// The form of SU.
                "su.layout" su_layout: SuLayout, Words { SuLayout: OneRecord "one-record", SixRecords "six-records" },
                    field SuLayout::OneRecord, manual SuLayout::SixRecords;
                /// The form of VR.
                "vr.layout" vr_layout: VrLayout, Words { VrLayout: Blanks "blanks", Packed "packed" },
                    field VrLayout::Blanks, manual VrLayout::Packed;
                /// What PRINT and INPUT do on IP1 and IP2 while nobody is connected.
                "channel.no_peer" no_peer: NoPeer, Words { NoPeer: Alarm "alarm", Silent "silent" },
                    field NoPeer::Alarm, manual NoPeer::Silent;
                /// What INPUT does with something that is not a number; the default depends on the arm.
                "input.malformed" malformed: Option<Malformed>, Words { Malformed: Alarm "alarm", LeadingNumber "leading-number" },
                    field Some(Malformed::Alarm), manual None;
                /// Where a program continues after SP has stopped it inside a WAIT.
                "wait.after_stop" wait_after_stop: WaitAfterStop, Words { WaitAfterStop: Next "next", Again "again" },
                    field WaitAfterStop::Next, manual WaitAfterStop::Next;
                /// Whether the command inputs need STROBE.
                "sig.strobe" strobe: Strobe, Words { Strobe: Free "free", Required "required" },
                    field Strobe::Free, manual Strobe::Free;
                /// The speed limit while input LOW_SPD is on.
                "sig.low_speed" low_speed: u8, Whole ("percent", 1, 100),
                    field limits::LOW_SPEED, manual limits::LOW_SPEED;
                /// The line end of the factory parameter files.
                "parameter.line_end" line_end: LineEnd, Words { LineEnd: Lf "lf", Cr "cr" },
                    field LineEnd::Lf, manual LineEnd::Cr;
                /// `[E00]` of a fresh ETHERNET.PAR: one digit for each of IP0 to IP3.
                "drive.open_mode" open_mode: [OpenMode; 4], Field (),
                    field [OpenMode::Server; 4], manual [OpenMode::Server, OpenMode::NotUsed, OpenMode::NotUsed, OpenMode::NotUsed];
                /// Whether a six-axis arm serves the commands of the SCARA edition.
                "extensions" extensions: bool, Field (),
                    field true, manual false;
                /// Which hosts receive the unsolicited SP.
                "sp.unsolicited" unsolicited_sp: UnsolicitedSp, Words { UnsolicitedSp: Auto "auto", Always "true", Never "false" },
                    field UnsolicitedSp::Auto, manual UnsolicitedSp::Always;
                /// Whether a text that comes within 50 ms after a text of the controller is ignored.
                "strict_50ms" strict_50ms: bool, Field (),
                    field false, manual false;
                /// How long SF shows a DO as running at least.
                "do.min_run" do_min_run: Duration, Period ("0s", "200ms"),
                    field limits::DO_MIN_RUN, manual limits::DO_MIN_RUN;
                /// The size of the RAM drive for user files, in bytes.
                "drive.capacity" drive_capacity: usize, Whole ("bytes", 0, MAX_CAPACITY),
                    field limits::DRIVE_CAPACITY, manual limits::DRIVE_CAPACITY;
                /// What `/` gives for two integers.
                "scol.int_division" int_division: IntDivision, Words { IntDivision: Truncate "truncate", Real "real" },
                    field IntDivision::Truncate, manual IntDivision::Truncate;
                /// Whether a command ends a download if it comes alone in a text after the first.
                "dl.command_ends" command_ends_download: bool, Field (),
                    field true, manual true;
                /// Whether characters on HOST and COM1 take the time that `[U06]` gives them.
                "serial.pacing" serial_pacing: bool, Field (),
                    field true, manual true;
                /// What happens to a character with a parity or framing error.
                "serial.bad_character" bad_character: BadCharacter, Words { BadCharacter: Drop "drop", Keep "keep" },
                    field BadCharacter::Drop, manual BadCharacter::Drop;
                /// What happens to bytes that arrive on HOST while the robot sends.
                "serial.while_sending" while_sending: WhileSending, Words { WhileSending: Lost "lost", Kept "kept" },
                    field WhileSending::Lost, manual WhileSending::Lost;
                /// How long replies to commands take: minimum, quartiles and maximum of many measurements.
                "reply.delay" reply_delay: [Duration; 5], Field (),
                    field [Duration::ZERO; 5], manual [Duration::ZERO; 5];
                /// By how much every third servo-on is delayed.
                "servo.interval" servo_interval: Duration, Period ("0s", "7s"),
                    field Duration::ZERO, manual Duration::ZERO;
                /// Whether a WORK line of the DATA block holds for all points after it, or for the next.
                "scol.sticky_work" sticky_work: bool, Field (),
                    field false, manual false;
                /// Whether a program that assigns to a name of DATA gets its own copy.
                "scol.data_copy" data_copy: bool, Field (),
                    field false, manual false;
                /// The alarm that is raised when the arm cannot reach the target or the path of a motion.
                "alarm.out_of_reach" out_of_reach: OutOfReach, Words { OutOfReach: Level8 "8-035", Level4 "4-101" },
                    field OutOfReach::Level8, manual OutOfReach::Level8;
                /// What DIN does with the number of an input that does not exist.
                "scol.din_unknown" din_unknown: UnknownInput, Words { UnknownInput: Alarm "alarm", Zero "zero" },
                    field UnknownInput::Alarm, manual UnknownInput::Alarm;
                /// The largest difference at which a comparison treats two reals as equal; the default depends on the arm.
                "scol.equal_within" equal_within: Option<f32>, Real (0.0, 1_000.0),
                    field None, manual None;
                /// How AC writes the year.
                "ac.date" ac_date: YearDigits, Words { YearDigits: Four "yyyy", Two "yy" },
                    field YearDigits::Four, manual YearDigits::Two;
                /// What RS,CYC does when no file is selected, or when the program has no label RCYCLE.
                "rs.cycle_without_label" cycle_without_label: CycleWithoutLabel, Words { CycleWithoutLabel: AsStep "as-step", Ng "ng" },
                    field CycleWithoutLabel::AsStep, manual CycleWithoutLabel::Ng;
                /// Whether RS,STP and RS,CYC reset the variables of the programs.
                "scol.reset_locals" reset_locals: bool, Field (),
                    field false, manual false;
                /// What happens to an INPUT that waits on IP1 or IP2 when another peer connects.
                "channel.reconnect" reconnect: Reconnect, Words { Reconnect: Keep "keep", Release "release" },
                    field Reconnect::Keep, manual Reconnect::Keep;
                /// Whether the controller has a field bus, with lines 301-364 and 401-464.
                "io.field_bus" field_bus: FieldBus, Words { FieldBus: Absent "absent", Present "present" },
                    field FieldBus::Absent, manual FieldBus::Absent;
            }
        }
    };
}
