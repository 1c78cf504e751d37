//! Runs every transcript of `fixtures/transcripts`: as written, with the host's bytes cut at every place, and with the
//! connection lost at every place and a new host afterwards.
//!
//! The form of a transcript is described in `ts3100_tests::transcript`.

use std::path::PathBuf;
use ts3100_tests::notation;
use ts3100_tests::transcript::{Cut, Transcript};

const FEWEST: usize = 25;

pub fn transcripts() -> Vec<(String, Transcript)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../fixtures/transcripts");
    let entries = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "txt"))
        .collect();
    paths.sort();
    let read = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(path).unwrap();
        let transcript = Transcript::read(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        (name, transcript)
    };
    paths.iter().map(read).collect()
}

fn report(failures: &[String]) {
    assert!(
        failures.is_empty(),
        "{} failed\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn every_transcript_holds_as_written() {
    let all = transcripts();
    assert!(all.len() >= FEWEST, "{} transcripts", all.len());
    let failures = all.iter().filter_map(|(name, transcript)| {
        let failure = transcript.run(Cut::Whole).err()?;
        Some(format!("{name}: {failure}"))
    });
    report(&failures.collect::<Vec<_>>());
}

// clause: FRM-05
#[test]
fn every_transcript_holds_however_the_bytes_are_cut() {
    let failures = transcripts().into_iter().filter_map(|(name, transcript)| {
        let cuts = (1..transcript.longest()).map(Cut::At);
        let failure = std::iter::once(Cut::Bytes)
            .chain(cuts)
            .find_map(|cut| transcript.run(cut).err())?;
        Some(format!("{name}: {failure}"))
    });
    report(&failures.collect::<Vec<_>>());
}

// clause: ETH-07 TRN-02 CMD-DL-06
#[test]
fn a_host_that_leaves_in_mid_text_never_spoils_the_next() {
    let mut tried = 0;
    let failures = transcripts()
        .into_iter()
        .filter_map(|(name, transcript)| match transcript.truncate() {
            Ok(count) => {
                tried += count;
                None
            }
            Err(failure) => Some(format!("{name}: {failure}")),
        });
    report(&failures.collect::<Vec<_>>());
    assert!(tried > 500, "only {tried} truncations tried");
}

#[test]
fn the_runner_refuses_what_does_not_hold() {
    let header = "origin: assumed\nclauses: X-1\n";
    let outcome = |body: &str| {
        Transcript::read(&format!("{header}{body}"))
            .unwrap()
            .run(Cut::Whole)
    };
    assert!(outcome("> IP0 SO<CR>\n< IP0 OK<CR>\n").is_ok());
    assert!(
        outcome("> IP0 SO<CR>\n< IP0 NG<CR>\n")
            .unwrap_err()
            .contains("found <STX>OK<CR><ETX>")
    );
    assert!(outcome("> IP0 SO<CR>\n").unwrap_err().contains("unread"));
    assert!(
        outcome("> IP0 SO<CR>\n> IP0 SO<CR>\n")
            .unwrap_err()
            .contains("unread")
    );
    assert!(outcome("< IP0 OK<CR>\n").is_err());
    assert!(Transcript::read("clauses: X\n").unwrap_err().contains("origin"));
    assert!(
        Transcript::read("origin: assumed\n")
            .unwrap_err()
            .contains("clauses")
    );
    assert!(
        Transcript::read("origin: hearsay\nclauses: X\n")
            .unwrap_err()
            .contains("origin")
    );
    for line in [
        "> IP9 SO",
        "? IP0 SO",
        "> IP0 <XYZ>",
        "> IP0 <*3>",
        "@+5",
        "! dance",
        ">> IP0 2g",
        "| x",
    ] {
        let error = Transcript::read(&format!("{header}{line}\n")).unwrap_err();
        assert!(error.starts_with("line 3:"), "{line}: {error}");
    }
}

#[test]
fn the_notation_reads_what_it_writes() {
    let every: Vec<u8> = (0..=255).collect();
    assert_eq!(notation::read_bytes(&notation::write(&every)).unwrap(), every);
}
