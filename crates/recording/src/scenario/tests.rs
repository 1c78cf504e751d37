//! Scenarios read and played against a controller without sockets.

mod runaway;

use super::{
    CHANNEL_ACTIONS, EntryProgress, EntryState, Play, Scenario, ScenarioAction, ScenarioState, Verdict,
};
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use ts3100_controller::port::Port;
use ts3100_controller::{Config, Controller, Dialect, Input, Time, action_forms};
use ts3100_driver::seat::{Notice, Seat, Side, Subscriber};

fn read(text: &str) -> Result<Scenario, String> {
    Scenario::parse(Path::new("dir/s.toml"), text).map_err(|error| error.to_string())
}

#[test]
fn what_is_wrong_is_said_with_its_line() {
    for (text, expected) in [
        ("name = 5", "dir/s.toml, line 1: expected text, found 5"),
        (
            "\n\nnmae = \"x\"",
            "line 3: unknown key `nmae` in the file; did you mean `name`?",
        ),
        (
            "[start]\nkeyswitch = 1",
            "line 2: unknown key `keyswitch` in [start]",
        ),
        (
            "[start]\nkey-switch = \"Ext\"",
            "line 2: expected teaching, internal or ext, found `Ext`",
        ),
        (
            "[start]\ninputs = [1, 77]",
            "line 2: expected line 1-64, 101-164, 201-264, 301-364, 401-464, found 77",
        ),
        ("do = 3", "line 1: expected tables [[do]], found 3"),
        (
            "[[do]]\nactions = []",
            "line 1: expected `at` or `when` in [[do]], found neither",
        ),
        (
            "[[do]]\nat = \"1 s\"\nwhen = \"alarm\"\nactions = []",
            "found both",
        ),
        (
            "[[do]]\nat = \"1 s\"\ntimes = 2\nactions = []",
            "line 3: expected `at` alone",
        ),
        (
            "[[do]]\nat = \"1 hour\"\nactions = []",
            "line 2: cannot read `1 hour` as a duration: expected e.g. `5s`",
        ),
        (
            "[[do]]\nat = \"-1 s\"\nactions = []",
            "line 2: cannot read `-1 s` as a duration: expected e.g. `5s`",
        ),
        (
            "[[do]]\nat = \"9999999999 s\"\nactions = []",
            "line 2: expected a time of at most 365 days",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\n \"servo on\",\n \"servo up\"]",
            "line 5: cannot read the action `servo up`: expected on or off, found `up`",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"channel IP0 inject x\"]",
            "expected the channel COM1, IP1 or IP2, found `IP0`",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"alarms raise 9-999\"]",
            "line 3: expected the number of an alarm",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"alarms raise 8-027\"]",
            "line 3: expected 8-014, which replaces 8-027, found `8-027`",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"faults arm flipped-bit:way=in,command=SO\"]",
            "cannot arm flipped-bit: no occasion matches command=SO",
        ),
        (
            "[[expect]]\nwhat = \"command\"",
            "line 2: cannot read the condition `command`: expected text",
        ),
        (
            "[[expect]]\nwithin = \"1 s\"",
            "line 1: expected `what` in [[expect]], found none",
        ),
        ("[[expect]]\nwhat = \"alarm\"\ntimes = 0", "write [[never]]"),
        (
            "[[expect]]\nwhat = \"alarm 9-999\"",
            "line 2: cannot read the condition `alarm 9-999`: expected the number of an alarm of the controller, \
             for example 2-046, found `9-999`",
        ),
        (
            "[[never]]\nwhat = \"dance\"",
            "line 2: unknown condition `dance`; `ts3100 docs conditions` lists every condition",
        ),
        (
            "[[never]]\nwhat = \"alarm\"\nwithin = \"1 s\"",
            "line 3: unknown key `within` in [never]",
        ),
        (
            "[[expect]]\nwhat = \"commandd SU\"",
            "line 2: unknown condition `commandd SU`; did you mean `command`?",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"serv on\"]",
            "line 3: unknown action `serv on`; did you mean `servo`?",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"inputs 5 on\"]\n",
            "line 3: unknown action `inputs 5 on`; did you mean `input`?",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"files put A B\"]\n",
            "line 3: unknown action `files put A B`; did you mean `file`?",
        ),
        (
            "[[do]]\nat = \"1 s\"\nactions = [\"file put A\"]\n",
            "line 3: expected a text after the name of the file, found nothing",
        ),
        (
            "[[expect]]\nwhat = \"alarm\"\nwithin = 10",
            "line 3: expected a time with its unit, found 10; write \"10 s\"",
        ),
        (
            "\nPROGRAM PICK\nEND\n",
            "line 1: this is a SCOL program, not a scenario: load it with `--load`",
        ),
        ("a = [", "line 1:"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.contains(expected), "{text}\n{error}");
    }
}

