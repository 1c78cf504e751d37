//! Tests of robots that are joined by wires.

use super::super::request::{PendingWait, Request, View};
use super::super::tests::{At, open_with, turns};
use super::super::wait::Wait;
use super::*;
use crate::cell::{ActionSource, PlannedAction};
use crate::clock::TimeMode;
use crate::store::Store;
use crate::store::backing::{Backing, WhenFull};
use crate::testing::TempDir;
use ts3100_controller::action::Action;
use ts3100_proto::status::ExecutionStatus;

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
    let (done, _is_done) = oneshot::channel();
    wired.robots[0].0.edge.waits.push(PendingWait {
        reached: None,
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
    let sent = wired.robots[0].0.edge.clock.wall() + HOUR;
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

/// Alarms from a microsecond on, in these distances.
struct Alarms(Time, Duration);

impl ActionSource for Alarms {
    fn deadline(&self) -> Option<Time> {
        Some(self.0)
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let at = self.0;
        let raise = "alarms raise 1-102".parse().unwrap();
        (at <= now).then(|| {
            self.0 = at + self.1;
            (at, PlannedAction::Input(Input::Action(raise)))
        })
    }
}

/// A driver that raises alarms, and keeps them in a directory.
fn open_with_alarms(
    directory: &TempDir,
    time: TimeMode,
    distance: Duration,
) -> (Box<Driver>, mpsc::Sender<Request>) {
    let (store, _) = Store::open(directory.path()).unwrap();
    let (mut driver, requests) = open_with(|setup| {
        setup.time = time;
        setup.controller.persist_outside(true);
        setup.backing = Some(Backing::new(store, WhenFull::Refuse));
    });
    driver
        .cell()
        .plan(Box::new(Alarms(Time::from_micros(1), distance)));
    (driver, requests)
}

#[test]
fn an_action_is_answered_although_what_was_due_before_it_has_to_be_stored() {
    // One alarm, and more of them than can be stored.
    for (time, distance) in [
        (TimeMode::Real, HOUR),
        (TimeMode::Scaled(10_000.0), Duration::from_millis(1)),
    ] {
        runtime().block_on(async {
            let directory = TempDir::new("wired");
            let (driver, requests) = open_with_alarms(&directory, time, distance);
            let other = open_with(|setup| setup.time = time).0;
            let robots = [driver, other].map(|driver| (driver, Span::none()));
            let (mut wired, _handle) = Wired::new(robots.into(), Vec::new());
            let (done, result) = oneshot::channel();
            let name = "NOFILE".to_owned();
            let reply = Box::new(move |result, _: &View<'_>| done.send(result).unwrap());
            let select = Request::Action(Action::Select { name }, reply);
            requests.send(select).await.ok().unwrap();
            // The first alarm is due before the first step.
            let mut refused = None;
            let served = wired.serve(async { refused = result.await.ok() });
            tokio::time::timeout(Duration::from_secs(10), served)
                .await
                .unwrap();
            assert!(refused.unwrap().is_err(), "there is no such file");
        });
    }
}

#[test]
fn who_sets_an_outside_line_while_something_is_stored_is_told_when_it_has_changed() {
    runtime().block_on(async {
        let directory = TempDir::new("wired");
        let (driver, _requests) = open_with_alarms(&directory, TimeMode::Real, HOUR);
        let other = open_with(|setup| setup.time = TimeMode::Real).0;
        let store = driver.edge.backing.as_ref().unwrap().store();
        let robots = [driver, other].map(|driver| (driver, Span::none()));
        let wire = Wire {
            from: WireEnd::Outside("lid".to_owned()),
            to: WireEnd::Line { robot: 1, line: 7 },
        };
        let (mut wired, handle) = Wired::new(robots.into(), vec![wire]);
        // The write waits for the store, which another thread has until it is told to let go.
        let (locked, is_locked) = std::sync::mpsc::channel();
        let (release, is_released) = std::sync::mpsc::channel();
        let disk = std::thread::spawn(move || {
            let _store = store.lock().unwrap();
            locked.send(()).unwrap();
            is_released.recv().unwrap();
        });
        is_locked.recv().unwrap();
        let set = async {
            turns().await;
            let later = async {
                turns().await;
                release.send(()).unwrap();
            };
            let (told, ()) = tokio::join!(handle.set("lid", true), later);
            assert!(told);
        };
        wired.serve(set).await;
        let signals = wired.robots[1].0.cell.controller.signals();
        assert!(handle.levels()[0] && signals.input(7));
        disk.join().unwrap();
    });
}

/// An action that is due at the beginning.
struct Once(Option<Action>);

impl ActionSource for Once {
    fn deadline(&self) -> Option<Time> {
        self.0.as_ref().map(|_| Time::ZERO)
    }

    fn take_due(&mut self, _now: Time) -> Option<(Time, PlannedAction)> {
        let action = self.0.take()?;
        Some((Time::ZERO, PlannedAction::Input(Input::Action(action))))
    }
}

#[test]
fn a_program_sees_nothing_of_what_else_drives_the_input_of_a_wire() {
    for (words, is_planned) in [
        ("input 7 on", false),
        ("input 7 on", true),
        ("input 7 pulse on 1 s", false),
        ("input 7 release", false),
    ] {
        runtime().block_on(async {
            let (mut driver, _requests) = open_with(|setup| {
                setup.time = TimeMode::Stepped;
                setup.servo_on = true;
                let controller = &mut setup.controller;
                controller
                    .put_file("P", b"PROGRAM P\nWAIT DIN(7)\nDOUT(1)\nEND\n")
                    .unwrap();
                controller.select(Time::ZERO, "P").unwrap();
            });
            let action: Action = words.parse().unwrap();
            // What it has been set to before the wire is there.
            let before = ["input 7 on", "input 7 force off", "program start"];
            let before = before.iter().skip(if words.ends_with("release") { 0 } else { 2 });
            for words in before {
                driver.feed(Input::Action(words.parse().unwrap()));
            }
            if is_planned {
                driver.cell().plan(Box::new(Once(Some(action.clone()))));
            }
            let wire = Wire {
                from: WireEnd::Outside("lid".to_owned()),
                to: WireEnd::Line { robot: 0, line: 7 },
            };
            let (mut wired, _handle) = Wired::new(vec![(driver, Span::none())], vec![wire]);
            wired.carry(Duration::ZERO);
            let work = match is_planned {
                true => Work::Tick,
                false => Work::Request(Request::Action(action, Box::new(|result, _| result.unwrap()))),
            };
            wired.catch_up_and_perform(Step::Of(0, work)).await;
            let controller = &wired.robots[0].0.cell.controller;
            assert!(!controller.signals().input(7), "{words}");
            assert_eq!(controller.status(), ExecutionStatus::Running, "{words}");
        });
    }
}
