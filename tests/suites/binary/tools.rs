//! The tools for programs from outside: `check` as documents, `fmt`.

use super::support::{Serve, expect_code, kill, run, stderr, stdout, ts3100};
use serde_json::Value;
use ts3100_tests::testing::{TempDir, eventually};

const UNTIDY: &str = "program t\nn=1\nprint ip1,n,cr ' Count\nend\n";
const TIDY: &str = "PROGRAM T\n  N = 1\n  PRINT IP1, N, CR ' Count\nEND\n";

#[test]
fn check_writes_documents() {
    let directory = TempDir::new("binary");
    let bad = directory.file("bad.scol", "PROGRAM BAD\nSPARE = 1\nGOTO NOWHERE\nEND\n");
    let output = run(&["check", "--format", "json", &bad]);
    assert_eq!(output.status.code(), Some(1));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["files"][0]["diagnostics"][0]["code"], "E0202");
    let output = run(&["check", "--format", "sarif", &bad]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["runs"][0]["results"][0]["ruleId"], "E0202");
}

#[test]
fn warnings_fail_only_where_they_are_denied() {
    let directory = TempDir::new("binary");
    let doubtful = directory.file("doubtful.scol", "PROGRAM T\nSPARE = 1\nEND\n");
    let output = run(&["check", &doubtful]);
    assert_eq!(output.status.code(), Some(0));
    assert!(stdout(&output).contains("warning[W0605]"), "{}", stdout(&output));
    assert!(stdout(&output).contains("no errors, 1 warning"));
    assert_eq!(
        run(&["check", "--deny-warnings", &doubtful]).status.code(),
        Some(1)
    );
}

#[test]
fn fmt_writes_only_what_changes() {
    let directory = TempDir::new("binary");
    let file = directory.file("t.scol", UNTIDY);
    let output = run(&["fmt", "--check", &file]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("t.scol: not formatted"));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), UNTIDY);
    assert_eq!(run(&["fmt", &file]).status.code(), Some(0));
    assert_eq!(std::fs::read_to_string(&file).unwrap(), TIDY);
    assert_eq!(run(&["fmt", "--check", &file]).status.code(), Some(0));
    let binary = directory.file("b.scol", b"PROGRAM\xff\n");
    assert_eq!(run(&["fmt", &binary]).status.code(), Some(2));
    assert_eq!(std::fs::read(&binary).unwrap(), b"PROGRAM\xff\n");
}

#[test]
fn fmt_shows_differences_that_patch_and_git_take() {
    let programs: [(&str, &[u8]); 5] = [
        ("in/a.scol", UNTIDY.as_bytes()),
        ("in/two words.scol", b"program t\r\nn=1\r\nend"),
        ("in/cr.scol", b"program t\rn=1\rend\r"),
        (
            "in/long.scol",
            &[UNTIDY.as_bytes(), &b"\n' x\n".repeat(9), b"\n\n\nDATA\nend\n"].concat(),
        ),
        ("in/tidy.scol", TIDY.as_bytes()),
    ];
    for tool in [
        &["patch", "-p0", "--binary", "--fuzz=0"][..],
        &["git", "apply", "-p0"],
    ] {
        let directory = TempDir::new("diff");
        std::fs::create_dir(directory.at("in")).unwrap();
        for (name, content) in programs {
            directory.file(name, content);
        }
        let fmt = |words: &[&str]| {
            let mut command = ts3100(&["fmt"]);
            command
                .args(words)
                .current_dir(directory.path())
                .output()
                .unwrap()
        };
        let diff = fmt(&["--diff", "in"]);
        expect_code(&diff, 1);
        for (name, content) in programs {
            assert_eq!(std::fs::read(directory.at(name)).unwrap(), content);
        }
        assert_eq!(
            stdout(&diff).matches("\n--- ").count() + 1,
            4,
            "{}",
            stdout(&diff)
        );
        for words in [&["--check", "--diff", "in"][..], &["--diff", "."]] {
            assert_eq!(fmt(words).stdout, diff.stdout, "{words:?}");
        }
        directory.file("changes.diff", &diff.stdout);
        let mut apply = std::process::Command::new(tool[0]);
        let apply = apply.args(&tool[1..]).current_dir(directory.path());
        let applied = apply.stdin(std::fs::File::open(directory.at("changes.diff")).unwrap());
        let applied = applied.output().unwrap();
        expect_code(&applied, 0);
        let output = fmt(&["--diff", "in"]);
        expect_code(&output, 0);
        assert_eq!(stdout(&output), "", "{tool:?}");
    }
}

