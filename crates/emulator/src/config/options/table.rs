//! The table of the named options. How their values are read and written is in `value`.

use super::OptionRow;
use super::value::{Field, Period, Real, Setting, Whole};
use ts3100_controller::limits;

/// Largest RAM drive in bytes: the largest number of files, each of the largest size.
const MAX_CAPACITY: usize = limits::MAX_FILES * limits::MAX_FILE;

const fn row(key: &'static str, setting: &'static dyn Setting) -> OptionRow {
    OptionRow { key, setting }
}

/// Every option, in alphabetical order: key, and the field that it sets.
pub static OPTIONS: &[OptionRow] = &[
    row("ac.date", &Field(|o, _| &mut o.ac_date)),
    row("alarm.out_of_reach", &Field(|o, _| &mut o.out_of_reach)),
    // An answer on the loopback takes about as long.
    row("auto.silence", &Period("0.05ms", "1ms", |_, l| &mut l.silence)),
    row("channel.no_peer", &Field(|o, _| &mut o.no_peer)),
    row("channel.reconnect", &Field(|o, _| &mut o.reconnect)),
    // So that dialling does not use up the CPU.
    row("channel.redial", &Period("10ms", "2s", |_, l| &mut l.redial)),
    row("channel.second", &Field(|_, l| &mut l.second)),
    row("dl.command_ends", &Field(|o, _| &mut o.command_ends_download)),
    row("do.min_run", &Period("0s", "200ms", |o, _| &mut o.do_min_run)),
    row(
        "drive.capacity",
        &Whole("bytes", 0, MAX_CAPACITY, |o, _| &mut o.drive_capacity),
    ),
    row("drive.open_mode", &Field(|o, _| &mut o.open_mode)),
    row("drive.when_full", &Field(|_, l| &mut l.when_full)),
    row("extensions", &Field(|o, _| &mut o.extensions)),
    row("input.malformed", &Field(|o, _| &mut o.malformed)),
    row("io.field_bus", &Field(|o, _| &mut o.field_bus)),
    row("parameter.line_end", &Field(|o, _| &mut o.line_end)),
    row("reply.delay", &Field(|o, _| &mut o.reply_delay)),
    row(
        "rs.cycle_without_label",
        &Field(|o, _| &mut o.cycle_without_label),
    ),
    row("scol.data_copy", &Field(|o, _| &mut o.data_copy)),
    row("scol.din_unknown", &Field(|o, _| &mut o.din_unknown)),
    row(
        "scol.equal_within",
        &Real(0.0, 1_000.0, |o, _| &mut o.equal_within),
    ),
    row("scol.int_division", &Field(|o, _| &mut o.int_division)),
    row("scol.reset_locals", &Field(|o, _| &mut o.reset_locals)),
    row("scol.sticky_work", &Field(|o, _| &mut o.sticky_work)),
    row("serial.bad_character", &Field(|o, _| &mut o.bad_character)),
    row("serial.pacing", &Field(|o, _| &mut o.serial_pacing)),
    row("serial.while_sending", &Field(|o, _| &mut o.while_sending)),
    row(
        "servo.interval",
        &Period("0s", "7s", |o, _| &mut o.servo_interval),
    ),
    row("sf.split", &Field(|o, _| &mut o.sf_texts)),
    row(
        "sig.low_speed",
        &Whole("percent", 1, 100, |o, _| &mut o.low_speed),
    ),
    row("sig.strobe", &Field(|o, _| &mut o.strobe)),
    row("sp.unsolicited", &Field(|o, _| &mut o.unsolicited_sp)),
    row("strict_50ms", &Field(|o, _| &mut o.strict_50ms)),
    row("su.layout", &Field(|o, _| &mut o.su_layout)),
    row("text.checksum", &Field(|o, _| &mut o.text.checksum)),
    row("text.end", &Field(|o, _| &mut o.text.end)),
    row("text.require_cr", &Field(|o, _| &mut o.require_cr)),
    row("text.stx", &Field(|o, _| &mut o.text.stx)),
    row("vr.layout", &Field(|o, _| &mut o.vr_layout)),
    row("wait.after_stop", &Field(|o, _| &mut o.wait_after_stop)),
];
