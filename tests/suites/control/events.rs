//! The stream of events: their order and numbers, what was missed, and where a reader continues.

use serde_json::json;
use ts3100_tests::bench::{Bench, builder};
use ts3100_tests::host::Host;

#[test]
fn events_are_told_in_order_and_the_missed_are_counted() {
    let robot = Bench::start(builder());
    let mut host = robot.host();
    host.command("SO");
    let (_, stream) = robot
        .client
        .call("GET", "/events?since=1&count=12", None)
        .unwrap();
    let events: Vec<serde_json::Value> = stream
        .lines()
        .filter_map(|line| line.strip_prefix("data: "))
        .map(|data| serde_json::from_str(data).unwrap())
        .collect();
    assert_eq!(events.len(), 12, "{stream}");
    for (number, event) in (1..).zip(&events) {
        assert_eq!(event["seq"], number, "{event}");
    }
    let served = events.iter().find(|event| event["event"] == "answered").unwrap();
    assert_eq!(
        (&served["command"], &served["mode"]),
        (&json!("SU"), &json!("EXT (ETHER)"))
    );
    let text = events.iter().find(|event| event["event"] == "text-in").unwrap();
    assert_eq!(
        (&text["text"], &text["hex"]),
        (&json!("SU<CR>"), &json!("53550d"))
    );
    for line in 0..2_500 {
        host.command(if line % 2 == 0 { "SO" } else { "SP" });
    }
    let (_, stream) = robot.client.call("GET", "/events?since=1&count=1", None).unwrap();
    assert!(
        stream.starts_with("event: missed\ndata: {\"missed\":"),
        "{stream}"
    );
}

#[test]
fn a_reader_that_names_its_last_event_continues_after_it() {
    let robot = Bench::start(builder());
    let _host = robot.host();
    for last in [1, 3] {
        let request = format!(
            "GET /events?count=2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nLast-Event-ID: {last}\r\n\r\n"
        );
        let answer = robot.raw(request.as_bytes());
        let ids = answer.lines().filter_map(|line| line.strip_prefix("id: "));
        let ids: Vec<u64> = ids.map(|id| id.parse().unwrap()).collect();
        assert_eq!(ids, [last + 1, last + 2], "{answer}");
    }
}