#[test]
fn fmt_shows_the_difference_of_stdin() {
    let directory = TempDir::new("diff");
    let mut piped = ts3100(&["fmt", "--diff", "-"]);
    let untidy = std::fs::File::open(directory.file("t.scol", UNTIDY)).unwrap();
    let output = piped.stdin(untidy).output().unwrap();
    expect_code(&output, 1);
    assert!(stdout(&output).starts_with("--- <stdin>\n+++ <stdin>\n@@ -1,4 +1,4 @@\n-program t\n"));
    let tidy = std::fs::File::open(directory.file("t.scol", TIDY)).unwrap();
    let output = piped.stdin(tidy).output().unwrap();
    expect_code(&output, 0);
    assert_eq!(stdout(&output), "");
}

#[test]
fn a_folder_means_its_programs() {
    let directory = TempDir::new("folders");
    for folder in ["cell/b", "empty"] {
        std::fs::create_dir_all(directory.at(folder)).unwrap();
    }
    let deep = directory.file("cell/b/deep.scol", UNTIDY);
    let bad = directory.file("cell/bad.scol", "PROGRAM BAD\n  GOTO NOWHERE\nEND\n");
    let other = directory.file("cell/notes.csv", "P1,1,2,3\n");
    let cell = directory.at("cell");
    let cell = cell.to_str().unwrap();
    let output = run(&["check", cell]);
    expect_code(&output, 1);
    let said = stdout(&output);
    let places = [said.find("deep.scol: no errors"), said.find("bad.scol:2:")];
    assert!(places[0].is_some() && places[0] < places[1], "{said}");
    let empty = directory.at("empty");
    let empty = empty.to_str().unwrap();
    for (command, verb) in [("check", "read"), ("fmt", "format")] {
        let output = run(&[command, empty, cell]);
        expect_code(&output, 2);
        let expected = format!(
            "error: cannot {verb} {empty}: no SCOL files (*.scol) in this folder and the folders below\n"
        );
        assert_eq!(stderr(&output), expected);
    }
    assert_eq!(std::fs::read_to_string(deep).unwrap(), TIDY);
    assert_eq!(
        std::fs::read_to_string(bad).unwrap(),
        "PROGRAM BAD\n  GOTO NOWHERE\nEND\n"
    );
    assert_eq!(std::fs::read_to_string(other).unwrap(), "P1,1,2,3\n");
    let output = run(&["check", "--json", empty]);
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let reason = found["files"][0]["unreadable"].as_str().unwrap();
    assert!(reason.starts_with("no SCOL files"), "{reason}");
}

