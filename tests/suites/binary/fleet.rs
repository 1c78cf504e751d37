//! Several robots in one process: each is a robot of its own, one control interface leads to all, and wires between them
//! act in virtual time.

use super::support::{Serve, expect_code, run, stderr, stdout};
use serde_json::{Value, json};
use std::process::Output;
use ts3100_tests::testing::TempDir;

/// Gives a part at its output 5 and waits until it was taken, half a second each.
const FEEDER: &str = "PROGRAM FEEDER\nN=0\nLOOP:\nDELAY 0.5\nDOUT(5)\nWAIT DIN(3)\nDOUT(-5)\nWAIT DIN(-3)\nN=N+1\n\
    PRINT \"FED\",N,CR\nGOTO LOOP\nEND\n";
/// Takes a part that is there.
const PICKER: &str = "PROGRAM PICKER\nLOOP:\nWAIT DIN(1)\nMOVE A\nDELAY 0.2\nDOUT(2)\nWAIT DIN(-1)\nDOUT(-2)\n\
    GOTO LOOP\nEND\nDATA\nPOINT A = 250,100,200,0,0,0 / 0\nEND\n";
/// The two, wired to each other and to the outside.
const CELL: &str = r#"
servo-on = true
transcript = "{robot}.txt"

[[robot]]
name = "feeder"
load = "feeder.scol"
select = "FEEDER"

[[robot]]
name = "picker"
load = "picker.scol"
select = "PICKER"

[[wire]]
from = "feeder.dout.5"
to = "picker.din.1"

[[wire]]
from = "picker.dout.2"
to = "feeder.din.3"

[[wire]]
from = "outside.fence"
to = "feeder.din.10"

[[wire]]
from = "picker.dout.2"
to = "outside.taken"
"#;

fn ctl(serve: &Serve, words: &[&str]) -> Output {
    let url = serve.control.as_deref().unwrap();
    run(&[&["ctl", "--json", "--url", url], words].concat())
}

fn answer(serve: &Serve, words: &[&str]) -> Value {
    let output = ctl(serve, words);
    expect_code(&output, 0);
    serde_json::from_str(&stdout(&output)).unwrap()
}

/// One command to IP0 of a robot of the ready line.
fn host(serve: &Serve, robot: &str, words: &[&str]) -> Output {
    let robot = &serve.robots[robot];
    let address = format!("{}:{}", robot["address"].as_str().unwrap(), robot["ports"]["ip0"]);
    run(&[&["host", &address], words].concat())
}

#[test]
fn each_robot_has_its_own_ports_state_and_time() {
    let serve = Serve::start(&["--robots", "3", "--time", "stepped"]);
    assert_eq!(serve.robots.as_object().unwrap().len(), 3);
    expect_code(&host(&serve, "robot-2", &["so"]), 0);
    let servo = |robot| answer(&serve, &["--robot", robot, "servo"]);
    assert_eq!(servo("robot-2"), json!({"on": true}));
    assert_eq!(servo("robot-3"), json!({"on": false}));
    answer(&serve, &["--robot", "robot-3", "emergency-stop", "press"]);
    assert_eq!(servo("robot-2"), json!({"on": true}));
    answer(&serve, &["--robot", "robot-1", "clock", "advance", "7"]);
    let now = |robot| answer(&serve, &["--robot", robot, "clock"])["now"].as_f64();
    assert_eq!((now("robot-1"), now("robot-2")), (Some(7.0), Some(0.0)));

    let robots = answer(&serve, &["robots"]);
    assert_eq!(robots["robots"][1]["name"], "robot-2");
    assert_eq!(robots["robots"][1]["started"], true);
    let ended = serve.signal("TERM");
    expect_code(&ended, 0);
    assert!(
        stderr(&ended).contains("robot{robot-3}: alarm 8-014"),
        "{}",
        stderr(&ended)
    );
}

#[test]
fn a_call_that_names_no_robot_is_told_how() {
    let serve = Serve::start(&["--robots", "2"]);
    let refused = |words: &[&str]| {
        let output = ctl(&serve, words);
        expect_code(&output, 1);
        serde_json::from_str::<Value>(&stderr(&output)).unwrap()["error"].clone()
    };
    assert_eq!(
        refused(&["state"]),
        "/state is for one robot, and 2 run here; say which: /robots/robot-1/state (ts3100 ctl --robot robot-1)"
    );
    assert_eq!(
        refused(&["--robot", "robt-1", "state"]),
        "unknown robot `robt-1`; did you mean `robot-1` or `robot-2`?"
    );
    assert_eq!(
        refused(&["--robot", "x", "state"]),
        "unknown robot `x`: expected robot-1, robot-2"
    );
}

