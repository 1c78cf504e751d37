//! Where the program is to stop, as an editor says it.

use super::arguments::{BreakpointsArguments, SourceBreakpoint};
use super::{ALARMS, Launcher, Refusal, Server};
use serde_json::{Value, json};
use ts3100_controller::inspection::{Breakpoint, HitRule};
use ts3100_controller::limits::MAX_BREAKPOINTS;

impl<L: Launcher> Server<L> {
    pub(super) fn set_breakpoints(&mut self, arguments: BreakpointsArguments) -> Result<Value, Refusal> {
        self.debuggee()?.refresh()?;
        let recognized = self.recognize(&arguments.source);
        let (client, no_debug) = (self.client, self.no_debug);
        let wanted = arguments.breakpoints;
        let first = self.next_breakpoint;
        self.next_breakpoint += wanted.len();
        let source = arguments.source.get("path").cloned().unwrap_or_default();
        if let Err(reason) = recognized {
            // Those that were set in its lines before it was changed.
            if self.breakpoints_of == source {
                self.breakpoints.clear();
                self.debuggee()?.set_breakpoints(Vec::new());
            }
            let all = (first..).zip(&wanted);
            let all = all.map(|(id, breakpoint)| unverified(id, breakpoint, &reason));
            return Ok(json!({ "breakpoints": all.collect::<Vec<_>>() }));
        }
        self.breakpoints_of = source;
        let read = wanted.iter().enumerate().map(|(index, breakpoint)| {
            if index >= MAX_BREAKPOINTS {
                return Err(Refusal::new(format!(
                    "at most {MAX_BREAKPOINTS} breakpoints can be set"
                )));
            }
            breakpoint.read(client.line_in(&breakpoint.line)?)
        });
        let read: Vec<Result<Breakpoint, Refusal>> = read.collect();
        let usable: Vec<Breakpoint> = read.iter().filter_map(|read| read.clone().ok()).collect();
        let usable = if no_debug { Vec::new() } else { usable };
        let mut set = self.debuggee()?.set_breakpoints(usable).into_iter();
        let places = read.into_iter().map(|read| match read {
            Ok(_) => set.next().unwrap_or(Err(Refusal::new("nothing is debugged"))),
            Err(reason) => Err(reason),
        });
        let places: Vec<Result<u32, Refusal>> = places.collect();
        let stops = (first..).zip(&places).filter(|(_, place)| place.is_ok());
        self.breakpoints = stops.map(|(id, _)| id).collect();
        let shown = (first..)
            .zip(places.iter().zip(&wanted))
            .map(|(id, (place, wanted))| match place {
                Ok(line) => json!({ "id": id, "verified": true, "line": client.line(*line) }),
                Err(reason) => unverified(id, wanted, reason),
            });
        Ok(json!({ "breakpoints": shown.collect::<Vec<_>>() }))
    }

    pub(super) fn set_exceptions(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let filters = arguments.get("filters").and_then(Value::as_array);
        let mut filters = filters.into_iter().flatten();
        let on = filters.any(|filter| filter == ALARMS);
        let no_debug = self.no_debug;
        self.debuggee()?.stop_on_alarm(on && !no_debug);
        Ok(Value::Null)
    }

    pub(super) fn breakpoint_locations(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        self.debuggee()?;
        let is_program = self
            .recognize(arguments.get("source").unwrap_or(&Value::Null))
            .is_ok();
        let client = self.client;
        let line = |key: &str| arguments.get(key).and_then(Value::as_u64);
        let first = line("line")
            .and_then(|line| u32::try_from(line).ok())
            .unwrap_or(1);
        let last = line("endLine")
            .and_then(|line| u32::try_from(line).ok())
            .unwrap_or(first);
        let (first, last) = (client.line_of_editor(first), client.line_of_editor(last));
        let lines = self.debuggee()?.statement_lines();
        let lines = lines
            .into_iter()
            .filter(|line| is_program && (first..=last).contains(line));
        let lines: Vec<Value> = lines.map(|line| json!({ "line": client.line(line) })).collect();
        Ok(json!({ "breakpoints": lines }))
    }
}

impl SourceBreakpoint {
    fn read(&self, line: u32) -> Result<Breakpoint, Refusal> {
        let given = |text: &Option<String>| text.clone().filter(|text| !text.trim().is_empty());
        let hits = given(&self.hit_condition).map(|text| text.parse::<HitRule>());
        Ok(Breakpoint {
            line,
            condition: given(&self.condition),
            hits: hits.transpose().map_err(Refusal::new)?,
            message: given(&self.log_message),
            hit: 0,
        })
    }
}

/// A breakpoint that is not set, for this reason.
fn unverified(id: usize, wanted: &SourceBreakpoint, reason: &Refusal) -> Value {
    let mut shown = json!({ "id": id, "verified": false, "message": reason });
    if wanted.line.is_i64() || wanted.line.is_u64() {
        shown["line"] = wanted.line.clone();
    }
    shown
}
