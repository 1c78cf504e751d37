//! `ts3100 mcp`: the Model Context Protocol over stdin and stdout. `tests/system/control/mcp_server.py` does the same with its reference client.

use super::support::{Serve, ts3100};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Stdio};

struct Assistant {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Assistant {
    fn start(serve: &Serve) -> Assistant {
        let control = serve.control.clone().unwrap();
        let mut child = ts3100(&["mcp", "--url", &control])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        Assistant {
            input: child.stdin.take().unwrap(),
            output: BufReader::new(child.stdout.take().unwrap()),
            child,
        }
    }

    fn say(&mut self, line: &str) {
        writeln!(self.input, "{line}").unwrap();
    }

    fn hear(&mut self) -> Value {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        serde_json::from_str(&line).unwrap()
    }

    fn ask(&mut self, method: &str, parameters: &Value) -> Value {
        self.say(&json!({"jsonrpc": "2.0", "id": 7, "method": method, "params": parameters}).to_string());
        let answer = self.hear();
        assert_eq!((&answer["jsonrpc"], &answer["id"]), (&json!("2.0"), &json!(7)));
        answer
    }

    /// The text of a tool's result, and whether it is an error.
    fn tool(&mut self, name: &str, arguments: &Value) -> (String, bool) {
        let answer = self.ask("tools/call", &json!({"name": name, "arguments": arguments}));
        let result = &answer["result"];
        let text = result["content"][0]["text"].as_str().unwrap().to_owned();
        (text, result["isError"] == true)
    }
}

impl Drop for Assistant {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn an_assistant_writes_checks_and_runs_a_program_and_learns_what_a_host_did_wrong() {
    let serve = Serve::ready(&["serve", "--servo-on", "--time", "stepped"]);
    let mut assistant = Assistant::start(&serve);
    let hello = assistant.ask(
        "initialize",
        &json!({"protocolVersion": "2025-03-26", "capabilities": {}}),
    );
    assert_eq!(hello["result"]["protocolVersion"], "2025-03-26");
    assert_eq!(hello["result"]["serverInfo"]["name"], "ts3100");
    assistant.say(r#"{"jsonrpc": "2.0", "method": "notifications/initialized"}"#);
    let tools = assistant.ask("tools/list", &json!({}));
    let tools = tools["result"]["tools"].as_array().unwrap().clone();
    assert!(tools.len() > 10 && tools.iter().all(|tool| tool["inputSchema"]["type"] == "object"));

    let (said, is_error) = assistant.tool(
        "load_program",
        &json!({"name": "COUNT", "source": "PROGRAM COUNT\nMOV P1\nEND\n"}),
    );
    assert!(is_error && said.contains("\"line\": 2"), "{said}");
    let source = "GLOBAL\nN = 0\nEND\nPROGRAM COUNT\nFOR I = 1 TO 10\nN = I\nDELAY 0.1\nNEXT I\nEND\n";
    let (said, is_error) = assistant.tool("load_program", &json!({"name": "COUNT", "source": source}));
    assert!(!is_error, "{said}");
    let (said, is_error) = assistant.tool("run_program", &json!({}));
    assert!(!is_error && said.contains("\"reached\": true"), "{said}");
    assert!(assistant.tool("variables", &json!({})).0.contains("10"));

    serve.host(&["fd"]);
    let mut host = serve.dial(0);
    host.write_all(b"\x02qq\r\x03").unwrap();
    ts3100_tests::host::Host::read_until(&mut host, 0x03);
    let (said, _) = assistant.tool("findings", &json!({}));
    assert!(said.contains("unknown-command"), "{said}");
    let (said, _) = assistant.tool("explain", &json!({"code": "unknown-command"}));
    assert!(said.contains("reference/findings#unknown-command"), "{said}");
    let (said, is_error) = assistant.tool("explain", &json!({"code": "unknown-comand"}));
    assert!(
        is_error && said.contains("did you mean `unknown-command`?"),
        "{said}"
    );
    for (tool, expected) in [
        ("explain", "argument `word`: unknown; explain has code"),
        ("state", "argument `word`: unknown; state has no arguments"),
    ] {
        assert_eq!(
            assistant.tool(tool, &json!({"word": "RN"})),
            (expected.to_owned(), true)
        );
    }
    let (said, _) = assistant.tool("documentation", &json!({"search": "feed hold"}));
    let hits: Value = serde_json::from_str(&said).unwrap();
    let topic = hits[0]["topic"].as_str().unwrap();
    let (said, is_error) = assistant.tool("documentation", &json!({"topic": topic}));
    assert!(!is_error && said.starts_with('#'), "{said}");
    assert!(
        assistant
            .tool("documentation", &json!({}))
            .0
            .contains("reference/scol/motion")
    );
    assert!(assistant.tool("traffic", &json!({})).0.contains("qq"));

    let (said, is_error) = assistant.tool("panel", &json!({"control": "servo", "value": "closed"}));
    assert!(
        is_error && said.contains("expected on or off, found `closed`"),
        "{said}"
    );
    let (said, is_error) = assistant.tool("panel", &json!({"control": "emergency-stop", "value": "press"}));
    assert!(!is_error, "{said}");
    let (said, is_error) = assistant.tool("run_program", &json!({}));
    assert!(is_error && said.contains("emergency stop"), "{said}");
}

#[test]
fn what_is_no_request_gets_the_error_that_json_rpc_has_for_it() {
    let serve = Serve::ready(&["serve"]);
    let mut assistant = Assistant::start(&serve);
    for (line, code) in [
        ("{", -32_700),
        ("[]", -32_600),
        (r#"{"id": 1}"#, -32_600),
        (r#"{"id": 1, "method": "tools/fly"}"#, -32_601),
        (
            r#"{"id": 1, "method": "tools/call", "params": {"name": "fly"}}"#,
            -32_602,
        ),
        (r#"{"id": 1, "method": "tools/call"}"#, -32_602),
    ] {
        assistant.say(line);
        assert_eq!(assistant.hear()["error"]["code"], code, "{line}");
    }
    // Batches, as the revision 2025-03-26 has them: requests are answered in one array, notifications not.
    assistant.say(
        r#"[{"id": 1, "method": "ping"}, {"method": "notifications/initialized"}, 5, {"id": 2, "method": "fly"}]"#,
    );
    let answers = assistant.hear();
    let answers = answers.as_array().unwrap();
    assert_eq!(answers.len(), 3);
    assert_eq!(
        (&answers[0]["id"], &answers[0]["result"]),
        (&json!(1), &json!({}))
    );
    assert_eq!(answers[1]["error"]["code"], -32_600);
    assert_eq!(
        (&answers[2]["id"], &answers[2]["error"]["code"]),
        (&json!(2), &json!(-32_601))
    );
    assistant.say(r#"[{"method": "notifications/initialized"}]"#);
    // What there is none of is an empty list, also for an assistant that does not look at the capabilities.
    for (method, list) in [
        ("prompts/list", "prompts"),
        ("resources/list", "resources"),
        ("resources/templates/list", "resourceTemplates"),
    ] {
        assert_eq!(assistant.ask(method, &json!({}))["result"], json!({list: []}));
    }
    // A shell of Windows puts a byte order mark in front.
    assistant.say("\u{feff}{\"id\": 7, \"method\": \"ping\"}");
    assert_eq!(assistant.hear()["result"], json!({}));
    // Blank lines, notifications and answers get none; the next request is answered.
    assistant.say("");
    assistant.say(r#"{"jsonrpc": "2.0", "method": "notifications/cancelled"}"#);
    assistant.say(r#"{"jsonrpc": "2.0", "id": 3, "result": {}}"#);
    assert_eq!(assistant.ask("ping", &json!({}))["result"], json!({}));
    for (arguments, expected) in [
        (json!({}), "`source`: missing"),
        (json!({"source": 3}), "expected a string, found 3"),
        (json!({"sourc": "x"}), "did you mean `source`?"),
        (json!(["x"]), "expected an object"),
    ] {
        let (said, is_error) = assistant.tool("check_program", &arguments);
        assert!(is_error && said.contains(expected), "{said}");
    }
}

#[test]
fn a_program_starts_only_for_a_condition_that_there_is() {
    let serve = Serve::ready(&["serve", "--servo-on", "--time", "stepped"]);
    let mut assistant = Assistant::start(&serve);
    let source = "PROGRAM L\nA:\nDELAY 1\nDOUT(5)\nGOTO A\nEND\n";
    let (said, is_error) = assistant.tool("load_program", &json!({"name": "L", "source": source}));
    assert!(!is_error, "{said}");
    let (said, is_error) = assistant.tool("run_program", &json!({"condition": "stopped"}));
    assert!(is_error && said.contains("unknown condition `stopped`"), "{said}");
    for seconds in [json!(-1), json!(61), json!("5")] {
        let (said, is_error) = assistant.tool("run_program", &json!({ "seconds": seconds }));
        let expected = format!("`seconds`: expected a number of seconds from 0 to 60, found {seconds}");
        assert!(is_error && said.contains(&expected), "{said}");
    }
    let (said, is_error) = assistant.tool("set_input", &json!({"line": 5.5, "on": true}));
    assert!(
        is_error && said.contains("expected a whole number from 0 to 65535, found 5.5"),
        "{said}"
    );
    let (state, _) = assistant.tool("state", &json!({}));
    assert!(!state.contains("running"), "{state}");

    // Each that the tool names is one.
    let tools = assistant.ask("tools/list", &json!({}));
    let tools = tools["result"]["tools"].as_array().unwrap();
    let tool = tools.iter().find(|tool| tool["name"] == "run_program").unwrap();
    let about = tool["inputSchema"]["properties"]["condition"]["description"].as_str();
    let named = about.unwrap().strip_prefix("Condition to wait for: ").unwrap();
    let named = named.split_once(" ...").unwrap().0;
    for condition in named.split(", ") {
        let arguments = json!({"condition": condition, "seconds": 0});
        let (said, is_error) = assistant.tool("run_program", &arguments);
        assert!(!is_error, "{condition}: {said}");
        assistant.tool("stop_program", &json!({}));
        assistant.tool("advance_clock", &json!({"seconds": 2}));
    }
}