#[test]
fn every_form_of_an_action_is_one() {
    for form in action_forms().chain(CHANNEL_ACTIONS) {
        let examples = [
            ("teaching|internal|ext", "ext"),
            ("sig|rs232c|ether", "sig"),
            ("press|release", "release"),
            (
                "AXIS plus|minus joint|tool|work|world slow|mid|fast [inching]",
                "6 minus tool mid",
            ),
            (
                "none|LINE [if CONDITION] [hits RULE] [say TEXT] [LINE ...]",
                "3 if N<20>==<20>2 hits >=4 say part 17",
            ),
            ("into|over|out|motion TASK", "over 1"),
            ("TASK CALL NAME = VALUE", "1 0 N = 5"),
            ("PERCENT", "35"),
            ("continuous|cycle|step|segment", "step"),
            ("open|close", "close"),
            ("on|off|cycle", "cycle"),
            ("on|off", "off"),
            ("low|ok", "ok"),
            ("alarms raise NUMBER [TEXT]", "alarms raise 2-046 by hand"),
            ("NUMBER", "3"),
            ("put NAME TEXT", "put NAME END<LF>"),
            ("keys TEXT", "keys 5<CR>"),
            ("inject TEXT", "inject 5<CR>"),
            ("SPEC", "ng:command=SO"),
            ("TIME", "250 us"),
            ("VALUES", "1 2.5"),
            ("LINE", "3"),
            ("CHANNEL", "IP1"),
            ("PORT", "IP0"),
        ];
        let words = examples
            .iter()
            .fold((*form).to_owned(), |words, (word, example)| {
                words.replace(word, example)
            });
        assert!(ScenarioAction::parse(&words).is_ok(), "{words}");
    }
}

/// docs/reference/scenarios.md names every action.
#[test]
fn every_action_is_documented() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference/scenarios.md");
    let page = std::fs::read_to_string(page).unwrap();
    for form in action_forms().chain(CHANNEL_ACTIONS) {
        let form = form.replace('|', "\\|");
        assert!(page.contains(&format!("`{form}`")), "{form} is missing");
    }
}

#[test]
fn a_connection_can_be_dropped() {
    let mut step = Stage::new("[[do]]\nat = \"1 s\"\nactions = [\"channel IP0 drop\", \"channel IP3 drop\"]");
    let drops = Arc::default();
    step.seat.subscribe(Box::new(Drops(Arc::clone(&drops))));
    step.until(2_000);
    assert_eq!(*drops.lock().unwrap(), [Port::Ip0], "nobody is connected to IP3");
}

/// Notes the connections that were closed from outside.
struct Drops(Arc<Mutex<Vec<Port>>>);

impl Subscriber for Drops {
    fn notice(&mut self, _at: Time, notice: Notice<'_>) {
        if let Notice::Dropped(port) = notice {
            self.0.lock().unwrap().push(port);
        }
    }
}

/// A controller and a play.
struct Stage {
    seat: Seat,
    play: Play,
}

