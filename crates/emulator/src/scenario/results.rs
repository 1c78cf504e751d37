//! The outcome of a scenario, for people and as JUnit XML: one test case for each expectation and for each step with a
//! condition.

use crate::reports::escape;
use std::fmt::Write as _;
use std::time::Duration;

/// What came of one entry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// As expected.
    Held,
    /// Not as expected: what was expected and what came.
    Failed(String),
    /// It had no occasion.
    Skipped(String),
}

/// One entry of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EntryResult {
    /// Its name.
    pub name: String,
    /// Its line.
    pub line: usize,
    /// Virtual time from the beginning to its verdict.
    pub time: Duration,
    /// What came of it.
    pub verdict: Verdict,
}

/// What came of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioOutcome {
    /// Its name.
    pub name: String,
    /// How long it was played, in virtual time.
    pub time: Duration,
    /// Its entries in the order of the file.
    pub entries: Vec<EntryResult>,
}

impl ScenarioOutcome {
    /// Whether something was not as expected.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.count(|verdict| matches!(verdict, Verdict::Failed(_))) > 0
    }

    /// What was not as expected, a line each.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.entries.iter().filter_map(|entry| match &entry.verdict {
            Verdict::Failed(reason) => Some(format!("line {}, {}: {reason}", entry.line, entry.name)),
            Verdict::Held | Verdict::Skipped(_) => None,
        })
    }

    fn count(&self, is: impl Fn(&Verdict) -> bool) -> usize {
        self.entries.iter().filter(|entry| is(&entry.verdict)).count()
    }

    /// As JUnit XML. Times are virtual seconds, with three decimals: more is none to the schema that CIs use.
    #[must_use]
    pub fn junit(&self) -> String {
        let failures = self.count(|verdict| matches!(verdict, Verdict::Failed(_)));
        let skipped = self.count(|verdict| matches!(verdict, Verdict::Skipped(_)));
        let name = escape(&self.name);
        let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
        // Writing to a String cannot fail.
        let _ = writeln!(
            xml,
            "  <testsuite name=\"{name}\" tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\" time=\"{:.3}\">",
            self.entries.len(),
            self.time.as_secs_f64()
        );
        for entry in &self.entries {
            let head = format!(
                "    <testcase classname=\"{name}\" name=\"{}\" time=\"{:.3}\"",
                escape(&entry.name),
                entry.time.as_secs_f64()
            );
            let _ = match &entry.verdict {
                Verdict::Held => writeln!(xml, "{head}/>"),
                Verdict::Failed(reason) => writeln!(
                    xml,
                    "{head}>\n      <failure message=\"{}\">line {}</failure>\n    </testcase>",
                    escape(reason),
                    entry.line
                ),
                Verdict::Skipped(reason) => {
                    writeln!(
                        xml,
                        "{head}>\n      <skipped message=\"{}\"/>\n    </testcase>",
                        escape(reason)
                    )
                }
            };
        }
        xml.push_str("  </testsuite>\n</testsuites>\n");
        xml
    }
}
