//! Why something is as it is: every change of a value with what caused it, and every execution of a line with the value that it
//! found.
//!
//! A recording is played once more for each question, with its statements told one by one. What was asked is kept.

use crate::run::Run;
use serde::ser::{Serialize, SerializeSeq as _, Serializer};
use std::mem;
use std::sync::{Arc, Mutex, PoisonError};
use ts3100_controller::{Controller, Event, Output, Time, Watched};
use ts3100_driver::seat::Subscriber;
use ts3100_proto::escape::Escaped;
use ts3100_proto::words::shortened;
use ts3100_recording::replay::{Moment, Step};
use ts3100_recording::transcript::{Record, RecordKind};

/// Most changes or executions of an answer that are found; the rest is counted.
pub const MAX_FOUND: usize = 50_000;
/// Answers that are kept; the oldest goes first.
const MAX_KEPT: usize = 16;
/// Most characters of a cause.
const MAX_CAUSE: usize = 120;

/// A change of a value, or an execution of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The last event that had happened then.
    pub event: u64,
    pub at: Time,
    /// The new value of a change; the value before an execution. Empty where there is none.
    pub value: String,
    /// What has changed it; the task of an execution.
    pub cause: String,
}

/// As `[event, t, value, cause]`, the time in microseconds.
impl Serialize for Found {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut items = serializer.serialize_seq(Some(4))?;
        items.serialize_element(&self.event)?;
        items.serialize_element(&self.at)?;
        items.serialize_element(&self.value)?;
        items.serialize_element(&self.cause)?;
        items.end()
    }
}

/// What a question has found.
#[derive(Debug, Clone, Default)]
pub struct Answer {
    pub found: Vec<Found>,
    /// How many more there are.
    pub more: u64,
}

impl Answer {
    /// The changes or executions until a moment.
    pub fn before(&self, run: &Run, moment: Moment) -> &[Found] {
        let event = run.event_at(moment);
        let is_before = |found: &Found| found.event < event || found.event == event && found.at <= moment.at;
        let after = self.found.partition_point(is_before);
        self.found.get(..after).unwrap_or_default()
    }
}

/// What is asked of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Question {
    /// Each change of a value.
    Changes(Watched),
    /// Each execution of a line of this file, with the value before it.
    Hits {
        file: String,
        line: u32,
        value: Option<Watched>,
    },
}

/// The answers that were given last.
#[derive(Default)]
pub struct Answers(Mutex<Vec<(String, Arc<Answer>)>>);

impl Answers {
    /// The answer to a question; of a run that is whole it is kept.
    pub fn get(&self, run: &Run, question: &Question) -> Arc<Answer> {
        let key = format!("{question:?}");
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, answer)) = kept.iter().find(|(known, _)| *known == key) {
            return Arc::clone(answer);
        }
        let answer = Arc::new(ask(run, question));
        if run.is_complete() {
            kept.push((key, Arc::clone(&answer)));
            if kept.len() > MAX_KEPT {
                kept.remove(0);
            }
        }
        answer
    }
}

/// A statement that was told.
struct Statement {
    line: u32,
    task: u16,
    seen: String,
}

impl Statement {
    /// `PICK line 7: N = N + 1`, of the file as it is now: it may have been stored again.
    fn place(&self, controller: &Controller, file: &str) -> String {
        if self.task == 0 {
            return "the statement of DO".to_owned();
        }
        let content = controller.files().find(|(name, _)| *name == file);
        let text = content.map(|(_, content)| String::from_utf8_lossy(content));
        let place = usize::try_from(self.line)
            .ok()
            .and_then(|line| line.checked_sub(1));
        let line = text
            .as_deref()
            .zip(place)
            .and_then(|(text, place)| text.lines().nth(place));
        let task = match self.task {
            1 => String::new(),
            task => format!(" (task {task})"),
        };
        let line = line.unwrap_or_default().trim();
        let words = format!("{file} line {}{task}: {line}", self.line);
        shortened(&words, MAX_CAUSE).into_owned()
    }
}

/// Collects the statements of a step.
struct Listener(Arc<Mutex<Vec<Statement>>>);

impl Subscriber for Listener {
    fn output(&mut self, _at: Time, output: &Output) {
        if let Output::Event(Event::Statement { line, task, seen, .. }) = output {
            let (line, task, seen) = (*line, *task, seen.clone().unwrap_or_default());
            let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            told.push(Statement { line, task, seen });
        }
    }

