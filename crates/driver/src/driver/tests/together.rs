//! Tests of several robots of one driver: one clock, one queue of requests, one disk that all wait for.

use super::*;
use crate::clock::Wake;
use crate::driver::request::Paused;
use crate::testing::TempDir;
use crate::world::WireEnd;
use std::collections::VecDeque;

/// Two robots in this time.
fn two(time: TimeMode) -> (Box<Driver>, Requests) {
    let (mut driver, requests) = open_with(|setup| setup.time = time);
    add(&mut driver, |_| {});
    (driver, requests)
}

#[test]
fn the_time_of_a_robot_without_a_host_passes_with_that_of_the_others() {
    let runtime = single_threaded();
    let _guard = runtime.enter();
    let (mut driver, _requests) = two(TimeMode::Auto);
    // Somebody waits at the first one: automatic time passes for both.
    let (done, _is_done) = oneshot::channel();
    driver.world[0].edge.waits.push(request::PendingWait {
        reached: None,
        wait: wait::Wait::new(None, HOUR, false),
        since: Time::ZERO,
        limit: Time::ZERO + HOUR,
        done,
    });
    driver.tick();
    let start = driver.clock.wall();
    for turn in 1..=1_000 {
        driver.clock.hold(Some(start + Duration::from_nanos(900) * turn));
        driver.feed(1, Input::Tick);
    }
    driver.tick();
    let passed = [0, 1].map(|robot| driver.world[robot].seat.controller.now());
    assert_eq!(passed[0], passed[1]);
    assert!(passed[0] >= Time::from_micros(900));
}

#[test]
fn what_is_sent_at_one_robot_ends_the_silence_of_all_and_the_longest_counts() {
    let runtime = single_threaded();
    let _guard = runtime.enter();
    let long = Duration::from_millis(50);
    let (mut driver, _requests) = open_with(|setup| setup.links.silence = long);
    let hurried = add(&mut driver, |_| {});
    driver.seat(hurried).plan(Box::new(At(Time::ZERO + HOUR)));
    let sent = driver.clock.wall() + HOUR;
    driver.clock.hold(Some(sent));
    driver.world[0].edge.has_sent = true;
    driver.note_effects();
    for (later, left) in [
        (Duration::ZERO, long),
        (long / 2, long / 2),
        (long, Duration::ZERO),
    ] {
        driver.clock.hold(Some(sent + later));
        assert_eq!(driver.wake(), Wake::JumpAfter(left));
        assert_eq!(driver.jump_target(), Some(Time::ZERO + HOUR));
    }
}

#[test]
fn robots_with_different_deadlines_wait_in_real_time() {
    let runtime = single_threaded();
    let _guard = runtime.enter();
    for moments in [[100_u64, 100_000], [100_000, 100], [100, 100]] {
        let (mut driver, _requests) = open_with(|setup| setup.time = TimeMode::Real);
        add(&mut driver, |_| {});
        for (robot, moment) in moments.into_iter().enumerate() {
            driver.seat(robot).plan(Box::new(At(Time::from_millis(moment))));
        }
        let wake = driver.wake();
        assert!(matches!(wake, Wake::After(_)), "{moments:?}: {wake:?}");
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
            (at, PlannedAction::Input(Input::by_owner(raise)))
        })
    }
}