impl Stage {
    fn new(text: &str) -> Stage {
        let mut controller = Controller::new(Config::new(Dialect::Field), Vec::new()).unwrap();
        let program = "PROGRAM T\nINPUT IP1, N\nPRINT IP1, N, CR\nDOUT(7)\nEND\n";
        controller.put_file("T", program.as_bytes()).unwrap();
        controller.select(Time::ZERO, "T").unwrap();
        let play = Play::new(read(text).unwrap());
        let mut seat = Seat::new(controller);
        play.start(&mut seat);
        let mut step = Stage { seat, play };
        for port in [Port::Ip0, Port::Ip1] {
            let peer = "test".to_owned();
            step.step(Time::ZERO, Input::Connected { port, peer });
        }
        step
    }

    fn step(&mut self, at: Time, input: Input) {
        let _refusal_is_an_event = self.seat.feed(at, input, Side::Host, &mut ());
    }

    /// Time passes; what is due happens at its time.
    fn until(&mut self, millis: u64) {
        self.step(Time::from_millis(millis), Input::Tick);
    }

    fn replace_controller(&mut self, next: Controller) -> Controller {
        let before = self.seat.controller.now();
        self.seat.notify(before, Notice::Restored(&next));
        std::mem::replace(&mut self.seat.controller, next)
    }

    fn host(&mut self, command: &str) {
        let bytes = format!("\x02{command}\r\x03").into_bytes();
        let port = Port::Ip0;
        self.step(self.seat.controller.now(), Input::received(port, bytes));
    }

    fn verdicts(&self) -> Vec<Verdict> {
        let outcome = self.play.outcome(self.seat.controller.now());
        outcome.entries.into_iter().map(|entry| entry.verdict).collect()
    }
}

const PLAY: &str = r#"
[start]
servo-on = true
inputs = [3]

[[do]]
when = "command RN"
after = "200 ms"
actions = ["channel IP1 inject 5<CR>"]

[[do]]
at = "2 s"
actions = ["emergency-stop press"]

[[expect]]
what = "printed IP1 5"
within = "1 s"

[[expect]]
what = "output 7 on"
after = "status running"
within = "100 ms"

[[expect]]
what = "command SU"
after = "alarm 8-014"
within = "500 ms"

[[never]]
what = "command RN"
after = "alarm"

[[never]]
what = "command RN"
after = "alarm"
until = "alarms reset"

[[do]]
when = "finding no-cr"
actions = ["program stop"]
"#;

#[test]
fn a_host_that_does_what_is_expected_passes() {
    let mut step = Stage::new(PLAY);
    step.until(100);
    step.host("RN");
    step.until(2_400);
    step.host("SU");
    step.until(3_000);
    let verdicts = step.verdicts();
    assert_eq!(verdicts[0], Verdict::Held, "the step of RN");
    assert_eq!(verdicts[1], Verdict::Held, "PRINT at 300 ms");
    let late = "expected within 0.1 s, happened after 0.2 s";
    assert_eq!(
        verdicts[2],
        Verdict::Failed(late.to_owned()),
        "the output came with the value"
    );
    assert_eq!(verdicts[3..6], [Verdict::Held, Verdict::Held, Verdict::Held]);
    assert_eq!(
        verdicts[6],
        Verdict::Undone(
            "`program stop` was not done: its condition never happened; the run ended after 3 s".to_owned()
        )
    );
}

