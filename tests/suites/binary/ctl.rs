//! `ts3100 ctl` and `completions` against a running `ts3100 serve`: exit codes, both forms of an answer, the token.

use super::support::{Serve, TS3100, expect_code, run, stderr, stdout, ts3100};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::process::{Command, Output, Stdio};
use ts3100_tests::testing::TempDir;

fn ctl(serve: &Serve, words: &[&str]) -> Output {
    let url = serve.control.as_deref().unwrap();
    let mut all = vec!["ctl", "--url", url];
    all.extend(words);
    run(&all)
}

/// What a call that succeeds answers, as JSON.
fn answer(serve: &Serve, words: &[&str]) -> Value {
    let mut all = vec!["--json"];
    all.extend(words);
    let output = ctl(serve, &all);
    expect_code(&output, 0);
    serde_json::from_str(&stdout(&output)).unwrap()
}

fn code(serve: &Serve, words: &[&str]) -> Option<i32> {
    ctl(serve, words).status.code()
}

#[test]
fn each_list_is_asked_for_in_the_same_words() {
    let serve = Serve::start(&["--time", "stepped"]);
    for noun in [
        "alarms",
        "breakpoints",
        "channels",
        "faults",
        "files",
        "findings",
        "inputs",
        "outputs",
        "positions",
        "robots",
        "snapshots",
        "variables",
        "wires",
    ] {
        assert_eq!(answer(&serve, &[noun, "list"]), answer(&serve, &[noun]), "{noun}");
    }
    assert_eq!(code(&serve, &["variables", ""]), Some(2));
    let metrics = answer(&serve, &["metrics"]);
    assert_eq!(metrics["ts3100_power"], 1, "{metrics}");
}

#[test]
fn control_codes_are_written_as_traffic_prints_them() {
    let serve = Serve::start(&["--time", "stepped"]);
    let both = r"1<CR>2\r";
    let channel = answer(&serve, &["channels", "ip1", "inject", both]);
    assert_eq!(channel["buffer"], "1<CR>2<CR>");
    let error = stderr(&ctl(&serve, &["channels", "ip1", "inject", "1<"]));
    assert!(error.contains("no > after <; write a < alone as <3C>"), "{error}");
}

#[test]
fn a_name_that_the_editor_of_the_robot_does_not_allow_is_warned_of() {
    let serve = Serve::start(&["--time", "stepped"]);
    let directory = TempDir::new("binary");
    let file = directory.file("a.scol", "PROGRAM A\nEND\n");
    let put = |name: &str| stderr(&ctl(&serve, &["files", "put", name, &file]));
    assert_eq!(put("ABCDEFGH"), "");
    assert!(put("ABCDEFGHI").starts_with("warning: the name ABCDEFGHI is longer"));
}

#[test]
fn a_snapshot_and_a_transcript_become_files() {
    let serve = Serve::start(&["--time", "stepped"]);
    let directory = TempDir::new("binary");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    answer(&serve, &["battery", "low"]);
    let shown = ctl(&serve, &["snapshots", "show"]);
    let file = directory.file("low.json", stdout(&shown));
    answer(&serve, &["snapshots", "take", "low"]);
    assert_eq!(
        stdout(&ctl(&serve, &["snapshots", "show", "low"])),
        stdout(&shown)
    );
    answer(&serve, &["battery", "ok"]);
    answer(&serve, &["snapshots", "load", &file]);
    assert_eq!(answer(&serve, &["battery"]), json!({"low": true}));
    let other = Serve::start(&["--restore", &file]);
    assert_eq!(answer(&other, &["battery"]), json!({"low": true}));
    assert_eq!(code(&serve, &["snapshots", "load", &path("none.json")]), Some(2));
    assert_eq!(code(&serve, &["snapshots", "show", "none"]), Some(1));

    let text = stdout(&ctl(&serve, &["transcript"]));
    assert!(text.contains("! battery low\n"), "{text}");
    let lines = stdout(&ctl(&serve, &["transcript", "--json"]));
    assert!(lines.starts_with("{\"event\":\"start\""), "{lines}");
    for (name, begins) in [
        ("a.txt", &b"origin: "[..]),
        ("a.jsonl", b"{\"event\""),
        ("a.pcapng", b"\n\r\r\n"),
    ] {
        assert_eq!(code(&serve, &["transcript", &path(name)]), Some(0));
        assert!(std::fs::read(path(name)).unwrap().starts_with(begins), "{name}");
    }
    assert_eq!(code(&serve, &["transcript", &path("a.xml")]), Some(2));
}

