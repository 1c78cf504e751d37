//! The table of the named options: the rows of the controller, and those of the links. How their values are read and
//! written is in `value`.

use super::value::{Field, Period, Real, Setting, Value, Whole};
use super::{OptionRow, Values};
use scol_mini::IntDivision;
use std::sync::LazyLock;
use ts3100_controller::for_each_option;
use ts3100_controller::limits;
use ts3100_controller::options::{
    BadCharacter, CycleWithoutLabel, FieldBus, Malformed, NoPeer, OutOfReach, Reconnect, SfTexts, Strobe,
    UnknownInput, UnsolicitedSp, WaitAfterStop, WhileSending,
};
use ts3100_driver::store::backing::WhenFull;
use ts3100_driver::tcp::SecondConnection;
use ts3100_proto::parameter::LineEnd;
use ts3100_proto::status::eu::YearDigits;
use ts3100_proto::status::su::SuLayout;
use ts3100_proto::status::vr::VrLayout;
use ts3100_proto::text::{Checksum, EndRule, StxRule};

/// Largest RAM drive in bytes: the largest number of files, each of the largest size.
const MAX_CAPACITY: usize = limits::MAX_FILES * limits::MAX_FILE;

const fn row(key: &'static str, about: &'static str, setting: &'static dyn Setting) -> OptionRow {
    OptionRow { key, about, setting }
}

/// The field at a place, with the values of its row.
macro_rules! setting {
    (Words $words:tt, $place:expr) => {
        &Field($place)
    };
    (Field (), $place:expr) => {
        &Field($place)
    };
    (Period ($least:literal, $example:literal), $place:expr) => {
        &Period($least, $example, $place)
    };
    (Whole ($unit:literal, $min:expr, $max:expr), $place:expr) => {
        &Whole($unit, $min, $max, $place)
    };
    (Real ($min:expr, $max:expr), $place:expr) => {
        &Real($min, $max, $place)
    };
}

/// The words of a type, if its values have a word each.
macro_rules! words {
    (Words { $type:ident: $($value:ident $word:literal),* }) => {
        impl Value for $type {
            fn values() -> Values {
                Values::Words(&[$($word),*])
            }

            /// `_` counts as `-`, because keys are written with one and values with the other.
            fn parse(text: &str) -> Option<$type> {
                match text.replace('_', "-").as_str() {
                    $($word => Some($type::$value),)*
                    _ => None,
                }
            }

            fn text(&self) -> String {
                match self {
                    $($type::$value => $word,)*
                }
                .to_owned()
            }
        }
    };
    ($kind:ident $values:tt) => {};
}

/// Makes the table of the rows.
macro_rules! rows {
    (
        text {$(
            #[doc = $text_doc:literal]
            $text_key:literal $text_field:ident: $text_type:ty, $text_kind:ident $text_values:tt,
            field $text_preset:expr, manual $text_manual:expr;
        )*}
        own {$(
            #[doc = $doc:literal]
            $key:literal $field:ident: $type:ty, $kind:ident $values:tt,
            field $preset:expr, manual $manual:expr;
        )*}
    ) => {
        $(words! { $text_kind $text_values })*
        $(words! { $kind $values })*

        static OF_CONTROLLER: &[OptionRow] = &[
            $(row($text_key, $text_doc, setting!($text_kind $text_values, |options, _| &mut options.text.$text_field)),)*
            $(row($key, $doc, setting!($kind $values, |options, _| &mut options.$field)),)*
        ];
    };
}

for_each_option!(rows);

words! { Words { SecondConnection: Refuse "refuse", Replace "replace" } }
words! { Words { WhenFull: Refuse "refuse", Memory "memory" } }

static OF_LINKS: &[OptionRow] = &[
    // An answer on the loopback takes about as long.
    row(
        "auto.silence",
        "How long every host must be silent before `--time auto` jumps.",
        &Period("0.05ms", "1ms", |_, l| &mut l.silence),
    ),
    // So that dialling does not use up the CPU.
    row(
        "channel.redial",
        "How long a client channel waits after a failed or lost connection before it connects again.",
        &Period("10ms", "2s", |_, l| &mut l.redial),
    ),
    row(
        "channel.second",
        "What happens to a second connection to a channel that has one.",
        &Field(|_, l| &mut l.second),
    ),
    row(
        "drive.when_full",
        "What happens to a change that the directory of `--drive` does not accept.",
        &Field(|_, l| &mut l.when_full),
    ),
];

/// Every option, in alphabetical order.
pub static OPTIONS: LazyLock<Vec<OptionRow>> = LazyLock::new(|| {
    let mut rows = [OF_CONTROLLER, OF_LINKS].concat();
    rows.sort_by_key(|row| row.key);
    rows
});
