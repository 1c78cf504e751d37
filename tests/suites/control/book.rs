//! `/book/`: every page is reached from the first, every link of every page leads somewhere, and nothing is loaded from elsewhere.

use std::collections::{BTreeMap, BTreeSet};
use ts3100_book::{book, explain_path};
use ts3100_emulator::control::ControlSettings;
use ts3100_tests::bench::{Bench, builder};

/// A path without `.` and `..`, relative to another.
fn resolved(base: &str, link: &str) -> String {
    let mut parts: Vec<&str> = base.split('/').collect();
    parts.pop();
    if let Some(absolute) = link.strip_prefix('/') {
        return format!("/{absolute}");
    }
    for part in link.split('/') {
        match part {
            "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// The links of a page.
fn links(page: &str) -> impl Iterator<Item = &str> {
    let links = page.split("href=\"").skip(1);
    links.filter_map(|rest| rest.split('"').next())
}

#[test]
fn every_page_is_reached_and_every_link_leads_somewhere() {
    let robot = Bench::start(builder());
    let mut wanted = vec!["/book/".to_owned()];
    let mut anchors: BTreeSet<(String, String)> = BTreeSet::new();
    let mut seen: BTreeMap<String, String> = BTreeMap::new();
    while let Some(path) = wanted.pop() {
        if seen.contains_key(&path) {
            continue;
        }
        let (status, text) = robot.call_text("GET", &path, "");
        assert_eq!(status, 200, "{path}: {text}");
        if path.starts_with("/book/") {
            assert!(!text.contains("<script") && !text.contains("src="), "{path}");
            for link in links(&text).filter(|link| !link.starts_with("http")) {
                let (page, anchor) = link.split_once('#').unwrap_or((link, ""));
                let page = resolved(&path, page);
                if !anchor.is_empty() {
                    anchors.insert((page.clone(), anchor.to_owned()));
                }
                wanted.push(page);
            }
        }
        seen.insert(path, text);
    }
    for page in book().pages() {
        assert!(
            seen.contains_key(&format!("/book/{}", page.path)),
            "{}",
            page.path
        );
    }
    assert!(anchors.len() > 300, "{}", anchors.len());
    for (page, anchor) in anchors {
        assert!(
            seen[&page].contains(&format!("id=\"{anchor}\"")),
            "{page}#{anchor}"
        );
    }
}

#[test]
fn codes_and_words_are_found() {
    let robot = Bench::start(builder());
    for (path, status, words) in [
        (explain_path("2-046"), 200, "Invalid Channel."),
        (explain_path("E0101"), 200, "id=\"unexpected-token\""),
        (explain_path("no-sxt"), 404, "did you mean `no-stx`"),
        ("/book/?search=feed+hold".to_owned(), 200, "feed hold"),
        ("/book/?search=%3Cscript%3E".to_owned(), 200, "&lt;script&gt;"),
        ("/book/reference/alarm".to_owned(), 404, "did you mean"),
        (
            "/robots/robot/book/reference/alarms".to_owned(),
            200,
            "<h1 id=\"alarms\">",
        ),
    ] {
        let (found, text) = robot.call_text("GET", &path, "");
        assert_eq!(found, status, "{path}: {text}");
        assert!(text.contains(words), "{path}: {text}");
        assert!(!text.contains("<script"), "{path}: {text}");
    }
    let alarms = robot.get("/alarms/table");
    let docs = alarms[0]["docs"].as_str().unwrap();
    assert_eq!(robot.call_text("GET", docs, "").0, 200, "{docs}");
}

/// Pages link the schemas and the list of controls.
#[test]
fn files_of_json_are_served_as_json() {
    let robot = Bench::start(builder());
    for name in [
        "config.schema",
        "controls",
        "faults.schema",
        "scenario.schema",
        "test.schema",
    ] {
        let request = format!(
            "GET /book/reference/{name}.json HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        );
        let answer = robot.raw(request.as_bytes());
        assert!(answer.contains("content-type: application/json"), "{answer}");
        let (_, text) = robot.call_text("GET", &format!("/book/reference/{name}.json"), "");
        let served: serde_json::Value = serde_json::from_str(&text).unwrap();
        let path = ts3100_tests::reference::book().join(format!("reference/{name}.json"));
        let file: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        assert_eq!(served, file, "{name}");
    }
}

/// It shows nothing of a robot, so it needs no token, as the page.
#[test]
fn it_needs_no_token_and_loads_only_styles_and_the_icon_of_the_emulator() {
    let control = ControlSettings {
        token: Some("0123456789abcdef".to_owned()),
        ..ControlSettings::free()
    };
    let robot = Bench::start(builder().control(control));
    let request = b"GET /book/ HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    let answer = robot.raw(request);
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    assert!(
        answer.contains("default-src 'none'; img-src 'self'; style-src 'self'"),
        "{answer}"
    );
    assert!(!answer.contains("unsafe-inline"), "{answer}");
}