/// A step whose actions were not done has an entry that says why; one that may happen any number of times may be left out.
#[test]
fn a_step_that_was_not_done_says_why() {
    let text = "[start]\nservo-on = true\n\
        [[do]]\nat = \"1 s\"\nactions = [\"input 3 on\"]\n\
        [[do]]\nat = \"3 s\"\nactions = [\"input 4 on\", \"input 5 on\"]\n\
        [[do]]\nwhen = \"input 3 on\"\nafter = \"1.5 s\"\nactions = [\"input 6 on\"]\n\
        [[do]]\nwhen = \"input 9 on\"\ntimes = 0\nactions = [\"input 7 on\"]\n";
    let mut step = Stage::new(text);
    step.until(2_000);
    let undone = |words: &str| Verdict::Undone(words.to_owned());
    assert_eq!(
        step.verdicts(),
        [
            undone("`input 4 on, input 5 on` was not done: the run ended after 2 s, before its time"),
            undone(
                "`input 6 on` was not done: the run ended after 2 s, before the 1.5 s after its condition had passed"
            ),
            Verdict::Skipped(
                "`input 7 on` was not done: its condition never happened; the run ended after 2 s".to_owned()
            ),
        ]
    );
    let outcome = step.play.outcome(step.seat.controller.now());
    assert!(!outcome.has_failed());
    assert!(outcome.junit().contains("tests=\"3\" skipped=\"3\""));
    step.until(3_000);
    assert_eq!(step.verdicts()[0], Verdict::Held, "1.5 s after input 3");
    assert_eq!(step.verdicts().len(), 2);
}

fn entry<'a>(entries: &'a [EntryProgress], name: &str) -> (EntryState, Option<u128>, Option<&'a str>) {
    let entry = entries.iter().find(|entry| entry.name.contains(name));
    let entry = entry.unwrap_or_else(|| panic!("{name}: {entries:?}"));
    let time = entry.time.map(|time| time.as_millis());
    (entry.state, time, entry.message.as_deref())
}

#[test]
fn progress_says_how_far_each_entry_is() {
    use EntryState::{Failed, Passed, Waiting};
    let mut step = Stage::new(PLAY);
    let progress = |step: &Stage| step.play.progress(step.seat.controller.now());
    let begin = progress(&step);
    assert_eq!(
        (begin.file.as_str(), begin.state, begin.entries.len()),
        ("s.toml", ScenarioState::Running, 8)
    );
    assert!(begin.entries.is_sorted_by_key(|entry| entry.line));
    assert!(begin.entries.iter().all(|entry| entry.state == Waiting));
    step.until(100);
    step.host("RN");
    let entries = progress(&step).entries;
    assert_eq!(
        entry(&entries, "do when command RN").0,
        Waiting,
        "it is due at 300 ms"
    );
    step.until(2_400);
    let middle = progress(&step);
    let entries = &middle.entries;
    assert_eq!(middle.state, ScenarioState::Failed, "the output came late");
    assert_eq!(
        entry(entries, "do when command RN"),
        (Passed, Some(300), Some("channel IP1 inject 5<CR>"))
    );
    assert_eq!(
        entry(entries, "do at 2 s"),
        (Passed, Some(2_000), Some("emergency-stop press"))
    );
    assert_eq!(entry(entries, "printed IP1 5"), (Passed, Some(300), None));
    let late = Some("expected within 0.1 s, happened after 0.2 s");
    assert_eq!(entry(entries, "output 7 on"), (Failed, Some(300), late));
    assert_eq!(entry(entries, "command SU"), (Waiting, None, None));
    step.until(2_600);
    let unmet = Some("expected once within 0.5 s, but never happened");
    assert_eq!(
        entry(&progress(&step).entries, "command SU"),
        (Failed, Some(2_500), unmet),
        "it can no longer come in time"
    );
}

#[test]
fn progress_ends_when_nothing_waits() {
    let text = "[[expect]]\nname = \"twice\"\nwhat = \"command SU\"\ntimes = 2\n\
        [[expect]]\nname = \"later\"\nwhat = \"command SF\"\nafter = \"command SU\"\n";
    let mut step = Stage::new(text);
    let of = |step: &Stage, name: &str| {
        let progress = step.play.progress(step.seat.controller.now());
        let (state, _, message) = entry(&progress.entries, name);
        (progress.state, state, message.map(str::to_owned))
    };
    let waiting = |message: &str| {
        (
            ScenarioState::Running,
            EntryState::Waiting,
            Some(message.to_owned()),
        )
    };
    assert_eq!(of(&step, "later"), waiting("begins after `command SU`"));
    for command in ["SU", "OK", "SF", "OK"] {
        step.host(command);
    }
    assert_eq!(of(&step, "twice"), waiting("happened 1 of 2 times"));
    step.host("SU");
    assert_eq!(
        of(&step, "twice"),
        (ScenarioState::Passed, EntryState::Passed, None)
    );
}