#[test]
fn every_switch_has_its_words() {
    let serve = Serve::start(&[]);
    for (words, expected) in [
        ("key-switch teaching", json!({"position": "teaching"})),
        ("key-switch ext", json!({"position": "ext"})),
        ("control-right sig", json!({"holder": "sig"})),
        ("control-right ether", json!({"holder": "ether"})),
        ("safety-switch open", json!({"open": true})),
        ("safety-switch close", json!({"open": false})),
        ("emergency-stop press", json!({"pressed": true})),
        ("emergency-stop release", json!({"pressed": false})),
        ("machine-lock on", json!({"on": true})),
        ("machine-lock off", json!({"on": false})),
        ("battery low", json!({"low": true})),
        ("battery ok", json!({"low": false})),
        ("feed-hold on", json!({"on": true})),
        ("feed-hold off", json!({"on": false})),
        ("feed-hold press", json!({"on": true})),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        assert_eq!(answer(&serve, &words), expected, "{words:?}");
        assert_eq!(answer(&serve, &words[..1]), expected, "{words:?}");
    }
    assert_eq!(answer(&serve, &["alarms"])["active"].as_array().unwrap().len(), 3);
    assert_eq!(answer(&serve, &["alarms", "reset"])["active"], json!([]));
    answer(&serve, &["alarms", "raise", "1-102", "by hand"]);
    let armed = answer(&serve, &["faults", "arm", "ng:command=SO,after=1"]);
    assert_eq!(armed["faults"][0]["spec"], "ng:command=SO,after=1");
    assert_eq!(answer(&serve, &["faults", "disarm", "1"])["armed"], false);
    assert_eq!(answer(&serve, &["faults"])["never_fired"], json!([1]));
    assert_eq!(answer(&serve, &["faults", "clear"])["faults"], json!([]));
    assert_eq!(answer(&serve, &["faults", "kinds"])[0]["kind"], "no-reply");
    assert_eq!(answer(&serve, &["alarms", "table", "1-102"])["level"], 1);
}