#[test]
fn the_only_robot_of_a_process_has_a_name_too() {
    for flags in [&[][..], &["--robots", "1"]] {
        let serve = Serve::start(flags);
        let named = answer(&serve, &["--robot", "robot-1", "key-switch"]);
        assert_eq!(named, answer(&serve, &["key-switch"]));
    }
}

#[test]
fn the_cell_is_saved_and_restored_as_a_whole() {
    let directory = TempDir::new("fleet");
    let last = directory.path().join("last.json").to_str().unwrap().to_owned();
    let serve = Serve::start(&["--robots", "2", "--time", "stepped", "--snapshot-on-exit", &last]);
    let low = |serve: &Serve, robot| {
        answer(serve, &["--robot", robot, "battery"])["low"]
            .as_bool()
            .unwrap()
    };
    answer(&serve, &["--robot", "robot-2", "battery", "low"]);
    answer(&serve, &["snapshots", "take", "a"]);
    let file = directory.file("cell.json", stdout(&ctl(&serve, &["snapshots", "show"])));
    answer(&serve, &["--robot", "robot-2", "battery", "ok"]);
    answer(&serve, &["--robot", "robot-1", "battery", "low"]);
    answer(&serve, &["snapshots", "restore", "a"]);
    assert_eq!((low(&serve, "robot-1"), low(&serve, "robot-2")), (false, true));
    answer(&serve, &["--robot", "robot-2", "battery", "ok"]);
    answer(&serve, &["snapshots", "load", &file]);
    assert!(low(&serve, "robot-2"));
    // A name that one of them does not have changes none.
    answer(&serve, &["--robot", "robot-1", "snapshots", "take", "one"]);
    expect_code(&ctl(&serve, &["snapshots", "restore", "one"]), 1);
    expect_code(&serve.signal("TERM"), 0);

    for file in [file, last] {
        let serve = Serve::start(&["--robots", "2", "--restore", &file]);
        assert_eq!((low(&serve, "robot-1"), low(&serve, "robot-2")), (false, true));
    }
    let other = run(&[
        "serve",
        "--robots",
        "3",
        "--ports",
        "auto",
        "--restore",
        &directory.path().join("cell.json").to_string_lossy(),
    ]);
    expect_code(&other, 2);
    assert!(
        stderr(&other).contains("the file has no robot `robot-3`"),
        "{}",
        stderr(&other)
    );
}

#[test]
fn a_snapshot_of_several_robots_is_of_one_moment() {
    let directory = TempDir::new("fleet");
    let wired = directory.file(
        "cell.toml",
        "[[robot]]\nname = \"robot-1\"\n[[robot]]\nname = \"robot-2\"\n\
         [[wire]]\nfrom = \"robot-1.dout.5\"\nto = \"robot-2.din.1\"\n",
    );
    for robots in [["--robots", "2"], ["--config", &wired]] {
        let serve = Serve::start(&[&robots[..], &["--time", "x1000"]].concat());
        let distance = |state: Value| {
            let [one, other] =
                ["robot-1", "robot-2"].map(|name| state["robots"][name]["now"].as_i64().unwrap());
            one - other
        };
        let distances: Vec<_> = (0..10)
            .map(|_| distance(answer(&serve, &["snapshots", "show"])))
            .collect();
        // Times are rounded down to a microsecond.
        let spread = distances.iter().max().unwrap() - distances.iter().min().unwrap();
        assert!(spread <= 1, "{robots:?} {distances:?}");
    }
}

