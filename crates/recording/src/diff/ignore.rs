//! Parts that are not compared (`--ignore`): named groups for values that always differ between two controllers, and
//! keys of single parts.

use ts3100_proto::command::COMMANDS;

/// Groups: name and keys. `*` matches one word of a key; a key matches all that begin with it.
const GROUPS: [(&str, &[&str]); 4] = [
    (
        "clock",
        &[
            "sf.power-on-time",
            "sf.run-time",
            "eu.*.date",
            "ac.*.date",
            "ah.*.date",
        ],
    ),
    ("versions", &["vr"]),
    ("positions", &["sf.joint", "sf.world", "sf.work", "pr"]),
    ("lines", &["sf.input", "sf.output", "io"]),
];
/// When answers come.
const TIME: &str = "time";
/// The unsolicited SP: whether and when it comes.
const SP: &str = "sp";
/// First words of a key besides commands.
const OTHERS: [&str; 3] = ["text", "reply", "file"];

/// Parts that are not compared.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ignore {
    patterns: Vec<String>,
    /// When answers come.
    pub time: bool,
    /// Whether SP comes unsolicited.
    pub sp: bool,
}

/// A word that is neither a group nor a key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected {expected}, or a key like sf.servo, su.status or eu.*.date, found `{found}`")]
pub struct IgnoreError {
    /// The groups.
    expected: String,
    /// The word.
    found: String,
}

impl Ignore {
    /// Adds groups and keys.
    ///
    /// # Errors
    /// The first word that is neither.
    pub fn add(&mut self, words: &[String]) -> Result<(), IgnoreError> {
        for word in words {
            match word.as_str() {
                TIME => self.time = true,
                SP => self.sp = true,
                word => self.patterns.extend(patterns(word)?),
            }
        }
        Ok(())
    }

    /// Whether a part does not count.
    pub fn covers(&self, key: &str) -> bool {
        let covers = |pattern: &String| {
            let mut words = key.split('.');
            pattern
                .split('.')
                .all(|wanted| words.next().is_some_and(|word| wanted == "*" || wanted == word))
        };
        self.patterns.iter().any(covers)
    }
}

/// The keys of a group, or the key itself.
fn patterns(word: &str) -> Result<Vec<String>, IgnoreError> {
    if let Some((_, keys)) = GROUPS.iter().find(|(name, _)| *name == word) {
        return Ok(keys.iter().map(ToString::to_string).collect());
    }
    let first = word.split('.').next().unwrap_or_default();
    let mut known = COMMANDS.iter().map(|row| row.letters).chain(OTHERS);
    if known.any(|known| known.to_ascii_lowercase() == first) && !word.split('.').any(str::is_empty) {
        return Ok(vec![word.to_owned()]);
    }
    let groups = GROUPS.iter().map(|(name, _)| *name);
    let groups: Vec<&str> = groups.chain([TIME, SP]).collect();
    Err(IgnoreError {
        expected: groups.join(", "),
        found: word.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ignoring(words: &[&str]) -> Result<Ignore, IgnoreError> {
        let words: Vec<String> = words.iter().map(ToString::to_string).collect();
        let mut ignore = Ignore::default();
        ignore.add(&words)?;
        Ok(ignore)
    }

    #[test]
    fn groups_and_keys_cover_what_begins_with_them() {
        let ignore = ignoring(&["clock", "positions", "su.ovrd"]).unwrap();
        for key in ["sf.power-on-time", "eu.12.date", "sf.joint.3", "su.ovrd", "pr.1"] {
            assert!(ignore.covers(key), "{key}");
        }
        for key in [
            "sf.servo",
            "eu.12.alarm",
            "eu.count",
            "su.status",
            "sf.jointed",
            "vr.1",
            "reply",
        ] {
            assert!(!ignore.covers(key), "{key}");
        }
        assert!(!Ignore::default().covers("sf.servo"));
        assert!(ignoring(&["time"]).unwrap().time);
        assert!(ignoring(&["sp"]).unwrap().sp);
    }

    #[test]
    fn a_word_that_means_nothing_is_refused() {
        for word in ["", "everything", "xx.servo", "sf.", ".sf", "SF"] {
            let error = ignoring(&[word]).unwrap_err().to_string();
            assert!(
                error.contains("clock, versions, positions, lines, time, sp"),
                "{error}"
            );
        }
    }
}
