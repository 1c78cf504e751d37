//! Tests of robots that are joined by wires.

use super::super::request::{PendingWait, View};
use super::super::tests::{At, OnAlarm, open_with, turns};
use super::super::wait::Wait;
use super::*;
use crate::cell::{ActionSource, PlannedAction, Subscriber};
use crate::clock::TimeMode;
use crate::snapshot::SnapshotTask;
use crate::store::Store;
use crate::store::backing::{Backing, WhenFull};
use crate::testing::TempDir;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
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
        assert_eq!(wired.wake(), Wake::JumpAfter(left));
        assert_eq!(wired.jump_distance(), Some(HOUR));
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

/// Actions at one time.
struct Together(Time, VecDeque<&'static str>);

impl ActionSource for Together {
    fn deadline(&self) -> Option<Time> {
        (!self.1.is_empty()).then_some(self.0)
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let action = self.1.pop_front_if(|_| self.0 <= now)?.parse().unwrap();
        Some((self.0, PlannedAction::Input(Input::Action(action))))
    }
}

/// When an input line changes.
struct Changes(std::sync::mpsc::Sender<Time>);

impl Subscriber for Changes {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        if let Input::Panel(PanelAction::InputLine { .. }) = input {
            self.0.send(at).unwrap();
        }
    }
}

/// A driver with a plan, and a directory in which it keeps alarms.
fn open_with_drive(
    directory: &TempDir,
    time: TimeMode,
    plan: impl ActionSource + 'static,
) -> (Box<Driver>, mpsc::Sender<Request>) {
    let (store, _) = Store::open(directory.path()).unwrap();
    let (mut driver, requests) = open_with(|setup| {
        setup.time = time;
        setup.controller.persist_outside(true);
        setup.backing = Some(Backing::new(store, WhenFull::Refuse));
    });
    driver.cell().plan(Box::new(plan));
    (driver, requests)
}

/// Writes of this driver wait for the store, which a thread has until it is told to let go.
fn keep_disk_busy(driver: &Driver) -> std::sync::mpsc::Sender<()> {
    let store = driver.edge.backing.as_ref().unwrap().store();
    let (locked, is_locked) = std::sync::mpsc::channel();
    let (release, is_released) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let _store = store.lock().unwrap();
        locked.send(()).unwrap();
        is_released.recv().unwrap();
    });
    is_locked.recv().unwrap();
    release
}

fn wire(from: WireEnd) -> Wire {
    let to = WireEnd::Line { robot: 1, line: 7 };
    Wire { from, to }
}

/// Sends a request and waits until it is answered.
async fn ask(requests: &mpsc::Sender<Request>, request: impl FnOnce(Box<dyn FnOnce() + Send>) -> Request) {
    let (done, is_done) = oneshot::channel();
    let request = request(Box::new(|| done.send(()).unwrap()));
    requests.send(request).await.ok().unwrap();
    is_done.await.unwrap();
}

async fn set_output(requests: &mpsc::Sender<Request>, on: bool) {
    let action = Action::SetOutput { line: 5, on };
    ask(requests, |done| {
        Request::Action(action, Box::new(move |_, _| done()))
    })
    .await;
}

async fn on_snapshot(requests: &mpsc::Sender<Request>, task: SnapshotTask) {
    let reply = |done: Box<dyn FnOnce() + Send>| {
        Box::new(move |result: Result<(), _>, _: &View<'_>| {
            result.unwrap();
            done();
        })
    };
    ask(requests, |done| Request::Snapshot(task, reply(done))).await;
}

async fn look(requests: &mpsc::Sender<Request>) {
    ask(requests, |done| Request::Query(Box::new(|(), _| done()))).await;
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
            let (driver, requests) =
                open_with_drive(&directory, time, Alarms(Time::from_micros(1), distance));
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
        let (driver, _requests) =
            open_with_drive(&directory, TimeMode::Real, Alarms(Time::from_micros(1), HOUR));
        let other = open_with(|setup| setup.time = TimeMode::Real).0;
        let release = keep_disk_busy(&driver);
        let robots = [driver, other].map(|driver| (driver, Span::none()));
        let lid = wire(WireEnd::Outside("lid".to_owned()));
        let (mut wired, handle) = Wired::new(robots.into(), vec![lid]);
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
    });
}

