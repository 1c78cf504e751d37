//! Who may call: token, Host, Origin, kinds of body, sizes, garbage.

use serde_json::Value;
use std::io::Write as _;
use std::time::Duration;
use ts3100_emulator::client::Client;
use ts3100_emulator::control::ControlSettings;
use ts3100_tests::bench::{Bench, builder};
use ts3100_tests::host::{Host, dial_address};

const TOKEN: &str = "0123456789abcdef";

/// Path and method of every operation of the OpenAPI document.
fn operations(document: &str) -> Vec<(String, String)> {
    let document: Value = serde_json::from_str(document).unwrap();
    let paths = document["paths"].as_object().unwrap().iter();
    let operations = paths.flat_map(|(path, item)| {
        let methods = item.as_object().unwrap().keys();
        methods.map(|method| (path.clone(), method.to_ascii_uppercase()))
    });
    operations.collect()
}

fn with_headers(robot: &Bench, headers: &str) -> u16 {
    let answer = robot.raw(format!("GET /state HTTP/1.1\r\nConnection: close\r\n{headers}\r\n").as_bytes());
    answer
        .split(' ')
        .nth(1)
        .and_then(|status| status.parse().ok())
        .unwrap_or_default()
}

#[test]
fn what_others_have_made_up_is_shown_and_not_obeyed() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    host.command("\x1b[2J");
    host.command("\x7f\x08");
    let (_, metrics) = robot.call_text("GET", "/metrics", "");
    assert!(metrics.contains("x1b["), "{metrics}");
    let raw = |text: &str| {
        text.chars()
            .any(|letter| letter.is_control() && !"\n\t".contains(letter))
    };
    assert!(!raw(&metrics), "{metrics:?}");
    let long = "A".repeat(50_000);
    for (method, path, body) in [
        ("GET", "/files/%1B%5B2J%07".to_owned(), String::new()),
        ("POST", "/files/%1B%5B2J%07/select".to_owned(), String::new()),
        ("DELETE", "/files/%C2%9BA".to_owned(), String::new()),
        ("GET", "/variables/%C2%9B".to_owned(), String::new()),
        ("GET", "/faults/%0D%0A%09".to_owned(), String::new()),
        (
            "PUT",
            "/key-switch".to_owned(),
            "{\"position\":\"\\u001b[2J\\u009b\"}".to_owned(),
        ),
        (
            "PUT",
            "/key-switch".to_owned(),
            "{\"\\u001b\\u202e\":1}".to_owned(),
        ),
        ("PUT", "/key-switch".to_owned(), format!("{{\"{long}\":1}}")),
        ("POST", "/faults".to_owned(), format!("{{\"kind\":\"{long}\"}}")),
    ] {
        let (status, answer) = robot.call(method, &path, &body);
        assert!(status >= 400, "{path}");
        let words = answer["error"].as_str().unwrap();
        assert!(!raw(words), "{path}: {words:?}");
        assert!(words.len() < 4_000, "{path}: {} bytes", words.len());
    }
}