#[test]
fn statements_and_idleness_are_conditions() {
    let text = "[start]\nservo-on = true\n\
        [[do]]\nwhen = \"line 3\"\nactions = [\"output 9 on\"]\n\
        [[expect]]\nwhat = \"idle\"\nafter = \"line 4\"\nwithin = \"1 s\"\n\
        [[expect]]\nwhat = \"output 9 on\"\n\
        [[never]]\nwhat = \"line 9\"\n";
    let mut step = Stage::new(text);
    step.until(100);
    step.host("RN");
    step.until(200);
    step.step(
        step.seat.controller.now(),
        Input::received(Port::Ip1, b"5\r".to_vec()),
    );
    step.until(1_000);
    assert_eq!(step.verdicts(), [const { Verdict::Held }; 4]);
}

#[test]
fn its_time_goes_on_when_a_snapshot_or_a_reset_sets_the_clock_back() {
    let text = "[[do]]\nat = \"2 s\"\nactions = [\"emergency-stop press\"]\n\
        [[expect]]\nwhat = \"command SU\"\nwithin = \"3 s\"\n\
        [[never]]\nwhat = \"servo on\"\n";
    for (asked, held) in [(1_900, true), (2_100, false)] {
        let mut step = Stage::new(text);
        step.until(500);
        let kept = step.seat.controller.clone();
        step.until(1_500);
        step.replace_controller(kept);
        step.until(900);
        assert!(
            !step.seat.controller.state().emergency_stop,
            "1.9 s after the beginning"
        );
        step.until(1_100);
        assert!(
            step.seat.controller.state().emergency_stop,
            "2.1 s after the beginning"
        );
        step.until(asked);
        step.host("SU");
        let verdicts = step.verdicts();
        assert_eq!(verdicts[0] == Verdict::Held, held, "{verdicts:?}");
        assert_eq!(verdicts[1], Verdict::Held);
    }
}

#[test]
fn a_fault_keeps_the_number_it_is_armed_with() {
    let text =
        "[[do]]\nat = \"10 ms\"\nactions = [\"faults arm ng:command=SO,id=9\", \"faults arm 8 no-reply\"]\n";
    let mut step = Stage::new(text);
    step.until(20);
    let armed = step
        .seat
        .controller
        .faults()
        .reports()
        .map(|report| report.fault.id);
    assert_eq!(armed.collect::<Vec<_>>(), [8, 9]);
}

#[test]
fn what_holds_in_a_snapshot_has_not_come() {
    let mut step = Stage::new("[[never]]\nwhat = \"input 9 on\"\n");
    let mut other = step.seat.controller.clone();
    let on = Input::by_hand(ts3100_controller::PanelAction::InputLine { line: 9, on: true });
    let _refusal_is_an_event = other.handle(other.now(), on);
    while other.poll_output().is_some() {}
    step.replace_controller(other);
    step.until(10);
    assert_eq!(step.verdicts(), [Verdict::Held]);
}

#[test]
fn a_host_that_does_not_fails_with_words() {
    let mut step = Stage::new(PLAY);
    step.until(2_100);
    step.host("RN");
    step.until(2_600);
    step.host("SU");
    let failed = |words: &str| Verdict::Failed(words.to_owned());
    assert_eq!(
        step.verdicts()[1..6],
        [
            failed("expected once within 1 s, but never happened; the run ended after 2.6 s"),
            failed(
                "expected within 0.1 s after `status running`, which never happened; the run ended after 2.6 s"
            ),
            failed("expected within 0.5 s, happened after 0.6 s"),
            failed("expected never, happened at 2.1 s"),
            failed("expected never, happened at 2.1 s"),
        ]
    );
    let outcome = step.play.outcome(step.seat.controller.now());
    assert!(outcome.has_failed() && outcome.failures().count() == 5);
    let xml = outcome.junit();
    assert!(
        xml.contains("<testsuite name=\"s\" tests=\"7\" skipped=\"1\" errors=\"0\" failures=\"5\""),
        "{xml}"
    );
    assert!(
        xml.contains("after `status running`, which never happened"),
        "{xml}"
    );
}

