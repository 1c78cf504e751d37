//! The lines that have a name: those by which other equipment operates the controller, and the outputs of the hands.
//!
//! The manual gives the names of the system signals (SF-31, SF-38). The outputs of a hand are named after its statements. The
//! effect of a line is in `robot::system_signals` and `robot::requests`.

use super::signals::IoKind;

/// Derives constants and a table of names from rows `NAME = number`.
macro_rules! line_names {
    ($(#[$doc:meta])* $direction:ident { $($name:ident = $number:literal,)* }) => {
        $(#[$doc])*
        pub(crate) mod $direction {
            $(pub const $name: u16 = $number;)*
            /// Number and name of each, in the order of the numbers.
            pub(super) const NAMES: &[(u16, &str)] = &[$(($number, stringify!($name)),)*];
        }
    };
}

line_names! {
    /// Numbers of the system inputs (SF-31).
    din {
        STROBE = 249,
        PRG_RST = 250,
        STEP_RST = 251,
        CYC_RST = 252,
        DO_RST = 253,
        ALM_RST = 254,
        RUN = 255,
        EX_SVON = 256,
        STOP = 257,
        CYCLE = 258,
        LOW_SPD = 259,
        BREAK = 260,
        SVOFF = 261,
    }
}

line_names! {
    /// Numbers of the outputs of the hands (assumed; scol.md 3.3 leaves it open) and of the system outputs (SF-38).
    dout {
        OPEN1 = 201,
        CLOSE1 = 202,
        OPEN2 = 203,
        CLOSE2 = 204,
        EMG_ST = 249,
        SV_RDY = 250,
        ACK = 251,
        TEACH = 252,
        INT = 253,
        EXTSIG = 254,
        EXTHOST = 255,
        SYS_RDY = 256,
        AUTORUN = 257,
        CYC_END = 258,
        LOW_ST = 259,
        CYC_ST = 260,
        BT_ALM = 261,
        ALARM = 262,
    }
}

/// Hand n opens by the first output of its pair and closes by the second (assumed; scol.md 3.3 leaves it open).
pub(crate) const HANDS: [(u16, u16); 2] = [(dout::OPEN1, dout::CLOSE1), (dout::OPEN2, dout::CLOSE2)];

/// The name of a line: `STROBE`, `OPEN1`; `None` for one that has only a number.
pub fn line_name(kind: IoKind, line: u16) -> Option<&'static str> {
    let names = match kind {
        IoKind::Input => din::NAMES,
        IoKind::Output => dout::NAMES,
    };
    let found = names.binary_search_by_key(&line, |(number, _)| *number).ok()?;
    names.get(found).map(|(_, name)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_found_by_direction_and_number() {
        for (kind, line, name) in [
            (IoKind::Input, 249, Some("STROBE")),
            (IoKind::Output, 249, Some("EMG_ST")),
            (IoKind::Input, 261, Some("SVOFF")),
            (IoKind::Output, 204, Some("CLOSE2")),
            (IoKind::Input, 201, None),
            (IoKind::Input, 262, None),
            (IoKind::Output, 1, None),
        ] {
            assert_eq!(line_name(kind, line), name, "{kind:?} {line}");
        }
        for names in [din::NAMES, dout::NAMES] {
            assert!(names.is_sorted_by_key(|(number, _)| number));
        }
    }
}
