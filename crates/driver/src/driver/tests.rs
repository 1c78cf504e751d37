//! Tests of the loop: when automatic time may jump, and in which order work is served.

use super::request::{View, WaitResult};
use super::*;
use crate::clock::Wake;
use crate::seat::{ActionSource, Notice, PlannedAction};
use crate::snapshot::SnapshotTask;
use crate::store::Store;
use crate::store::backing::WhenFull;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use ts3100_controller::action::Action;
use ts3100_controller::findings::rules::MIN_POLL_INTERVAL;
use ts3100_controller::input::{By, PanelAction};
use ts3100_controller::options::{Config, Dialect};
use ts3100_controller::{Event, Output, Time};
use ts3100_proto::parameter::LineEnd;

const HOUR: Duration = Duration::from_secs(3_600);

fn single_threaded() -> tokio::runtime::Runtime {
    let mut builder = tokio::runtime::Builder::new_current_thread();
    builder.enable_all().build().unwrap()
}

/// Selects a file that does not exist after an alarm.
pub(super) struct OnAlarm(pub(super) Arc<AtomicBool>);

impl Subscriber for OnAlarm {
    fn output(&mut self, _at: Time, output: &Output) {
        if let Output::Event(Event::Alarm { .. }) = output {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

impl ActionSource for OnAlarm {
    fn deadline(&self) -> Option<Time> {
        None
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let name = "NOFILE".to_owned();
        let raised = self.0.swap(false, Ordering::Relaxed);
        raised.then(|| {
            let select = Input::by_owner(Action::Select { name });
            (now, PlannedAction::Input(select))
        })
    }
}

/// Settings of a driver of one robot.
pub(super) struct Opening {
    setup: Setup,
    pub(super) time: TimeMode,
}

impl Deref for Opening {
    type Target = Setup;

    fn deref(&self) -> &Setup {
        &self.setup
    }
}

impl DerefMut for Opening {
    fn deref_mut(&mut self) -> &mut Setup {
        &mut self.setup
    }
}

/// A driver in automatic time.
fn open() -> (Box<Driver>, Requests) {
    open_with(|_| {})
}

fn opening(change: impl FnOnce(&mut Opening)) -> Opening {
    let mut config = Config::new(Dialect::Field);
    config.options.serial_pacing = false;
    let setup = Setup {
        shared: None,
        controller: Controller::new(config, Vec::new()).unwrap(),
        backing: None,
        listen: [127, 0, 0, 1].into(),
        ports: Ports::Auto,
        links: LinkOptions::default(),
        serial: BTreeMap::new(),
        faults: Vec::new(),
        servo_on: false,
        subscribers: Vec::new(),
        span: Span::none(),
    };
    let time = TimeMode::Auto;
    let mut opening = Opening { setup, time };
    change(&mut opening);
    opening
}

pub(super) fn open_with(change: impl FnOnce(&mut Opening)) -> (Box<Driver>, Requests) {
    let Opening { setup, time } = opening(change);
    let (mut driver, requests) = Driver::new(time, TimeGap::default());
    driver.add(setup).unwrap();
    (driver, requests)
}

/// As [`open_with`], with another robot in the same world.
pub(super) fn add(driver: &mut Driver, change: impl FnOnce(&mut Opening)) -> usize {
    driver.add(opening(change).setup).unwrap()
}

/// Keeps the inputs that peers have caused.
#[derive(Clone, Default)]
struct Inputs(Arc<Mutex<Vec<Input>>>);

impl Subscriber for Inputs {
    fn input(&mut self, _at: Time, input: &Input, _by: Side) {
        if *input != Input::Tick {
            self.0.lock().unwrap().push(input.clone());
        }
    }
}

impl Inputs {
    /// Bytes that a port has received.
    fn received(&self, port: Port) -> Vec<u8> {
        let inputs = self.0.lock().unwrap();
        let received = inputs.iter().filter_map(|input| match input {
            Input::Received { port: of, bytes } if *of == port => Some(bytes.to_vec()),
            _ => None,
        });
        received.collect::<Vec<_>>().concat()
    }
}

/// A request that reads, and its answer.
fn query<T: Send + 'static>(
    requests: &Requests,
    read: impl FnOnce(&View<'_>) -> T + Send + 'static,
) -> oneshot::Receiver<T> {
    let (done, is_done) = oneshot::channel();
    let look = Request::Query(Box::new(move |(), view| {
        let _nobody_waits = done.send(read(view));
    }));
    requests.try_send(look).ok().unwrap();
    is_done
}

/// Serves until a thread of its own has done what hosts do.
async fn serve_while<T: Send + 'static>(
    driver: &mut Driver,
    hosts: impl FnOnce(BTreeMap<Port, u16>) -> T + Send + 'static,
) -> T {
    let (done, is_done) = oneshot::channel();
    let ports = driver.ports(FIRST).clone();
    let thread = std::thread::spawn(move || {
        let value = hosts(ports);
        done.send(()).unwrap();
        value
    });
    driver.serve(async { is_done.await.unwrap() }).await;
    thread.join().unwrap()
}

fn dial(ports: &BTreeMap<Port, u16>, port: Port) -> TcpStream {
    TcpStream::connect(("127.0.0.1", ports[&port])).unwrap()
}

fn exchange(host: &mut TcpStream, bytes: &[u8], expected: &[u8]) {
    host.write_all(bytes).unwrap();
    let mut found = vec![0; expected.len()];
    host.read_exact(&mut found).unwrap();
    assert_eq!(found, expected);
}

/// Some turns of the loop.
pub(super) async fn turns() {
    for _ in 0..100 {
        tokio::task::yield_now().await;
    }
}

/// Serves until it is so.
async fn serve_until(driver: &mut Driver, is_so: impl Fn(&Driver) -> bool) {
    const ROUNDS: u32 = 100_000;
    for _ in 0..ROUNDS {
        if is_so(driver) {
            return;
        }
        driver.serve(turns()).await;
    }
    panic!("not after {ROUNDS} rounds");
}

/// Virtual time has not run ahead of wall-clock time since `started`.
fn assert_not_ahead(driver: &Driver, started: Instant) {
    let (passed, wall) = (driver.clock.now().as_micros(), started.elapsed().as_micros());
    assert!(u128::from(passed) <= wall, "{passed} us passed in {wall} us");
}

/// Whether the pace of hosts is judged: each change.
#[derive(Clone, Default)]
struct Judged(Arc<Mutex<Vec<bool>>>);

impl Subscriber for Judged {
    fn notice(&mut self, _at: Time, notice: Notice<'_>) {
        if let Notice::TimedFindings(on) = notice {
            self.0.lock().unwrap().push(on);
        }
    }
}

#[test]
fn time_goes_on_from_the_moment_that_a_slow_machine_has_reached() {
    let runtime = single_threaded();
    let _guard = runtime.enter();
    let (mut driver, _requests) = open_with(|setup| setup.time = TimeMode::Real);
    let due = Time::from_millis(5);
    driver.seat(FIRST).plan(Box::new(At(due)));
    let judged = Judged::default();
    driver.seat(FIRST).subscribe(Box::new(judged.clone()));
    // The loop woke a second ago to serve an hour.
    let woken = driver.clock.wall().checked_sub(Duration::from_secs(1)).unwrap();
    driver.clock.hold(Some(woken));
    driver.clock.jump(Time::ZERO + HOUR);
    driver.tick();
    let reached = driver.world[FIRST].moment_of(due);
    assert_eq!(driver.clock.now(), reached);
    assert_eq!(driver.clock.lag(), (Time::ZERO + HOUR).since(reached));
    driver.seat(FIRST).plan(Box::new(At(reached + HOUR)));
    let regained = woken + MIN_POLL_INTERVAL;
    for (at, expected) in [
        (regained - Duration::from_micros(1), &[false][..]),
        (regained, &[false, true]),
    ] {
        driver.clock.hold(Some(at));
        driver.tick();
        assert_eq!(*judged.0.lock().unwrap(), expected);
    }
}

#[test]
fn automatic_time_does_not_run_away_while_nothing_is_due() {
    single_threaded().block_on(async {
        let started = Instant::now();
        let (mut driver, _panel) = open();
        let _hosts = serve_while(&mut driver, |ports| {
            let program = dial(&ports, Port::Ip1);
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
            (host, program)
        })
        .await;
        // An hour in which the hosts are idle passes at once for timers, not in wall-clock time: a loop that
        // jumps again and again does so here.
        tokio::time::pause();
        driver.serve(tokio::time::sleep(HOUR)).await;
        driver.feed(FIRST, Input::Tick);
        assert_not_ahead(&driver, started);
        assert_eq!(
            driver
                .clock
                .wake(driver.world[FIRST].seat.controller.poll_deadline(), true),
            Wake::Never
        );
    });
}

#[test]
fn automatic_time_runs_as_on_the_wall_while_a_host_owes_the_rest_of_a_text() {
    single_threaded().block_on(async {
        let started = Instant::now();
        let (mut driver, _panel) = open();
        let _host = serve_while(&mut driver, |ports| {
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02SO\r\x03\x02S", b"\x02OK\r\x03");
            host
        })
        .await;
        assert!(
            driver.world[FIRST].seat.controller.poll_deadline().is_some(),
            "10 s between characters"
        );
        tokio::time::pause();
        driver.serve(tokio::time::sleep(Duration::from_secs(9))).await;
        assert_not_ahead(&driver, started);
        assert!(
            driver.world[FIRST].seat.controller.poll_deadline().is_some(),
            "they have not passed"
        );
    });
}

#[test]
fn automatic_time_stands_while_nobody_is_there_for_whom_the_wall_counts() {
    single_threaded().block_on(async {
        let (mut driver, requests) = open();
        driver.serve(turns()).await;
        // To the microsecond, or two runs of the same would differ.
        assert_eq!(
            (driver.clock.now(), driver.world[FIRST].seat.controller.now()),
            (Time::ZERO, Time::ZERO)
        );
        let host = serve_while(&mut driver, |ports| {
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
            host
        })
        .await;
        // A host pauses in wall-clock time.
        let met = driver.clock.now();
        serve_until(&mut driver, |driver| driver.clock.now() > met).await;
        drop(host);
        serve_until(&mut driver, |driver| {
            driver.world[FIRST].seat.controller.peer(Port::Ip0).is_none()
        })
        .await;
        let left = driver.clock.now();
        driver.serve(turns()).await;
        assert_eq!(driver.clock.now(), left);
        // One who waits for a length of time does not wait for ever.
        let (done, is_done) = oneshot::channel();
        let condition = Some(ts3100_controller::Condition::Alarm(None));
        let short = Duration::from_millis(20);
        let wait = wait::Wait::new(condition, short, false);
        requests.send(Request::Wait(wait, done)).await.ok().unwrap();
        let mut waited = None;
        driver.serve(async { waited = is_done.await.ok() }).await;
        assert!(!waited.unwrap().reached);
        assert!(driver.clock.now() >= left + short);
    });
}

#[test]
fn what_a_host_has_sent_is_served_before_what_is_asked_for_after_it() {
    single_threaded().block_on(async {
        let (mut driver, requests) = open();
        let mut host = serve_while(&mut driver, |ports| {
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
            host
        })
        .await;
        for percent in 1..=50 {
            write!(host, "\x02EC,OVRD {percent}\r\x03").unwrap();
            let is_done = query(&requests, |view| view.controller.state().override_percent);
            let mut seen = None;
            driver.serve(async { seen = is_done.await.ok() }).await;
            assert_eq!(seen, Some(percent));
        }
    });
}

#[test]
fn the_refusal_of_a_scenarios_action_does_not_reach_another_caller() {
    single_threaded().block_on(async {
        let (mut driver, requests) = open();
        let raised = Arc::default();
        driver
            .seat(FIRST)
            .subscribe(Box::new(OnAlarm(Arc::clone(&raised))));
        driver.seat(FIRST).plan(Box::new(OnAlarm(Arc::clone(&raised))));
        let (done, result) = oneshot::channel();
        let press = Action::Panel(PanelAction::EmergencyStop(true));
        let reply = Box::new(move |result, _: &View<'_>| done.send(result).unwrap());
        requests
            .send(Request::Action(press, By::Owner, reply))
            .await
            .ok()
            .unwrap();
        driver.serve(turns()).await;
        assert!(driver.world[FIRST].seat.controller.state().emergency_stop);
        assert!(!raised.load(Ordering::Relaxed), "the action has been taken");
        assert_eq!(result.await.unwrap(), Ok(()), "the button was pressed");
    });
}

/// Opens a terminal of the driver as a program does. A test run without a controlling terminal must not get this one: it would
/// end with SIGHUP when the driver closes it.
#[cfg(unix)]
fn open_terminal(path: &std::path::Path) -> std::fs::File {
    use std::os::unix::fs::OpenOptionsExt as _;
    let no_controlling_terminal = i32::try_from(rustix::fs::OFlags::NOCTTY.bits()).unwrap();
    std::fs::File::options()
        .read(true)
        .write(true)
        .custom_flags(no_controlling_terminal)
        .open(path)
        .unwrap()
}

#[cfg(unix)]
#[test]
fn what_a_host_has_written_to_a_terminal_is_handled_before_what_is_asked_for_after_it() {
    single_threaded().block_on(async {
        let directory = crate::testing::TempDir::new("order");
        let inputs = Inputs::default();
        let (mut driver, requests) = open_with(|setup| {
            let line = SerialEndpoint::Pty(directory.at("host"));
            setup.serial.insert(Port::Host, line);
            setup.subscribers.push(Box::new(inputs.clone()));
        });
        // It is opened and written to while the driver gets no turn.
        let mut host = open_terminal(&directory.at("host"));
        let mut sent = Vec::new();
        for number in 1..=50 {
            let text = format!("\x02SU{number}\r\x03");
            host.write_all(text.as_bytes()).unwrap();
            sent.extend(text.into_bytes());
            let seen = inputs.clone();
            let is_done = query(&requests, move |_| seen.received(Port::Host));
            let mut found = None;
            driver.serve(async { found = is_done.await.ok() }).await;
            assert_eq!(found, Some(sent.clone()));
        }
    });
}

#[cfg(unix)]
#[test]
fn who_has_connected_or_opened_a_terminal_before_a_command_on_another_port_is_known_before_it() {
    single_threaded().block_on(async {
        let directory = crate::testing::TempDir::new("order");
        let inputs = Inputs::default();
        let (mut driver, _requests) = open_with(|setup| {
            let line = SerialEndpoint::Pty(directory.at("com1"));
            setup.serial.insert(Port::Com1, line);
            setup.subscribers.push(Box::new(inputs.clone()));
        });
        let mut host = serve_while(&mut driver, |ports| {
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02SO\r\x03", b"\x02OK\r\x03");
            host
        })
        .await;
        inputs.0.lock().unwrap().clear();
        let _terminal = open_terminal(&directory.at("com1"));
        let _vision = dial(driver.ports(FIRST), Port::Ip1);
        host.write_all(b"\x02RN\r\x03").unwrap();
        serve_until(&mut driver, |_| !inputs.received(Port::Ip0).is_empty()).await;
        let found = inputs.0.lock().unwrap();
        let place = |is: &dyn Fn(&Input) -> bool| found.iter().position(is).unwrap();
        let command = place(&|input| matches!(input, Input::Received { port: Port::Ip0, .. }));
        for port in [Port::Com1, Port::Ip1] {
            let connected = place(&|input| matches!(input, Input::Connected { port: of, .. } if *of == port));
            assert!(connected < command, "{found:?}");
        }
    });
}

#[test]
fn while_a_file_is_being_stored_the_state_can_be_read_and_everything_else_waits_in_order() {
    single_threaded().block_on(async {
        let directory = crate::testing::TempDir::new("storing");
        let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
        let backing = Backing::new(store, WhenFull::Refuse);
        let (store, (locked, is_locked), (release, is_released)) =
            (backing.store(), channel::<()>(), channel::<()>());
        let (mut driver, requests) = open_with(|setup| {
            setup.controller.persist_outside(true);
            setup.backing = Some(backing);
        });
        let mut host = serve_while(&mut driver, |ports| {
            let mut host = dial(&ports, Port::Ip0);
            exchange(&mut host, b"\x02DL,A\r\x03", b"\x02OK\r\x03");
            host
        })
        .await;
        // The write waits for the store, which another thread has until it is told to let go.
        let disk = std::thread::spawn(move || {
            let _store = store.lock().unwrap();
            locked.send(()).unwrap();
            is_released.recv().unwrap();
        });
        is_locked.recv().unwrap();
        host.write_all(b"\x02FL,PROGRAM A\nEND\n\x1A\x03").unwrap();
        serve_until(&mut driver, |driver| driver.world[FIRST].edge.write.is_some()).await;
        let is_done = query(&requests, |view| {
            view.controller.drive().get("A").map(<[u8]>::to_vec)
        });
        let mut found = None;
        driver.serve(async { found = is_done.await.ok() }).await;
        assert_eq!(
            found,
            Some(None),
            "the state can be read, and the file is not there yet"
        );
        // An action, and a command on the same connection.
        let (done, mut result) = oneshot::channel();
        let name = "A".to_owned();
        let reply = Box::new(move |result, _: &View<'_>| done.send(result).unwrap());
        let erase = Request::Action(Action::EraseFile { name }, By::Owner, reply);
        requests.send(erase).await.ok().unwrap();
        host.write_all(b"\x02SU\r\x03").unwrap();
        driver.serve(turns()).await;
        assert!(result.try_recv().is_err(), "the action waits");
        host.set_nonblocking(true).unwrap();
        assert!(host.read(&mut [0]).is_err(), "nothing has been answered");
        host.set_nonblocking(false).unwrap();
        release.send(()).unwrap();
        disk.join().unwrap();
        serve_while(&mut driver, move |_| {
            exchange(&mut host, b"", b"\x02OK\r\x03\x02FL,");
        })
        .await;
        let mut erased = None;
        driver.serve(async { erased = result.await.ok() }).await;
        assert_eq!(erased, Some(Ok(())), "the file was there");
        assert_eq!(driver.world[FIRST].seat.controller.drive().get("A"), None);
        assert!(!directory.at("A").exists());
    });
}

/// Replaces the running controller by another state.
async fn restore(driver: &mut Driver, next: Controller) {
    let task = SnapshotTask::Replace(Box::new(next));
    let results = driver.act_together(vec![(FIRST, task)]).await;
    results.into_iter().for_each(Result::unwrap);
}

/// Begins a wait for a condition.
async fn begin_wait(driver: &mut Driver, condition: &str, within: Duration) -> oneshot::Receiver<WaitResult> {
    let (done, is_done) = oneshot::channel();
    let wait = wait::Wait::new(Some(condition.parse().unwrap()), within, false);
    driver.serve_request(FIRST, Request::Wait(wait, done)).await;
    is_done
}

fn input_line(line: u16, on: bool) -> Input {
    Input::by_hand(PanelAction::InputLine { line, on })
}

#[test]
fn a_wait_ends_unreached_when_a_snapshot_is_restored_in_which_its_condition_holds() {
    single_threaded().block_on(async {
        let directory = crate::testing::TempDir::new("restored-wait");
        let (store, _) = Store::open(directory.path(), LineEnd::Lf).unwrap();
        let (mut driver, _requests) = open_with(|setup| {
            setup.time = TimeMode::Stepped;
            setup.controller.persist_outside(true);
            setup.backing = Some(Backing::new(store, WhenFull::Refuse));
        });
        driver.feed(FIRST, input_line(5, true));
        let next = driver.world[FIRST].seat.controller.clone();
        driver.feed(FIRST, input_line(5, false));
        let mut ended = begin_wait(&mut driver, "input 5 on", HOUR).await;
        restore(&mut driver, next).await;
        assert_eq!(ended.try_recv().map(|result| result.reached), Ok(false));
    });
}

/// Switches input line 5 at these moments, in milliseconds.
struct Switched(Vec<(u64, bool)>);

impl ActionSource for Switched {
    fn deadline(&self) -> Option<Time> {
        self.0.first().map(|(at, _)| Time::from_millis(*at))
    }

    fn take_due(&mut self, now: Time) -> Option<(Time, PlannedAction)> {
        let at = self.deadline().filter(|at| *at <= now)?;
        let (_, on) = self.0.remove(0);
        Some((at, PlannedAction::Input(input_line(5, on))))
    }
}

#[test]
fn a_condition_counts_if_it_is_met_within_the_limit_of_a_wait_however_far_time_jumps() {
    single_threaded().block_on(async {
        for (switched, reached) in [
            (vec![(4_000, true)], true),
            (vec![(2_000, true), (3_000, false)], true),
            (vec![(5_000, true)], true),
            (vec![(5_000, true), (6_000, false)], true),
            (vec![(5_001, true)], false),
            (vec![(28_800_000, true)], false),
        ] {
            let (mut driver, _requests) = open_with(|setup| setup.time = TimeMode::Stepped);
            driver.seat(FIRST).plan(Box::new(Switched(switched.clone())));
            let mut ended = begin_wait(&mut driver, "input 5 on", Duration::from_secs(5)).await;
            driver.clock.jump(Time::ZERO + HOUR * 8);
            driver.feed(FIRST, Input::Tick);
            let found = ended.try_recv().map(|result| result.reached);
            assert_eq!(found, Ok(reached), "{switched:?}");
        }
    });
}

/// Something to be done at one moment.
pub(super) struct At(pub(super) Time);

impl ActionSource for At {
    fn deadline(&self) -> Option<Time> {
        Some(self.0)
    }

    fn take_due(&mut self, _now: Time) -> Option<(Time, PlannedAction)> {
        None
    }
}

mod serial;
mod together;
