//! `ts3100 ready`, and what `serve` prints when it is ready.

use super::support::{Serve, expect_code, run, stderr, stdout, ts3100};
use std::io::{BufRead as _, BufReader};
use std::net::TcpListener;
use std::process::{Output, Stdio};
use ts3100_tests::testing::TempDir;

/// Runs `ts3100 ready` with these variables.
fn ready(variables: &[(&str, &str)], words: &[&str]) -> Output {
    let mut command = ts3100(&["ready"]);
    command.args(words).envs(variables.iter().copied());
    command.output().unwrap()
}

/// `HOST:PORT` of the control interface.
fn place(robot: &Serve) -> &str {
    let control = robot.control.as_deref().unwrap();
    control.strip_prefix("http://").unwrap()
}

/// A port on which nobody listens.
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port()
}

#[test]
fn it_finds_the_emulator_by_the_variables_of_serve() {
    let robot = Serve::start(&[]);
    let url = robot.control.clone().unwrap();
    for variables in [
        &[("TS3100_CONTROL", place(&robot))][..],
        &[("TS3100_CONTROL_URL", &url)],
        &[("TS3100_CONTROL", "127.0.0.1:1"), ("TS3100_CONTROL_URL", &url)],
    ] {
        let output = ready(variables, &[]);
        expect_code(&output, 0);
        assert_eq!(stdout(&output), format!("the emulator at {url} is ready\n"));
    }
    expect_code(&ready(&[("TS3100_CONTROL", "127.0.0.1:1")], &["--url", &url]), 0);
}

#[test]
fn programs_get_json() {
    let robot = Serve::start(&[]);
    let url = robot.control.clone().unwrap();
    let output = ready(&[], &["--json", "--url", &url]);
    expect_code(&output, 0);
    assert_eq!(stdout(&output), format!("{{\"ready\":true,\"at\":\"{url}\"}}\n"));
    let url = format!("http://127.0.0.1:{}", free_port());
    let output = ready(&[], &["--json", "--url", &url]);
    expect_code(&output, 3);
    let begin = format!("{{\"ready\":false,\"at\":\"{url}\",\"reason\":\"cannot reach ");
    assert!(stdout(&output).starts_with(&begin), "{}", stdout(&output));
    assert_eq!(stderr(&output), "");
}

#[test]
fn an_interface_that_wants_a_token_answers() {
    let token = "0123456789abcdef";
    let robot = Serve::start(&["--control-token", token]);
    let control = ("TS3100_CONTROL", place(&robot));
    expect_code(&ready(&[control], &[]), 0);
    expect_code(&ready(&[control, ("TS3100_CONTROL_TOKEN", token)], &[]), 0);
}

#[test]
fn without_a_control_interface_it_asks_ip0() {
    let robot = Serve::start(&["--control", "off"]);
    let offset = (robot.ports[0].unwrap() - 1_000).to_string();
    let variables = [("TS3100_CONTROL", "off"), ("TS3100_PORT_OFFSET", &*offset)];
    expect_code(&ready(&variables, &[]), 0);
}

#[test]
fn nobody_there_is_3_and_not_in_time_is_4() {
    let control = free_port().to_string();
    let nobody = [("TS3100_CONTROL", &*control)];
    let output = ready(&nobody, &[]);
    expect_code(&output, 3);
    assert!(stderr(&output).contains(&format!("http://127.0.0.1:{control} is not ready")));
    expect_code(&ready(&nobody, &["--wait", "300ms"]), 4);
    expect_code(&ready(&nobody, &["--wait", "soon"]), 2);
    expect_code(&ready(&[("TS3100_PORT_OFFSET", "x")], &[]), 2);
}

#[test]
fn who_takes_the_connection_and_says_nothing_is_waited_for_no_longer_than_was_asked() {
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", silent.local_addr().unwrap());
    let output = ready(&[], &["--url", &url, "--wait", "200ms"]);
    expect_code(&output, 4);
    let errors = stderr(&output);
    assert!(errors.contains("not answered within 0."), "{errors}");
}

