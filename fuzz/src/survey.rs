//! Fuzzes the files of surveys. A wrong checksum is corrected first: it detects what somebody changed by accident, and not a
//! file that was made to do harm.
//!
//! A file is refused with a message, or it is written and read again as it is, does not differ from itself, and its options
//! are set or refused with a message.

use ts3100_controller::{Config, Dialect};
use ts3100_driver::tcp::LinkOptions;
use ts3100_emulator::config::set_option;
use ts3100_survey::ledger::{assumed, remaining};
use ts3100_survey::{Comparison, Report, ReportError, compare};

fn read(text: &str) -> Option<Report> {
    match Report::read(text) {
        Ok(report) => Some(report),
        Err(ReportError::Checksum { found, computed }) if !found.is_empty() => {
            let corrected = text.replacen(&found, &computed, 1);
            Report::read(&corrected).ok()
        }
        Err(refused) => {
            assert!(!refused.to_string().is_empty(), "{refused:?}");
            None
        }
    }
}

/// Reads the file of a survey.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let Some(report) = read(&String::from_utf8_lossy(data)) else {
        return;
    };
    let written = report.write();
    let again = Report::read(&written);
    assert_eq!(again.as_ref(), Ok(&report), "{written}");
    assert_eq!(compare(&report, &report), Comparison::default());
    assert!(remaining(&report).count() <= assumed().count());
    let (mut options, mut links) = (Config::new(Dialect::Field).options, LinkOptions::default());
    for (key, value) in report.options() {
        if let Err(refused) = set_option(&mut options, &mut links, key, value) {
            assert!(!refused.to_string().is_empty(), "{key}");
        }
    }
}