/// Actions at one time.
struct Planned(Time, VecDeque<&'static str>);

impl ActionSource for Planned {
    fn deadline(&self) -> Option<Time> {
        (!self.1.is_empty()).then_some(self.0)
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let action = self.1.pop_front_if(|_| self.0 <= now)?.parse().unwrap();
        Some((self.0, PlannedAction::Input(Input::by_owner(action))))
    }
}

/// When an input line changes.
struct Changes(std::sync::mpsc::Sender<Time>);

impl Subscriber for Changes {
    fn input(&mut self, at: Time, input: &Input, _by: Side) {
        if let Input::Action {
            action: Action::Panel(PanelAction::InputLine { .. }),
            ..
        } = input
        {
            self.0.send(at).unwrap();
        }
    }
}

/// The changes of input lines of a robot.
fn changes_of(driver: &mut Driver, robot: usize) -> std::sync::mpsc::Receiver<Time> {
    let (sender, changes) = channel();
    driver.seat(robot).subscribe(Box::new(Changes(sender)));
    changes
}

/// Two robots, of which the first has a plan and a directory in which it keeps alarms.
fn two_with_drive(
    directory: &TempDir,
    time: TimeMode,
    plan: impl ActionSource + 'static,
) -> (Box<Driver>, Requests) {
    let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
    let (mut driver, requests) = open_with(|setup| {
        setup.time = time;
        setup.controller.persist_outside(true);
        setup.backing = Some(Backing::new(store, WhenFull::Refuse));
    });
    add(&mut driver, |_| {});
    driver.seat(FIRST).plan(Box::new(plan));
    (driver, requests)
}

/// Writes of this robot wait for the store, which a thread has until it is told to let go.
fn keep_disk_busy(driver: &Driver, robot: usize) -> std::sync::mpsc::Sender<()> {
    let store = driver.world[robot].edge.backing.as_ref().unwrap().store();
    let (locked, is_locked) = channel();
    let (release, is_released) = channel();
    std::thread::spawn(move || {
        let _store = store.lock().unwrap();
        locked.send(()).unwrap();
        is_released.recv().unwrap();
    });
    is_locked.recv().unwrap();
    release
}

/// A wire from here to input 7 of the second robot.
fn wire(from: WireEnd) -> Wire {
    let (to, name) = (WireEnd::Line { robot: 1, line: 7 }, String::new());
    Wire { from, to, name }
}

/// Sends a request and waits until it is answered.
async fn ask(requests: &Requests, request: impl FnOnce(Box<dyn FnOnce() + Send>) -> Request) {
    let (done, is_done) = oneshot::channel();
    let request = request(Box::new(|| done.send(()).unwrap()));
    requests.send(request).await.unwrap();
    is_done.await.unwrap();
}

async fn set_output(requests: &Requests, on: bool) {
    let action = Action::SetOutput { line: 5, on };
    ask(requests, |done| {
        Request::Action(action, By::Owner, Box::new(move |_, _| done()))
    })
    .await;
}

async fn look(requests: &Requests) {
    ask(requests, |done| Request::Query(Box::new(|(), _| done()))).await;
}

async fn set_lid(requests: &Requests) -> bool {
    let (done, is_done) = oneshot::channel();
    let set = Request::SetOutside("lid".to_owned(), true, done);
    requests.send(set).await.unwrap();
    is_done.await.unwrap()
}

async fn pause(requests: &Requests) -> Paused {
    let (caller, paused) = oneshot::channel();
    requests.send(Request::Pause(caller)).await.unwrap();
    paused.await.unwrap()
}

/// Runs the driver to the end of this, which goes on while the driver pauses.
async fn run_while(driver: Box<Driver>, hosts: impl Future<Output = ()>) -> Vec<Controller> {
    let (done, is_done) = oneshot::channel();
    let run = driver.run(async { is_done.await.unwrap() });
    let hosts = async {
        hosts.await;
        done.send(()).unwrap();
    };
    let both = async { tokio::join!(run, hosts).0 };
    tokio::time::timeout(Duration::from_secs(10), both).await.unwrap()
}

#[test]
fn an_action_is_answered_although_what_was_due_before_it_has_to_be_stored() {
    // One alarm, and more of them than can be stored.
    for (time, distance) in [
        (TimeMode::Real, HOUR),
        (TimeMode::Scaled(10_000.0), Duration::from_millis(1)),
    ] {
        // At the robot that stores, and at the other.
        for robot in [0, 1] {
            single_threaded().block_on(async {
                let directory = TempDir::new("together");
                let alarms = Alarms(Time::from_micros(1), distance);
                let (mut driver, requests) = two_with_drive(&directory, time, alarms);
                let (done, result) = oneshot::channel();
                let name = "NOFILE".to_owned();
                let reply = Box::new(move |result, _: &View<'_>| done.send(result).unwrap());
                let select = Request::Action(Action::Select { name }, By::Owner, reply);
                requests.of(robot).send(select).await.unwrap();
                // The first alarm is due before the first step.
                let mut refused = None;
                let served = driver.serve(async { refused = result.await.ok() });
                tokio::time::timeout(Duration::from_secs(10), served)
                    .await
                    .unwrap();
                assert!(refused.unwrap().is_err(), "there is no such file");
            });
        }
    }
}

#[test]
fn who_sets_an_outside_line_while_something_is_stored_is_told_when_it_has_changed() {
    single_threaded().block_on(async {
        let directory = TempDir::new("together");
        let alarms = Alarms(Time::from_micros(1), HOUR);
        let (mut driver, requests) = two_with_drive(&directory, TimeMode::Real, alarms);
        let release = keep_disk_busy(&driver, 0);
        driver.join(vec![wire(WireEnd::Outside("lid".to_owned()))]);
        let set = async {
            turns().await;
            let later = async {
                turns().await;
                release.send(()).unwrap();
            };
            let (told, ()) = tokio::join!(set_lid(&requests), later);
            assert!(told);
        };
        driver.serve(set).await;
        let signals = driver.world[1].seat.controller.signals();
        assert!(driver.world.levels()[0] && signals.input(7));
    });
}

#[test]
fn who_sets_an_outside_line_is_told_when_what_a_program_does_then_is_stored() {
    const PROGRAM: &[u8] = b"GLOBAL\nN = 1\nEND\nPROGRAM P\nWAIT DIN(7)\nN = 5\nRESTORE N\nEND\n";
    single_threaded().block_on(async {
        let directory = TempDir::new("together");
        let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
        let (mut driver, requests) = open_with(|setup| setup.time = TimeMode::Stepped);
        let robot = add(&mut driver, |setup| {
            setup.servo_on = true;
            setup.controller.put_file("P", PROGRAM).unwrap();
            setup.controller.select(Time::ZERO, "P").unwrap();
            setup.controller.persist_outside(true);
            setup.backing = Some(Backing::new(store, WhenFull::Refuse));
        });
        driver.feed(robot, Input::by_owner("program start".parse().unwrap()));
        let release = keep_disk_busy(&driver, robot);
        driver.join(vec![wire(WireEnd::Outside("lid".to_owned()))]);
        let level = || {
            let (done, level) = oneshot::channel();
            let tell = |(): (), view: &View<'_>| done.send(view.wire_levels()[0]).unwrap();
            (Request::Query(Box::new(tell)), level)
        };
        let set = async {
            let mut set = std::pin::pin!(set_lid(&requests));
            let has_changed = async {
                loop {
                    let (query, level) = level();
                    requests.send(query).await.unwrap();
                    if level.await.unwrap() {
                        break turns().await;
                    }
                }
            };
            tokio::select! {
                biased;
                _ = &mut set => panic!("told while the file is being stored"),
                () = has_changed => release.send(()).unwrap(),
            }
            assert!(set.await);
        };
        driver.serve(set).await;
        let stored = std::fs::read_to_string(directory.at("P")).unwrap();
        assert!(stored.contains("N = 5"), "{stored}");
    });
}

#[test]
fn what_an_output_does_while_its_robot_stores_something_reaches_the_input_at_the_same_time() {
    single_threaded().block_on(async {
        let directory = TempDir::new("together");
        let (start, due) = (Time::from_millis(1_000), Time::from_millis(1_001));
        let plan = Planned(due, ["alarms raise 1-102", "output 5 on"].into());
        let (mut driver, requests) = two_with_drive(&directory, TimeMode::Real, plan);
        let raised = Arc::new(AtomicBool::new(false));
        driver.seat(0).subscribe(Box::new(OnAlarm(Arc::clone(&raised))));
        let changes = changes_of(&mut driver, 1);
        let release = keep_disk_busy(&driver, 0);
        driver.join(vec![wire(WireEnd::Line { robot: 0, line: 5 })]);
        driver.clock.jump(start);
        for robot in driver.world.robots_mut() {
            robot.set_time(start, start);
        }
        let write = async {
            while !raised.load(Ordering::Relaxed) {
                turns().await;
            }
            release.send(()).unwrap();
            look(&requests).await;
            while changes.try_recv().map(|at| assert_eq!(at, due)).is_err() {
                turns().await;
            }
        };
        driver.serve(write).await;
        assert_eq!(changes.try_iter().count(), 0);
    });
}

#[test]
fn robots_that_are_restored_together_see_nothing_of_each_other_as_they_were_before() {
    single_threaded().block_on(async {
        let (mut driver, requests) = two(TimeMode::Real);
        let changes = changes_of(&mut driver, 0);
        driver.join(vec![Wire {
            from: WireEnd::Line { robot: 1, line: 5 },
            to: WireEnd::Line { robot: 0, line: 7 },
            name: String::new(),
        }]);
        let other = requests.of(1);
        let on_both = async |task: fn(String) -> SnapshotTask| {
            let mut paused = pause(&requests).await;
            let moment = paused.wall();
            paused.stand_at(moment).await;
            let tasks = [0, 1].map(|robot| (robot, task("on".to_owned())));
            let results = paused.act_on_snapshots(tasks.into()).await;
            results.into_iter().for_each(Result::unwrap);
        };
        let restore = async {
            set_output(&other, true).await;
            on_both(SnapshotTask::Save).await;
            set_output(&other, false).await;
            look(&requests).await;
            assert_eq!(changes.try_iter().count(), 2);
            on_both(SnapshotTask::Restore).await;
            for requests in [&requests, &other] {
                look(requests).await;
            }
        };
        let controllers = run_while(driver, restore).await;
        assert_eq!(changes.try_iter().count(), 0);
        for controller in controllers {
            let signals = controller.signals();
            assert!(signals.input(7) || signals.output(5));
        }
    });
}

#[test]
fn while_a_world_pauses_nothing_is_served_and_no_time_passes() {
    single_threaded().block_on(async {
        let (mut driver, requests) = two(TimeMode::Scaled(1_000.0));
        driver
            .seat(1)
            .plan(Box::new(Planned(Time::from_millis(1), ["output 1 on"].into())));
        let asked = async {
            let mut paused = pause(&requests).await;
            let moment = paused.wall();
            paused.stand_at(moment).await;
            let now = |paused: &Paused| [0, 1].map(|robot| paused.view(robot).controller.now());
            let before = now(&paused);
            let mut answered = std::pin::pin!(set_output(&requests, true));
            tokio::select! {
                biased;
                () = &mut answered => panic!("answered during the pause"),
                () = turns() => {}
            }
            assert_eq!(now(&paused), before);
            assert!(!paused.view(0).controller.signals().output(5));
            drop(paused);
            answered.await;
        };
        let controllers = run_while(driver, asked).await;
        assert!(controllers[0].signals().output(5));
    });
}

#[test]
fn a_request_that_came_during_a_write_is_answered_after_a_pause_that_was_asked_for_before_it() {
    single_threaded().block_on(async {
        let directory = TempDir::new("together");
        let alarms = Alarms(Time::from_micros(1), HOUR);
        let (mut driver, requests) = two_with_drive(&directory, TimeMode::Real, alarms);
        let raised = Arc::new(AtomicBool::new(false));
        driver.seat(0).subscribe(Box::new(OnAlarm(Arc::clone(&raised))));
        let release = keep_disk_busy(&driver, 0);
        let asked = async {
            while !raised.load(Ordering::Relaxed) {
                turns().await;
            }
            let later = async {
                turns().await;
                release.send(()).unwrap();
            };
            let pauses = async {
                let paused = pause(&requests).await;
                assert!(!paused.view(0).controller.signals().output(5));
            };
            tokio::join!(pauses, set_output(&requests, true), later);
        };
        let controllers = run_while(driver, asked).await;
        assert!(controllers[0].signals().output(5));
    });
}

#[test]
fn the_port_that_is_polled_first_does_not_change_what_hosts_receive() {
    let mut first = None;
    for place in 0..2 * Port::ALL.len() {
        let answers = single_threaded().block_on(async {
            let (mut driver, _requests) = two(TimeMode::Stepped);
            let addresses = [0, 1].map(|robot| driver.ports(robot).clone());
            driver.rotation.port = place;
            // Everything has arrived before the first turn of the loop.
            let hosts = addresses.map(|ports| {
                let _vision = dial(&ports, Port::Ip1);
                let mut host = dial(&ports, Port::Ip0);
                host.write_all(b"\x02SU\r\x03").unwrap();
                host
            });
            serve_while(&mut driver, move |_| {
                hosts.map(|mut host| {
                    let mut answer = vec![0];
                    while answer.last() != Some(&3) {
                        let mut byte = [0];
                        host.read_exact(&mut byte).unwrap();
                        answer.extend(byte);
                    }
                    answer
                })
            })
            .await
        });
        assert_eq!(answers[0], answers[1]);
        let first = first.get_or_insert_with(|| answers.clone());
        assert_eq!(*first, answers, "from place {place}");
    }
}
