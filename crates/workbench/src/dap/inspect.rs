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
        let number = |key: &str| arguments.get(key).and_then(Value::as_u64);
        let first = number("startFrame").map_or(0, |first| usize::try_from(first).unwrap_or(usize::MAX));
        let most = number("levels").filter(|most| *most > 0);
        let most = most.map_or(usize::MAX, |most| usize::try_from(most).unwrap_or(usize::MAX));
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
            ("Lines", Container::Lines, None),
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
        let number = |key: &str| arguments.get(key).and_then(Value::as_u64);
        let first = number("start").map_or(0, |first| usize::try_from(first).unwrap_or(usize::MAX));
        let most = number("count").filter(|most| *most > 0);
        let most = most.and_then(|most| usize::try_from(most).ok());
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
        let text = |key: &str| arguments.get(key).and_then(Value::as_str).unwrap_or_default();
        let (name, value) = (text("name").to_owned(), text("value").to_owned());
        let (task, call, target, kind) = container.target(&self.scene, &name)?;
        self.assign(task, call, &variables::assignment(&target, kind, &value))
    }

    pub(super) fn set_expression(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let (task, call) = self.frame(arguments)?;
        let text = |key: &str| arguments.get(key).and_then(Value::as_str).unwrap_or_default();
        let (target, value) = (text("expression").to_owned(), text("value").to_owned());
        let now = self.stopped_debuggee()?.evaluate(task, call, &target);
        let kind = now.ok().and_then(|now| now.kind);
        self.assign(task, call, &variables::assignment(&target, kind, &value))
    }

    fn assign(&mut self, task: u16, call: usize, text: &str) -> Result<Value, Refusal> {
        let debuggee = self.stopped_debuggee()?;
        let value = debuggee.assign(task, call, text)?;
        self.scene = debuggee.scene()?;
        let document = self.variable(Shown::of(value, task, call));
        Ok(result_of(document, "value"))
    }

    pub(super) fn evaluate(&mut self, arguments: &Value) -> Result<Value, Refusal> {
        let (task, call) = self.frame(arguments)?;
        let text = |key: &str| arguments.get(key).and_then(Value::as_str).unwrap_or_default();
        let (expression, context) = (text("expression").trim().to_owned(), text("context"));
        if context == "repl" && scol_mini::is_assignment(&expression) {
            let (target, value) = expression.split_once('=').unwrap_or((&expression, ""));
            let now = self.stopped_debuggee()?.evaluate(task, call, target);
            let kind = now.ok().and_then(|now| now.kind);
            let assignment = variables::assignment(target.trim(), kind, value);
            let assigned = self.assign(task, call, &assignment)?;
            return Ok(result_of(assigned, "result"));
        }
        let value = self.stopped_debuggee()?.evaluate(task, call, &expression)?;
        let document = self.variable(Shown::of(value, task, call));
        Ok(result_of(document, "result"))
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

/// A variable as the answer of a request that has made or found it, its value under this key.
fn result_of(mut variable: Value, key: &str) -> Value {
    let mut found = |name: &str| variable.get_mut(name).map(Value::take).unwrap_or_default();
    let (value, result) = (found("value"), found("result"));
    let value = if value.is_null() { result } else { value };
    let (kind, reference, indexed) = (
        found("type"),
        found("variablesReference"),
        found("indexedVariables"),
    );
    let mut result = json!({ "variablesReference": reference });
    result[key] = value;
    if !kind.is_null() {
        result["type"] = kind;
    }
    if !indexed.is_null() {
        result["indexedVariables"] = indexed;
    }
    result
}
