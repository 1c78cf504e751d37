//! The tables of commands and permissions.

use super::{code, table};
use ts3100_proto::command::{Answer, COMMANDS, CommandRow, Source};
use ts3100_proto::permission::Permission;

/// Every command with the bytes of an example.
pub fn commands() -> String {
    let headings = [
        "Command",
        "Example",
        "Bytes of the example",
        "Reply",
        "Valid",
        "From",
    ];
    table(headings, COMMANDS.iter().map(command))
}

fn command(row: &CommandRow) -> [String; 6] {
    let bytes = match row.letters {
        // The contents of a file and its end are not part of the example.
        "FL" => "`02 46 4C 2C` ... `1A 03`".to_owned(),
        _ => {
            let text = [&[2], row.example.as_bytes(), &[13, 3]].concat();
            let bytes: Vec<String> = text.iter().map(|byte| format!("{byte:02X}")).collect();
            code(&bytes.join(" "))
        }
    };
    let reply = match (row.letters, row.answer) {
        ("OK" | "NG", _) => "none",
        (_, Answer::Acknowledge) => "OK",
        (_, Answer::File | Answer::Status) => "FL",
    };
    let valid = match row.permission.map(|permission| permission.ip0) {
        Some([.., Permission::Valid]) => "O",
        Some([.., Permission::WhenStopped]) => "S",
        Some([.., Permission::Invalid]) => "X",
        None => "-",
    };
    let from = match row.source {
        Source::Manual => "manual",
        Source::ScaraManual => "SCARA edition",
    };
    [
        code(row.form),
        code(row.example),
        bytes,
        reply.to_owned(),
        valid.to_owned(),
        from.to_owned(),
    ]
}

/// The file of the built-in permission tables, as `--permissions` reads them.
pub fn permissions() -> String {
    let text = include_str!("../../../crates/proto/data/permissions.txt");
    format!("```text\n{}\n```", text.trim_matches('\n'))
}