#[test]
fn what_must_not_happen_after_an_event_needs_the_event() {
    let mut step = Stage::new("[[never]]\nwhat = \"command RN\"\nafter = \"input 3 on\"\n");
    step.until(1_000);
    let words =
        "nothing was checked: it begins after `input 3 on`, which never happened; the run ended after 1 s";
    assert_eq!(step.verdicts(), [Verdict::Undone(words.to_owned())]);
    let on = ts3100_controller::PanelAction::InputLine { line: 3, on: true };
    step.step(Time::from_millis(1_000), Input::by_hand(on));
    step.until(2_000);
    assert_eq!(step.verdicts(), [Verdict::Held]);
}

#[test]
fn the_state_to_begin_with_does_not_happen() {
    let text = "[start]\nservo-on = true\ninputs = [5]\n\
        [[never]]\nwhat = \"servo on\"\n\
        [[expect]]\nwhat = \"input 5 on\"\n\
        [[expect]]\nwhat = \"input 6 on\"\n\
        [[do]]\nat = \"0 s\"\nactions = [\"input 6 on\"]\n\
        [[do]]\nat = \"2 s\"\nactions = [\"input 5 off\", \"input 5 on\"]\n\
        [[do]]\nwhen = \"servo on\"\nactions = [\"emergency-stop press\"]\n";
    let mut step = Stage::new(text);
    step.until(1_000);
    let state = step.seat.controller.state();
    assert!(state.servo && !state.emergency_stop);
    let unmet = "expected once, but never happened; the run ended after 1 s".to_owned();
    let undone = |words: &str| Verdict::Undone(words.to_owned());
    let early = undone("`input 5 off, input 5 on` was not done: the run ended after 1 s, before its time");
    let never =
        undone("`emergency-stop press` was not done: its condition never happened; the run ended after 1 s");
    let (held, failed) = (Verdict::Held, Verdict::Failed(unmet));
    assert_eq!(step.verdicts(), [held.clone(), failed, held, early, never]);
    step.until(3_000);
    assert_eq!(step.verdicts()[1], Verdict::Held);
    assert_eq!(
        step.verdicts().len(),
        4,
        "a step at a time that was done has no entry"
    );
}

/// Counts how often FEED HOLD is pressed.
struct FeedHolds(Arc<AtomicU32>);

impl Subscriber for FeedHolds {
    fn input(&mut self, _at: Time, input: &Input, _by: Side) {
        let pressed = *input == Input::by_hand(ts3100_controller::PanelAction::PressFeedHold);
        self.0.fetch_add(u32::from(pressed), Ordering::Relaxed);
    }
}

#[test]
fn a_step_happens_as_often_as_it_says() {
    for (times, expected) in [("", 1), ("times = 2", 2), ("times = 0", 5)] {
        let text = format!("[[do]]\nwhen = \"command SU\"\n{times}\nactions = [\"feed-hold press\"]\n");
        let mut step = Stage::new(&text);
        let held = Arc::default();
        step.seat.subscribe(Box::new(FeedHolds(Arc::clone(&held))));
        for _ in 0..5 {
            step.host("SU");
            step.host("OK");
        }
        assert_eq!(held.load(Ordering::Relaxed), expected, "{times}");
    }
    let at = read("[[do]]\nat = \"0.0015 s\"\nactions = [\"program start\"]").unwrap();
    assert_eq!(
        at.steps[0].trigger,
        super::StepTrigger::At(Duration::from_micros(1_500))
    );
}