#[test]
fn every_resource_has_its_words() {
    let directory = TempDir::new("binary");
    let serve = Serve::start(&["--time", "stepped"]);
    let program = directory.file(
        "cell.scol",
        "GLOBAL\nN = 1\nEND\nPROGRAM CELL\nDELAY 5\nDOUT(3)\nPRINT COM1, \"DONE\", CR\nEND\nDATA\n\
         POINT P1 = 300,0,400,0,0,0,0,0\nEND\n",
    );
    answer(&serve, &["files", "put", "CELL", &program]);
    assert_eq!(answer(&serve, &["files", "select", "CELL"])["file"], "CELL");
    assert_eq!(answer(&serve, &["variables", "N", "-7"])["value"], json!([-7]));
    assert_eq!(answer(&serve, &["variables", "N"])["value"], json!([-7]));
    answer(&serve, &["positions", "P1", "teach", "--restore"]);
    assert_eq!(
        answer(
            &serve,
            &["positions", "P1", "1", "2", "3", "0", "0", "0", "0", "0", "0"]
        )["value"][1],
        2.0
    );
    assert_eq!(
        answer(&serve, &["files", "check", "CELL"])[0]["severity"],
        "warning"
    );
    answer(&serve, &["inputs", "9", "on"]);
    assert_eq!(answer(&serve, &["inputs"])["on"], json!([9]));
    assert_eq!(answer(&serve, &["lines"])["inputs"][8]["on"], true);
    assert_eq!(answer(&serve, &["status-frame"])[0]["name"], "servo power");
    assert_eq!(answer(&serve, &["coverage"])["reached"], 0);
    let fields = answer(&serve, &["decode", "host", "02", "53550d", "03"]);
    assert_eq!(fields["fields"][1]["key"], "command");
    let fields = answer(&serve, &["decode", "controller", "4e470d03", "--command", "SF"]);
    assert_eq!(fields["fields"][0]["key"], "reply");
    // `<STX>FL,1,2-046,OUT,2014-02-06 00:00:01<CR><EOF><CR><ETX>`
    let row = "02464c2c312c322d3034362c4f55542c323031342d30322d30362030303a30303a30310d1a0d03";
    let shown = stdout(&ctl(&serve, &["decode", "controller", row, "--command", "AC"]));
    assert!(shown.contains("    value: 2-046\n"), "as people read it: {shown}");
    answer(&serve, &["inputs", "9", "force", "off"]);
    assert_eq!(answer(&serve, &["inputs", "9", "release"])["on"], true);
    answer(&serve, &["outputs", "9", "pulse", "on", "0.5", "s"]);
    answer(&serve, &["outputs", "9", "pulse", "on", "500ms"]);
    answer(&serve, &["outputs", "9", "pulse", "on", "0.5"]);
    answer(&serve, &["servo", "on"]);
    assert_eq!(answer(&serve, &["program", "start"])["status"], "running");
    let reached = answer(
        &serve,
        &["clock", "advance-until", "output", "3", "on", "--within", "60"],
    );
    assert_eq!(reached["passed"], 5.0);
    assert_eq!(answer(&serve, &["clock", "advance", "1"])["now"], 6.0);
    assert_eq!(answer(&serve, &["clock", "advance", "500ms"])["now"], 6.5);
    assert_eq!(answer(&serve, &["clock", "advance", "0.5", "s"])["now"], 7.0);
    assert_eq!(
        answer(&serve, &["wait", "status", "stop", "(reset)", "--within", "0"])["reached"],
        true
    );
    assert_eq!(
        answer(&serve, &["inputs", "9", "wait", "on", "--within", "1"])["reached"],
        true
    );
    answer(&serve, &["channels", "ip1", "inject", r"1,2\r"]);
    assert_eq!(answer(&serve, &["channels", "ip1"])["buffer"], "1,2<CR>");
    answer(&serve, &["pendant", "keys", r"5\r"]);
    assert_eq!(answer(&serve, &["parameters"])["host"]["speed"], 9600);
    assert_eq!(answer(&serve, &["power", "cycle"])["on"], true);
    assert_eq!(answer(&serve, &["clock", "mode", "auto"])["mode"], "auto");
    assert_eq!(answer(&serve, &["reset"])["on"], true);
    assert_eq!(answer(&serve, &["call", "GET", "/program"])["file"], "");
    for words in [
        "state",
        "health",
        "version",
        "findings",
        "channels",
        "files",
        "variables",
    ] {
        answer(&serve, &[words]);
    }
}

