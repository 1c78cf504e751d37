//! `ts3100 survey`, `conform` and `fidelity` as commands, against an emulator with sockets.

use super::support::{Serve, expect_code, kill, run, stderr, stdout, ts3100};
use serde_json::Value;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::Stdio;
use ts3100_controller::{Config, Controller, Dialect};
use ts3100_driver::snapshot::to_json_line;
use ts3100_tests::testing::TempDir;

/// A host that pauses long enough is not early because a restored snapshot has moved time back.
#[test]
fn a_recording_in_which_time_begins_again_proves_nothing_about_pauses() {
    let directory = TempDir::new("survey");
    let mut robot = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
    while robot.poll_output().is_some() {}
    let restored = to_json_line(&robot);
    let exchange = "> IP0 SO<CR>\n< IP0 OK<CR>\n";
    let text = |between: &str| {
        format!("origin: observed, by hand\n! connect IP0\n@+5s\n{exchange}{between}\n@+100ms\n{exchange}")
    };
    for (between, is_early) in [
        ("", false),
        (&*format!("! restore 40us {restored}"), false),
        (&*format!("! begin 40us IP0 {restored}"), false),
        ("! reset\n! connect IP0", false),
        ("@+10ms\n> IP0 SO<CR>\n< IP0 OK<CR>", true),
    ] {
        let path = directory.file("day.txt", text(between));
        let output = run(&["survey", "infer", &path]);
        expect_code(&output, 0);
        let said = stdout(&output);
        let pause = said
            .lines()
            .any(|line| line.split_whitespace().nth(1) == Some("pause"));
        assert_eq!(pause, is_early, "{between}: {said}");
    }
}

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
fn a_question_that_one_file_has_not_asked_is_no_difference() {
    let directory = TempDir::new("survey");
    let serve = Serve::ready(&["serve"]);
    let survey = |name: &str, questions: &str| {
        let path = directory.path().join(name).to_str().unwrap().to_owned();
        let only = format!("--only={questions}");
        expect_code(&run(&["survey", &serve.address(0), &only, "--out", &path]), 0);
        path
    };
    let all = survey("all.toml", "stx,status-form,second-connection");
    let fewer = survey("fewer.toml", "stx,status-form");
    for files in [[&all, &fewer], [&fewer, &all]] {
        let output = run(&["survey", "diff", files[0], files[1]]);
        expect_code(&output, 0);
        let expected = format!("0 differences\nanswered in {all} only: second-connection\n");
        assert_eq!(stdout(&output), expected);
    }
}

#[test]
fn a_controller_without_ip1_answers_the_rest() {
    let serve = Serve::ready(&["serve", "--servo-on"]);
    let directory = TempDir::new("survey");
    let path = directory.path().join("robot.toml");
    let output = run(&[
        "survey",
        &serve.address(0),
        "--ask=program",
        "--only=value,print-without-peer,print-numbers,buffer-reset",
        "--ip1=1",
        "--out",
        path.to_str().unwrap(),
    ]);
    expect_code(&output, 0);
    let said = stdout(&output);
    assert!(
        said.contains("refused   print-numbers          cannot connect to port 1:"),
        "{said}"
    );
    let file = std::fs::read_to_string(path).unwrap();
    assert!(file.contains("port 1:") && !file.contains("127.0.0.1"), "{file}");
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
    assert!(stderr(&output).contains("no reply to SU"), "{}", stderr(&output));
    // A page is no text, and a controller serves one host.
    let web = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let place = web.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut visitor, _) = web.accept().unwrap();
        visitor
            .write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n<html>")
            .unwrap();
        // Until the other side has ended.
        let _ = visitor.read_to_end(&mut Vec::new());
    });
    let output = run(&["survey", &place, "--only", "stx"]);
    expect_code(&output, 3);
    let said = stderr(&output);
    assert!(said.contains("is not a TS3100 message"), "{said}");
    assert!(said.contains("Give the port of IP0"), "{said}");
    let host = serve.dial(0);
    let output = run(&["survey", &address, "--only", "stx"]);
    expect_code(&output, 3);
    let said = stderr(&output);
    assert!(said.contains("closed the connection"), "{said}");
    drop(host);
    // What cannot be written is known before.
    let output = run(&[
        "survey",
        &address,
        "--only",
        "stx",
        "--out",
        "/nowhere/robot.toml",
    ]);
    expect_code(&output, 2);
    assert!(!stdout(&output).contains("manual    "), "{}", stdout(&output));
}

