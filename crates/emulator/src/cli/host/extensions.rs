//! The arguments of `ts3100 host` for commands that real hosts send but the manual does not have. A controller in
//! the manual's dialect answers them with NG.
//!
//! Their operands and answers are defined in `ts3100-proto`.

use super::args::{Decoder, ExchangeKind};
use super::table::help;
use clap::{Subcommand, ValueEnum};
use ts3100_proto::command::ZsFrame;

/// Words for the numbers of MD.
const MODES: [&str; 3] = ["jog", "inching", "free"];
/// Words for the numbers of RT.
const RATES: [&str; 3] = ["slow", "mid", "fast"];
/// Words for the numbers of SC.
const SYSTEMS: [&str; 4] = ["joint", "tool", "work", "world"];

/// One command beyond the manual.
#[derive(Debug, Subcommand)]
pub(super) enum Extension {
    #[command(about = help("SM"))]
    Sm,
    #[command(about = help("WD"))]
    Wd {
        /// Longest silence of the host in milliseconds
        timeout_ms: String,
        /// Level of the alarm: 8, 4, 2 or 1; 0 none
        level: String,
    },
    #[command(about = help("AC"))]
    Ac,
    #[command(about = help("AH"))]
    Ah,
    #[command(about = help("IO"))]
    Io,
    #[command(about = help("HI"))]
    Hi {
        /// Number of the first line, which is bit 0
        first: String,
        /// How many lines, 1 to 16
        count: String,
    },
    #[command(about = help("HO"))]
    Ho {
        /// Number of the first line, which is bit 0
        first: String,
        /// How many lines, 1 to 16
        count: String,
        /// The number
        value: String,
    },
    #[command(about = help("PR"))]
    Pr {
        /// Which position
        which: String,
    },
    #[command(about = help("VL"))]
    Vl {
        /// Which speed
        which: String,
    },
    #[command(about = help("ZS"))]
    Zs {
        /// Which one
        frame: FrameArg,
        /// Name of the coordinate variable
        name: String,
        /// X Y Z C of a SCARA, X Y Z A B C of a six-axis arm
        #[arg(required = true, allow_negative_numbers = true)]
        values: Vec<String>,
    },
    #[command(about = help("MN"))]
    Mn,
    #[command(about = help("MD"))]
    Md {
        /// Word or number
        mode: String,
    },
    #[command(about = help("RT"))]
    Rt {
        /// Word or number
        rate: String,
    },
    #[command(about = help("SC"))]
    Sc {
        /// Word or number
        system: String,
    },
    #[command(about = help("JG"))]
    Jg {
        /// Axis, 1 to 8
        axis: String,
        /// + - or !
        #[arg(allow_hyphen_values = true)]
        motion: String,
    },
}

/// The coordinate system of ZS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum FrameArg {
    /// The work coordinate system
    Work,
    /// The tool
    Tool,
}

impl From<FrameArg> for ZsFrame {
    fn from(frame: FrameArg) -> ZsFrame {
        match frame {
            FrameArg::Work => ZsFrame::Work,
            FrameArg::Tool => ZsFrame::Tool,
        }
    }
}

impl Extension {
    /// The message they make.
    pub(super) fn message(&self) -> String {
        match self {
            Extension::Sm => "SM,1".to_owned(),
            Extension::Wd { timeout_ms, level } => format!("WD,{timeout_ms} {level}"),
            Extension::Ac => "AC".to_owned(),
            Extension::Ah => "AH".to_owned(),
            Extension::Io => "IO,1".to_owned(),
            Extension::Mn => "MN".to_owned(),
            Extension::Hi { first, count } => format!("HI,{first} {count}"),
            Extension::Ho { first, count, value } => format!("HO,{first} {count} {value}"),
            Extension::Pr { which } => format!("PR,{which}"),
            Extension::Vl { which } => format!("VL,{which}"),
            Extension::Zs { frame, name, values } => {
                format!("ZS,{} {name} {}", ZsFrame::from(*frame).code(), values.join(" "))
            }
            Extension::Md { mode } => format!("MD,{}", name_to_number(mode, &MODES)),
            Extension::Rt { rate } => format!("RT,{}", name_to_number(rate, &RATES)),
            Extension::Sc { system } => format!("SC,{}", name_to_number(system, &SYSTEMS)),
            Extension::Jg { axis, motion } => format!("JG,{axis} {motion}"),
        }
    }

    /// What is to be done with it.
    pub(super) fn exchange_kind(&self) -> ExchangeKind {
        match self {
            Extension::Sm => ExchangeKind::Status(Decoder::QuickStatus),
            Extension::Ac | Extension::Ah => ExchangeKind::Status(Decoder::Alarms),
            Extension::Hi { .. } => ExchangeKind::Status(Decoder::Values),
            Extension::Pr { .. } | Extension::Vl { .. } => ExchangeKind::Status(Decoder::Position),
            Extension::Mn => ExchangeKind::Status(Decoder::Maintenance),
            Extension::Io => ExchangeKind::Lines,
            Extension::Wd { .. }
            | Extension::Ho { .. }
            | Extension::Zs { .. }
            | Extension::Md { .. }
            | Extension::Rt { .. }
            | Extension::Sc { .. }
            | Extension::Jg { .. } => ExchangeKind::Plain,
        }
    }
}

/// The number of a word, or the word as it is: proto knows which numbers there are.
fn name_to_number(word: &str, words: &[&str]) -> String {
    let place = words.iter().position(|known| word.eq_ignore_ascii_case(known));
    place.map_or_else(|| word.to_owned(), |place| place.to_string())
}