#[test]
fn a_call_about_the_snapshots_of_all_robots_that_one_refuses_changes_none() {
    let serve = Serve::start(&["--robots", "2"]);
    let url = serve.control.as_deref().unwrap();
    let client = ts3100_emulator::client::Client::new(url, None).unwrap();
    let refused = |method, status| {
        let (found, text) = client.call(method, "/snapshots/one", None).unwrap();
        assert_eq!(found, status, "{text}");
    };
    let kept = || answer(&serve, &["--robot", "robot-1", "snapshots"])["snapshots"].clone();
    for number in 0..64 {
        let path = format!("/robots/robot-2/snapshots/n{number}");
        assert_eq!(client.call("PUT", &path, None).unwrap().0, 200);
    }
    refused("PUT", 409);
    assert_eq!(kept(), json!([]), "robot-2 has as many as it can");
    answer(&serve, &["--robot", "robot-1", "snapshots", "take", "one"]);
    refused("DELETE", 404);
    assert_eq!(kept()[0]["name"], "one", "robot-2 does not have it");
}

#[test]
fn each_robot_has_a_seed_of_its_own() {
    let directory = TempDir::new("fleet");
    let path = directory.path().join("{robot}.txt").to_str().unwrap().to_owned();
    let serve = Serve::start(&[
        "--robots",
        "3",
        "--vary",
        "7",
        "--fault-seed",
        "20",
        "--transcript",
        &path,
    ]);
    expect_code(&serve.signal("TERM"), 0);
    for (robot, vary, faults) in [("robot-1", 7, 20), ("robot-3", 9, 22)] {
        let text = std::fs::read_to_string(directory.path().join(format!("{robot}.txt"))).unwrap();
        for flag in [format!("vary={vary}"), format!("fault-seed={faults}")] {
            assert!(text.contains(&flag), "{robot}: {flag}\n{text}");
        }
    }
}

#[test]
fn metrics_have_the_robot_as_a_label() {
    let serve = Serve::start(&["--robots", "2"]);
    host(&serve, "robot-2", &["su"]);
    let url = serve.control.as_deref().unwrap();
    let metrics = ts3100_emulator::client::Client::new(url, None)
        .unwrap()
        .call("GET", "/metrics", None);
    let (status, text) = metrics.unwrap();
    assert_eq!(status, 200);
    for line in [
        "ts3100_connections_total{robot=\"robot-2\",port=\"IP0\"} 1",
        "ts3100_power{robot=\"robot-1\"} 1",
        "ts3100_power{robot=\"robot-2\"} 1",
    ] {
        assert!(text.lines().any(|found| found == line), "{line}\n{text}");
    }
    let headers = text.lines().filter(|line| *line == "# TYPE ts3100_power gauge");
    assert_eq!(headers.count(), 1);
    let (_, own) = ts3100_emulator::client::Client::new(url, None)
        .unwrap()
        .call("GET", "/robots/robot-2/metrics", None)
        .unwrap();
    assert!(
        own.contains("ts3100_connections_total{port=\"IP0\"} 1\n"),
        "{own}"
    );
}

/// The cell in a directory of its own, with this time.
fn cell(directory: &TempDir, time: &str) -> Serve {
    directory.file("feeder.scol", FEEDER);
    directory.file("picker.scol", PICKER);
    let file = directory.file("cell.toml", format!("time = \"{time}\"\n{CELL}"));
    Serve::start(&["--config", &file])
}

#[test]
fn wired_robots_shake_hands_in_virtual_time_the_same_way_each_time() {
    let play = || {
        let directory = TempDir::new("fleet");
        let serve = cell(&directory, "stepped");
        for robot in ["feeder", "picker"] {
            answer(&serve, &["--robot", robot, "program", "start"]);
        }
        // Their time is one: whoever is advanced, the other goes along.
        answer(&serve, &["--robot", "picker", "clock", "advance", "6.25"]);
        answer(&serve, &["--robot", "feeder", "clock", "advance", "3.75"]);
        let now = answer(&serve, &["--robot", "picker", "clock"])["now"].as_f64();
        assert_eq!(now, Some(10.0));
        let printed = answer(&serve, &["--robot", "feeder", "pendant"])["text"].clone();
        let state = answer(&serve, &["snapshots", "show"]);
        expect_code(&serve.signal("TERM"), 0);
        let transcript = std::fs::read(directory.path().join("feeder.txt")).unwrap();
        (printed, transcript, state)
    };
    let (printed, transcript, state) = play();
    let fed = printed.as_str().unwrap().matches("FED").count();
    // 0.5 s to give, the way to A (only the first time), 0.2 s to take.
    assert!((12..=14).contains(&fed), "{printed}");
    assert_eq!(play(), (printed, transcript, state));
}