#[cfg(unix)]
#[test]
fn at_ctrl_c_what_was_changed_is_put_back() {
    let serve = Serve::ready(&["serve", "--servo-on"]);
    let directory = TempDir::new("survey");
    let path = directory.path().join("robot.toml");
    let path = path.to_str().unwrap();
    let address = serve.address(0);
    let mut survey = ts3100(&["survey", &address, "--ask=program", "--out", path])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // One program has run, and the next one is being stored.
    let mut said = BufReader::new(survey.stdout.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("manual    value") {
        line.clear();
        assert_ne!(said.read_line(&mut line).unwrap(), 0, "it ended");
    }
    kill("INT", survey.id());
    said.read_to_string(&mut line).unwrap();
    let output = survey.wait_with_output().unwrap();
    expect_code(&output, 1);
    let errors = stderr(&output);
    assert!(errors.contains("it was interrupted"), "{errors}");
    assert!(!errors.contains("not restored"), "{errors}");
    let file = std::fs::read_to_string(path).unwrap();
    assert!(file.contains("probe = \"value\"\nquestion"), "{file}");
    let directory = serve.host(&["ca"]);
    assert!(!stdout(&directory).contains("TSSURVEY"), "{}", stdout(&directory));
}

#[cfg(unix)]
#[test]
fn at_ctrl_c_before_the_first_answer_nobody_is_told_to_look_for_the_address() {
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    for words in [["survey", &address], ["conform", &address]] {
        let mut command = ts3100(&words);
        command.stdout(Stdio::null()).stderr(Stdio::piped());
        let survey = command.spawn().unwrap();
        // It listens for signals before it connects.
        let _asked = silent.accept().unwrap();
        kill("INT", survey.id());
        let output = survey.wait_with_output().unwrap();
        expect_code(&output, 1);
        let errors = stderr(&output);
        assert!(errors.contains("error: stopped: it was interrupted"), "{errors}");
    }
}

#[cfg(unix)]
#[test]
fn a_serial_line_is_surveyed_at_a_terminal() {
    let lines = TempDir::new("survey");
    let folder = lines.path().to_str().unwrap();
    let serve = Serve::ready(&[
        "serve",
        "--serial-dir",
        folder,
        "--control-right",
        "rs232c",
        "--servo-on",
    ]);
    let host = serve.serial["host"].as_str().unwrap();
    let only = "--only=stx,status-form,second-connection,file-round-trip,value";
    let output = run(&["survey", "--serial", host, "--ask=look,files,program", only]);
    expect_code(&output, 0);
    let said = stdout(&output);
    assert!(
        said.contains("4 manual, 0 variation, 0 unknown, 1 refused"),
        "{said}"
    );
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
    let document: Value = serde_json::from_str(&stdout(&run(&["fidelity", "--json"]))).unwrap();
    let rows = document["rows"].as_array().unwrap();
    let assumed = rows.iter().filter(|row| row["evidence"] == "assumed").count();
    assert_eq!(document["counts"]["assumed"], assumed);
    assert!(counts.contains(&format!(" {assumed} assumed")), "{counts}");
    let directory = TempDir::new("survey");
    let [json, markdown] = ["findings.json", "findings.md"].map(|name| directory.path().join(name));
    let serve = Serve::ready(&[
        "serve",
        "--servo-on",
        "--findings",
        json.to_str().unwrap(),
        "--findings",
        markdown.to_str().unwrap(),
    ]);
    // The second one ends feed hold; a program starts.
    for command in [&["fd"][..], &["fd"], &["sl", "DEMO"], &["rn"]] {
        expect_code(&serve.host(command), 0);
    }
    serve.signal("TERM");
    let document = std::fs::read_to_string(json).unwrap();
    let document: serde_json::Value = serde_json::from_str(&document).unwrap();
    let rows = document["assumptions"].as_array().unwrap();
    let survey = |id: &str| {
        let row = rows.iter().find(|row| row["id"] == id);
        row.map(|row| row["survey"].as_str().unwrap())
    };
    assert_eq!(survey("op-16"), Some("feed-hold, feed-hold-motion"), "{document}");
    assert_eq!(survey("op-9"), Some("unsolicited-stop"), "{document}");
    assert_eq!(
        survey("motion-10"),
        Some("motion"),
        "a MOVE of the program: {document}"
    );
    let markdown = std::fs::read_to_string(markdown).unwrap();
    assert!(markdown.contains("- op-16: FD toggles"), "{markdown}");
}
