//! `ts3100 serve` with serial lines: what the ready line says of them, the links of pseudo terminals through signals,
//! errors at the start.

use super::support::{Serve, run, stderr};
use serialport::TTYPort;
use std::io::{Read, Write};
use std::path::Path;
use ts3100_tests::host::LONG;
use ts3100_tests::testing::TempDir;

/// A host on the terminal asks for SU.
fn status(path: &Path) {
    let opened = serialport::new(path.to_str().unwrap(), 9_600).timeout(LONG);
    let mut host: TTYPort = opened.open_native().unwrap();
    host.write_all(b"\x02SU\r\x03").unwrap();
    let mut found = [0; 9];
    host.read_exact(&mut found).unwrap();
    assert_eq!(&found, b"\x02FL,MODE:");
}

#[test]
fn links_are_removed_by_a_signal_left_by_a_kill_and_replaced_by_the_next() {
    let directory = TempDir::new("binary");
    let (host, com1) = (directory.path().join("host"), directory.path().join("com1"));
    let words = ["--serial-dir", directory.path().to_str().unwrap()];
    let serve = Serve::start(&words);
    assert_eq!(serve.serial["host"], host.to_str().unwrap());
    assert_eq!(serve.serial["com1"], com1.to_str().unwrap());
    status(&host);
    let refused = run(&["serve", "--ports", "auto", words[0], words[1]]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("another running ts3100"),
        "{}",
        stderr(&refused)
    );
    serve.signal("KILL");
    let left = std::fs::symlink_metadata(&host);
    assert!(left.is_ok(), "a killed daemon cannot tidy up");
    let serve = Serve::start(&words);
    status(&host);
    assert_eq!(serve.signal("TERM").status.code(), Some(0));
    for link in [host, com1] {
        assert!(std::fs::symlink_metadata(&link).is_err(), "{}", link.display());
    }
}

#[test]
fn addresses_that_were_left_open_are_told() {
    let serve = Serve::start(&["--serial-host-rfc2217", ":0", "--serial-com1-tcp", "127.0.0.1:0"]);
    let place = |name: &str, scheme: &str| {
        let place = serve.serial[name].as_str().unwrap();
        let port: u16 = place.strip_prefix(scheme).unwrap().parse().unwrap();
        assert_ne!(port, 0);
    };
    place("host", "rfc2217://127.0.0.1:");
    place("com1", "socket://127.0.0.1:");
    let without = Serve::start(&[]);
    assert!(without.serial.is_null());
}

#[test]
fn two_ways_to_one_port_are_an_error() {
    let refused = run(&["serve", "--serial-host-tcp", "0", "--serial-host-rfc2217", "0"]);
    assert_eq!(refused.status.code(), Some(2));
    let printed = stderr(&refused);
    assert!(
        printed
            .contains("HOST can have one transport only: choose --serial-host-rfc2217 or --serial-host-tcp"),
        "{printed}"
    );
    let refused = run(&["serve", "--serial-com1-rfc2217", "somewhere"]);
    assert!(
        stderr(&refused).contains("expected ADDRESS:PORT"),
        "{}",
        stderr(&refused)
    );
}