#[test]
fn what_an_output_does_while_its_robot_stores_something_reaches_the_input_at_the_same_time() {
    runtime().block_on(async {
        let directory = TempDir::new("wired");
        let (start, due) = (Time::from_millis(1_000), Time::from_millis(1_001));
        let plan = Together(due, ["alarms raise 1-102", "output 5 on"].into());
        let (mut driver, _requests) = open_with_drive(&directory, TimeMode::Real, plan);
        let raised = Arc::new(AtomicBool::new(false));
        driver.cell().subscribe(Box::new(OnAlarm(Arc::clone(&raised))));
        let mut other = open_with(|setup| setup.time = TimeMode::Real).0;
        let (sender, changes) = std::sync::mpsc::channel();
        other.cell().subscribe(Box::new(Changes(sender)));
        let release = keep_disk_busy(&driver);
        let robots = [driver, other].map(|driver| (driver, Span::none()));
        let line = wire(WireEnd::Line { robot: 0, line: 5 });
        let (mut wired, handle) = Wired::new(robots.into(), vec![line]);
        wired.hold();
        for driver in wired.drivers() {
            driver.edge.clock.set(start);
        }
        wired.release();
        let write = async {
            while !raised.load(Ordering::Relaxed) {
                turns().await;
            }
            release.send(()).unwrap();
            while !handle.levels()[0] {
                turns().await;
            }
        };
        wired.serve(write).await;
        assert_eq!(changes.try_iter().collect::<Vec<_>>(), [due]);
    });
}

#[test]
fn robots_that_are_restored_together_see_nothing_of_each_other_as_they_were_before() {
    runtime().block_on(async {
        let (mut one, of_one) = open_with(|setup| setup.time = TimeMode::Real);
        let (other, of_other) = open_with(|setup| setup.time = TimeMode::Real);
        let (sender, changes) = std::sync::mpsc::channel();
        one.cell().subscribe(Box::new(Changes(sender)));
        let robots = [one, other].map(|driver| (driver, Span::none()));
        let line = Wire {
            from: WireEnd::Line { robot: 1, line: 5 },
            to: WireEnd::Line { robot: 0, line: 7 },
        };
        let (mut wired, _handle) = Wired::new(robots.into(), vec![line]);
        let requests = [of_one, of_other];
        let restore = async {
            set_output(&requests[1], true).await;
            for requests in &requests {
                on_snapshot(requests, SnapshotTask::Save("on".to_owned())).await;
            }
            set_output(&requests[1], false).await;
            look(&requests[0]).await;
            assert_eq!(changes.try_iter().count(), 2);
            let mut alone = Vec::new();
            for requests in &requests {
                let (sender, private) = mpsc::channel(1);
                requests.send(Request::Exclusive(private)).await.ok().unwrap();
                look(&sender).await;
                alone.push(sender);
            }
            let (sender, moment) = oneshot::channel();
            let tell = |(): (), view: &View<'_>| sender.send(view.clock.wall()).unwrap();
            alone[1].send(Request::Query(Box::new(tell))).await.ok().unwrap();
            let moment = moment.await.unwrap();
            for requests in &alone {
                ask(requests, |done| {
                    Request::StandStill(moment, Box::new(|(), _| done()))
                })
                .await;
            }
            for requests in &alone {
                on_snapshot(requests, SnapshotTask::Restore("on".to_owned())).await;
            }
            drop(alone);
            for requests in &requests {
                look(requests).await;
            }
        };
        wired.serve(restore).await;
        assert_eq!(changes.try_iter().count(), 0);
        for driver in wired.drivers() {
            let signals = driver.cell.controller.signals();
            assert!(signals.input(7) || signals.output(5));
        }
    });
}

#[test]
fn a_request_that_came_during_a_write_is_answered_while_another_robot_serves_its_requests_alone() {
    runtime().block_on(async {
        let directory = TempDir::new("wired");
        let (one, of_one) = open_with(|setup| setup.time = TimeMode::Real);
        let alarm = Alarms(Time::from_micros(1), HOUR);
        let (mut storing, of_storing) = open_with_drive(&directory, TimeMode::Real, alarm);
        let raised = Arc::new(AtomicBool::new(false));
        storing.cell().subscribe(Box::new(OnAlarm(Arc::clone(&raised))));
        let release = keep_disk_busy(&storing);
        let robots = [one, storing].map(|driver| (driver, Span::none()));
        let (mut wired, _handle) = Wired::new(robots.into(), Vec::new());
        let requests = async {
            while !raised.load(Ordering::Relaxed) {
                turns().await;
            }
            let (alone, private) = mpsc::channel(1);
            of_one.send(Request::Exclusive(private)).await.ok().unwrap();
            let later = async {
                turns().await;
                release.send(()).unwrap();
                look(&alone).await;
            };
            tokio::join!(set_output(&of_storing, true), later);
        };
        let served = wired.serve(requests);
        tokio::time::timeout(Duration::from_secs(10), served)
            .await
            .unwrap();
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