#[test]
fn it_finds_the_one_emulator_of_this_machine_by_its_state_file() {
    let directory = TempDir::new("ready");
    let own = ("XDG_RUNTIME_DIR", directory.path().to_str().unwrap());
    expect_code(&ready(&[own, ("TS3100_PORTS", "auto")], &["--wait", "100ms"]), 4);
    let robot = Serve::start_in(&[own], &[]);
    let output = ready(&[own], &[]);
    expect_code(&output, 0);
    assert!(stdout(&output).contains(place(&robot)), "{}", stdout(&output));
    let other = Serve::start_in(&[own], &["--control", "off"]);
    expect_code(&ready(&[own], &[]), 0);
    drop(robot);
    let output = ready(&[own], &[]);
    expect_code(&output, 0);
    assert!(stdout(&output).contains(&other.address(0)), "{}", stdout(&output));
}

#[test]
fn it_waits_for_one_that_starts_later() {
    let control = free_port().to_string();
    let waiting = std::thread::spawn({
        let control = control.clone();
        move || ready(&[("TS3100_CONTROL", &*control)], &["--wait", "60s"])
    });
    let _robot = Serve::start(&["--control", &control]);
    expect_code(&waiting.join().unwrap(), 0);
}

#[test]
fn a_port_of_the_robot_is_no_control_interface() {
    let robot = Serve::start(&[]);
    let other = format!("http://127.0.0.1:{}", robot.ports[0].unwrap());
    expect_code(&ready(&[], &["--url", &other]), 3);
}

/// Starts `ts3100 serve` with these words and reads stderr up to the line that ends its start; ends it on drop.
struct Started {
    child: std::process::Child,
    lines: Vec<String>,
}

impl Started {
    fn until(words: &[&str], last: &str) -> Started {
        let mut command = ts3100(&["serve", "--ports", "auto"]);
        command.args(words).stderr(Stdio::piped());
        let mut started = Started {
            child: command.spawn().unwrap(),
            lines: Vec::new(),
        };
        let stderr = BufReader::new(started.child.stderr.take().unwrap());
        for line in stderr.lines() {
            let line = line.unwrap();
            let ends = line.contains(last);
            started.lines.push(line);
            if ends {
                return started;
            }
        }
        panic!("no line with {last:?}: {:?}", started.lines);
    }
}

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_commands_of_the_banner_work_when_pasted() {
    for flags in [&[][..], &["--servo-on"], &["--model", "tsl3000-thl400"]] {
        let robot = Started::until(flags, "Press Ctrl-C");
        let commands = robot
            .lines
            .iter()
            .filter_map(|line| line.strip_prefix("  ts3100 "));
        let mut printed = Vec::new();
        for command in commands {
            let output = run(&command.split(' ').collect::<Vec<_>>());
            expect_code(&output, 0);
            printed.push(stdout(&output));
        }
        let last = printed.last().unwrap();
        assert!(last.starts_with("text: SQUARE           1<CR>"), "{last}");
        let servo = robot.lines.iter().any(|line| line.ends_with(" so"));
        assert_eq!(servo, !flags.contains(&"--servo-on"), "{:?}", robot.lines);
        let open = robot.lines.iter().find(|line| line.starts_with("Open "));
        assert!(open.unwrap().starts_with("Open http://127.0.0.1:"), "{open:?}");
    }
}

#[test]
fn commands_that_the_robot_would_refuse_are_not_suggested() {
    for flags in [&["--time", "stepped"], &["--control-right", "sig"]] {
        let robot = Started::until(flags, "Press Ctrl-C");
        let found = robot.lines.iter().filter(|line| line.starts_with("  ts3100 "));
        assert_eq!(found.count(), 1, "{:?}", robot.lines);
    }
}

#[test]
fn a_log_in_json_is_json_only() {
    let robot = Started::until(&["--log-format", "json"], r#""event":"ready""#);
    for line in &robot.lines {
        assert!(serde_json::from_str::<serde_json::Value>(line).is_ok(), "{line}");
    }
}

#[test]
fn an_open_control_interface_is_warned_about() {
    let words = ["--control", "0.0.0.0:0", "--control-open"];
    let robot = Started::until(&words, "Press Ctrl-C");
    let warning = "  warning: the control interface accepts every call";
    let found = robot.lines.iter().any(|line| line.starts_with(warning));
    assert!(found, "{:?}", robot.lines);
    drop(robot);
    let logged = Started::until(&[&words[..], &["--log-format", "json"]].concat(), "control-open");
    assert!(logged.lines[0].contains("WARN"), "{:?}", logged.lines);
    let output = run(&["serve", "--ports", "auto", "--control", "0.0.0.0:0"]);
    expect_code(&output, 2);
    assert!(stderr(&output).contains("--control-open"));
}
