//! Tests of robots that are joined by wires.

use super::super::request::PendingWait;
use super::super::tests::{At, open_with};
use super::super::wait::Wait;
use super::*;

const HOUR: Duration = Duration::from_secs(3_600);

fn runtime() -> tokio::runtime::Runtime {
    let mut builder = tokio::runtime::Builder::new_current_thread();
    builder.enable_all().build().unwrap()
}

#[test]
fn the_clock_of_a_robot_without_a_host_keeps_up_with_the_others() {
    let runtime = runtime();
    let _guard = runtime.enter();
    let robots = [(); 2].map(|()| (open_with(|_| {}).0, Span::none()));
    let (mut wired, _handle) = Wired::new(robots.into(), Vec::new());
    // Somebody waits at the first one: automatic time passes for both.
    let (done, _is_done) = tokio::sync::oneshot::channel();
    wired.robots[0].0.edge.waits.push(PendingWait {
        wait: Wait::new(None, HOUR, false),
        since: Time::ZERO,
        limit: Time::ZERO + HOUR,
        done,
    });
    wired.hold();
    wired.catch_up();
    let start = wired.robots[0].0.edge.clock.wall();
    for turn in 1..=1_000 {
        for driver in wired.drivers() {
            driver
                .edge
                .clock
                .hold(Some(start + Duration::from_nanos(900) * turn));
        }
        wired.catch_up();
        wired.step(1, Duration::ZERO, Input::Tick);
        wired.carry(Duration::ZERO);
    }
    let passed: Vec<Time> = wired.drivers().map(|driver| driver.edge.clock.now()).collect();
    assert_eq!(passed[0], passed[1]);
    assert!(passed[0] >= Time::from_micros(900));
}

#[test]
fn what_is_sent_at_one_robot_ends_the_silence_of_all_and_the_longest_counts() {
    let runtime = runtime();
    let _guard = runtime.enter();
    let long = Duration::from_millis(50);
    let patient = open_with(|setup| setup.links.silence = long).0;
    let mut hurried = open_with(|_| {}).0;
    hurried.cell().plan(Box::new(At(Time::ZERO + HOUR)));
    let robots = [patient, hurried].map(|driver| (driver, Span::none()));
    let (mut wired, _handle) = Wired::new(robots.into(), Vec::new());
    let sent = Instant::now() + HOUR;
    let clock = &mut wired.robots[0].0.edge.clock;
    clock.hold(Some(sent));
    clock.note_activity();
    wired.release();
    for (later, left) in [
        (Duration::ZERO, long),
        (long / 2, long / 2),
        (long, Duration::ZERO),
    ] {
        for driver in wired.drivers() {
            driver.edge.clock.hold(Some(sent + later));
        }
        assert_eq!(wired.next_wake(), (Wake::JumpAfter(left), Some(HOUR)));
    }
}
