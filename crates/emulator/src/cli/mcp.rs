//! `ts3100 mcp`: a Model Context Protocol server on stdin and stdout, with which an assistant works an emulator that runs.
//!
//! The protocol is JSON-RPC 2.0, one message or batch a line, and of it a few methods, so no library
//! is needed. The tools are in [`tools`], each a few calls of the control interface.

#[cfg(test)]
pub(super) mod tests;
mod tools;

use super::ctl::call::Call;
use super::ctl::target::{TargetArgs, advice};
use super::ctl::words_of_refusal;
use anyhow::{Context as _, ensure};
use clap::Args;
use serde_json::{Value, json};
use std::io::{self, BufRead, Read as _, Write as _};
use tools::{TOOLS, Tool, ToolError};
use ts3100_workbench::rpc::{ResponseError, response};

/// Longest message in bytes: a program of the largest size, escaped.
const MAX_MESSAGE: u64 = 1024 * 1024;
/// The revisions of the protocol that are spoken, newest first.
const REVISIONS: [&str; 3] = ["2025-06-18", "2025-03-26", "2024-11-05"];
/// The byte order mark, which shells of Windows put in front of what they pass on.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
/// First message to an assistant.
const INSTRUCTIONS: &str = "An emulated robot controller (Toshiba Machine TS3100). Programs are in SCOL. Check a program with \
    check_program, store and select it with load_program, start it with run_program. findings lists the protocol mistakes of a host program. explain \
    explains codes and words; documentation has the manual of the emulator and of SCOL.";

/// Let an AI assistant operate a running emulator (Model Context Protocol over stdin and stdout).
///
/// Configure your assistant to start `ts3100 mcp`. It can check, load and run programs, read state, alarms, positions and
/// variables, operate the panel and the inputs, and explain what a host did wrong. It calls the control interface of a
/// running emulator, which it finds as `ctl` does.
///
/// Exit codes: 0 the assistant disconnected; 2 wrong usage.
#[derive(Debug, Args)]
pub(super) struct McpArgs {
    #[command(flatten)]
    target: TargetArgs,
}

/// Function that calls the control interface: method, path, body.
type MakeCall<'a> = dyn Fn(&'static str, &str, Option<Value>) -> Result<Value, ToolError> + 'a;

/// The control interface of the robot.
pub(super) struct Robot<'a>(&'a MakeCall<'a>);

impl Robot<'_> {
    fn call(&self, method: &'static str, path: &str, body: Option<Value>) -> Result<Value, ToolError> {
        (self.0)(method, path, body)
    }
}

/// The answer to a call. The emulator is looked for each time: it may have been started again meanwhile.
fn call_emulator(
    target: &TargetArgs,
    method: &'static str,
    path: &str,
    body: Option<Value>,
) -> Result<Value, ToolError> {
    let unreachable = |error: &dyn std::fmt::Display| ToolError::Unreachable(error.to_string());
    let url = target.url().map_err(|error| unreachable(&error))?;
    let path = path.to_owned();
    let call = Call { method, path, body }.of_robot(target.robot());
    let body = call.body.as_ref().map(ToString::to_string);
    let client = target.client(&url, tools::LONGEST_CALL);
    let answer = client.and_then(|client| client.call(call.method, &call.path, body.as_deref()));
    let (status, text) =
        answer.map_err(|error| unreachable(&format_args!("{error}{}", advice(&error, "--url"))))?;
    match status {
        400.. => Err(ToolError::Refused(words_of_refusal(&text))),
        _ => Ok(serde_json::from_str(&text).unwrap_or(Value::String(text))),
    }
}