#[test]
fn numbers_beyond_what_the_controller_holds_are_refused() {
    let robot = ts3100_tests::bench::running("GLOBAL\nX = 1.5\nEND\nPROGRAM TEST\nDELAY 1\nEND\n");
    for (method, path, bodies) in [
        (
            "PUT",
            "/variables/X",
            &["{\"value\":1e308}", "{\"value\":-3.5e38}", "{\"value\":1e999}"][..],
        ),
        (
            "POST",
            "/clock/advance",
            &[
                "{\"seconds\":1e9}",
                "{\"seconds\":-1}",
                "{\"seconds\":1e308}",
                "{\"seconds\":1,\"wall\":1e308}",
                "{\"seconds\":1,\"wall\":601}",
                "{\"seconds\":1,\"wall\":600.0000000000001}",
            ],
        ),
        (
            "POST",
            "/clock/advance-until",
            &[
                "{\"condition\":{\"line\":0},\"within\":1}",
                "{\"condition\":{\"line\":4294967296},\"within\":1}",
                "{\"condition\":{\"input\":{\"line\":65536,\"on\":true}},\"within\":1}",
            ],
        ),
        (
            "PUT",
            "/clock",
            &[
                "{\"mode\":\"x1e308\"}",
                "{\"mode\":\"xinf\"}",
                "{\"mode\":\"xNaN\"}",
                "{\"mode\":\"x0\"}",
            ],
        ),
        (
            "POST",
            "/inputs/5/pulse",
            &["{\"seconds\":1e308}", "{\"seconds\":-1}"],
        ),
        ("PUT", "/inputs/65536", &["{\"on\":true}"]),
        ("PUT", "/inputs/0", &["{\"on\":true}"]),
        (
            "POST",
            "/faults",
            &[
                "{\"kind\":\"ng\",\"after\":1e20}",
                "{\"kind\":\"ng\",\"times\":-1}",
                "{\"kind\":\"ng\",\"probability\":1.5}",
                "{\"kind\":\"late-reply\",\"delay\":\"1e300s\"}",
                "{\"kind\":\"late-reply\",\"delay\":18446744073709551615}",
            ],
        ),
    ] {
        for body in bodies {
            let (status, answer) = robot.call(method, path, body);
            assert!(
                (400..500).contains(&status),
                "{method} {path} {body}: {status} {answer}"
            );
        }
    }
    assert_eq!(robot.get("/variables/X")["value"], serde_json::json!([1.5]));
}

