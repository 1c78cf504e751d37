//! Requests about a program that has stopped: its calls, its variables, their values.

use super::variables::{self, Container, Shown};
use super::{Launcher, MAIN_TASK, Refusal, Server, thread};
use serde_json::{Value, json};
use std::mem;
use ts3100_book::book;

impl<L: Launcher> Server<L> {
    pub(super) fn stack_trace(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let task = thread(arguments)?;
        self.stopped_debuggee()?;
        let source = self.source_document();
        let stack = self.scene.tasks.iter().find(|stack| stack.id == task);
        let calls = stack.map(|stack| stack.calls.as_slice()).unwrap_or_default();
        let mut shown = Vec::new();
        for (call, view) in calls.iter().enumerate().rev() {
            self.frames.push((task, call));
            let interrupted = stack.and_then(|stack| stack.interrupted);
            let name = match interrupted {
                Some(first) if call == first => format!("{} (ON ... DO)", view.program),
                _ => view.program.clone(),
            };
            shown.push(json!({
                "id": self.frames.len(),
                "name": name,
                "source": source,
                "line": self.client.line(view.line),
                "column": self.client.first_column(),
            }));
        }
        let total = shown.len();
        let first = count(arguments, "startFrame").unwrap_or(0);
        let most = count(arguments, "levels").unwrap_or(usize::MAX);
        let shown: Vec<Value> = shown.into_iter().skip(first).take(most).collect();
        Ok(json!({ "stackFrames": shown, "totalFrames": total }))
    }

    /// Task and call of a frame; without one, the innermost call of the main program.
    fn frame(&self, arguments: &Value) -> Result<(u16, usize), Refusal> {
        let Some(id) = arguments.get("frameId").and_then(Value::as_u64) else {
            let main = self.scene.tasks.first();
            return Ok(main.map_or((MAIN_TASK, 0), |main| {
                (main.id, main.calls.len().saturating_sub(1))
            }));
        };
        let place = usize::try_from(id).ok().and_then(|id| id.checked_sub(1));
        let frame = place.and_then(|place| self.frames.get(place)).copied();
        frame.ok_or_else(|| Refusal::new(format!("frame {id} is of another stop")))
    }

    fn open(&mut self, container: Container) -> usize {
        self.containers.push(container);
        self.containers.len()
    }

    pub(super) fn scopes(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let (task, call) = self.frame(arguments)?;
        self.stopped_debuggee()?;
        let scopes = [
            ("Local", Container::Locals { task, call }, Some("locals")),
            ("Global", Container::Globals { task, call }, None),
            ("Points", Container::Points { task, call }, None),
            ("Lines", Container::Lines { task, call }, None),
            ("Channels", Container::Channels, None),
        ];
        let scopes = scopes.map(|(name, container, hint)| {
            let mut scope =
                json!({ "name": name, "variablesReference": self.open(container), "expensive": false });
            if let Some(hint) = hint {
                scope["presentationHint"] = json!(hint);
            }
            scope
        });
        Ok(json!({ "scopes": scopes }))
    }

    fn container(&self, arguments: &Value) -> Result<Container, Refusal> {
        let reference = arguments.get("variablesReference").and_then(Value::as_u64);
        let place = reference.and_then(|reference| usize::try_from(reference).ok()?.checked_sub(1));
        let found = place.and_then(|place| self.containers.get(place));
        found
            .cloned()
            .ok_or_else(|| Refusal::new("these variables are of another stop"))
    }

    pub(super) fn variables(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let container = self.container(arguments)?;
        let scene = mem::take(&mut self.scene);
        let first = count(arguments, "start").unwrap_or(0);
        let most = count(arguments, "count");
        let debuggee = self.stopped_debuggee();
        let shown = debuggee.map(|debuggee| container.shown(&scene, debuggee.as_ref(), first, most));
        self.scene = scene;
        let shown = shown?;
        let documents = shown.into_iter().map(|shown| self.variable(shown));
        Ok(json!({ "variables": documents.collect::<Vec<_>>() }))
    }