#[test]
fn automatic_time_takes_wired_robots_along() {
    let directory = TempDir::new("fleet");
    let serve = cell(&directory, "auto");
    for robot in ["picker", "feeder"] {
        answer(&serve, &["--robot", robot, "program", "start"]);
    }
    let waited = ["--robot", "feeder", "wait", "printed FED", "--within", "1000"];
    assert_eq!(answer(&serve, &waited)["reached"], true);
}

#[test]
fn lines_from_and_to_the_outside_are_set_and_read() {
    let directory = TempDir::new("fleet");
    let serve = cell(&directory, "stepped");
    let level = |wires: &Value, index: usize| wires["wires"][index]["on"].as_bool().unwrap();
    assert!(!level(&answer(&serve, &["wires"]), 2));
    assert!(level(&answer(&serve, &["wires", "fence", "on"]), 2));
    let input = |line| {
        answer(&serve, &["--robot", "feeder", "inputs", line])["on"]
            .as_bool()
            .unwrap()
    };
    assert!(input("10"));
    answer(&serve, &["--robot", "picker", "outputs", "2", "on"]);
    let wires = answer(&serve, &["wires"]);
    assert!(level(&wires, 1) && level(&wires, 3) && input("3"));
    assert_eq!(
        wires["wires"][3],
        json!({"from": "picker.dout.2", "to": "outside.taken", "on": true})
    );
    // The wire holds its input; a forced one is cut off from it.
    answer(&serve, &["--robot", "feeder", "inputs", "3", "off"]);
    assert!(input("3"));
    answer(&serve, &["--robot", "feeder", "inputs", "3", "force", "off"]);
    assert!(!input("3"));
    answer(&serve, &["--robot", "feeder", "inputs", "3", "release"]);
    assert!(input("3"));
    // Without power an output is off.
    answer(&serve, &["--robot", "picker", "power", "off"]);
    assert!(!input("3"));
    // The state of one robot alone is put back; its inputs are those of the wires all the same.
    answer(&serve, &["--robot", "feeder", "snapshots", "take", "before"]);
    answer(&serve, &["wires", "fence", "off"]);
    answer(&serve, &["--robot", "feeder", "snapshots", "restore", "before"]);
    assert!(!input("10"));
    answer(&serve, &["--robot", "feeder", "reset"]);
    assert!(!input("10") && !input("3"));
    expect_code(&ctl(&serve, &["wires", "taken", "on"]), 1);
}

/// `serve` with these words does not start, and says why.
fn refused_at_start(words: &[&str], expected: &str) {
    let output = run(&[&["serve"], words].concat());
    expect_code(&output, 2);
    let error = stderr(&output);
    assert!(error.contains(expected), "{expected}\n{error}");
}

/// What follows the tables of the robots a and b, and what is said of it.
const WRONG_TABLES: &[(&str, &str)] = &[
    ("[[robot]]\nname = \"a\"\n", "two [[robot]] have the name `a`"),
    (
        "[[robot]]\nname = \"a b\"\n",
        "expected 1 to 32 letters, digits, `-` or `_`, found `a b`",
    ),
    (
        "[[robot]]\nname = \"outside\"\n",
        "`outside` is reserved for lines outside the robots",
    ),
    (
        "[[robot]]\nmodel = \"ts3100-tv800\"\n",
        "[[robot]] 3: the key `name` is missing",
    ),
    (
        "[[robot]]\nname = \"c\"\ncontrol = \"off\"\n",
        "`control` is for the whole process",
    ),
    (
        "[[robot]]\nname = \"c\"\nmodl = \"x\"\n",
        "unknown key `modl`; did you mean `model`?",
    ),
    (
        "[[robot]]\nname = \"c\"\nselect = \"NOPE\"\nkey-switch = \"extern\"\n",
        "key-switch: expected",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.5\"\n",
        "[[wire]] 1: the key `to` is missing",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.5\"\nto = \"b.din.1\"\ndelay = 3\n",
        "[[wire]] 1: unknown key `delay`",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.5\"\nto = \"c.din.1\"\n",
        "to: unknown robot `c`",
    ),
    (
        "[[wire]]\nfrom = \"a.din.5\"\nto = \"b.din.1\"\n",
        "from: expected ROBOT.dout.LINE or outside.NAME, found `a.din.5`",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.65\"\nto = \"b.din.1\"\n",
        "unknown line `65`",
    ),
    (
        "[[wire]]\nfrom = \"outside.x\"\nto = \"outside.y\"\n",
        "both ends are outside",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.1\"\nto = \"b.din.1\"\n[[wire]]\nfrom = \"a.dout.2\"\nto = \"b.din.1\"\n",
        "another wire leads to `b.din.1`",
    ),
    (
        "[[wire]]\nfrom = \"a.dout.1\"\nto = \"outside.x\"\n[[wire]]\nfrom = \"outside.x\"\nto = \"b.din.1\"\n",
        "another wire leads to `outside.x`",
    ),
    (
        "[[robot]]\nname = \"c\"\ntime = \"x2\"\n[[wire]]\nfrom = \"a.dout.1\"\nto = \"c.din.1\"\n",
        "robots joined by wires need the same time: a has `real`, c has `x2`",
    ),
    (
        "[[robot]]\nname = \"c\"\ntime-gap = \"skip\"\n[[wire]]\nfrom = \"a.dout.1\"\nto = \"c.din.1\"\n",
        "robots joined by wires need the same time-gap: a and c have different ones",
    ),
];

