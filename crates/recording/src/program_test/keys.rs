//! The keys of a file of tests. `read` knows no others; the JSON schema for editors and the table of docs/reference/test.md are
//! made from the same rows.

use crate::scenario::keys::{Key, KeyValue, Table, key};

/// How a test can end, in the words of `ts3100 run --json`.
pub const ENDINGS: [&str; 8] = [
    "end",
    "stopped",
    "alarm",
    "out-of-input",
    "no-input",
    "stuck",
    "time-up",
    "power-off",
];

const CHANNELS: &[Key] = &[
    key("tp", KeyValue::Texts).means("of the teach pendant"),
    key("com1", KeyValue::Texts).means("of COM1"),
    key("ip1", KeyValue::Texts).means("of IP1"),
    key("ip2", KeyValue::Texts).means("of IP2"),
];

/// The tables of a file of tests; the first is the file itself. `[[test.do]]`, `[[test.expect]]` and `[[test.never]]` are those of
/// scenarios.
pub const TABLES: [Table; 6] = [
    Table {
        name: "",
        keys: &[
            key("program", KeyValue::Text)
                .means("the program; default: the file of the same name, `pick.scol` for `pick.test.toml`"),
            key("model", KeyValue::Text).means("arm, as `--model` of `serve`"),
            key("points", KeyValue::Text)
                .means("points taught on the controller; default: `points.csv` beside the program"),
            key("options", KeyValue::Texts).means("named options, as `--set` of `serve`: `KEY=VALUE`"),
            key("test", KeyValue::Tables).means("entries `[[test]]`: the tests"),
        ],
        required: &["test"],
    },
    Table {
        name: "test",
        keys: &[
            key("name", KeyValue::Text).means("what the test shows"),
            key("call", KeyValue::Text)
                .means("a subprogram with its values, as in `PLACE(2, 30.5)`; default: the main program runs"),
            key("limit", KeyValue::Time).means("longest run in virtual time; default: 600 s"),
            key("given", KeyValue::Table).means("the state before the start"),
            key("at", KeyValue::Texts)
                .means("what happens: a time from START on, a colon and an action, as in `1.5 s: input 8 on`"),
            key("do", KeyValue::Tables).means("entries `[[test.do]]` of scenarios: actions"),
            key("expect", KeyValue::Tables)
                .means("entries `[[test.expect]]` of scenarios: conditions that have to happen"),
            key("never", KeyValue::Tables)
                .means("entries `[[test.never]]` of scenarios: conditions that must not happen"),
            key("then", KeyValue::Table).means("the expected result"),
        ],
        required: &["name"],
    },
    Table {
        name: "test.given",
        keys: &[
            key("variables", KeyValue::Variables)
                .means("variables of GLOBAL, points of DATA and taught points with their values; a position has the numbers of MW"),
            key("inputs", KeyValue::Lines).means("numbers of inputs that are on"),
            key("position", KeyValue::Place)
                .means("where the arm is: the name of a point, or the first coordinates in the world; default: the ready posture of `model`"),
            key("records", KeyValue::Table).means("records for INPUT by channel"),
        ],
        required: &[],
    },
    Table {
        name: "test.given.records",
        keys: CHANNELS,
        required: &[],
    },
    Table {
        name: "test.then",
        keys: &[
            key("printed", KeyValue::Table).means("all lines of PRINT by channel, in order"),
            key("outputs-on", KeyValue::Lines).means("numbers of outputs that are on"),
            key("outputs-off", KeyValue::Lines).means("numbers of outputs that are off"),
            key("variables", KeyValue::Variables)
                .means("variables with their values, `PICK.COUNT` of a program too"),
            key("position", KeyValue::Place)
                .means("where the arm is: the name of a point, or the first coordinates in the world"),
            key("tolerance", KeyValue::Number)
                .means("with `position`: how far off the arm may be, in mm and degrees; default: 0.01"),
            key("alarm", KeyValue::Text).means("number of the alarm that ends it, as in `2-046`"),
            key("within", KeyValue::Time).means("longest cycle time"),
            key("ending", KeyValue::Words(&ENDINGS))
                .means("how it ends; default: `end`, and `alarm` with the key `alarm`"),
        ],
        required: &[],
    },
    Table {
        name: "test.then.printed",
        keys: CHANNELS,
        required: &[],
    },
];
