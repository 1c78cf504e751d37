//! The options of the controller as a table: one row each.
//!
//! [`for_each_option`](crate::for_each_option) hands the rows to a macro. [`super`] makes the struct and the presets of the
//! dialects of them; who reads options by their key makes its table. A row has the reading, the key, the field and its type,
//! how its values are read, and the value in each dialect.

/// Hands the rows to a macro: those of [`TextOptions`](ts3100_proto::text::TextOptions), which are the field `text` of
/// [`Options`](crate::options::Options), and those of its other fields.
#[macro_export]
macro_rules! for_each_option {
    ($each:ident) => {
        $each! {
            text {
                "text.checksum" checksum: Checksum, Words { Checksum: None "none", Sum "sum" },
                    field Checksum::None, manual Checksum::None;
                "text.end" end: EndRule, Words { EndRule: Etx "etx", Cr "cr", Detect "detect" },
                    field EndRule::Detect, manual EndRule::Etx;
                "text.stx" stx: StxRule, Words { StxRule: Detect "detect", Required "required" },
                    field StxRule::Detect, manual StxRule::Required;
            }
            own {
                /// `text.require_cr`: a command without CR before ETX gets NG (FRM-10); otherwise it is served, with a finding.
                "text.require_cr" require_cr: bool, Field (),
                    field false, manual true;
                /// `sf.split`.
                "sf.split" sf_texts: SfTexts, Words { SfTexts: One "one", Several "several" },
                    field SfTexts::One, manual SfTexts::Several;
                /// `su.layout`.
                "su.layout" su_layout: SuLayout, Words { SuLayout: OneRecord "one-record", SixRecords "six-records" },
                    field SuLayout::OneRecord, manual SuLayout::SixRecords;
                /// `vr.layout`.
                "vr.layout" vr_layout: VrLayout, Words { VrLayout: Blanks "blanks", Packed "packed" },
                    field VrLayout::Blanks, manual VrLayout::Packed;
                /// `channel.no_peer`.
                "channel.no_peer" no_peer: NoPeer, Words { NoPeer: Alarm "alarm", Silent "silent" },
                    field NoPeer::Alarm, manual NoPeer::Silent;
                /// `input.malformed`; none: as the arm has it, see [`Options::malformed`].
                "input.malformed" malformed: Option<Malformed>, Words { Malformed: Alarm "alarm", LeadingNumber "leading-number" },
                    field Some(Malformed::Alarm), manual None;
                /// `wait.after_stop`.
                "wait.after_stop" wait_after_stop: WaitAfterStop, Words { WaitAfterStop: Next "next", Again "again" },
                    field WaitAfterStop::Next, manual WaitAfterStop::Next;
                /// `sig.strobe`.
                "sig.strobe" strobe: Strobe, Words { Strobe: Free "free", Required "required" },
                    field Strobe::Free, manual Strobe::Free;
                /// `sig.low_speed` in percent.
                "sig.low_speed" low_speed: u8, Whole ("percent", 1, 100),
                    field limits::LOW_SPEED, manual limits::LOW_SPEED;
                /// `parameter.line_end`: of the factory parameter files.
                "parameter.line_end" line_end: LineEnd, Words { LineEnd: Lf "lf", Cr "cr" },
                    field LineEnd::Lf, manual LineEnd::Cr;
                /// `drive.open_mode`: \[E00\] of a fresh drive.
                "drive.open_mode" open_mode: [OpenMode; 4], Field (),
                    field [OpenMode::Server; 4], manual [OpenMode::Server, OpenMode::NotUsed, OpenMode::NotUsed, OpenMode::NotUsed];
                /// `extensions`: the commands real hosts send beyond the manual are served.
                "extensions" extensions: bool, Field (),
                    field true, manual false;
                /// `sp.unsolicited`.
                "sp.unsolicited" unsolicited_sp: UnsolicitedSp, Words { UnsolicitedSp: Auto "auto", Always "true", Never "false" },
                    field UnsolicitedSp::Auto, manual UnsolicitedSp::Always;
                /// `strict_50ms`: a text within 50 ms of the controller's last text is ignored.
                "strict_50ms" strict_50ms: bool, Field (),
                    field false, manual false;
                /// `do.min_run`.
                "do.min_run" do_min_run: Duration, Period ("0s", "200ms"),
                    field limits::DO_MIN_RUN, manual limits::DO_MIN_RUN;
                /// `drive.capacity` in bytes.
                "drive.capacity" drive_capacity: usize, Whole ("bytes", 0, MAX_CAPACITY),
                    field limits::DRIVE_CAPACITY, manual limits::DRIVE_CAPACITY;
                /// `scol.int_division`.
                "scol.int_division" int_division: IntDivision, Words { IntDivision: Truncate "truncate", Real "real" },
                    field IntDivision::Truncate, manual IntDivision::Truncate;
                /// `dl.command_ends`: a later text of a download that is a command and nothing else ends the download
                /// (TRN-09); otherwise it is a part of the file (FL-03).
                "dl.command_ends" command_ends_download: bool, Field (),
                    field true, manual true;
                /// `serial.pacing`: characters on HOST and COM1 take the time \[U06\] gives them.
                "serial.pacing" serial_pacing: bool, Field (),
                    field true, manual true;
                /// `serial.bad_character`.
                "serial.bad_character" bad_character: BadCharacter, Words { BadCharacter: Drop "drop", Keep "keep" },
                    field BadCharacter::Drop, manual BadCharacter::Drop;
                /// `serial.while_sending`.
                "serial.while_sending" while_sending: WhileSending, Words { WhileSending: Lost "lost", Kept "kept" },
                    field WhileSending::Lost, manual WhileSending::Lost;
                /// `reply.delay`: how long the answers to commands take, as least, quartiles and greatest of many; 0: at once.
                "reply.delay" reply_delay: [Duration; 5], Field (),
                    field [Duration::ZERO; 5], manual [Duration::ZERO; 5];
                /// `servo.interval`: every third servo-on comes only this much later (S41); zero: none does.
                "servo.interval" servo_interval: Duration, Period ("0s", "7s"),
                    field Duration::ZERO, manual Duration::ZERO;
                /// `scol.sticky_work`.
                "scol.sticky_work" sticky_work: bool, Field (),
                    field false, manual false;
                /// `scol.data_copy`: a program that assigns to a name of DATA has a copy of its own.
                "scol.data_copy" data_copy: bool, Field (),
                    field false, manual false;
                /// `alarm.out_of_reach`.
                "alarm.out_of_reach" out_of_reach: OutOfReach, Words { OutOfReach: Level8 "8-035", Level4 "4-101" },
                    field OutOfReach::Level8, manual OutOfReach::Level8;
                /// `scol.din_unknown`.
                "scol.din_unknown" din_unknown: UnknownInput, Words { UnknownInput: Alarm "alarm", Zero "zero" },
                    field UnknownInput::Alarm, manual UnknownInput::Alarm;
                /// `scol.equal_within`: comparisons count reals that differ by so much or less as equal; none: as the arm has it,
                /// [`limits::SCARA_EQUAL_WITHIN`] on a SCARA and 0 on six axes.
                "scol.equal_within" equal_within: Option<f32>, Real (0.0, 1_000.0),
                    field None, manual None;
                /// `ac.date`: how AC writes the year (T9).
                "ac.date" ac_date: YearDigits, Words { YearDigits: Four "yyyy", Two "yy" },
                    field YearDigits::Four, manual YearDigits::Two;
                /// `rs.cycle_without_label`.
                "rs.cycle_without_label" cycle_without_label: CycleWithoutLabel, Words { CycleWithoutLabel: AsStep "as-step", Ng "ng" },
                    field CycleWithoutLabel::AsStep, manual CycleWithoutLabel::Ng;
                /// `scol.reset_locals`: after RS,STP and RS,CYC the variables of the programs have no value (T10).
                "scol.reset_locals" reset_locals: bool, Field (),
                    field false, manual false;
                /// `channel.reconnect`.
                "channel.reconnect" reconnect: Reconnect, Words { Reconnect: Keep "keep", Release "release" },
                    field Reconnect::Keep, manual Reconnect::Keep;
                /// `io.field_bus`.
                "io.field_bus" field_bus: FieldBus, Words { FieldBus: Absent "absent", Present "present" },
                    field FieldBus::Absent, manual FieldBus::Absent;
            }
        }
    };
}
