//! The sections of the kinds of faults, with an example each.

use super::{code, table};
use std::fmt::Write as _;
use ts3100_controller::faults::{CAUSES, FaultKind, KINDS, Parameter};

/// An example of each kind: the fault, and what it does.
const EXAMPLES: [(&str, &str); 20] = [
    (
        "no-reply:command=SO",
        "The first SO is obeyed, but its reply is lost.",
    ),
    (
        "late-reply:command=SU,delay=1500",
        "The first SU is answered 1.5 s later than usual.",
    ),
    ("ng:command=SO,times=2", "SO gets NG twice, then it works."),
    ("wrong-reply:command=SO", "SO is answered with an empty file."),
    ("lost-etx:command=SU", "The reply to SU never ends."),
    (
        "flipped-bit:command=SO,byte=1,bit=0",
        "The reply to SO is NK, because the lowest bit of its first letter is inverted.",
    ),
    (
        "split-bytes:command=SU,size=10,pause=30",
        "The reply to SU arrives in portions of 10 bytes, one every 30 ms.",
    ),
    (
        "merged-texts:channel=IP1",
        "A PRINT on IP1 waits for the next one, and both arrive in one packet.",
    ),
    ("duplicate-text:channel=IP1", "One PRINT on IP1 arrives twice."),
    (
        "reset-mid-text:command=SU,bytes=20",
        "The connection is reset after 20 bytes of the reply to SU.",
    ),
    (
        "half-open:command=SU,lasts=1500",
        "The robot is silent for 1.5 s after SU, then the connection is reset.",
    ),
    (
        "slow-line:command=SU,speed=1200",
        "The reply to SU arrives byte by byte, as on a line of 1200 bit/s.",
    ),
    (
        "drive-full:free=20",
        "The first download of more than 20 bytes gets NG.",
    ),
    (
        "power-loss:command=DL,block=1",
        "The robot loses power during a download, and starts again.",
    ),
    ("alarm:command=SU,number=4-101", "SU raises alarm 4-101."),
    (
        "emergency-stop:command=SO,release=300",
        "SO triggers the emergency stop, which is released after 300 ms.",
    ),
    (
        "servo-failure:command=RN,delay=100",
        "The servo fails 100 ms after the start of the program.",
    ),
    (
        "key-turned:delay=100,back=300",
        "100 ms after RN, someone turns the key switch to TEACHING, and back after 300 ms.",
    ),
    (
        "parity-error:channel=HOST,character=1",
        "The second character on HOST has a parity error.",
    ),
    (
        "lost-record:channel=IP1",
        "INPUT on IP1 never gets the first record of its peer.",
    ),
];

/// A section for each kind.
pub fn kinds() -> String {
    let overview = table(
        ["Kind", "What it does"],
        KINDS
            .iter()
            .map(|kind| [format!("[`{0}`](#{0})", kind.name), kind.summary.to_owned()]),
    );
    let sections: Vec<String> = KINDS.iter().map(|kind| section(kind)).collect();
    format!("{overview}\n\n{}", sections.join("\n\n"))
}

fn section(kind: &FaultKind) -> String {
    let mut text = format!("### {}\n\n{}\n", kind.name, kind.summary);
    let points: Vec<&str> = kind.points.iter().map(|point| point.description()).collect();
    write!(text, "\n**Waits for:** {}", points.join("; ")).unwrap();
    if let Some(command) = kind.command {
        write!(text, "; `command={command}` by default").unwrap();
    }
    if let Some(block) = kind.block {
        write!(text, "; `block={block}` by default").unwrap();
    }
    write!(text, ".\n\n**A robust host:** {}\n", kind.remedy).unwrap();
    if !kind.parameters.is_empty() {
        let rows = table(
            ["Parameter", "Values", "Default", "Meaning"],
            kind.parameters.iter().map(parameter),
        );
        write!(text, "\n{rows}\n").unwrap();
    }
    let example = EXAMPLES.iter().find(|(spec, _)| {
        spec.strip_prefix(kind.name)
            .is_some_and(|rest| rest.starts_with(':'))
    });
    let (spec, effect) = example.expect("an example of each kind");
    write!(
        text,
        "\n<!-- ci:commands --ports auto -->\n```sh\nts3100 serve --fault '{spec}'\n```\n\n{effect}"
    )
    .unwrap();
    text
}

fn parameter(parameter: &Parameter) -> [String; 4] {
    let values = parameter.value_type.description();
    [
        code(parameter.name),
        values.trim_end_matches(',').replace('<', "\\<"),
        parameter.default.map_or("-".to_owned(), code),
        parameter.description.to_owned(),
    ]
}

/// Which findings each kind of fault can cause.
pub fn causes() -> String {
    let list = |names: &mut dyn Iterator<Item = String>| names.collect::<Vec<_>>().join(", ");
    table(
        ["Faults", "How far", "Findings", "Why"],
        CAUSES.iter().map(|row| {
            let rules = row.rules.iter();
            let rules = list(&mut rules.map(|rule| format!("[`{0}`](findings.md#{0})", rule.id)));
            [
                list(&mut row.kinds.iter().map(|kind| format!("`{kind}`"))),
                row.reach.description().to_owned(),
                if rules.is_empty() { "all".to_owned() } else { rules },
                row.reason.to_owned(),
            ]
        }),
    )
}
