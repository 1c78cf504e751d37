//! Tables 5.3 and 5.4 of both editions of the manual, typed from the manuals a second time.
//!
//! The controller's own copy is in `ts3100-proto`; nothing here may be taken from there.

use ts3100_controller::{ControlRight, Dialect, KeySwitch, Port};

/// Command, HOST, IP0; columns TEACHING, INTERNAL, EXT SIG, EXT RS-232C, EXT ETHER; O valid, X invalid,
/// S valid when stopped.
pub const MANUAL: [(&str, &str, &str); 20] = [
    ("RN", "X X X S O", "X X X X S"),
    ("SP", "O O O O O", "O O O O O"),
    ("BR", "O O O O O", "O O O O O"),
    ("SO", "X X X O X", "X X X X O"),
    ("RS", "X X X O X", "X X X X O"),
    ("SL", "X X X O X", "X X X X O"),
    ("UL", "S S S S S", "S S S S S"),
    ("DL", "S S S S S", "S S S S S"),
    ("CA", "O O O O O", "O O O O O"),
    ("SU", "O O O O O", "O O O O O"),
    ("ER", "S S S S S", "S S S S S"),
    ("EU", "O O O O O", "O O O O O"),
    ("EC", "X X X O X", "X X X X O"),
    ("MW", "O O O O O", "O O O O O"),
    ("FD", "O O O O O", "O O O O O"),
    ("SF", "O O O O O", "O O O O O"),
    ("MR", "O O O O O", "O O O O O"),
    ("IW", "X X X O X", "X X X X O"),
    ("VR", "O O O O O", "O O O O O"),
    ("DO", "X X X O X", "X X X X O"),
];

/// The commands that only the SCARA edition has, in the same form.
const SCARA_EDITION: [(&str, &str, &str); 21] = [
    ("SM", "O O O O O", "O O O O O"),
    ("AC", "O O O O O", "O O O O O"),
    ("AH", "O O O O O", "O O O O O"),
    ("IO", "O O O O O", "O O O O O"),
    ("PR", "O O O O O", "O O O O O"),
    ("VL", "O O O O O", "O O O O O"),
    ("MN", "O O O O O", "O O O O O"),
    ("WD", "O O O O O", "O O O O O"),
    ("HI", "X X X O X", "X X X X O"),
    ("HO", "X X X O X", "X X X X O"),
    ("ZS", "X X X O X", "X X X X O"),
    ("MD", "X X X O X", "X X X X O"),
    ("RT", "X X X O X", "X X X X O"),
    ("SC", "X X X O X", "X X X X O"),
    ("JG", "X X X O X", "X X X X O"),
    ("RS,ERR", "X X X O X", "X X X X O"),
    ("MP", "X X X O X", "X X X X O"),
    ("PS", "O O O O O", "O O O O O"),
    ("RM", "O O O O O", "O O O O O"),
    ("ZC", "O O O O O", "O O O O O"),
    ("EM", "X X X O X", "X X X X O"),
];

/// The tables that hold on this arm in this dialect: the SCARA's has RN and SL otherwise, and the print of RN on HOST is a
/// misprint that the field dialect corrects on six axes.
#[must_use]
pub fn tables(is_scara: bool, dialect: Dialect) -> Vec<(&'static str, &'static str, &'static str)> {
    let mut rows = MANUAL.to_vec();
    if is_scara || dialect == Dialect::Field {
        rows[0] = ("RN", "X X X S X", "X X X X S");
    }
    if is_scara {
        rows[5] = ("SL", "S S S S S", "S S S S S");
    }
    if is_scara || dialect == Dialect::Field {
        // ZC is about the third axis of a SCARA.
        rows.extend(
            SCARA_EDITION
                .into_iter()
                .filter(|(letters, ..)| is_scara || *letters != "ZC"),
        );
    }
    rows
}

/// Whether the manual has a command valid; `None` if it has no row, or if the port speaks no protocol.
#[must_use]
pub fn is_valid(
    table: &[(&str, &str, &str)],
    row: &str,
    port: Port,
    (key, right): (KeySwitch, ControlRight),
    running: bool,
) -> Option<bool> {
    let (_, host, ip0) = table.iter().find(|(letters, ..)| *letters == row)?;
    let columns = match port {
        Port::Host => host,
        Port::Ip0 => ip0,
        Port::Com1 | Port::Ip1 | Port::Ip2 | Port::Ip3 => return None,
    };
    let column = match (key, right) {
        (KeySwitch::Teaching, _) => 0,
        (KeySwitch::Internal, _) => 1,
        (KeySwitch::Ext, ControlRight::Sig) => 2,
        (KeySwitch::Ext, ControlRight::Rs232c) => 3,
        (KeySwitch::Ext, ControlRight::Ether) => 4,
    };
    Some(match columns.split(' ').nth(column)? {
        "O" => true,
        "S" => !running,
        _ => false,
    })
}
