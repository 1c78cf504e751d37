//! A directory behind the RAM drive that takes no files: moved away while the emulator runs, which stops root as well.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use ts3100_tests::bench::{Bench, builder};
use ts3100_tests::host::Host;
use ts3100_tests::testing::TempDir;

const PROGRAM: &str = "GLOBAL\nN = 1\nEND\nPROGRAM TEST\nEND\n";

/// A directory that can be moved away and back; both are gone when this is.
struct Directory(TempDir);

impl Directory {
    fn new(name: &str) -> Directory {
        let directory = Directory(TempDir::new(name));
        std::fs::create_dir(directory.drive()).unwrap();
        directory
    }

    fn drive(&self) -> PathBuf {
        self.0.at("drive")
    }

    fn take_away(&self) {
        std::fs::rename(self.drive(), self.0.at("away")).unwrap();
    }

    fn put_back(&self) {
        std::fs::rename(self.0.at("away"), self.drive()).unwrap();
    }

    fn content(&self, name: &str) -> Option<String> {
        std::fs::read_to_string(self.drive().join(name)).ok()
    }
}

fn start(drive: &Path, when_full: &str) -> Bench {
    let builder = builder().drive(drive).file("TEST", PROGRAM).select("TEST");
    Bench::start(builder.option("drive.when_full", when_full).unwrap())
}

/// The answer to the last text of a download.
fn download(host: &mut TcpStream, name: &str, content: &str) -> String {
    assert_eq!(host.command(&format!("DL,{name}")), "OK");
    host.write_all(format!("\x02FL,{content}\x1a\x03").as_bytes())
        .unwrap();
    String::from_utf8(host.text()).unwrap().trim_end().to_owned()
}

fn text(robot: &Bench, name: &str) -> String {
    robot.get(&format!("/files/{name}"))["text"]
        .as_str()
        .unwrap()
        .to_owned()
}

fn unkept(robot: &Bench) -> String {
    robot.get("/health")["drive"]["unkept"].to_string()
}

#[test]
fn what_is_not_kept_is_refused_and_told() {
    let directory = Directory::new("refuse");
    let robot = start(&directory.drive(), "refuse");
    let mut host = robot.host();
    assert_eq!(download(&mut host, "A", "OLD\n"), "OK");
    assert_eq!(directory.content("A").as_deref(), Some("OLD\n"));
    assert_eq!(robot.get("/health")["drive"]["status"], "ok");
    directory.take_away();
    assert_eq!(download(&mut host, "A", "NEW\n"), "NG");
    assert_eq!(host.command("ER,A"), "NG");
    assert_eq!(host.command("MW,1 N 0 2"), "NG");
    for (method, path, body) in [
        ("PUT", "/files/A", r#"{"text": "NEW\n"}"#),
        ("DELETE", "/files/A", ""),
        ("PUT", "/variables/N", r#"{"value": [2], "restore": true}"#),
    ] {
        let words = robot.refused(507, method, path, body);
        assert!(words.contains("removed or replaced while ts3100 ran"), "{words}");
    }
    assert_eq!(
        (text(&robot, "A"), text(&robot, "TEST")),
        ("OLD\n".to_owned(), PROGRAM.to_owned())
    );
    assert_eq!(robot.get("/variables/N")["value"], serde_json::json!([1]));
    let drive = robot.get("/health")["drive"].clone();
    assert_eq!(
        (drive["status"].as_str(), drive["failures"].as_u64()),
        (Some("failing"), Some(6))
    );
    assert!(
        drive["error"].as_str().unwrap().contains("removed or replaced"),
        "{drive}"
    );
    assert_eq!(drive["unkept"], serde_json::json!([]));
    let metrics = robot.call_text("GET", "/metrics", "").1;
    for line in [
        "ts3100_drive_failing 1\n",
        "ts3100_drive_failures 6\n",
        "ts3100_drive_unkept_files 0\n",
    ] {
        assert!(metrics.contains(line), "{line}{metrics}");
    }
    directory.put_back();
    assert_eq!(host.command("ER,A"), "OK");
    assert_eq!(directory.content("A"), None);
    assert_eq!(robot.get("/health")["drive"]["status"], "ok");
}

#[test]
fn a_state_whose_files_are_not_kept_is_told_and_made_up_for() {
    let directory = Directory::new("states");
    let robot = start(&directory.drive(), "refuse");
    robot.put("/snapshots/before", "");
    robot.put("/files/A", r#"{"text": "A\n"}"#);
    directory.take_away();
    let words = robot.refused(507, "POST", "/snapshots/before/restore", "");
    assert!(words.contains("not all of its files are stored"), "{words}");
    robot.refused(404, "GET", "/files/A", "");
    assert_eq!(unkept(&robot), r#"["A"]"#);
    directory.put_back();
    assert_eq!(directory.content("A").as_deref(), Some("A\n"));
    robot.put("/files/B", r#"{"text": "B\n"}"#);
    assert_eq!((unkept(&robot).as_str(), directory.content("A")), ("[]", None));
    directory.take_away();
    robot.refused(507, "POST", "/reset", "");
    assert_eq!(unkept(&robot), r#"["B"]"#);
    directory.put_back();
    robot.post("/reset", "");
    assert_eq!((unkept(&robot).as_str(), directory.content("B")), ("[]", None));
}

#[test]
fn with_memory_the_change_happens_and_is_made_up_for() {
    let directory = Directory::new("memory");
    let robot = start(&directory.drive(), "memory");
    let mut host = robot.host();
    assert_eq!(download(&mut host, "GONE", "G\n"), "OK");
    directory.take_away();
    assert_eq!(download(&mut host, "A", "A\n"), "OK");
    assert_eq!(host.command("ER,GONE"), "OK");
    robot.put("/files/B", r#"{"text": "B\n"}"#);
    assert_eq!(unkept(&robot), r#"["A","B","GONE"]"#);
    assert_eq!(robot.get("/health")["drive"]["status"], "failing");
    directory.put_back();
    assert_eq!(directory.content("GONE").as_deref(), Some("G\n"));
    robot.put("/files/C", r#"{"text": "C\n"}"#);
    assert_eq!(unkept(&robot), "[]");
    for name in ["A", "B", "C"] {
        assert_eq!(directory.content(name), Some(format!("{name}\n")));
    }
    assert_eq!(directory.content("GONE"), None);
}

#[test]
fn without_a_directory_there_is_nothing_to_tell() {
    let robot = Bench::start(builder());
    assert!(robot.get("/health").get("drive").is_none());
    assert!(!robot.call_text("GET", "/metrics", "").1.contains("ts3100_drive"));
}
