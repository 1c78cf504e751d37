//! Tests of robots that are joined by wires.

use super::super::request::PendingWait;
use super::super::tests::open_with;
use super::super::wait::Wait;
use super::*;

const HOUR: Duration = Duration::from_secs(3_600);

#[test]
fn the_clock_of_a_robot_without_a_host_keeps_up_with_the_others() {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
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
