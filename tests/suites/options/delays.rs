//! What `reply.delay` does to the time of answers.

use std::collections::BTreeSet;
use ts3100_controller::Port;
use ts3100_tests::Robot;

/// When the answers to SO come, of twenty.
pub(super) fn time_of_an_answer(robot: &mut Robot) -> String {
    let mut times = BTreeSet::new();
    for _ in 0..20 {
        robot.send(Port::Ip0, b"SO\r");
        let is_silent = |robot: &mut Robot| robot.received(Port::Ip0).is_empty();
        times.insert(
            (0..100)
                .take_while(|_| {
                    is_silent(robot) && {
                        robot.advance_ms(1);
                        true
                    }
                })
                .count(),
        );
        robot.advance_ms(60);
    }
    match (times.first(), times.last()) {
        (Some(0), Some(0)) => "at once".to_owned(),
        (Some(first), Some(last)) if first == last => format!("after {first} ms"),
        (Some(10..), Some(..=40)) if times.len() > 3 => "between 10 and 40 ms".to_owned(),
        _ => format!("{times:?}"),
    }
}