    fn variable(&mut self, shown: Shown) -> Value {
        let mut document = json!({ "name": shown.name, "value": shown.value });
        if let Some(kind) = shown.kind {
            document["type"] = json!(kind);
        }
        if let Some(expression) = shown.expression {
            document["evaluateName"] = json!(expression);
        }
        if !shown.can_be_set {
            document["presentationHint"] = json!({ "attributes": ["readOnly"] });
        }
        let count = shown.children.as_ref().map_or(0, Container::indexed);
        if count > 0 {
            document["indexedVariables"] = json!(count);
        }
        document["variablesReference"] = json!(shown.children.map_or(0, |children| self.open(children)));
        document
    }

    pub(super) fn set_variable(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let container = self.container(arguments)?;
        let (task, call, target, kind) = container.target(&self.scene, text(arguments, "name"))?;
        let assignment = variables::assignment(&target, kind, text(arguments, "value"));
        Ok(result_of(self.assign(task, call, &assignment)?, "value"))
    }

    pub(super) fn set_expression(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let frame = self.frame(arguments)?;
        let (target, value) = (text(arguments, "expression"), text(arguments, "value"));
        Ok(result_of(self.give(frame, target, value)?, "value"))
    }

    pub(super) fn evaluate(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let (task, call) = self.frame(arguments)?;
        let expression = text(arguments, "expression").trim();
        let assignment = scol_mini::split_assignment(expression);
        let variable = match assignment.filter(|_| text(arguments, "context") == "repl") {
            Some((target, value)) => self.give((task, call), target, value)?,
            None => {
                let value = self.stopped_debuggee()?.evaluate(task, call, expression)?;
                self.variable(Shown::of(value, task, call))
            }
        };
        Ok(result_of(variable, "result"))
    }

    /// Gives what an expression names in a call this value.
    fn give(&mut self, (task, call): (u16, usize), target: &str, value: &str) -> Result<Value, Refusal> {
        let now = self.stopped_debuggee()?.evaluate(task, call, target);
        let kind = now.ok().and_then(|now| now.kind);
        self.assign(task, call, &variables::assignment(target, kind, value))
    }

    fn assign(&mut self, task: u16, call: usize, text: &str) -> Result<Value, Refusal> {
        let debuggee = self.stopped_debuggee()?;
        let value = debuggee.assign(task, call, text)?;
        self.scene = debuggee.scene()?;
        Ok(self.variable(Shown::of(value, task, call)))
    }

    pub(super) fn exception_info(&mut self) -> Result<Value, Refusal> {
        let Some((number, text)) = &self.alarm else {
            return Err(Refusal::new("an alarm was not the reason of the last stop"));
        };
        let explained = book().alarm(number).unwrap_or_default();
        Ok(json!({
            "exceptionId": number,
            "description": text,
            "breakMode": "always",
            "details": { "message": text, "typeName": number, "stackTrace": explained },
        }))
    }
}

/// A text among the arguments; empty where there is none.
fn text<'a>(arguments: &'a Value, key: &str) -> &'a str {
    arguments.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// A count among the arguments; 0 counts as none.
fn count(arguments: &Value, key: &str) -> Option<usize> {
    let count = arguments
        .get(key)
        .and_then(Value::as_u64)
        .filter(|count| *count > 0)?;
    Some(usize::try_from(count).unwrap_or(usize::MAX))
}

/// A variable as the answer of a request that has made or found it, its value under this key.
fn result_of(mut variable: Value, key: &str) -> Value {
    let mut result = json!({});
    for (from, to) in [
        ("variablesReference", "variablesReference"),
        ("value", key),
        ("type", "type"),
        ("indexedVariables", "indexedVariables"),
    ] {
        if let Some(found) = variable.get_mut(from) {
            result[to] = found.take();
        }
    }
    result
}
