//! The book is complete: its generated regions are what the code's tables say, and what else is written about each row
//! has its place.
//!
//! Whether what a row says is true is tested in the suite of its subject. To rewrite the regions, and then review the
//! difference:
//!
//! ```text
//! cargo test -p ts3100-tests -- --ignored bless_docs
//! git diff docs
//! ```

use scol_mini::DIAGNOSTICS;
use std::fs;
use std::path::PathBuf;
use ts3100_controller::alarm::ALARMS;
use ts3100_controller::findings::RULES;
use ts3100_emulator::config::OPTIONS;
use ts3100_tests::reference::{self, FILES, README, REGIONS};

fn document(name: &str) -> String {
    let path = reference::book().join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Every page of the book, below `docs`.
fn pages() -> Vec<PathBuf> {
    let pages = super::house::files(&reference::book(), "md");
    assert!(pages.len() > 50, "the book was not found");
    pages
}

#[test]
fn every_generated_region_is_up_to_date() {
    for region in REGIONS {
        let page = document(region.page);
        let found = reference::region(&page, region.name);
        let found = found.unwrap_or_else(|| panic!("{}: no region {}", region.page, region.name));
        let expected = (region.text)();
        for (found, expected) in found.lines().zip(expected.lines()) {
            assert_eq!(found, expected, "docs/{}: {}", region.page, region.name);
        }
        assert_eq!(found.lines().count(), expected.lines().count(), "{}", region.page);
    }
}

#[test]
fn every_region_of_the_book_is_generated() {
    let mut found = 0;
    let readme = reference::book().join(README);
    for path in pages().into_iter().chain([readme]) {
        let page = fs::read_to_string(&path).unwrap();
        for name in reference::names(&page) {
            let known = REGIONS
                .iter()
                .any(|region| region.name == name && path.ends_with(region.page));
            assert!(known, "{}: nothing generates {name}", path.display());
            found += 1;
        }
    }
    assert_eq!(found, REGIONS.len());
}

#[test]
fn every_generated_file_is_up_to_date() {
    for (path, text) in FILES {
        let (found, expected) = (document(path), text());
        let mut lines = found.lines().zip(expected.lines());
        let first = lines.find(|(found, expected)| found != expected);
        assert!(
            found == expected,
            "docs/{path} is stale; cargo test -p ts3100-tests -- --ignored bless_docs writes it. First difference: {first:?}"
        );
    }
}

#[test]
#[ignore = "rewrites the generated regions of docs; review the difference"]
fn bless_docs() {
    for region in REGIONS {
        let page = document(region.page);
        let page = reference::replace(&page, region.name, &(region.text)());
        let page = page.unwrap_or_else(|| panic!("{}: no region {}", region.page, region.name));
        fs::write(reference::book().join(region.page), page).unwrap();
    }
    for (path, text) in FILES {
        fs::write(reference::book().join(path), text()).unwrap();
    }
}

#[test]
fn every_alarm_has_its_section() {
    let page = document("reference/alarms.md");
    for alarm in ALARMS {
        let section = format!("\n### Alarm {}\n", alarm.number());
        assert!(page.contains(&section), "alarms.md misses {section}");
    }
}

#[test]
fn every_option_has_its_section() {
    let (page, fidelity) = (
        document("reference/options.md"),
        document("explanation/fidelity.md"),
    );
    for row in OPTIONS.iter() {
        let key = row.key;
        let section = format!("\n### {key}\n");
        assert!(page.contains(&section), "options.md misses the section of {key}");
        // A heading has an anchor of its own, which has no dots.
        let anchor = format!("<a id=\"{key}\"></a>");
        assert!(!key.contains('.') || page.contains(&anchor), "{key}");
        assert!(fidelity.contains(&format!("`{key}")), "fidelity.md misses {key}");
    }
}

#[test]
fn every_diagnostic_has_its_section() {
    let page = document("reference/diagnostics.md");
    for kind in DIAGNOSTICS {
        let section = format!("\n<a id=\"{}\"></a>\n\n### {}\n", kind.code, kind.name);
        assert!(page.contains(&section), "diagnostics.md misses {}", kind.name);
    }
}

#[test]
fn every_rule_names_clauses_that_exist() {
    let table = document("clauses.tsv");
    let clauses: Vec<&str> = table.lines().filter_map(|line| line.split('\t').next()).collect();
    for rule in RULES {
        let (_, named) = rule.source.split_once('[').unwrap();
        for name in named.trim_end_matches(']').split(", ") {
            let decision = name
                .strip_prefix('D')
                .is_some_and(|number| number.parse::<u8>().is_ok());
            assert!(
                decision || clauses.contains(&name),
                "{}: no clause {name}",
                rule.id
            );
        }
    }
}

/// A link to a page that does not exist opens nothing, and a page without a link is found by nobody.
#[test]
fn the_summary_lists_every_page_once() {
    let summary = document("SUMMARY.md");
    let mut linked: Vec<PathBuf> = summary
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .map(|link| reference::book().join(link))
        .collect();
    linked.sort();
    let mut pages = pages();
    pages.retain(|page| !page.ends_with("SUMMARY.md"));
    pages.sort();
    assert_eq!(linked, pages);
}