/// Serves until stdin ends.
pub(super) fn run(args: &McpArgs) -> anyhow::Result<u8> {
    let mut input = io::stdin().lock();
    let make_call = |method, path: &str, body| call_emulator(&args.target, method, path, body);
    let robot = Robot(&make_call);
    loop {
        let mut line = Vec::new();
        // One byte more shows that it is too long.
        let read = input.by_ref().take(MAX_MESSAGE + 1).read_until(b'\n', &mut line);
        if read.context("cannot read stdin")? == 0 {
            return Ok(0);
        }
        ensure!(
            line.len() as u64 <= MAX_MESSAGE,
            "a message has more than {MAX_MESSAGE} bytes"
        );
        let line = line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&line);
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        if let Some(answer) = answer(&robot, line) {
            let mut out = io::stdout().lock();
            // Who closes the pipe has gone.
            if writeln!(out, "{answer}").and_then(|()| out.flush()).is_err() {
                return Ok(0);
            }
        }
    }
}

/// The answer to a line: to a message, or in one array those to a batch, which the revision 2025-03-26 has.
fn answer(robot: &Robot<'_>, line: &[u8]) -> Option<Value> {
    let Ok(message) = serde_json::from_slice::<Value>(line) else {
        let error = ResponseError::not_json("the message is not JSON");
        return Some(response(&Value::Null, Err(error)));
    };
    let Some(batch) = message.as_array().filter(|batch| !batch.is_empty()) else {
        return answer_message(robot, &message);
    };
    let answers: Vec<Value> = batch
        .iter()
        .filter_map(|message| answer_message(robot, message))
        .collect();
    (!answers.is_empty()).then_some(Value::Array(answers))
}

/// The answer to a message; notifications and answers get none.
fn answer_message(robot: &Robot<'_>, message: &Value) -> Option<Value> {
    let id = message.get("id");
    let Some(method) = message.get("method").and_then(Value::as_str) else {
        let is_answer = message.get("result").is_some() || message.get("error").is_some();
        let id = id.unwrap_or(&Value::Null);
        return (!is_answer).then(|| {
            let error = ResponseError::invalid_request("the request lacks a method");
            response(id, Err(error))
        });
    };
    let id = id?;
    let parameters = message.get("params").unwrap_or(&Value::Null);
    let result = match method {
        "initialize" => Ok(initialize(parameters)),
        "ping" => Ok(json!({})),
        "tools/list" => Ok(json!({ "tools": TOOLS.iter().map(Tool::description).collect::<Vec<_>>() })),
        // Assistants ask for these whatever the capabilities say.
        "prompts/list" => Ok(json!({ "prompts": [] })),
        "resources/list" => Ok(json!({ "resources": [] })),
        "resources/templates/list" => Ok(json!({ "resourceTemplates": [] })),
        "tools/call" => {
            let message = "unknown tool; call tools/list for the names";
            call(robot, parameters).ok_or_else(|| ResponseError::invalid_params(message))
        }
        _ => Err(ResponseError::unknown_method("unknown method")),
    };
    Some(response(id, result))
}

fn initialize(parameters: &Value) -> Value {
    let asked = parameters.get("protocolVersion").and_then(Value::as_str);
    let revision = REVISIONS.iter().find(|known| Some(**known) == asked);
    json!({
        "protocolVersion": revision.unwrap_or(&REVISIONS[0]),
        "capabilities": { "tools": {} },
        "serverInfo": { "name": "ts3100", "version": env!("CARGO_PKG_VERSION") },
        "instructions": INSTRUCTIONS,
    })
}

/// The result of a tool; what the tool could not do is a result too, which the assistant reads. `None`: no such tool.
fn call(robot: &Robot<'_>, parameters: &Value) -> Option<Value> {
    let name = parameters.get("name")?.as_str()?;
    let tool = TOOLS.iter().find(|tool| tool.name == name)?;
    let arguments = parameters.get("arguments").unwrap_or(&Value::Null);
    let done = tool.check(arguments).and_then(|()| (tool.run)(robot, arguments));
    Some(match done {
        Ok(value) => {
            let text = value.as_str().map_or_else(|| format!("{value:#}"), str::to_owned);
            json!({ "content": [{ "type": "text", "text": text }] })
        }
        Err(error) => json!({ "content": [{ "type": "text", "text": error.to_string() }], "isError": true }),
    })
}