#[test]
fn the_exit_code_says_how_it_ended() {
    let serve = Serve::start(&["--time", "stepped"]);
    ctl(&serve, &["emergency-stop", "press"]);
    let refused = ctl(&serve, &["servo", "on"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        stderr(&refused).contains("error: cannot turn the servo on: the emergency stop is pressed"),
        "{}",
        stderr(&refused)
    );
    for words in [
        vec!["servo", "sideways"],
        vec!["wait", "moon"],
        vec!["variables", "N", "one"],
        vec!["call", "GET", "state"],
        vec!["positions", "P1", "teach", "1"],
        vec!["files", "put", "A", "/does/not/exist"],
        vec!["nothing"],
    ] {
        assert_eq!(code(&serve, &words), Some(2), "{words:?}");
    }
    let late = ["clock", "advance-until", "output", "3", "on", "--within", "1s"];
    assert_eq!(code(&serve, &late), Some(4));
    // Time stands still, so only the wall-clock limit ends the wait.
    let never = ["wait", "output", "3", "on", "--within", "1", "--wall", "100 ms"];
    let ended = ctl(&serve, &never);
    assert_eq!(ended.status.code(), Some(4));
    assert!(
        stderr(&ended).contains(
            "the wait for `output 3 on` has not ended within 0.1 s of wall-clock time: the clock is stepped"
        ),
        "{}",
        stderr(&ended)
    );
    assert_eq!(
        run(&["ctl", "--url", "http://127.0.0.1:1", "state"])
            .status
            .code(),
        Some(3)
    );
    assert_eq!(
        run(&["ctl", "--url", "https://a:1", "state"]).status.code(),
        Some(2)
    );
}

#[test]
fn people_get_names_and_values_and_files_as_they_are() {
    let directory = TempDir::new("binary");
    let program = directory.file("p.scol", "PROGRAM P\nEND\n\x1a");
    let serve = Serve::start(&[]);
    let shown = |words: &[&str]| stdout(&ctl(&serve, words));
    assert_eq!(shown(&["files", "put", "P", &program]), "stored P: 14 bytes\n");
    assert_eq!(shown(&["findings"]), "none\n");
    assert_eq!(
        shown(&["faults", "arm", "late-reply:delay=1.5 s"]),
        "armed fault 1: late-reply:delay=1500\n"
    );
    assert_eq!(
        shown(&["faults", "arm", "no-reply:id=1"]),
        "armed fault 1: no-reply:lost=reply\n"
    );
    let program = directory.file(
        "q.scol",
        "PROGRAM Q\nEND\nDATA\nPOINT P1 = 300,0,400,0,0,0,0,0/11111\nEND\n",
    );
    ctl(&serve, &["files", "put", "Q", &program]);
    ctl(&serve, &["files", "select", "Q"]);
    let position = shown(&["positions", "P1"]);
    assert!(position.ends_with(" 0.000 11111\n"), "{position}");
    assert_eq!(stdout(&ctl(&serve, &["files", "get", "P"])), "PROGRAM P\nEND\n");
    assert_eq!(stdout(&ctl(&serve, &["servo", "on"])), "on: true\n");
    assert!(stdout(&ctl(&serve, &["metrics"])).contains("ts3100_servo 1\n"));
    let events = stdout(&ctl(&serve, &["events", "--since", "1", "--count", "2"]));
    assert!(events.contains(" stored        bytes=14 file=P\n"), "{events}");
}

#[test]
fn a_stream_of_events_ends_when_it_is_told_to() {
    let serve = Serve::start(&["--time", "stepped"]);
    ctl(&serve, &["servo", "on"]);
    let events = |words: &[&str]| ctl(&serve, &[&["events"], words].concat());
    let all = events(&["--since", "1", "--timeout", "0.2"]);
    expect_code(&all, 0);
    let count = stdout(&all).lines().count();
    assert!(count > 0, "none");
    let count = |more: usize| (count + more).to_string();
    expect_code(&events(&["--since", "1", "--count", &count(0)]), 0);
    let late = events(&["--since", "1", "--count", &count(2), "--timeout", "0.2"]);
    expect_code(&late, 4);
    let words = format!(
        "error: {} of {} events came within --timeout\n",
        count(0),
        count(2)
    );
    assert_eq!(stderr(&late), words);

    // It waits for events, and for the end of the emulator.
    let url = serve.control.clone().unwrap();
    let mut follow = ts3100(&[
        "ctl",
        "--url",
        &url,
        "events",
        "--since",
        "1",
        "--count",
        &count(99),
    ]);
    let mut follow = follow
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = String::new();
    let mut lines = BufReader::new(follow.stdout.take().unwrap());
    lines.read_line(&mut first).unwrap();
    serve.signal("TERM");
    lines.read_to_string(&mut first).unwrap();
    let ended = follow.wait_with_output().unwrap();
    expect_code(&ended, 3);
    assert!(stderr(&ended).ends_with("events came before the emulator ended\n"));
}

#[test]
fn url_and_token_come_from_the_environment() {
    let directory = TempDir::new("binary");
    let file = directory.file("token", "0123456789abcdef\n");
    let serve = Serve::start(&["--control-token-file", &file]);
    let url = serve.control.as_deref().unwrap();
    let with = |token: &str| {
        let mut command = ts3100(&["ctl", "health"]);
        command.env("TS3100_CONTROL_URL", url);
        if !token.is_empty() {
            command.env("TS3100_CONTROL_TOKEN", token);
        }
        command.output().unwrap().status.code()
    };
    assert_eq!(with("0123456789abcdef"), Some(0));
    assert_eq!(with("0123456789abcdee"), Some(1));
    assert_eq!(with(""), Some(1));
    assert_eq!(code(&serve, &["--token", "0123456789abcdef", "health"]), Some(0));
}

/// `ctl state` for a user whose state files are here.
fn state_of(runtime: &TempDir, words: &[&str]) -> Output {
    let mut command = ts3100(&["ctl", "state"]);
    command.args(words);
    command.env("XDG_RUNTIME_DIR", runtime.path()).output().unwrap()
}

#[test]
fn the_only_emulator_of_the_machine_is_found_and_several_are_listed() {
    let runtime = TempDir::new("runtime");
    let place = runtime.path().to_str().unwrap().to_owned();
    let start = || Serve::start_in(&[("XDG_RUNTIME_DIR", &place)], &["--control", "127.0.0.1:0"]);
    let first = start();
    expect_code(&state_of(&runtime, &[]), 0);
    let second = start();
    let several = state_of(&runtime, &[]);
    expect_code(&several, 2);
    for serve in [&first, &second] {
        let line = format!("  {}  process ", serve.control.as_deref().unwrap());
        assert!(stderr(&several).contains(&line), "{}", stderr(&several));
        assert!(stderr(&several).contains(&format!(", IP0 at {}", serve.address(0))));
    }
    // One ends, the other is killed and leaves its files.
    first.signal("TERM");
    let url = second.control.clone().unwrap();
    expect_code(&state_of(&runtime, &[]), 0);
    let robot = state_of(&runtime, &["--url", &format!("http://{}", second.address(0))]);
    expect_code(&robot, 2);
    assert!(
        stderr(&robot).starts_with("error: IP0 of the robot answers at ")
            && stderr(&robot).ends_with(&format!("; that is at {url}\n")),
        "{}",
        stderr(&robot)
    );
    second.signal("KILL");
    // No emulator of another test can have this port; that of the killed one may be taken already.
    let none = state_of(&runtime, &["--url", "http://127.0.0.1:1"]);
    expect_code(&none, 3);
    assert!(stderr(&none).contains("ts3100 serve"), "{}", stderr(&none));
    let left = std::fs::read_dir(runtime.path().join("ts3100")).unwrap();
    assert_eq!(left.count(), 0);
}

#[test]
fn a_port_of_a_robot_elsewhere_is_told_from_a_slow_interface() {
    let elsewhere = TempDir::new("runtime");
    for end in ["text.end=detect", "text.end=etx"] {
        let serve = Serve::start(&["--set", "text.stx=detect", "--set", end]);
        let url = format!("http://{}", serve.address(0));
        let robot = state_of(&elsewhere, &["--url", &url, "--timeout", "0.3"]);
        expect_code(&robot, 3);
        let expected = format!("error: IP0 of a robot answers at {url}, not the control interface");
        assert!(stderr(&robot).starts_with(&expected), "{end}: {}", stderr(&robot));
    }
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", silent.local_addr().unwrap());
    let late = state_of(&elsewhere, &["--url", &url, "--timeout", "0.3"]);
    expect_code(&late, 3);
    let expected = format!("error: {url} accepts connections but has not answered within 0.3 s (--timeout)");
    assert!(stderr(&late).starts_with(&expected), "{}", stderr(&late));
    // The address of a wait that goes on is right.
    let waiting = run(&["ctl", "--url", &url, "wait", "input 5 on", "--timeout", "0.3"]);
    let advice = ": what is waited for has not come; --wall limits a wait\n";
    assert_eq!(stderr(&waiting), expected + advice);
}

#[test]
fn serve_says_why_there_can_be_no_interface() {
    let everywhere = run(&["serve", "--ports", "auto", "--control", "0.0.0.0:0"]);
    assert_eq!(everywhere.status.code(), Some(2));
    assert!(
        stderr(&everywhere).contains("--control-token"),
        "{}",
        stderr(&everywhere)
    );
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = run(&["serve", "--ports", "auto", "--control", &address]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains(&address), "{}", stderr(&output));
    let far = run(&["serve", "--port-offset", "64000"]);
    assert!(stderr(&far).contains("--control off"), "{}", stderr(&far));
    let off = Serve::start(&["--control", "off"]);
    assert_eq!(off.control, None);
}

#[test]
fn shells_get_their_completions() {
    for (shell, part) in [
        ("bash", "-F _ts3100 ts3100"),
        ("zsh", "#compdef ts3100"),
        ("fish", "--command ts3100"),
        ("powershell", "ts3100"),
        ("elvish", "ts3100"),
    ] {
        let output = run(&["completions", shell]);
        let script = stdout(&output);
        assert!(
            output.status.success() && script.contains(part),
            "{shell}: {script}"
        );
        assert!(script.contains("TS3100_COMPLETE"), "{shell}: {script}");
    }
    assert_eq!(run(&["completions", "cmd"]).status.code(), Some(2));
    // What the script asks for at a TAB.
    for (words, expected) in [
        (&["ctl", "clock", "adv"][..], "advance advance-until"),
        (&["ctl", "emergency-stop", "pr"], "press"),
        (&["serve", "--control-token-f"], "--control-token-file"),
        (&["serve", "--set", "text.stx=d"], "text.stx=detect"),
    ] {
        let asked = ts3100(&[])
            .env("TS3100_COMPLETE", "fish")
            .args([&["--", "ts3100"][..], words].concat())
            .output()
            .unwrap();
        let printed = stdout(&asked);
        let values: Vec<&str> = printed
            .lines()
            .filter_map(|line| line.split('\t').next())
            .collect();
        assert_eq!(values.join(" "), expected, "{words:?}");
    }
}

/// The answer that a shell gets at a TAB, with this address of the control interface.
fn completed(url: &str, words: &[&str]) -> Vec<String> {
    let asked = ts3100(&[])
        .env("TS3100_COMPLETE", "fish")
        .env("TS3100_CONTROL_URL", url)
        .args([&["--", "ts3100"][..], words].concat())
        .output()
        .unwrap();
    let printed = stdout(&asked);
    let values = printed.lines().filter_map(|line| line.split('\t').next());
    values.map(str::to_owned).collect()
}

#[test]
fn names_are_completed_from_the_robot_that_runs() {
    let serve = Serve::start(&["--select", "DEMO"]);
    let url = serve.control.clone().unwrap();
    expect_code(&ctl(&serve, &["snapshots", "take", "begin"]), 0);
    for (words, expected) in [
        (&["ctl", "files", "get", "DE"][..], "DEMO"),
        (&["ctl", "files", "select", "DI"], "DIALOG"),
        (&["ctl", "snapshots", "restore", "b"], "begin"),
    ] {
        assert_eq!(completed(&url, words), [expected], "{words:?}");
    }
    // Nobody answers there.
    assert!(completed("http://127.0.0.1:1", &["ctl", "files", "get", "DE"]).is_empty());
    let words = ["ctl", "--url", &url, "files", "get", "DE"];
    assert_eq!(completed("http://127.0.0.1:1", &words), ["DEMO"]);
}

#[cfg(unix)]
#[test]
fn completions_and_manual_pages_are_installed_where_they_are_looked_for() {
    let home = TempDir::new("home");
    let bin = home.path().join("bin");
    fs::create_dir(&bin).unwrap();
    let program = bin.join("ts3100");
    // A child that another test forks inherits what this process has open, and no file is executed that is open for writing.
    let copied = Command::new("cp").arg(TS3100).arg(&program).status().unwrap();
    assert!(copied.success());
    let installed = |words: &[&str]| {
        let mut command = Command::new(&program);
        command
            .env_remove("XDG_DATA_HOME")
            .env_remove("XDG_CONFIG_HOME")
            .env("HOME", home.path());
        command.args(words).arg("--install").output().unwrap()
    };
    for (words, file) in [
        (
            &["completions", "bash"][..],
            ".local/share/bash-completion/completions/ts3100",
        ),
        (&["completions", "zsh"], ".local/share/zsh/site-functions/_ts3100"),
        (&["completions", "fish"], ".config/fish/completions/ts3100.fish"),
        (&["man"], "share/man/man1/ts3100-ctl.1"),
    ] {
        let output = installed(words);
        expect_code(&output, 0);
        assert!(home.path().join(file).is_file(), "{file}: {}", stdout(&output));
    }
    let output = installed(&["completions", "powershell"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("to your profile"), "{}", stderr(&output));
    let output = run(&["man", "--install"]);
    assert_eq!(output.status.code(), Some(2), "it is in no directory bin");
    assert!(
        stderr(&output).contains("give a directory"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn the_scenario_that_is_played_can_be_watched() {
    let directory = TempDir::new("binary");
    let text = "[[do]]\nat = \"2 s\"\nactions = [\"emergency-stop press\"]\n\
        [[expect]]\nname = \"the stop is seen\"\nwhat = \"alarm 8-014\"\nwithin = \"3 s\"\n";
    let file = directory.file("stop.toml", text);
    let serve = Serve::start(&["--time", "stepped", "--scenario", &file]);
    let scenario = || answer(&serve, &["scenario"]);
    let begin = scenario();
    assert_eq!(
        (&begin["file"], &begin["state"]),
        (&json!("stop.toml"), &json!("running"))
    );
    assert_eq!(
        begin["steps"][1],
        json!({"name": "the stop is seen", "line": 4, "state": "waiting"})
    );
    answer(&serve, &["clock", "advance", "2.5"]);
    assert_eq!(
        scenario(),
        json!({"file": "stop.toml", "state": "passed", "steps": [
            {"name": "do at 2 s", "line": 1, "state": "passed", "t": 2.0, "message": "emergency-stop press"},
            {"name": "the stop is seen", "line": 4, "state": "passed", "t": 2.0},
        ]})
    );
}

#[test]
fn a_port_is_named_in_either_case() {
    let serve = Serve::start(&["--time", "stepped"]);
    let shown = answer(&serve, &["channels", "IP1"]);
    assert_eq!(shown, answer(&serve, &["channels", "ip1"]));
    assert_eq!(code(&serve, &["channels", "IP1", "inject", r"4\r"]), Some(0));
    assert_eq!(code(&serve, &["channels", "Host"]), Some(0));
    assert_eq!(code(&serve, &["channels", "IP4"]), Some(2));
}

/// A server that answers with this head and then with these bytes without an end.
fn flood(head: &'static str, bytes: &'static str) -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        use std::io::Write as _;
        let (mut stream, _) = listener.accept().unwrap();
        let _ = stream.write_all(head.as_bytes());
        let bytes = bytes.repeat(1_000);
        while stream.write_all(bytes.as_bytes()).is_ok() {}
    });
    url
}

#[test]
fn a_server_that_floods_does_not_flood_the_terminal() {
    let ok = "HTTP/1.0 200 OK\r\n\r\n";
    let refused = "HTTP/1.0 404 Not Found\r\nContent-Length: 1000000\r\n\r\n";
    for (head, words, code) in [
        (refused, &["state"][..], 1),
        (refused, &["--json", "state"], 1),
        (ok, &["state"], 3),
        (ok, &["events"], 3),
        ("HTTP/9 ", &["state"], 3),
    ] {
        let url = flood(head, "abcdefgh");
        let output = run(&[&["ctl", "--url", &url, "--timeout", "5"], words].concat());
        expect_code(&output, code);
        let written = output.stdout.len() + output.stderr.len();
        assert!(written < 100_000, "{words:?}: {written} bytes");
    }
}
