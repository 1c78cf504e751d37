//! Which tool makes which call: each tool is run with arguments that fit, and its calls are noted.

use super::Robot;
use super::tools::TOOLS;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::collections::BTreeSet;
use ts3100_controller::controls::{BUTTONS, SWITCHES};

/// A call with the tool that makes it.
pub type MadeCall = (&'static str, &'static str, String);

/// The calls of all tools: tool, method, path.
pub fn calls() -> Vec<MadeCall> {
    let made = RefCell::new(BTreeSet::new());
    for tool in TOOLS {
        let make_call = |method, path: &str, _body: Option<Value>| {
            made.borrow_mut().insert((tool.name, method, path.to_owned()));
            Ok(Value::Null)
        };
        let robot = Robot(&make_call);
        let words = |control: &str, value: &str| json!({ "control": control, "value": value });
        let arguments: Vec<Value> = if tool.name == "panel" {
            let switch = SWITCHES
                .iter()
                .filter_map(|switch| Some((switch.name(), switch.words().next()?)));
            let button = BUTTONS.iter().filter_map(|button| button.form.split_once(' '));
            let percent = |value| if value == "PERCENT" { "50" } else { value };
            switch
                .chain(button)
                .map(|(control, value)| words(control, percent(value)))
                .collect()
        } else {
            let all =
                json!({ "name": "A", "source": "END", "seconds": 1, "line": 5, "on": true, "code": "pace" });
            vec![json!({}), all]
        };
        for arguments in arguments {
            // A code that does not exist is refused before a call.
            let _ = (tool.run)(&robot, &arguments);
        }
    }
    made.into_inner().into_iter().collect()
}
