//! `ts3100 survey`, `conform` and `fidelity` as commands, against an emulator with sockets.

use super::support::{Serve, expect_code, run, stderr, stdout};
use ts3100_tests::testing::TempDir;

#[test]
fn a_survey_is_a_file_that_another_emulator_takes() {
    let directory = TempDir::new("survey");
    let path = directory.path().join("robot.toml");
    let path = path.to_str().unwrap();
    let serve = Serve::ready(&[
        "serve",
        "--set",
        "channel.second=replace",
        "--set",
        "su.layout=six-records",
    ]);
    let address = serve.address(0);
    let only = "--only=stx,status-form,second-connection";
    let output = run(&["survey", &address, only, "--out", path]);
    expect_code(&output, 0);
    let said = stdout(&output);
    assert!(said.contains("sends SU<CR><ETX>"), "what will be sent: {said}");
    assert!(
        said.contains("variation second-connection      the second replaces it"),
        "{said}"
    );
    let shown = stdout(&run(&["survey", "show", path]));
    assert!(
        shown.contains("Which form has SU?") && shown.contains("six records"),
        "{shown}"
    );
    let page = stdout(&run(&["survey", "show", path, "--html"]));
    assert!(
        page.starts_with("<!doctype html>") && page.contains("&lt;STX&gt;SU"),
        "{page}"
    );
    expect_code(&run(&["survey", "diff", path, path]), 0);

    let like = Serve::ready(&["serve", "--like", path]);
    let output = run(&[
        "conform",
        &like.address(0),
        "--only=status-form,second-connection",
    ]);
    expect_code(&output, 0);
    let xml = directory.path().join("conform.xml");
    let words = [
        "conform",
        &like.address(0),
        "--only=status-form",
        "--strict",
        "--junit",
        xml.to_str().unwrap(),
    ];
    expect_code(&run(&words), 1);
    let xml = std::fs::read_to_string(xml).unwrap();
    assert!(
        xml.contains("failures=\"1\"") && xml.contains("classname=\"ts3100.conform.look\""),
        "{xml}"
    );

    let changed = std::fs::read_to_string(path)
        .unwrap()
        .replace("six-records", "one-record");
    std::fs::write(path, changed).unwrap();
    let output = run(&["serve", "--ports", "auto", "--like", path]);
    expect_code(&output, 2);
    assert!(
        stderr(&output).contains("changed after it was made"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_controller_without_ip1_answers_the_rest() {
    let serve = Serve::ready(&["serve", "--servo-on"]);
    let output = run(&[
        "survey",
        &serve.address(0),
        "--ask=program",
        "--only=value,print-without-peer,print-numbers,buffer-reset",
        "--ip1=1",
    ]);
    expect_code(&output, 0);
    let said = stdout(&output);
    assert!(
        said.contains("refused   print-numbers          cannot connect to 127.0.0.1:1"),
        "{said}"
    );
    assert!(said.contains("--ip1 gives its port"), "{said}");
    assert!(
        said.contains("2 manual, 0 variation, 0 unknown, 2 refused"),
        "{said}"
    );
}

#[test]
fn nothing_is_sent_without_consent_or_to_nobody() {
    let serve = Serve::ready(&["serve"]);
    let address = serve.address(0);
    let output = run(&["survey", &address, "--dry-run"]);
    expect_code(&output, 0);
    assert!(stdout(&output).contains("look (changes nothing):"));
    // stdin is closed: nobody types the word.
    let output = run(&["survey", &address, "--ask", "motion"]);
    expect_code(&output, 2);
    assert!(
        stderr(&output).contains("nothing was sent"),
        "{}",
        stderr(&output)
    );
    assert!(!stdout(&output).contains("manual    "));
    let output = run(&["survey", &address, "--only", "stxx"]);
    expect_code(&output, 2);
    assert!(
        stderr(&output).contains("did you mean `stx`?"),
        "{}",
        stderr(&output)
    );
    // IP1 answers no command.
    let output = run(&["survey", &serve.address(1), "--only", "stx"]);
    expect_code(&output, 3);
    assert!(stderr(&output).contains("no answer to SU"), "{}", stderr(&output));
}

#[test]
fn what_is_known_is_counted_and_findings_name_what_a_run_rested_on() {
    let counts = stdout(&run(&["fidelity"]));
    assert!(
        counts.lines().count() == 5 && counts.contains(" assumed"),
        "{counts}"
    );
    let list = stdout(&run(&["fidelity", "--list"]));
    assert!(list.contains("text-5     assumed   lower-case"), "{list}");
    let directory = TempDir::new("survey");
    let path = directory.path().join("findings.json");
    let serve = Serve::ready(&["serve", "--findings", path.to_str().unwrap()]);
    serve.host(&["fd"]);
    serve.signal("TERM");
    let document = std::fs::read_to_string(path).unwrap();
    let document: serde_json::Value = serde_json::from_str(&document).unwrap();
    assert_eq!(document["assumptions"][0]["id"], "op-16", "{document}");
    assert_eq!(
        document["assumptions"][0]["survey"],
        "feed-hold, feed-hold-motion"
    );
}