#[test]
fn what_does_not_go_together_is_refused_before_a_port_opens() {
    refused_at_start(
        &["--robots", "0"],
        "expected a whole number from 1 to 65536, found `0`",
    );
    refused_at_start(
        &["--robots", "2", "--drive", "d"],
        "robot-1 and robot-2 cannot use the same; put `{robot}` in the path",
    );
    refused_at_start(
        &["--robots", "2", "--listen", "0.0.0.0"],
        "cannot give each robot an address from 0.0.0.0 on",
    );
    refused_at_start(&["--robots", "2", "--port-step", "3"], "use a step of 4 or more");
    refused_at_start(
        &["--robots", "9000", "--port-step", "10"],
        "drop --port-step if the ports do not suffice",
    );
    // clause: T27
    let exec = run(&["exec", "--robots", "2", "--", "true"]);
    expect_code(&exec, 125);
    assert!(stderr(&exec).contains("exec runs one robot"), "{}", stderr(&exec));
}

#[test]
fn tables_that_do_not_go_together_are_refused_with_their_place() {
    let directory = TempDir::new("fleet");
    let two = "[[robot]]\nname = \"a\"\n[[robot]]\nname = \"b\"\n";
    for (rest, expected) in WRONG_TABLES {
        let file = directory.file("cell.toml", format!("{two}{rest}"));
        refused_at_start(&["--ports", "auto", "--config", &file], expected);
    }
    let file = directory.file("cell.toml", two);
    refused_at_start(
        &["--ports", "auto", "--robots", "2", "--config", &file],
        "cannot use --robots together with [[robot]]",
    );
}

#[test]
fn each_robot_has_a_snapshot_of_its_own_where_the_path_has_its_name() {
    let directory = TempDir::new("fleet");
    let path = directory.path().join("{robot}.json").to_str().unwrap().to_owned();
    let tables = directory.file(
        "cell.toml",
        "[[robot]]\nname = \"feeder\"\n[[robot]]\nname = \"picker\"\n",
    );
    for (words, robots) in [
        (["--robots", "3"], &["robot-1", "robot-2", "robot-3"][..]),
        (["--robots", "1"], &["robot-1"]),
        (["--config", &tables], &["feeder", "picker"]),
    ] {
        let words = [&words[..], &["--time", "stepped", "--snapshot-on-exit", &path]].concat();
        expect_code(&Serve::start(&words).signal("TERM"), 0);
        for robot in robots {
            let file = directory.path().join(format!("{robot}.json"));
            let restored = Serve::start(&["--restore", file.to_str().unwrap()]);
            expect_code(&restored.signal("TERM"), 0);
            std::fs::remove_file(file).unwrap();
        }
    }
}

