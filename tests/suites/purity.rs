//! The pure crates cannot name a clock, a socket, a file or a thread: `#![no_std]` keeps the names out of the build, and
//! clippy refuses them where somebody brings `std` back. Both are tried here with the compiler.
//!
//! Which dependencies a crate may have is in `house.rs`.

use std::path::{Path, PathBuf};
use std::process::Command;
use ts3100_tests::testing::TempDir;

const PURE: [&str; 3] = ["proto", "scol-mini", "controller"];
const EDITION: &str = "2024";

/// What a pure crate must not name, as a function that names it.
const FORBIDDEN: [(&str, &str); 4] = [
    (
        "clock",
        "pub fn f() -> std::time::Instant { std::time::Instant::now() }",
    ),
    (
        "socket",
        "pub fn f(a: &str) -> Option<std::net::TcpStream> { std::net::TcpStream::connect(a).ok() }",
    ),
    (
        "file",
        "pub fn f(a: &str) -> Option<std::fs::File> { std::fs::File::open(a).ok() }",
    ),
    ("thread", "pub fn f() { drop(std::thread::spawn(|| {})); }"),
];

fn crate_folder(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../crates")
        .join(name)
}

/// The inner attributes of a crate: what its build obeys.
fn header(name: &str) -> String {
    let text = std::fs::read_to_string(crate_folder(name).join("src/lib.rs")).unwrap();
    text.lines()
        .filter(|line| line.starts_with("#!["))
        .map(|line| format!("{line}\n"))
        .collect()
}

/// Compiles a source and returns the messages of the compiler if it fails.
fn refusal(
    compiler: &str,
    folder: &Path,
    source: &str,
    arguments: &[&str],
    configuration: &Path,
) -> Option<String> {
    let file = folder.join("lib.rs");
    std::fs::write(&file, source).unwrap();
    let output = Command::new(compiler)
        .args([
            "--crate-type",
            "lib",
            "--emit",
            "metadata",
            "--edition",
            EDITION,
            "-o",
        ])
        .arg(folder.join("lib.rmeta"))
        .args(arguments)
        .arg(&file)
        .env("CLIPPY_CONF_DIR", configuration)
        .output()
        .unwrap_or_else(|error| {
            panic!("cannot run {compiler}: {error}; install it with `rustup component add clippy`")
        });
    (!output.status.success()).then(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn without_std_the_names_do_not_exist() {
    for name in PURE {
        let folder = TempDir::new(&format!("purity-rustc-{name}"));
        let header = header(name);
        assert!(header.contains("#![no_std]"), "{name} is not no_std");
        let refused = |source: &str| refusal("rustc", folder.path(), source, &[], &crate_folder(name));
        assert_eq!(refused(&header), None, "{name}: its header alone compiles");
        for (what, function) in FORBIDDEN {
            let message = refused(&format!("{header}{function}\n"));
            let message = message.unwrap_or_else(|| panic!("{name} may name a {what}"));
            assert!(
                message.contains("std"),
                "{name}: refused for another reason: {message}"
            );
        }
    }
}

#[test]
fn with_std_brought_back_clippy_refuses_them() {
    let lints = [
        "-D",
        "clippy::disallowed_types",
        "-D",
        "clippy::disallowed_methods",
    ];
    for name in PURE {
        let folder = TempDir::new(&format!("purity-clippy-{name}"));
        let header = format!("{}extern crate std;\n", header(name));
        let refused = |source: &str| {
            refusal(
                "clippy-driver",
                folder.path(),
                source,
                &lints,
                &crate_folder(name),
            )
        };
        assert_eq!(refused(&header), None, "{name}: its header alone passes");
        for (what, function) in FORBIDDEN {
            let message = refused(&format!("{header}{function}\n"));
            let message = message.unwrap_or_else(|| panic!("{name} may name a {what} with std"));
            assert!(
                message.contains("disallowed"),
                "{name}: refused for another reason: {message}"
            );
        }
    }
}
