//! The generated regions of the book: the tables of `docs` that repeat what the code has as a table.
//!
//! A region lies between `<!-- generated: NAME -->` and `<!-- end -->`. `tests/suites/docs.rs` compares each with what
//! its function here returns, and rewrites them on request. Begin with [`REGIONS`].

mod command_line;
mod configuration;
mod controller;
mod cookbook;
mod faults;
mod protocol;
mod survey;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// One generated region.
#[derive(Debug)]
pub struct Region {
    /// Page, from `docs` on.
    pub page: &'static str,
    /// Name in the mark.
    pub name: &'static str,
    /// Returns the text between the marks, without the line ends around it.
    pub text: fn() -> String,
}

/// The page before the book, from `docs` on.
pub const README: &str = "../README.md";

/// Every region of the book and of the README.
pub const REGIONS: &[Region] = &[
    Region {
        page: "how-to/rust.md",
        name: "rust-example",
        text: rust_example,
    },
    Region {
        page: "reference/protocol/commands.md",
        name: "commands",
        text: protocol::commands,
    },
    Region {
        page: "reference/protocol/permissions.md",
        name: "permissions",
        text: protocol::permissions,
    },
    Region {
        page: "reference/alarms.md",
        name: "alarms",
        text: controller::alarms,
    },
    Region {
        page: "reference/models.md",
        name: "models",
        text: controller::models,
    },
    Region {
        page: "reference/findings.md",
        name: "findings",
        text: controller::findings,
    },
    Region {
        page: "reference/survey.md",
        name: "questions",
        text: survey::questions,
    },
    Region {
        page: "explanation/fidelity.md",
        name: "evidence",
        text: survey::evidence,
    },
    Region {
        page: README,
        name: "trust",
        text: survey::trust,
    },
    Region {
        page: "explanation/fidelity.md",
        name: "reasons",
        text: survey::reasons,
    },
    Region {
        page: "explanation/fidelity.md",
        name: "clauses",
        text: survey::clauses,
    },
    Region {
        page: "reference/options.md",
        name: "options",
        text: controller::options,
    },
    Region {
        page: "reference/diagnostics.md",
        name: "diagnostics",
        text: diagnostics,
    },
    Region {
        page: "reference/command-line.md",
        name: "command-line",
        text: command_line::commands,
    },
    Region {
        page: "reference/configuration.md",
        name: "configuration",
        text: configuration::all,
    },
    Region {
        page: "reference/several-robots.md",
        name: "keys-of-the-process",
        text: configuration::keys_of_the_process,
    },
    Region {
        page: "reference/conditions.md",
        name: "conditions",
        text: controller::conditions,
    },
    Region {
        page: "reference/scenarios.md",
        name: "scenario-keys",
        text: configuration::scenario_keys,
    },
    Region {
        page: "reference/scol/test.md",
        name: "test-keys",
        text: configuration::test_keys,
    },
    Region {
        page: "reference/faults.md",
        name: "fault-keys",
        text: configuration::fault_keys,
    },
    Region {
        page: "reference/faults.md",
        name: "faults",
        text: faults::kinds,
    },
    Region {
        page: "reference/faults.md",
        name: "fault-causes",
        text: faults::causes,
    },
    Region {
        page: "explanation/variation.md",
        name: "variations",
        text: controller::variations,
    },
    Region {
        page: cookbook::PAGE,
        name: "pallet",
        text: cookbook::pallet,
    },
    Region {
        page: cookbook::PAGE,
        name: "vision",
        text: cookbook::vision,
    },
    Region {
        page: cookbook::PAGE,
        name: "two_tasks",
        text: cookbook::two_tasks,
    },
    Region {
        page: cookbook::PAGE,
        name: "monitors",
        text: cookbook::monitors,
    },
    Region {
        page: cookbook::PAGE,
        name: "recovery",
        text: cookbook::recovery,
    },
    Region {
        page: cookbook::PAGE,
        name: "subprograms",
        text: cookbook::subprograms,
    },
    Region {
        page: cookbook::PAGE,
        name: "hand",
        text: cookbook::hand,
    },
    Region {
        page: cookbook::PAGE,
        name: "conveyor",
        text: cookbook::conveyor,
    },
];

const END: &str = "<!-- end -->";

fn mark(name: &str) -> String {
    format!("<!-- generated: {name} -->\n")
}

/// The example of the Rust page, which the suites compile and run.
fn rust_example() -> String {
    let source = include_str!("../../clients/rust-example/tests/robot.rs");
    let example = source.split_once("\n\n").map_or(source, |(_, example)| example);
    format!("```rust\n{}\n```", example.trim_end())
}

/// A generated file: the path below `docs`, and the function that returns the text.
pub type GeneratedFile = (&'static str, fn() -> String);

/// Files of the book that are generated as a whole.
pub const FILES: &[GeneratedFile] = &[
    ("reference/config.schema.json", configuration::schema),
    ("reference/scenario.schema.json", configuration::scenario_schema),
    ("reference/faults.schema.json", configuration::faults_schema),
    ("reference/test.schema.json", configuration::test_schema),
];

/// Every diagnostic of `ts3100 check`.
fn diagnostics() -> String {
    table(
        ["Code", "Name", "Severity", "Meaning"],
        scol_mini::DIAGNOSTICS.iter().map(|kind| {
            let severity = match kind.severity {
                scol_mini::Severity::Error => "error",
                scol_mini::Severity::Warning => "warning",
            };
            let name = format!("[{0}](#{0})", kind.name);
            [
                kind.code.to_owned(),
                name,
                severity.to_owned(),
                kind.title.to_owned(),
            ]
        }),
    )
}

/// The directory of the book.
#[must_use]
pub fn book() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs")
}

/// The names of the regions of a page, in order.
pub fn names(page: &str) -> impl Iterator<Item = &str> {
    page.lines().filter_map(|line| {
        let name = line.strip_prefix("<!-- generated: ")?;
        name.strip_suffix(" -->")
    })
}

/// The text of a region of a page; `None` without its marks.
#[must_use]
pub fn region<'a>(page: &'a str, name: &str) -> Option<&'a str> {
    let (_, after) = page.split_once(&mark(name))?;
    let (text, _) = after.split_once(END)?;
    Some(text.trim_end_matches('\n'))
}

/// The page with another text in a region; `None` without its marks.
#[must_use]
pub fn replace(page: &str, name: &str, text: &str) -> Option<String> {
    let mark = mark(name);
    let (before, after) = page.split_once(&mark)?;
    let (_, after) = after.split_once(END)?;
    Some(format!("{before}{mark}{text}\n{END}{after}"))
}

/// A table: the row of headings, then the rows. `|` in a cell is escaped.
fn table<const N: usize>(headings: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |", cells.join(" | "))
    };
    let mut text = line(&headings.map(str::to_owned));
    write!(text, "\n|{}", "---|".repeat(N)).unwrap();
    for row in rows {
        write!(text, "\n{}", line(&row)).unwrap();
    }
    text
}

/// As code, in backticks.
fn code(text: &str) -> String {
    format!("`{text}`")
}