    fn wants_statements(&self) -> bool {
        true
    }
}

/// Plays the run once more for a question.
pub fn ask(run: &Run, question: &Question) -> Answer {
    let (Some(mut playback), told) = (run.start(), Arc::default()) else {
        return Answer::default();
    };
    let watched = match question {
        Question::Changes(watched) => Some(watched.clone()),
        Question::Hits { value, .. } => value.clone(),
    };
    playback.subscribe(Box::new(Listener(Arc::clone(&told))));
    playback.watch(watched.as_ref());
    let mut asked = Asked {
        question,
        watched,
        value: String::new(),
        found: Vec::new(),
        more: 0,
    };
    asked.value = asked.read(playback.controller());
    let mut file = playback.controller().selected().to_owned();
    while let Some(step) = playback.step() {
        let statements = mem::take(&mut *told.lock().unwrap_or_else(PoisonError::into_inner));
        let by = || match step {
            Step::Due => "the time: a delay, a pulse or a motion".to_owned(),
            Step::Record(place) => run.recording().records.get(place).map(cause).unwrap_or_default(),
        };
        let controller = playback.controller();
        asked.step(playback.moment(), controller, &file, &statements, by);
        if controller.selected() != file {
            controller.selected().clone_into(&mut file);
        }
    }
    let moments = asked.found.iter().map(|(moment, ..)| *moment);
    let events = run.events_at(moments);
    let found = asked.found.into_iter().zip(events);
    Answer {
        found: found
            .map(|((moment, value, cause), event)| Found {
                event,
                at: moment.at,
                value,
                cause,
            })
            .collect(),
        more: asked.more,
    }
}

/// A question on its way through a run.
struct Asked<'a> {
    question: &'a Question,
    watched: Option<Watched>,
    value: String,
    found: Vec<(Moment, String, String)>,
    more: u64,
}

impl Asked<'_> {
    fn read(&self, controller: &Controller) -> String {
        let watched = self.watched.as_ref();
        watched
            .map(|watched| controller.read_watched(watched))
            .unwrap_or_default()
    }

    fn step(
        &mut self,
        moment: Moment,
        controller: &Controller,
        file: &str,
        statements: &[Statement],
        by: impl Fn() -> String,
    ) {
        match self.question {
            Question::Changes(_) => {
                // The value was seen before each statement, so the one before that has changed it.
                let mut last = None;
                let cause = |last: Option<&Statement>| match last {
                    Some(statement) => statement.place(controller, file),
                    None => by(),
                };
                for statement in statements {
                    self.change(moment, &statement.seen, || cause(last));
                    last = Some(statement);
                }
                let now = self.read(controller);
                self.change(moment, &now, || cause(last));
            }
            Question::Hits {
                file: wanted, line, ..
            } => {
                for hit in statements.iter().filter(|hit| hit.line == *line && hit.task > 0) {
                    if wanted.is_empty() || file.eq_ignore_ascii_case(wanted) {
                        let task = match hit.task {
                            1 => "the main program".to_owned(),
                            task => format!("task {task}"),
                        };
                        self.keep(moment, &hit.seen, || task);
                    }
                }
            }
        }
    }

    fn change(&mut self, moment: Moment, value: &str, cause: impl FnOnce() -> String) {
        if value != self.value {
            value.clone_into(&mut self.value);
            self.keep(moment, value, cause);
        }
    }

    fn keep(&mut self, moment: Moment, value: &str, cause: impl FnOnce() -> String) {
        if self.found.len() < MAX_FOUND {
            self.found.push((moment, value.to_owned(), cause()));
        } else {
            self.more += 1;
        }
    }
}

/// What a record is, as a cause.
fn cause(record: &Record) -> String {
    let words = match &record.kind {
        RecordKind::Connected { line, .. } => format!("a host connected to {line}"),
        RecordKind::FromHost { line, bytes } => {
            format!("the host on {line}: {}", Escaped::for_reading(bytes))
        }
        RecordKind::FromRobot { line, .. } => format!("an answer on {line}"),
        RecordKind::Ended { line, .. } => format!("the connection of {line} ended"),
        RecordKind::Action(action) => format!("at the controller: {action}"),
        RecordKind::Link(link) => match record.kind.new_time() {
            Some(_) => "a reset or a restored snapshot".to_owned(),
            None => format!("on the line: {link}"),
        },
        RecordKind::Remark(words) => words.clone(),
    };
    shortened(&words, MAX_CAUSE).into_owned()
}