#[test]
fn only_a_host_of_this_machine_is_served() {
    let robot = Bench::start(builder());
    let port = robot.emulator.control().unwrap().port();
    for host in [
        "localhost",
        "LOCALHOST:1",
        "127.0.0.1",
        &format!("127.0.0.1:{port}"),
        "[::1]",
        "[::1]:3100",
    ] {
        assert_eq!(with_headers(&robot, &format!("Host: {host}\r\n")), 200, "{host}");
    }
    for headers in [
        "Host: evil.example\r\n",
        "Host: evil.example:3100\r\n",
        "Host: localhost.evil.example\r\n",
        "Host: 127.0.0.1.evil.example\r\n",
        "Host: 10.0.0.1\r\n",
        "Host: [::2]\r\n",
        "Host: \r\n",
        "Host: user@localhost\r\n",
    ] {
        assert_eq!(with_headers(&robot, headers), 403, "{headers}");
    }
    assert_eq!(
        with_headers(&robot, "Host: localhost\r\nHost: evil.example\r\n"),
        403
    );
    let none = robot.raw(b"GET /state HTTP/1.0\r\n\r\n");
    assert!(none.starts_with("HTTP/1.0 403"), "{none}");
    let absolute =
        robot.raw(b"GET http://evil.example/state HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    assert!(absolute.starts_with("HTTP/1.1 403"), "{absolute}");
}

#[test]
fn a_name_may_be_allowed() {
    let control = ControlSettings {
        hosts: vec!["Robot-7".to_owned()],
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(control));
    assert_eq!(with_headers(&robot, "Host: robot-7:80\r\n"), 200);
    assert_eq!(with_headers(&robot, "Host: robot-8\r\n"), 403);
}

#[test]
fn with_a_token_or_an_open_interface_every_name_is_served() {
    let guarded = ControlSettings {
        token: Some(TOKEN.to_owned()),
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(guarded));
    let token = format!("Authorization: Bearer {TOKEN}\r\n");
    for host in ["robot", "robot:3100", "robot.seat.example", "10.0.0.1"] {
        let host = format!("Host: {host}\r\n");
        assert_eq!(with_headers(&robot, &format!("{host}{token}")), 200, "{host}");
        assert_eq!(with_headers(&robot, &host), 401, "{host}");
    }
    let foreign = "Host: robot\r\nOrigin: http://evil.example\r\n";
    assert_eq!(with_headers(&robot, &format!("{foreign}{token}")), 403);
    let several = "Host: robot\r\nHost: robot\r\n";
    assert_eq!(with_headers(&robot, &format!("{several}{token}")), 403);

    let open = ControlSettings {
        open: true,
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(open));
    assert_eq!(with_headers(&robot, "Host: robot:3100\r\n"), 200);
    assert_eq!(
        with_headers(&robot, "Host: robot\r\nOrigin: http://robot\r\n"),
        200
    );
    assert_eq!(with_headers(&robot, foreign), 403);
    assert_eq!(with_headers(&robot, several), 403);
    assert_eq!(
        with_headers(&robot, "Host: robot\r\nSec-Fetch-Site: cross-site\r\n"),
        403
    );
}

#[test]
fn an_open_interface_with_a_token_still_needs_the_token() {
    let both = ControlSettings {
        token: Some(TOKEN.to_owned()),
        open: true,
        ..ControlSettings::free()
    };
    assert!(!both.accepts_everybody());
    let robot = Bench::start(builder().control(both));
    assert_eq!(with_headers(&robot, "Host: localhost\r\n"), 401);
}

#[test]
fn no_page_of_another_origin_is_served() {
    let robot = Bench::start(builder());
    let own = "Host: localhost:3100\r\n";
    for headers in [
        "Origin: http://localhost:3100\r\n",
        "Sec-Fetch-Site: none\r\n",
        "Sec-Fetch-Site: same-origin\r\nOrigin: http://LOCALHOST:3100\r\n",
    ] {
        assert_eq!(with_headers(&robot, &format!("{own}{headers}")), 200, "{headers}");
    }
    for headers in [
        "Origin: http://evil.example\r\n",
        "Origin: null\r\n",
        "Origin: https://localhost:3100\r\n",
        "Origin: http://localhost:8080\r\n",
        "Origin: http://localhost\r\n",
        "Origin: \r\n",
        "Sec-Fetch-Site: cross-site\r\n",
        "Sec-Fetch-Site: same-site\r\n",
    ] {
        assert_eq!(with_headers(&robot, &format!("{own}{headers}")), 403, "{headers}");
    }
    for path in ["/events", "/openapi.json", "/", "/docs", "/metrics"] {
        let request = format!(
            "GET {path} HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\nConnection: close\r\n\r\n"
        );
        let answer = robot.raw(request.as_bytes());
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
        assert!(
            !answer.to_ascii_lowercase().contains("access-control-"),
            "{answer}"
        );
    }
    let preflight = robot.raw(
        b"OPTIONS /servo HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example\r\n\
          Access-Control-Request-Method: PUT\r\nConnection: close\r\n\r\n",
    );
    assert!(preflight.starts_with("HTTP/1.1 403"), "{preflight}");
}

#[test]
fn with_a_token_every_call_needs_it() {
    let control = ControlSettings {
        token: Some(TOKEN.to_owned()),
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(control));
    let url = format!("http://{}", robot.emulator.control().unwrap());
    let client = Client::new(&url, Some(TOKEN.to_owned())).unwrap();
    let (_, document) = client.call("GET", "/openapi.json", None).unwrap();
    for (path, method) in operations(&document) {
        let path = path
            .replace("{line}", "1")
            .replace("{number}", "2-046")
            .replace("{port}", "IP0")
            .replace("{name}", "TEST");
        robot.refused(401, &method, &path, "");
    }
    robot.refused(401, "GET", "/openapi.json", "");
    for wrong in ["0123456789abcdee", "0123456789abcde", "0123456789abcdeff"] {
        let client = Client::new(&url, Some(wrong.to_owned())).unwrap();
        assert_eq!(client.call("GET", "/state", None).unwrap().0, 401, "{wrong}");
    }
    assert_eq!(client.call("GET", "/state", None).unwrap().0, 200);
    let own = "Host: localhost\r\n";
    for (headers, status) in [
        (format!("authorization: bearer {TOKEN}\r\n"), 200),
        (format!("Authorization: Basic {TOKEN}\r\n"), 401),
        (format!("Authorization: {TOKEN}\r\n"), 401),
        (
            format!("Authorization: Bearer {TOKEN}\r\nAuthorization: Bearer {TOKEN}\r\n"),
            401,
        ),
    ] {
        assert_eq!(
            with_headers(&robot, &format!("{own}{headers}")),
            status,
            "{headers}"
        );
    }
    // The pages ask for the token themselves. They load nothing, and speak to where they come from.
    for path in ["/", "/docs"] {
        let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
        let page = robot.raw(request.as_bytes());
        assert!(page.starts_with("HTTP/1.1 200"), "{page}");
        assert!(page.contains("default-src 'none'; connect-src 'self';"), "{page}");
        // What it loads is its own, and nothing it shows becomes part of its code.
        for attribute in ["src=\"", "href=\""] {
            for value in page.split(attribute).skip(1) {
                let own = ["ui/", "#", "../", "openapi.json", "docs", "book/", "./"];
                assert!(
                    own.iter().any(|own| value.starts_with(own)),
                    "{path}: {attribute}{value:.40}"
                );
            }
        }
        for loads in ["http://", "https://", "@import", "innerHTML", "localStorage"] {
            assert!(
                !page.replace("http://www.w3.org/", "").contains(loads),
                "{path}: {loads}"
            );
        }
    }
}

#[test]
fn beyond_the_loopback_there_is_no_interface_without_a_token() {
    let everywhere = ControlSettings {
        address: "0.0.0.0:0".parse().unwrap(),
        ..ControlSettings::free()
    };
    let words = everywhere.clone().validate().unwrap_err().to_string();
    assert!(words.contains("--control-token"), "{words}");
    assert!(words.contains("--control-open"), "{words}");
    let open = ControlSettings {
        open: true,
        ..everywhere.clone()
    };
    assert!(open.validate().is_ok());
    let short = ControlSettings {
        token: Some("short".to_owned()),
        ..everywhere.clone()
    };
    assert!(short.validate().is_err());
    let allowed = ControlSettings {
        token: Some(TOKEN.to_owned()),
        ..everywhere
    };
    assert!(allowed.validate().is_ok());
}

#[test]
fn what_changes_something_is_json() {
    let robot = Bench::start(builder());
    for kind in [
        "text/plain",
        "application/x-www-form-urlencoded",
        "multipart/form-data; boundary=a",
        "application/jsonp",
    ] {
        let request = format!(
            "PUT /servo HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Type: {kind}\r\n\
             Content-Length: 11\r\n\r\n{{\"on\":true}}"
        );
        let answer = robot.raw(request.as_bytes());
        assert!(answer.starts_with("HTTP/1.1 415"), "{kind}: {answer}");
    }
    let bare = b"PUT /servo HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 11\r\n\r\n{\"on\":true}";
    assert!(robot.raw(bare).starts_with("HTTP/1.1 415"));
    // A body whose length is not announced is a body too.
    let chunked =
        b"PUT /servo HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nTransfer-Encoding: chunked\r\n\r\n\
        b\r\n{\"on\":true}\r\n0\r\n\r\n";
    let answer = robot.raw(chunked);
    assert!(answer.starts_with("HTTP/1.1 415"), "{answer}");
    let form = b"POST /program/stop HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
        Content-Type: text/plain\r\nContent-Length: 0\r\n\r\n";
    assert!(robot.raw(form).starts_with("HTTP/1.1 415"));
    assert_eq!(robot.get("/servo")["on"], false);
}

#[test]
fn who_does_not_send_a_whole_request_gives_way_to_others() {
    let robot = Bench::start(builder());
    let address = robot.emulator.control().unwrap();
    let dial = |bytes: &str| {
        let mut stream = dial_address(address);
        stream.write_all(bytes.as_bytes()).unwrap();
        stream
    };
    // Before a slow request would be given up.
    let client = Client::new(&format!("http://{address}"), None).unwrap();
    let client = client.with_timeout(Duration::from_secs(4));
    let head = "Host: localhost\r\nContent-Type: application/json\r\nContent-Length: 11\r\n";
    let mut events = dial("GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
    events.read_until(b'\n');
    for begun in [
        "",
        "G",
        &format!("PUT /servo HTTP/1.1\r\n{head}"),
        &format!("PUT /servo HTTP/1.1\r\n{head}\r\n{{"),
    ] {
        // Three times as many as there are places.
        let slow: Vec<_> = (0..192).map(|_| dial(begun)).collect();
        let health = client.call("GET", "/health", None);
        assert!(matches!(health, Ok((200, _))), "{begun}: {health:?}");
        drop(slow);
    }
    // A stream of events is a request that is served.
    robot.put("/battery", "{\"low\":true}");
    let seen = events.read_until(b'}');
    assert!(
        String::from_utf8_lossy(&seen).contains("Battery"),
        "{}",
        seen.escape_ascii()
    );
}

#[test]
fn refusals_have_no_words_of_rust() {
    let robot = Bench::start(builder());
    for (status, method, path, body, words) in [
        (
            422,
            "PUT",
            "/override",
            "{\"percent\":\"x\"}",
            "request body: expected a number, found \"x\" at line 1 column 14",
        ),
        (
            400,
            "POST",
            "/channels/IP1/inject",
            "{}",
            "request body: the object is empty; expected `text` or `hex`",
        ),
        (
            422,
            "PUT",
            "/inputs/5",
            "{}",
            "request body: the field `on` is missing",
        ),
        (
            400,
            "PUT",
            "/inputs/5",
            "{on:1}",
            "request body: expected a name in double quotes at line 1 column 2",
        ),
        (
            400,
            "PUT",
            "/inputs/5",
            "{\"on\":tru}",
            "request body: expected true, false or null at line 1 column 10",
        ),
        (
            400,
            "PUT",
            "/snapshot",
            "{",
            "request body: this is not a snapshot: the JSON ends too early at line 1 column 1",
        ),
        (
            409,
            "PUT",
            "/snapshot",
            "{\"a\":1}",
            "request body: this is not a snapshot: the field `format` is missing",
        ),
        (
            400,
            "PUT",
            "/inputs/99999",
            "{\"on\":true}",
            "path /inputs/99999: expected a line, 1-64, 101-164, 201-264, 301-364, 401-464, found `99999`",
        ),
        (
            400,
            "GET",
            "/events?since=x",
            "",
            "query: since: expected a whole number",
        ),
        (
            404,
            "GET",
            "/variables/5x",
            "",
            "`5x` is not the name of a variable: character 1 is '5', not a letter",
        ),
        (
            404,
            "GET",
            "/alarms/table/2-46",
            "",
            "unknown number `2-46`: expected an alarm of /alarms/table; did you mean `2-046`?",
        ),
    ] {
        assert_eq!(robot.refused(status, method, path, body), words);
    }
    robot.post("/power/off", "{}");
    for (path, body, words) in [
        (
            "/files/B",
            "{\"text\":\"PROGRAM B\"}",
            "cannot store B: the power is off; turn it on first",
        ),
        (
            "/outputs/5",
            "{\"on\":true}",
            "cannot set output 5: the power is off; turn it on first",
        ),
    ] {
        assert_eq!(robot.refused(409, "PUT", path, body), words);
    }
}

#[test]
fn what_cannot_be_read_is_refused_with_words() {
    let robot = Bench::start(builder());
    for (status, body) in [
        (400, "{"),
        (400, "{\"on\":tru}"),
        (422, "{}"),
        (422, "{\"on\":1}"),
        (422, "{\"on\":true,\"off\":false}"),
        (422, "[]"),
    ] {
        let words = robot.refused(status, "PUT", "/servo", body);
        assert!(words.starts_with("request body: "), "{words}");
    }
    let words = robot.refused(422, "PUT", "/emergency-stop", "{\"press\":true}");
    assert_eq!(
        words,
        "request body: unknown field `press`; did you mean `pressed`?"
    );
    robot.refused(400, "POST", "/program/stop", "{\"now\":true}");
    robot.refused(404, "GET", "/no/such/path", "");
    for path in ["/state", "/", "/docs", "/openapi.json", "/book/"] {
        robot.refused(405, "POST", path, "");
    }
    robot.refused(400, "GET", "/inputs/first", "");
    robot.refused(400, "GET", "/events?since=x", "");
    let large = format!("{{\"text\":\"{}\"}}", "A".repeat(300_000));
    robot.refused(413, "PUT", "/files/LARGE", &large);
    for garbage in [
        b"\x02SO\r\x03\r\n\r\n".as_slice(),
        b"GET\r\n\r\n",
        b"\xff\xfe\x00",
    ] {
        let answer = robot.raw(&[garbage, b"\r\n\r\n"].concat());
        assert!(
            answer.is_empty() || answer.starts_with("HTTP/1.1 400"),
            "{answer}"
        );
    }
    assert_eq!(robot.get("/health")["status"], "ok");
}

#[test]
fn every_operation_of_the_document_is_served() {
    let robot = Bench::start(builder());
    let found = operations(&robot.call_text("GET", "/openapi.json", "").1);
    assert!(found.len() > 50, "{}", found.len());
    for (path, method) in found {
        let path = path.replace("{line}", "999").replace("{number}", "9-999");
        let path = path.replace("{port}", "IP0").replace("{name}", "NONE");
        // A body that no call takes: nothing happens, and the path is known.
        let body = if method == "GET" { "" } else { "[1]" };
        if path == "/events" {
            continue;
        }
        let (status, answer) = robot.call_text(&method, &path, body);
        assert!(
            [200, 400, 404, 409, 422].contains(&status),
            "{method} {path}: {status} {answer}"
        );
        assert!(
            !answer.contains("a path of /openapi.json"),
            "{method} {path}: {answer}"
        );
    }
}

/// The policy of a page, and the status of a request for it with these headers.
fn page_policy(robot: &Bench, path: &str, headers: &str) -> (String, String) {
    let request = format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{headers}\r\n");
    let answer = robot.raw(request.as_bytes());
    let status = answer.split(' ').nth(1).unwrap_or_default().to_owned();
    let policy = answer
        .lines()
        .find_map(|line| line.strip_prefix("content-security-policy: "));
    (status, policy.unwrap_or_default().to_owned())
}

#[test]
fn a_page_is_shown_in_a_frame_of_the_named_origins_only() {
    const FRAME: &str =
        "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: iframe\r\nSec-Fetch-Mode: navigate\r\n";
    let pages = ["/", "/docs", "/book/"];
    let alone = Bench::start(builder());
    for page in pages {
        let (status, policy) = page_policy(&alone, page, "");
        assert!(
            status == "200" && policy.contains("frame-ancestors 'none'"),
            "{page}: {status} {policy}"
        );
        assert_eq!(page_policy(&alone, page, FRAME).0, "403", "{page}");
    }
    let control = ControlSettings {
        frame_ancestors: vec!["vscode-webview:".to_owned(), "http://localhost:8080".to_owned()],
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(control));
    for page in pages {
        let (status, policy) = page_policy(&robot, page, FRAME);
        assert_eq!(status, "200", "{page}");
        let part = policy.split(';').find(|part| part.contains("frame-ancestors"));
        assert_eq!(
            part.unwrap().trim(),
            "frame-ancestors vscode-webview: http://localhost:8080",
            "{page}"
        );
    }
    // What a page tells of a robot is asked for by its own scripts.
    assert_eq!(page_policy(&robot, "/state", FRAME).0, "403");
    for headers in [
        "Sec-Fetch-Site: cross-site\r\n",
        "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Dest: script\r\n",
        "Origin: http://localhost:8080\r\nSec-Fetch-Site: same-site\r\nSec-Fetch-Dest: iframe\r\n",
    ] {
        assert_eq!(page_policy(&robot, "/", headers).0, "403", "{headers}");
    }
}

#[test]
fn what_names_more_than_an_origin_is_refused() {
    let checked = |origin: &str| {
        let settings = ControlSettings {
            frame_ancestors: vec![origin.to_owned()],
            ..ControlSettings::free()
        };
        settings.validate().map(|_| ()).map_err(|error| error.to_string())
    };
    for origin in [
        "vscode-webview:",
        "vscode-webview://1hhjo4v0",
        "http://localhost:8080",
        "https://editor.example",
        "http://[::1]:80",
    ] {
        assert_eq!(checked(origin), Ok(()), "{origin}");
    }
    for origin in [
        "",
        "*",
        "'self'",
        "http:",
        "HTTPS:",
        "data:",
        "http://",
        "http://*.example",
        "http://a.example/path",
        "http://a.example b.example",
        "http://a.example;",
        "http://a.example,x",
        "http://a.example:*",
        "http://a.example:65536",
        "http://[::1",
        "localhost:8080",
        "1a://b",
        "http://a\r\nX: y",
    ] {
        let refused = checked(origin).unwrap_err();
        assert!(
            refused.starts_with("--control-frame-ancestor: expected "),
            "{origin}: {refused}"
        );
    }
}