#[test]
fn colours_are_for_terminals_or_for_whoever_asks() {
    let directory = TempDir::new("binary");
    let bad = directory.file("bad.scol", "PROGRAM BAD\nGOTO NOWHERE\nEND\n");
    let is_coloured = |words: &[&str], environment: &[(&str, &str)]| {
        let mut command = ts3100(words);
        command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        let output = command.envs(environment.iter().copied()).output().unwrap();
        let both = [&output.stdout[..], &output.stderr].concat();
        assert!(!both.is_empty());
        both.contains(&0x1b)
    };
    let forced = [("CLICOLOR_FORCE", "1")];
    let refused = [("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")];
    let untidy = directory.file("untidy.scol", UNTIDY);
    let messages: [&[&str]; 5] = [
        &["check", &bad],
        &["fmt", "--diff", &untidy],
        &["check", "no-such.scol"],
        &["serve", "--help"],
        &["serve", "--ports", "auto", "--select", "NOPE"],
    ];
    for words in messages {
        assert!(!is_coloured(words, &[]), "{words:?} into a pipe");
        assert!(is_coloured(words, &forced), "{words:?} asked for colours");
        assert!(!is_coloured(words, &refused), "{words:?} refused colours");
    }
    let json: [&[&str]; 2] = [
        &["check", "--format", "json", &bad],
        &[
            "serve",
            "--ports",
            "auto",
            "--log-format",
            "json",
            "--select",
            "NOPE",
        ],
    ];
    for words in json {
        assert!(!is_coloured(words, &forced), "{words:?} is for programs");
    }
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let directory = TempDir::new("binary");
    let pages = directory.path().join("man1");
    assert_eq!(run(&["man", pages.to_str().unwrap()]).status.code(), Some(0));
    for (page, words) in [
        ("ts3100.1", "Emulator of the Toshiba Machine"),
        ("ts3100-serve.1", "TS3100_PORT_OFFSET"),
        ("ts3100-ctl-clock-advance.1", "Advance time"),
        (
            "ts3100-run.1",
            ".SH SYNOPSIS\n.nf\n&ts3100 run [OPTIONS] <FILE>\n",
        ),
        ("ts3100-run.1", ".SH EXAMPLES\n.nf\n&ts3100 run pick.scol"),
        ("ts3100-ctl.1", "ts3100 docs reference/ctl"),
        (
            "ts3100-ctl-files-get.1",
            ".SH EXAMPLES\n.nf\n&ts3100 ctl files get DEMO\n.fi\n",
        ),
        (
            "ts3100-host-rn.1",
            ".SH EXAMPLES\n.nf\n&ts3100 host 127.0.0.1:11000 rn --wait\n.fi\n",
        ),
        ("ts3100.1", "ts3100 explain CODE"),
    ] {
        let text = std::fs::read_to_string(pages.join(page)).unwrap();
        assert!(text.replace('\\', "").contains(words), "{page}:\n{text}");
    }
    let output = run(&["man", "/dev/null/man1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).starts_with("error: cannot write the manual pages to /dev/null/man1: "));
}

#[test]
fn the_documentation_is_printed_searched_and_explained() {
    let output = run(&["docs", "findings#no-stx"]);
    expect_code(&output, 0);
    assert!(stdout(&output).starts_with("### no-stx\n"), "{}", stdout(&output));
    for code in [
        "E0101",
        "left-in-exchange",
        "2-046",
        "text.end",
        "RN",
        "MOVEJ",
        "--port-offset",
    ] {
        let output = run(&["explain", code, "--json"]);
        expect_code(&output, 0);
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(found["sections"][0]["markdown"].is_string(), "{code}: {found}");
    }
    let output = run(&["docs", "--search", "feed", "hold"]);
    assert!(stdout(&output).contains("feed-hold"), "{}", stdout(&output));
    let output = run(&["docs", "--search", "xyzzy"]);
    expect_code(&output, 1);
    assert_eq!(stderr(&output), "error: no section has the words `xyzzy`\n");
    let output = run(&["explain", "left-in-exchnge"]);
    expect_code(&output, 2);
    assert!(
        stderr(&output).ends_with("did you mean `left-in-exchange`?\n"),
        "{}",
        stderr(&output)
    );
    // A page a line of the list, and every page is printed.
    let list = stdout(&run(&["docs"]));
    let pages = list.lines().filter(|line| line.starts_with("  ")).count();
    let all: Value = serde_json::from_slice(&run(&["docs", "--all", "--json"]).stdout).unwrap();
    assert_eq!(all["sections"].as_array().unwrap().len(), pages);
}

/// A pipe whose reader has gone.
#[cfg(target_os = "linux")]
fn closed_pipe() -> std::process::Stdio {
    std::io::pipe().unwrap().1.into()
}

#[test]
#[cfg(target_os = "linux")]
fn a_reader_that_has_gone_is_no_error_and_a_full_disk_is_one() {
    let directory = TempDir::new("binary");
    let serve = Serve::start(&[]);
    let (ip0, url) = (serve.address(0), serve.control.clone().unwrap());
    let program = directory.file("t.scol", "PROGRAM T\n  PRINT IP1, 1, CR\nEND\n");
    let untidy = directory.file("untidy.scol", UNTIDY);
    let wrong = directory.file("wrong.scol", "PROGRAM T\nGOTO NOWHERE\nEND\n");
    for (words, code) in [
        (&["fidelity"][..], 0),
        (&["docs"], 0),
        (&["docs", "--all"], 0),
        (&["docs", "--search", "alarm"], 0),
        (&["docs", "--json"], 0),
        (&["explain", "RN"], 0),
        (&["config", "schema"], 0),
        (&["completions", "bash"], 0),
        (&["serve", "--set", "help"], 0),
        (&["faults", "list"], 0),
        (&["faults", "list", "--json"], 0),
        (&["faults", "check", "ng"], 0),
        (&["faults", "check", "ng", "--json"], 0),
        (&["check", &program], 0),
        (&["check", &wrong], 1),
        (&["check", "--format", "json", &wrong], 1),
        (&["fmt", "--check", &untidy], 1),
        (&["run", &program], 0),
        (&["run", "--json", &program], 0),
        (&["ready", "--url", &url], 0),
        (&["ctl", "--url", &url, "state"], 0),
        (&["--version"], 0),
        (&["--help"], 0),
        (&["serve", "--help"], 0),
        (&["host", &ip0, "so"], 0),
        (&["host", &ip0, "su"], 0),
        (&["host", &ip0, "ul", "DEMO"], 0),
        (&["host", &ip0, "sl", "ABSENT"], 1),
    ] {
        let output = ts3100(words).stdout(closed_pipe()).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{words:?}: {}", stderr(&output));
        assert!(
            !stderr(&output).contains("rror: cannot"),
            "{words:?}: {}",
            stderr(&output)
        );
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = ts3100(words).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", stderr(&output));
        let expected = "cannot write to stdout: No space left on device";
        assert!(
            stderr(&output).contains(expected),
            "{words:?}: {}",
            stderr(&output)
        );
    }
    for (words, code) in [
        (&["run", "--trace", &program][..], 0),
        (&["run", &wrong], 2),
        (&["host", &ip0, "sl"], 2),
    ] {
        let output = ts3100(words).stderr(closed_pipe()).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{words:?}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_robot_needs_nobody_to_read_its_banner() {
    let mut command = ts3100(&["serve", "--ports", "auto"]);
    let mut child = command.stderr(closed_pipe()).spawn().unwrap();
    // It is written just before the banner.
    let state = format!("{}/ts3100/{}.json", env!("CARGO_TARGET_TMPDIR"), child.id());
    eventually("it is announced", || {
        let is_there = child.try_wait().unwrap().is_some() || std::path::Path::new(&state).exists();
        is_there.then_some(())
    });
    kill("TERM", child.id());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn a_fault_file_that_cannot_be_read_is_no_fault_that_is_wrong() {
    let directory = TempDir::new("binary");
    let wrong = directory.file("wrong.toml", "[[fault]]\nkind = \"ngg\"\n");
    assert_eq!(
        run(&["faults", "check", "--faults", &wrong]).status.code(),
        Some(1)
    );
    for words in [
        &["--faults", "absent.toml"][..],
        &["--faults", "absent.toml", "ngg"],
    ] {
        let output = run(&[&["faults", "check"], words].concat());
        assert_eq!(output.status.code(), Some(2), "{words:?}");
    }
}

/// A program in encodings that are not read, and the words of the message.
fn foreign_files() -> Vec<(Vec<u8>, &'static str)> {
    let program = "PROGRAM P\nREMARK GR_E\nEND\n";
    let utf16 = |to_bytes: fn(u16) -> [u8; 2]| program.encode_utf16().flat_map(to_bytes).collect::<Vec<u8>>();
    let with = |instead: &[u8]| {
        program
            .as_bytes()
            .split(|byte| *byte == b'_')
            .collect::<Vec<_>>()
            .join(instead)
    };
    let (little, big) = (utf16(u16::to_le_bytes), utf16(u16::to_be_bytes));
    vec![
        (
            [b"\xEF\xBB\xBF", program.as_bytes()].concat(),
            "UTF-8 with a byte order mark",
        ),
        (
            [b"\xFF\xFE", &little[..]].concat(),
            "UTF-16 (little-endian) with a byte order mark",
        ),
        (
            [b"\xFE\xFF", &big[..]].concat(),
            "UTF-16 (big-endian) with a byte order mark",
        ),
        (little, "UTF-16 (little-endian) without a byte order mark"),
        (big, "UTF-16 (big-endian) without a byte order mark"),
        (
            with(b"\xFC"),
            "Latin-1 or Windows-1252 (line 2, column 10: byte FC)",
        ),
        (
            with(b"\x83\x65\x83\x58"),
            "Shift-JIS (line 2, column 10: byte 83)",
        ),
    ]
}

#[test]
fn a_file_in_another_encoding_gets_one_message_with_the_remedy_at_every_door() {
    let directory = TempDir::new("encodings");
    let robot = Serve::start(&[]);
    let host = robot.address(0);
    for (content, words) in foreign_files() {
        let file = directory.file("pick.scol", &content);
        for command in [
            &["check", &file][..],
            &["fmt", &file],
            &["run", &file],
            &["serve", "--ports", "auto", "--load", &file],
            &["host", &host, "dl", &file],
        ] {
            let output = run(command);
            expect_code(&output, 2);
            let said = stderr(&output);
            assert!(said.contains(&format!("it is {words}")), "{command:?}: {said}");
            assert!(said.contains("; save it as ASCII"), "{command:?}: {said}");
            assert_eq!(said.matches("it is ").count(), 1, "{command:?}: {said}");
            assert_eq!(stdout(&output), "", "{command:?}");
            assert_eq!(std::fs::read(&file).unwrap(), content, "{command:?}");
        }
    }
}

/// Whatever bytes a file has, it is formatted whole or left as it is.
#[test]
fn fmt_never_writes_a_file_that_it_could_not_read_whole() {
    let directory = TempDir::new("broken");
    let program = "PROGRAM P\nIF A = 1 THEN GOTO L\nL:\nPRINT TP, \"X\", CR\nEND\n";
    let foreign = foreign_files().into_iter().map(|(content, _)| content);
    let mut files: Vec<Vec<u8>> = foreign.collect();
    for at in (0..program.len()).step_by(5) {
        for byte in [0x00, 0x1A, 0x80, 0xC3, 0xFF] {
            let mut broken = program.as_bytes().to_vec();
            broken[at] = byte;
            files.push(broken);
        }
        // Half of a UTF-16 file: an odd number of bytes.
        let wide: Vec<u8> = program.bytes().flat_map(|byte| [byte, 0]).collect();
        files.push(wide[..2 * at + 1].to_vec());
    }
    let paths: Vec<String> = (0..)
        .zip(&files)
        .map(|(number, content)| directory.file(&format!("f{number}.scol"), content))
        .collect();
    let words: Vec<&str> = ["fmt"]
        .into_iter()
        .chain(paths.iter().map(String::as_str))
        .collect();
    run(&words);
    for (path, before) in paths.iter().zip(&files) {
        let after = std::fs::read(path).unwrap();
        if str::from_utf8(before).is_err() || before.contains(&0) {
            assert_eq!(&after, before, "{path}");
            continue;
        }
        // Formatting changes blanks, letter case and line ends, and loses nothing else.
        let kept = |content: &[u8]| {
            content
                .iter()
                .filter(|byte| !byte.is_ascii_whitespace())
                .map(u8::to_ascii_uppercase)
                .collect::<Vec<_>>()
        };
        assert_eq!(kept(&after), kept(before), "{path}");
    }
}