#[test]
fn the_name_of_the_robot_is_its_part_of_every_path() {
    let directory = TempDir::new("fleet");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    // Nobody has these files, and each is named with the robot.
    for (flag, file) in [
        ("--faults", "faults-{robot}.toml"),
        ("--like", "like-{robot}.json"),
        ("--model", "model-{robot}.toml"),
        ("--permissions", "permissions-{robot}.txt"),
        ("--points", "points-{robot}.csv"),
    ] {
        let missing = path(&file.replace("{robot}", "robot-1"));
        refused_at_start(
            &["--robots", "2", "--ports", "auto", flag, &path(file)],
            &format!("cannot read {missing}"),
        );
    }
    // A file that is only read may be that of all.
    let faults = directory.file("faults.toml", "");
    let serve = Serve::start(&["--robots", "2", "--faults", &faults]);
    expect_code(&serve.signal("TERM"), 0);
}

#[test]
fn the_settings_of_each_robot_are_made_once() {
    let directory = TempDir::new("fleet");
    let path = directory.path().join("robot.toml");
    let path = path.to_str().unwrap();
    let surveyed = Serve::start(&[]);
    let only = "--only=stx";
    expect_code(&run(&["survey", &surveyed.address(0), only, "--out", path]), 0);
    let two = "[[robot]]\nname = \"a\"\n[[robot]]\nname = \"b\"\n";
    let wired = format!("{two}[[wire]]\nfrom = \"a.dout.5\"\nto = \"b.din.1\"\n");
    let two = directory.file("two.toml", two);
    let wired = directory.file("wired.toml", wired);
    for (words, robots) in [
        (&[][..], 1),
        (&["--robots", "3"], 3),
        (&["--config", &two], 2),
        (&["--config", &wired], 2),
    ] {
        let serve = Serve::start(&[words, &["--like", path, "--vary", "7"]].concat());
        let said = stderr(&serve.signal("TERM"));
        // The file is read whenever the settings of a robot are made, and each time a line says so.
        let made = said.lines().filter(|line| line.contains(" options set")).count();
        assert_eq!(made, robots, "{words:?}: {said}");
    }
}

#[test]
fn a_robot_whose_reports_cannot_be_written_costs_those_of_no_other() {
    for wire in ["", "[[wire]]\nfrom = \"a.dout.5\"\nto = \"b.din.1\"\n"] {
        let directory = TempDir::new("fleet");
        let tables = format!(
            "coverage = \"{{robot}}/c.json\"\nsnapshot-on-exit = \"all.json\"\n\
             [[robot]]\nname = \"a\"\n[[robot]]\nname = \"b\"\n{wire}"
        );
        for robot in ["a", "b"] {
            std::fs::create_dir(directory.path().join(robot)).unwrap();
        }
        let file = directory.file("cell.toml", tables);
        let serve = Serve::start(&["--config", &file]);
        std::fs::remove_dir_all(directory.path().join("a")).unwrap();
        let ended = serve.signal("TERM");
        expect_code(&ended, 2);
        let said = stderr(&ended);
        assert!(
            said.contains("cannot write") && said.contains("a/c.json"),
            "{said}"
        );
        let coverage = std::fs::read_to_string(directory.path().join("b/c.json")).unwrap();
        assert!(coverage.contains("percent"), "{coverage:.300}");
        let state = std::fs::read_to_string(directory.path().join("all.json")).unwrap();
        let state: Value = serde_json::from_str(&state).unwrap();
        assert_eq!(state["robots"].as_object().unwrap().len(), 2);
    }
}

#[test]
fn a_start_that_fails_is_in_the_junit_report_of_each_robot() {
    let directory = TempDir::new("fleet");
    let path = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let results = path("{robot}.xml");
    let tables = directory.file("cell.toml", "[[robot]]\nname = \"a\"\n[[robot]]\nname = \"b\"\n");
    let common = ["--ports", "auto", "--junit", &results];
    for (words, robots) in [
        (["--robots", "2"], ["robot-1", "robot-2"]),
        (["--config", &tables], ["a", "b"]),
    ] {
        refused_at_start(&[&words[..], &common].concat(), "add --scenario FILE");
        for robot in robots {
            let report = std::fs::read_to_string(path(&format!("{robot}.xml"))).unwrap();
            assert!(report.contains("add --scenario FILE"), "{robot}: {report}");
        }
    }
    // Before the configuration is read, nobody knows the names.
    for words in [&["--config", "/nowhere.toml"][..], &["--no-such-flag"]] {
        let note = format!("cannot write {results}: the names of the robots are not known");
        refused_at_start(&[words, &common].concat(), &note);
    }
    assert!(!std::fs::exists(&results).unwrap());
}
