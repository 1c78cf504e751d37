//! An editor in front of a server: sessions, message by message.

// A message is written where it is sent.
#![allow(clippy::needless_pass_by_value)]

use super::*;
use std::path::{Path, PathBuf};
use ts3100_controller::model::ArmModel;

/// A disk in memory: paths and texts.
#[derive(Debug, Default)]
struct Memory(BTreeMap<PathBuf, String>);

impl Project for Memory {
    fn read(&self, path: &Path) -> std::io::Result<String> {
        self.0
            .get(path)
            .cloned()
            .ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }

    fn programs(&self, folder: &Path) -> Vec<PathBuf> {
        let is_program =
            |path: &&PathBuf| path.starts_with(folder) && path.extension().is_none_or(|end| end == "scol");
        self.0.keys().filter(is_program).cloned().collect()
    }

    fn model(&self, name: &str) -> Result<ArmModel, SettingsError> {
        ArmModel::by_name(name).ok_or_else(|| SettingsError::Model(format!("there is no {name}")))
    }

    fn explanation(&self, code: &str) -> Option<String> {
        Some(format!("file:///explain/{code}.md"))
    }
}

/// An editor. It fails if something that was sent to it has not been looked at.
struct Editor {
    server: Server<Memory>,
    unread: Vec<Value>,
    requests: u64,
}

impl Drop for Editor {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            assert_eq!(self.unread, [] as [Value; 0], "unread messages");
        }
    }
}

const FOLDER: &str = "/cell";

fn address(name: &str) -> String {
    format!("file://{FOLDER}/{name}")
}

impl Editor {
    fn new(files: &[(&str, &str)]) -> Editor {
        Editor::with(files, json!({}))
    }

    fn with(files: &[(&str, &str)], options: Value) -> Editor {
        let file = |(name, text): &(&str, &str)| (Path::new(FOLDER).join(name), (*text).to_owned());
        let settings = Settings {
            model: ArmModel::by_name("ts3100-tv800").unwrap(),
            points: None,
        };
        let mut editor = Editor {
            server: Server::new(Memory(files.iter().map(file).collect()), settings),
            unread: Vec::new(),
            requests: 0,
        };
        let folders = json!([{ "uri": format!("file://{FOLDER}"), "name": "cell" }]);
        let snippets =
            json!({ "textDocument": { "completion": { "completionItem": { "snippetSupport": true } } } });
        let found = editor.ask("initialize", json!({ "capabilities": snippets, "workspaceFolders": folders, "initializationOptions": options }));
        assert_eq!(found["capabilities"]["positionEncoding"], "utf-16");
        editor.tell("initialized", json!({}));
        editor
    }

    fn send(&mut self, messages: &[Value]) {
        let texts: Vec<String> = messages.iter().map(Value::to_string).collect();
        self.unread
            .extend(self.server.receive(texts.iter().map(String::as_bytes)));
    }

    fn tell(&mut self, method: &str, params: Value) {
        self.send(&[rpc::notification(method, &params)]);
    }

    fn request(&mut self, method: &str, params: Value) -> Value {
        self.requests += 1;
        json!({ "jsonrpc": "2.0", "id": self.requests, "method": method, "params": params })
    }

    /// Whole response to a request.
    fn response(&mut self, method: &str, params: Value) -> Value {
        let request = self.request(method, params);
        self.send(&[request]);
        let id = json!(self.requests);
        let at = self
            .unread
            .iter()
            .position(|message| message["id"] == id && message.get("method").is_none());
        self.unread
            .remove(at.unwrap_or_else(|| panic!("{method} has no response")))
    }

    fn ask(&mut self, method: &str, params: Value) -> Value {
        let mut response = self.response(method, params);
        assert!(response.get("error").is_none(), "{method}: {response}");
        response["result"].take()
    }

    fn refusal(&mut self, method: &str, params: Value) -> (i64, String) {
        let response = self.response(method, params);
        let error = &response["error"];
        (
            error["code"].as_i64().unwrap(),
            error["message"].as_str().unwrap().to_owned(),
        )
    }

    /// Opens a file and returns its diagnostics: code and line, from 1.
    fn open(&mut self, name: &str, text: &str) -> Vec<(String, u64)> {
        let document = json!({ "uri": address(name), "languageId": "scol", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        self.diagnostics(name)
    }

    fn change(&mut self, name: &str, changes: Value) -> Vec<(String, u64)> {
        self.tell(
            "textDocument/didChange",
            json!({ "textDocument": { "uri": address(name), "version": 2 }, "contentChanges": changes }),
        );
        self.diagnostics(name)
    }

    /// The next diagnostics that were sent for a file.
    fn published(&mut self, name: &str) -> Value {
        let is_next = |message: &Value| {
            message["method"] == "textDocument/publishDiagnostics"
                && message["params"]["uri"] == address(name)
        };
        let at = self.unread.iter().position(is_next);
        let mut message = self
            .unread
            .remove(at.unwrap_or_else(|| panic!("no diagnostics of {name}: {:?}", self.unread)));
        message["params"]["diagnostics"].take()
    }

    fn diagnostics(&mut self, name: &str) -> Vec<(String, u64)> {
        let found = self.published(name);
        let line = |found: &Value| found["range"]["start"]["line"].as_u64().unwrap() + 1;
        let found = found.as_array().unwrap().iter();
        found
            .map(|found| (found["code"].as_str().unwrap_or("-").to_owned(), line(found)))
            .collect()
    }

    /// Asks about the place after the mark `|` of an excerpt that occurs once in a text.
    fn ask_at(&mut self, method: &str, name: &str, text: &str, excerpt: &str, more: Value) -> Value {
        let params = at(name, text, excerpt, more);
        self.ask(method, params)
    }
}

fn at(name: &str, text: &str, excerpt: &str, more: Value) -> Value {
    let plain = excerpt.replace('|', "");
    assert_eq!(text.matches(&plain).count(), 1, "{plain}");
    let byte = text.find(&plain).unwrap() + excerpt.find('|').unwrap();
    let position = Text::new(text.to_owned(), Units::Utf16).position(byte);
    let mut params = json!({ "textDocument": { "uri": address(name) }, "position": position });
    params
        .as_object_mut()
        .unwrap()
        .extend(more.as_object().cloned().unwrap_or_default());
    params
}

fn labels(items: &Value) -> Vec<&str> {
    items
        .as_array()
        .unwrap()
        .iter()
        .map(|item| item["label"].as_str().unwrap())
        .collect()
}

/// A text with edits carried out, as editors do: from the last to the first.
fn edited(text: &str, edits: &Value) -> String {
    let mut edits: Vec<(Span, String)> = edits
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| {
            (
                serde_json::from_value(edit["range"].clone()).unwrap(),
                edit["newText"].as_str().unwrap().to_owned(),
            )
        })
        .collect();
    edits.sort_by_key(|(span, _)| span.start);
    let mut text = Text::new(text.to_owned(), Units::Utf16);
    for (span, new) in edits.iter().rev() {
        text.replace(*span, new);
    }
    text.as_str().to_owned()
}

const PICK: &str = "' picks a part\nGLOBAL\n  TOTAL = 0 ' parts so far\nEND\n' speed of the way\nPROGRAM MAIN\n  SPEED = 50\nAGAIN: MOVE UP\n  PLACE(P1, 2)\n  \
    DOUT(5, 201) ' gripper\n  IF DIN(3) THEN GOTO AGAIN\n  WAIT MOTION >= 100\n  PRINT COM1, TOTAL, CR ' 2-046 without a peer\n  TOTAL = TOTAL + 1\nEND\n\
    PROGRAM PLACE(WHERE, N)\n  MOVE WHERE WITH SPEED = N\nEND\nDATA\n  POINT P1=400,0,200/\nEND\n";
const POINTS: &str = "NAME,X,Y,Z,A,B,C,U,V,CONFIG\nUP,300,100,50,0,0,0,0,0,\n";

fn cell() -> Editor {
    let mut editor = Editor::new(&[
        ("points.csv", POINTS),
        ("other.scol", "PROGRAM OTHER\n  MOVE UP\nEND\n"),
    ]);
    assert_eq!(editor.open("pick.scol", PICK), []);
    editor
}

#[test]
fn errors_are_shown_while_a_line_is_typed_and_go_when_it_is_right() {
    let mut editor = Editor::new(&[]);
    assert_eq!(
        editor.open(
            "t.scol",
            "PROGRAM T\n  MOV P1\nEND\nDATA\n  POINT P1=400,0,0/\nEND\n"
        ),
        [("E0103".to_owned(), 2), ("W0606".to_owned(), 5)][..1]
    );
    let insert = json!([{ "range": { "start": { "line": 1, "character": 5 }, "end": { "line": 1, "character": 5 } }, "text": "E" }]);
    assert_eq!(editor.change("t.scol", insert), []);
    // Two changes at a time, the second in the text that the first has made.
    let both = json!([
        { "range": { "start": { "line": 1, "character": 0 }, "end": { "line": 2, "character": 0 } }, "text": "" },
        { "range": { "start": { "line": 1, "character": 0 }, "end": { "line": 1, "character": 0 } }, "text": "  STOPP\n" },
    ]);
    assert_eq!(editor.change("t.scol", both), [("E0203".to_owned(), 2)]);
    assert_eq!(
        editor.change("t.scol", json!([{ "text": "PROGRAM T\nEND\n" }])),
        []
    );
    // A file that is just begun is not red.
    assert_eq!(
        editor.change("t.scol", json!([{ "text": "' picks a part\n" }])),
        []
    );
    assert_eq!(
        editor.change("t.scol", json!([{ "text": "GLOBAL\nEND\n" }])),
        [("E0304".to_owned(), 1)]
    );
    editor.tell(
        "textDocument/didClose",
        json!({ "textDocument": { "uri": address("t.scol") } }),
    );
    assert_eq!(editor.diagnostics("t.scol"), []);
    let (code, message) = editor.refusal("textDocument/hover", at("t.scol", "X", "|X", json!({})));
    assert_eq!(
        (code, message.as_str()),
        (-32_602, "file:///cell/t.scol is not open")
    );
}

#[test]
fn a_diagnostic_explains_itself_and_offers_its_fix() {
    const TEXT: &str = "PROGRAM T\n  MOVEL P1\n  N := 5\n  DELAY N\nEND\nDATA\n  POINT P1=400,0,0/\nEND\n";
    let mut editor = Editor::new(&[]);
    let document = json!({ "uri": address("t.scol"), "languageId": "scol", "version": 7, "text": TEXT });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    assert_eq!(editor.unread[0]["params"]["version"], 7);
    let found = editor.published("t.scol");
    assert_eq!(found.as_array().unwrap().len(), 2);
    let first = &found[0];
    assert_eq!(
        (&first["code"], &first["severity"], &first["source"]),
        (&json!("E0103"), &json!(1), &json!("ts3100"))
    );
    assert_eq!(first["codeDescription"]["href"], "file:///explain/E0103.md");
    assert_eq!(
        first["range"],
        json!({ "start": { "line": 1, "character": 2 }, "end": { "line": 1, "character": 7 } })
    );
    assert!(
        first["message"]
            .as_str()
            .unwrap()
            .contains("\nhelp: did you mean MOVES"),
        "{first}"
    );
    let params = json!({ "textDocument": { "uri": address("t.scol") }, "range": first["range"], "context": { "diagnostics": [first] } });
    let actions = editor.ask("textDocument/codeAction", params);
    let titles: Vec<&Value> = actions
        .as_array()
        .unwrap()
        .iter()
        .map(|action| &action["title"])
        .collect();
    assert_eq!(
        titles,
        ["Replace MOVEL by MOVES", "Fix all that can be fixed (2)"]
    );
    assert_eq!(
        (&actions[0]["kind"], &actions[1]["kind"]),
        (&json!("quickfix"), &json!("source.fixAll.ts3100"))
    );
    let fixed = edited(TEXT, &actions[0]["edit"]["changes"][address("t.scol")]);
    assert_eq!(fixed, TEXT.replace("MOVEL", "MOVES"));
    let fixed = edited(TEXT, &actions[1]["edit"]["changes"][address("t.scol")]);
    assert_eq!(editor.change("t.scol", json!([{ "text": fixed }])), []);
}

#[test]
fn hover_explains_words_names_lines_and_alarms() {
    let mut editor = cell();
    for (excerpt, parts) in [
        (
            "  MO|VE WHERE",
            &["`MOVE p`", "all axes start and end together", "*Source: "][..],
        ),
        ("WITH S|PEED", &["1 to 100 percent", "Default: 100"]),
        ("P|LACE(P1", &["**PLACE**: program", "PROGRAM PLACE(WHERE, N)"]),
        ("PLACE(P|1", &["data of the file", "POINT P1=400,0,200/"]),
        ("COM1, TO|TAL", &["GLOBAL", "TOTAL = 0 ' parts so far"]),
        (
            "MOVE U|P",
            &[
                "point that is taught on the controller, from points.csv",
                "300,100,50",
            ],
        ),
        ("MOVE WHE|RE", &["parameter of PLACE"]),
        ("GOTO AG|AIN", &["label of MAIN", "AGAIN: MOVE UP"]),
        ("DOUT(|5", &["**DOUT(5)**: output 5", "line 10: gripper"]),
        ("201|)", &["output 201, `OPEN1`"]),
        ("2-0|46", &["Alarm 2-046", "Connect the peer before"]),
    ] {
        let found = editor.ask_at("textDocument/hover", "pick.scol", PICK, excerpt, json!({}));
        let text = found["contents"]["value"]
            .as_str()
            .unwrap_or_else(|| panic!("{excerpt}: {found}"));
        for part in parts {
            assert!(text.contains(part), "{excerpt}: {text}");
        }
        assert!(!text.contains("]("), "{text}");
    }
    let found = editor.ask_at(
        "textDocument/hover",
        "pick.scol",
        PICK,
        "picks| a part",
        json!({}),
    );
    assert_eq!(found, Value::Null);
}

#[test]
fn every_word_of_the_language_is_explained() {
    for word in scol_mini::words() {
        assert!(ts3100_book::book().language_word(word).is_some(), "{word}");
    }
}

#[test]
fn a_name_leads_to_its_declaration_and_its_uses() {
    let mut editor = cell();
    let place = |text: &str, excerpt: &str| at("x", text, excerpt, json!({}))["position"].clone();
    for (excerpt, declared) in [
        ("P|LACE(P1", "PROGRAM |PLACE"),
        ("GOTO A|GAIN", "|AGAIN: MOVE"),
        ("PLACE(P1|,", "POINT |P1"),
        ("SPEED = N|\n", "WHERE, |N)"),
    ] {
        let found = editor.ask_at("textDocument/definition", "pick.scol", PICK, excerpt, json!({}));
        assert_eq!(
            (&found["uri"], &found["range"]["start"]),
            (&json!(address("pick.scol")), &place(PICK, declared)),
            "{excerpt}"
        );
    }
    let found = editor.ask_at(
        "textDocument/definition",
        "pick.scol",
        PICK,
        "MOVE U|P",
        json!({}),
    );
    assert_eq!(
        (&found["uri"], &found["range"]["start"]),
        (&json!(address("points.csv")), &place(POINTS, "|UP,"))
    );
    let lines = |found: &Value| -> Vec<(String, u64)> {
        let place = |found: &Value| {
            (
                found["uri"]
                    .as_str()
                    .unwrap()
                    .rsplit('/')
                    .next()
                    .unwrap()
                    .to_owned(),
                found["range"]["start"]["line"].as_u64().unwrap() + 1,
            )
        };
        found.as_array().unwrap().iter().map(place).collect()
    };
    let with = |with: bool| json!({ "context": { "includeDeclaration": with } });
    let found = editor.ask_at(
        "textDocument/references",
        "pick.scol",
        PICK,
        "TOT|AL = 0",
        with(true),
    );
    assert_eq!(
        lines(&found),
        [3, 13, 14, 14].map(|line| ("pick.scol".to_owned(), line))
    );
    let found = editor.ask_at(
        "textDocument/references",
        "pick.scol",
        PICK,
        "TOT|AL = 0",
        with(false),
    );
    assert_eq!(lines(&found).len(), 3);
    let found = editor.ask_at(
        "textDocument/references",
        "pick.scol",
        PICK,
        "MOVE U|P",
        with(true),
    );
    assert_eq!(
        lines(&found),
        [
            ("pick.scol".into(), 8),
            ("other.scol".into(), 2),
            ("points.csv".into(), 2)
        ]
    );
    let found = editor.ask_at(
        "textDocument/documentHighlight",
        "pick.scol",
        PICK,
        "TOT|AL = 0",
        json!({}),
    );
    let kinds: Vec<&Value> = found
        .as_array()
        .unwrap()
        .iter()
        .map(|found| &found["kind"])
        .collect();
    assert_eq!(kinds, [3, 2, 3, 2]);
}

#[test]
fn a_new_name_is_written_to_every_place_or_refused() {
    let mut editor = cell();
    let found = editor.ask_at(
        "textDocument/prepareRename",
        "pick.scol",
        PICK,
        "GOTO A|GAIN",
        json!({}),
    );
    assert_eq!(found["placeholder"], "AGAIN");
    let found = editor.ask_at(
        "textDocument/rename",
        "pick.scol",
        PICK,
        "GOTO A|GAIN",
        json!({ "newName": "NEXTONE" }),
    );
    assert_eq!(
        edited(PICK, &found["changes"][address("pick.scol")]),
        PICK.replace("AGAIN", "NEXTONE")
    );
    let found = editor.ask_at(
        "textDocument/rename",
        "pick.scol",
        PICK,
        "MOVE U|P",
        json!({ "newName": "High" }),
    );
    assert_eq!(
        edited(PICK, &found["changes"][address("pick.scol")]),
        PICK.replace("MOVE UP", "MOVE High")
    );
    assert_eq!(
        edited(
            "PROGRAM OTHER\n  MOVE UP\nEND\n",
            &found["changes"][address("other.scol")]
        ),
        "PROGRAM OTHER\n  MOVE High\nEND\n"
    );
    assert_eq!(
        edited(POINTS, &found["changes"][address("points.csv")]),
        POINTS.replace("UP", "HIGH")
    );
    // Another program that calls something else so.
    editor.server.projects.project_mut().0.insert(
        Path::new(FOLDER).join("LAST"),
        "PROGRAM LAST\n  HIGH = 5\n  DELAY HIGH\nEND\n".to_owned(),
    );
    for (excerpt, new_name, why) in [
        (
            "GOTO A|GAIN",
            "MOVE",
            "MOVE cannot be a name: it is a word of the language",
        ),
        (
            "GOTO A|GAIN",
            "2P",
            "\"2P\" cannot be a name: a name has letters, digits and _, and begins with a letter",
        ),
        ("PLACE(P|1", "UP", "UP is taken by a taught point"),
        ("MOVE U|P", "HIGH", "HIGH is taken in LAST, line 2"),
        (
            "GOTO A|GAIN",
            "RCYCLE",
            "RCYCLE is the label where a cycle continues; write it by hand",
        ),
        ("PLACE(P|1", "TOTAL", "TOTAL is taken in pick.scol, line 3"),
        (
            "PLACE(P|1",
            "A_VERY_LONG_NAME",
            "A_VERY_LONG_NAME has 16 characters; hosts reach names of at most 10",
        ),
        (
            "MO|VE UP",
            "GO",
            "only names of programs, labels, variables and points can change",
        ),
    ] {
        let params = at("pick.scol", PICK, excerpt, json!({ "newName": new_name }));
        assert_eq!(
            editor.refusal("textDocument/rename", params),
            (-32_803, why.to_owned())
        );
    }
}

#[test]
fn what_can_follow_is_offered() {
    let mut editor = Editor::new(&[("points.csv", POINTS)]);
    let mut offered = |line: &str, more: Value| {
        let text = format!(
            "GLOBAL\n  TOTAL = 0\nEND\nPROGRAM MAIN\nAGAIN:\n  {line}\nEND\nPROGRAM SUB(Q)\nLOST: STOP\nEND\nPROGRAM LOOK\nEND\nDATA\n  POINT P1=400,0,200/\n  TRANS T1=1,2,3/\nEND\n"
        );
        let plain = text.replace('|', "");
        editor.open("t.scol", &plain);
        let byte = text.find('|').unwrap();
        let excerpt = format!("{}|", &plain[byte - 6..byte]);
        let position = Text::new(plain.clone(), Units::Utf16).position(byte);
        let _ = excerpt;
        let mut params = json!({ "textDocument": { "uri": address("t.scol") }, "position": position });
        params
            .as_object_mut()
            .unwrap()
            .extend(more.as_object().cloned().unwrap());
        editor.ask("textDocument/completion", params)
    };
    let none = || json!({});
    assert_eq!(labels(&offered("GOTO |", none())), ["AGAIN"]);
    assert_eq!(labels(&offered("I = TASK(\"|", none())), ["LOOK"]);
    assert_eq!(labels(&offered("ENABLE |", none())), ["PASS", "NOWAIT"]);
    let found = offered("MOVE |", none());
    assert_eq!(labels(&found), ["P1", "UP", "POINT", "HERE", "DEST"]);
    assert_eq!(found[0]["detail"], "POINT 400,0,200");
    let found = offered("Q1 = P1\n  DIM Q2(3) AS POINT\n  I = -1\n  MOVE |", none());
    assert_eq!(labels(&found), ["P1", "Q1", "Q2", "UP", "POINT", "HERE", "DEST"]);
    assert_eq!(labels(&offered("IF DIN(1) THEN STOP |", none())), ["ELSE"]);
    assert_eq!(labels(&offered("IF DIN(1) THEN GOTO AGAIN |", none())), ["ELSE"]);
    assert_eq!(labels(&offered("IF DIN(1) THEN TOTAL = 1 |", none()))[0], "ELSE");
    let branch = offered("IF DIN(1) THEN |", none());
    let action = offered("ON DIN(1) DO |", none());
    for word in ["FOR", "NEXT", "DIM", "END", "REMARK"] {
        assert!(
            !labels(&branch).contains(&word) && !labels(&action).contains(&word),
            "{word}"
        );
    }
    assert!(labels(&branch).contains(&"WAIT") && !labels(&action).contains(&"WAIT"));
    assert!(labels(&action).contains(&"MOVE") && labels(&action).contains(&"SUB"));
    let value = offered("TOTAL = |", none());
    assert!(labels(&value).contains(&"NOT"));
    for word in ["AND", "OR", "MOD"] {
        assert!(!labels(&value).contains(&word), "{word}");
    }
    let dot = json!({ "context": { "triggerKind": 2, "triggerCharacter": "." } });
    assert!(labels(&offered("TOTAL = P1.|", dot.clone())).contains(&"X"));
    assert_eq!(labels(&offered("TOTAL = 1.|", dot)), [""; 0]);
    let found = offered("MOVE P1 WITH SPEED = 50, PAYLOAD = L1, |", none());
    assert!(!labels(&found).contains(&"SPEED") && !labels(&found).contains(&"PAYLOAD"));
    assert!(labels(&found).contains(&"ACCEL"));
    let found = offered("MOVE P1 WITH |", none());
    assert!(
        labels(&found).contains(&"SPEED")
            && labels(&found).contains(&"PAYLOAD")
            && !labels(&found).contains(&"P1")
    );
    let found = offered("|", none());
    for word in ["SUB", "TOTAL", "MOVE", "IF", "FOR", "DOUT", "SPEED"] {
        assert!(labels(&found).contains(&word), "{word}");
    }
    assert!(!labels(&found).contains(&"LOST") && !labels(&found).contains(&"Q"));
    let snippet = found
        .as_array()
        .unwrap()
        .iter()
        .find(|item| item["label"] == "FOR" && item["insertTextFormat"] == 2)
        .unwrap();
    assert!(
        snippet["textEdit"]["newText"]
            .as_str()
            .unwrap()
            .contains("NEXT ${1:I}")
    );
    // A blank opens a list where few words can follow only.
    let typed = json!({ "context": { "triggerKind": 2, "triggerCharacter": " " } });
    assert_eq!(labels(&offered("GOTO |", typed.clone())), ["AGAIN"]);
    assert_eq!(labels(&offered("N = |", typed)), [""; 0]);
    assert_eq!(labels(&offered("TOOL = |", none())), ["T1", "TRANS"]);
    assert_eq!(
        labels(&offered("mo|", none()))
            .iter()
            .filter(|label| label.starts_with("mo"))
            .count(),
        6
    );
    // What is misspelt once is not offered.
    assert!(!labels(&offered("MOVE P9 WITH SPED = 5\n  N = |", none())).contains(&"P9"));
    let found = offered("PRINT COM1, |", none());
    assert_eq!(labels(&found).iter().filter(|label| **label == "CR").count(), 1);
    let found = offered("IF TOTAL > 1 |", none());
    let first = found
        .as_array()
        .unwrap()
        .iter()
        .min_by_key(|item| item["sortText"].to_string())
        .unwrap();
    assert_eq!(first["label"], "THEN");
    let found = offered("N = TO|", none());
    let item = found
        .as_array()
        .unwrap()
        .iter()
        .find(|item| item["label"] == "TOTAL")
        .unwrap();
    assert_eq!(item["textEdit"]["range"]["start"]["character"], 6);
    let found = editor.ask(
        "completionItem/resolve",
        json!({ "label": "delay", "data": "DELAY" }),
    );
    assert!(
        found["documentation"]["value"]
            .as_str()
            .unwrap()
            .contains("`DELAY seconds`"),
        "{found}"
    );
}

#[test]
fn the_operands_of_a_call_are_shown() {
    let mut editor = cell();
    let text = PICK.replace("PLACE(P1, 2)", "PLACE(P1, BCDIN(9, MAX(1, 2, 3)))");
    editor.change("pick.scol", json!([{ "text": text }]));
    for (excerpt, label, operand) in [
        ("PLACE(P1,| BCD", "PLACE(WHERE, N)", 1),
        ("BCDIN(|9", "BCDIN(first, digits)", 0),
        ("BCDIN(9, |MAX", "BCDIN(first, digits)", 1),
        ("MAX(1, 2, |3", "MAX(a, b, ...)", 2),
    ] {
        let found = editor.ask_at(
            "textDocument/signatureHelp",
            "pick.scol",
            &text,
            excerpt,
            json!({}),
        );
        assert_eq!(
            (&found["signatures"][0]["label"], &found["activeParameter"]),
            (&json!(label), &json!(operand)),
            "{excerpt}"
        );
    }
    assert_eq!(
        editor.ask_at(
            "textDocument/signatureHelp",
            "pick.scol",
            &text,
            "GOTO |AGAIN",
            json!({})
        ),
        Value::Null
    );
}

#[test]
fn the_outline_has_programs_with_their_names() {
    let mut editor = cell();
    let found = editor.ask(
        "textDocument/documentSymbol",
        json!({ "textDocument": { "uri": address("pick.scol") } }),
    );
    let children = |symbol: &Value| -> Vec<String> {
        symbol["children"]
            .as_array()
            .unwrap()
            .iter()
            .map(|child| child["name"].as_str().unwrap().to_owned())
            .collect()
    };
    let rows: Vec<(String, Vec<String>)> = found
        .as_array()
        .unwrap()
        .iter()
        .map(|symbol| (symbol["name"].as_str().unwrap().to_owned(), children(symbol)))
        .collect();
    let expected = [
        ("GLOBAL", &["TOTAL"][..]),
        ("MAIN", &["AGAIN"]),
        ("PLACE", &["WHERE", "N"]),
        ("DATA", &["P1"]),
    ];
    assert_eq!(
        rows,
        expected.map(|(name, children)| (
            name.to_owned(),
            children.iter().map(|name| (*name).to_owned()).collect()
        ))
    );
    assert_eq!(found[2]["detail"], "(WHERE, N)");
    let found = editor.ask("workspace/symbol", json!({ "query": "oth" }));
    assert_eq!(
        (&found[0]["name"], &found[0]["location"]["uri"]),
        (&json!("OTHER"), &json!(address("other.scol")))
    );
    let folds = editor.ask(
        "textDocument/foldingRange",
        json!({ "textDocument": { "uri": address("pick.scol") } }),
    );
    let folds: Vec<(u64, u64)> = folds
        .as_array()
        .unwrap()
        .iter()
        .map(|fold| {
            (
                fold["startLine"].as_u64().unwrap() + 1,
                fold["endLine"].as_u64().unwrap() + 1,
            )
        })
        .collect();
    assert_eq!(folds, [(2, 4), (6, 15), (16, 18), (19, 21)]);
}

#[test]
fn points_have_their_values_beside_them() {
    let mut editor = cell();
    let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 99, "character": 0 } });
    let found = editor.ask(
        "textDocument/inlayHint",
        json!({ "textDocument": { "uri": address("pick.scol") }, "range": range }),
    );
    let hints: Vec<(u64, &str)> = found
        .as_array()
        .unwrap()
        .iter()
        .map(|hint| {
            (
                hint["position"]["line"].as_u64().unwrap() + 1,
                hint["label"].as_str().unwrap(),
            )
        })
        .collect();
    assert_eq!(hints, [(8, "(300,100,50)"), (9, "(400,0,200)")]);
}

/// The tokens of an open file: text, type, modifiers.
fn tokens<'t>(editor: &mut Editor, name: &str, text: &'t str) -> Vec<(&'t str, String, usize)> {
    let found = editor.ask(
        "textDocument/semanticTokens/full",
        json!({ "textDocument": { "uri": address(name) } }),
    );
    let legend = layout::legend();
    let lines: Vec<&str> = text.lines().collect();
    let (mut line, mut column, mut tokens) = (0, 0, Vec::new());
    for token in found["data"].as_array().unwrap().chunks(5) {
        let [down, right, length, kind, modifiers] =
            [0, 1, 2, 3, 4].map(|at| usize::try_from(token[at].as_u64().unwrap()).unwrap());
        column = if down > 0 { right } else { column + right };
        line += down;
        tokens.push((
            &lines[line][column..column + length],
            legend["tokenTypes"][kind].as_str().unwrap().to_owned(),
            modifiers,
        ));
    }
    tokens
}

#[test]
fn tokens_are_told_apart_by_what_they_are() {
    let mut editor = cell();
    let tokens = tokens(&mut editor, "pick.scol", PICK);
    for (text, kind, modifiers) in [
        ("' picks a part", "comment", 0),
        ("TOTAL", "variable", 1),
        ("PROGRAM", "keyword", 0),
        ("SPEED", "variable", 8),
        ("AGAIN", "label", 1),
        ("UP", "struct", 4),
        ("DIN", "function", 8),
        (">=", "operator", 0),
        ("100", "number", 0),
        ("COM1", "enumMember", 8),
        ("WHERE", "parameter", 1),
        ("PLACE", "function", 0),
    ] {
        assert!(
            tokens.contains(&(text, kind.to_owned(), modifiers)),
            "{text}: {tokens:?}"
        );
    }
}

#[test]
fn a_word_is_what_its_place_makes_of_it() {
    let text = "PROGRAM T\n  DIM A(3) AS INTEGER\n  A(1) = ON\n  ON DIN(1) DO STOP\n  A(2) = A(1) MOD 7 + MOD(9, 2)\n  MOVEL HOME\nEND\nDATA\n  POINT HOME=400,0,0/\nEND\n";
    let mut editor = Editor::new(&[]);
    assert_eq!(editor.open("t.scol", text), [("E0103".to_owned(), 6)]);
    let tokens = tokens(&mut editor, "t.scol", text);
    let kinds = |word: &str| -> Vec<&str> {
        tokens
            .iter()
            .filter(|token| token.0 == word)
            .map(|token| token.1.as_str())
            .collect()
    };
    assert_eq!((kinds("INTEGER"), kinds("POINT")), (vec!["type"], vec!["type"]));
    assert_eq!(
        (kinds("ON"), kinds("MOD")),
        (vec!["enumMember", "keyword"], vec!["operator", "function"])
    );
    let found = editor.ask_at("textDocument/hover", "t.scol", text, "O|N DIN", json!({}));
    assert!(
        found["contents"]["value"]
            .as_str()
            .unwrap()
            .contains("arms a monitor"),
        "{found}"
    );
    // A misspelt statement looks like a call, and is none.
    assert_eq!(kinds("MOVEL"), [""; 0]);
    assert_eq!(
        editor.ask_at("textDocument/hover", "t.scol", text, "MOV|EL", json!({})),
        Value::Null
    );
    let found = editor.ask_at("textDocument/completion", "t.scol", text, "|MOVEL", json!({}));
    assert!(!labels(&found).contains(&"MOVEL") && labels(&found).contains(&"MOVES"));
}

#[test]
fn formatting_touches_only_what_changes() {
    let text = "PROGRAM T\n  STOP\nn=1\n  STOP\nEND\n";
    let mut editor = Editor::new(&[]);
    editor.open("t.scol", text);
    let of = json!({ "textDocument": { "uri": address("t.scol") }, "options": { "tabSize": 8, "insertSpaces": false } });
    let edits = editor.ask("textDocument/formatting", of.clone());
    assert_eq!(edits[0]["range"]["start"], json!({ "line": 2, "character": 0 }));
    assert_eq!(edits[0]["range"]["end"], json!({ "line": 3, "character": 0 }));
    assert_eq!(edits.as_array().unwrap().len(), 1);
    let formatted = edited(text, &edits);
    assert_eq!(formatted, scol_mini::format(text));
    editor.change("t.scol", json!([{ "text": formatted }]));
    assert_eq!(editor.ask("textDocument/formatting", of), json!([]));
}

#[test]
fn a_program_says_why_no_taught_point_is_known() {
    let table = "NAME,X,Y,Z,A,B,C,U,V,CONFIG\n1UP,3,1,5,0,0,0,0,0,\n";
    let mut editor = Editor::new(&[("points.csv", table)]);
    let text = "PROGRAM T\n  MOVE UP\n  N = M\nEND\n";
    let document = json!({ "uri": address("t.scol"), "languageId": "scol", "version": 1, "text": text });
    editor.tell("textDocument/didOpen", json!({ "textDocument": document }));
    let found = editor.published("t.scol");
    assert_eq!(
        found[0]["message"],
        "no value for UP: add it to DATA or to the taught points\nhelp: correct points.csv, of which no point is used: \
         line 2, column 1: expected a name of at most 10 letters and digits, found `1UP`"
    );
    // A variable that is not known is none of its points.
    assert!(!found[1]["message"].as_str().unwrap().contains("points.csv"));
    assert_ne!(editor.published("points.csv"), json!([]));
}

#[test]
fn a_table_of_points_is_read_again_when_it_changes() {
    let mut editor = Editor::new(&[(
        "points.csv",
        "NAME,X,Y,Z,A,B,C,U,V,CONFIG\n1UP,3,1,5,0,0,0,0,0,\n",
    )]);
    assert_eq!(
        editor.open("t.scol", "PROGRAM T\n  MOVE UP\nEND\n"),
        [("E0201".to_owned(), 2)]
    );
    let found = editor.published("points.csv");
    assert_eq!(found[0]["range"]["start"], json!({ "line": 1, "character": 0 }));
    editor
        .server
        .projects
        .project_mut()
        .0
        .insert(Path::new(FOLDER).join("points.csv"), POINTS.to_owned());
    let changes = json!({ "changes": [{ "uri": address("points.csv"), "type": 2 }] });
    editor.tell("workspace/didChangeWatchedFiles", changes.clone());
    assert_eq!(editor.diagnostics("t.scol"), []);
    assert_eq!(editor.published("points.csv"), json!([]));
    // Without a word of the editor it is read when a program changes.
    editor
        .server
        .projects
        .project_mut()
        .0
        .insert(Path::new(FOLDER).join("points.csv"), POINTS.replace("UP", "DOWN"));
    let text = json!([{ "text": "PROGRAM T\n  MOVE DOWN\nEND\n" }]);
    assert_eq!(editor.change("t.scol", text), []);
    let text = json!([{ "text": "PROGRAM T\n  MOVE UP\nEND\n" }]);
    editor
        .server
        .projects
        .project_mut()
        .0
        .insert(Path::new(FOLDER).join("points.csv"), POINTS.to_owned());
    assert_eq!(editor.change("t.scol", text), []);
    // Nothing has changed since.
    editor.tell("workspace/didChangeWatchedFiles", changes);
    editor.tell(
        "workspace/didChangeConfiguration",
        json!({ "settings": { "ts3100": { "model": "tsl3000-thl400" } } }),
    );
    // Its arm has fewer axes, so the table does not fit.
    assert_eq!(editor.diagnostics("t.scol"), [("E0201".to_owned(), 2)]);
    assert_ne!(editor.published("points.csv"), json!([]));
    editor.tell(
        "workspace/didChangeConfiguration",
        json!({ "settings": { "ts3100": { "model": "TH999" } } }),
    );
    let message = editor.unread.remove(0);
    assert_eq!(
        message["params"]["message"],
        "workspace/didChangeConfiguration: model: there is no TH999"
    );
}

#[test]
fn requests_out_of_their_time_are_refused() {
    let settings = || Settings {
        model: ArmModel::by_name("ts3100-tv800").unwrap(),
        points: None,
    };
    let mut editor = Editor {
        server: Server::new(Memory::default(), settings()),
        unread: Vec::new(),
        requests: 0,
    };
    assert_eq!(editor.refusal("textDocument/hover", json!({})).0, -32_002);
    editor.tell("textDocument/didOpen", json!({}));
    editor.ask("initialize", json!({ "capabilities": {} }));
    assert_eq!(editor.refusal("initialize", json!({})).0, -32_600);
    assert_eq!(editor.refusal("textDocument/unheardOf", json!({})).0, -32_601);
    assert_eq!(
        editor.refusal("textDocument/hover", json!({ "position": 1 })).0,
        -32_602
    );
    editor.tell("textDocument/didChange", json!({}));
    assert!(
        editor.unread.remove(0)["params"]["message"]
            .as_str()
            .unwrap()
            .starts_with("textDocument/didChange: missing field")
    );
    for (text, code) in [
        ("{", -32_700),
        ("[]", -32_600),
        ("{\"id\":[]}", -32_600),
        ("{\"id\":5}", -32_600),
    ] {
        let answers = editor.server.receive([text.as_bytes()]);
        assert_eq!(answers[0]["error"]["code"], code, "{text}");
    }
    assert_eq!(
        editor.server.receive([b"{\"id\":5,\"result\":null}".as_slice()]),
        [] as [Value; 0]
    );
    editor.ask("shutdown", Value::Null);
    assert_eq!(editor.refusal("textDocument/hover", json!({})).0, -32_600);
    assert_eq!(editor.server.ended(), None);
    editor.tell("exit", Value::Null);
    assert_eq!(editor.server.ended(), Some(true));
    let mut server = Server::new(Memory::default(), settings());
    server.receive([br#"{"method":"exit"}"#.as_slice()]);
    assert_eq!(server.ended(), Some(false));
}

#[test]
fn a_request_that_is_cancelled_before_its_turn_is_not_carried_out() {
    let mut editor = cell();
    let hover = editor.request(
        "textDocument/hover",
        at("pick.scol", PICK, "  MO|VE WHERE", json!({})),
    );
    let symbols = editor.request(
        "textDocument/documentSymbol",
        json!({ "textDocument": { "uri": address("pick.scol") } }),
    );
    let cancel = rpc::notification("$/cancelRequest", &json!({ "id": hover["id"] }));
    editor.send(&[hover.clone(), symbols, cancel.clone()]);
    let responses = std::mem::take(&mut editor.unread);
    assert_eq!(responses[0]["error"]["code"], -32_800);
    assert!(responses[1]["result"].is_array());
    // It comes too late, or for nothing.
    editor.send(&[hover]);
    assert!(editor.unread.remove(0)["result"].is_object());
    editor.send(&[cancel]);
    // Diagnostics are made once for all changes that have arrived.
    let change = |text: &str| {
        rpc::notification(
            "textDocument/didChange",
            &json!({ "textDocument": { "uri": address("pick.scol"), "version": 3 }, "contentChanges": [{ "text": text }] }),
        )
    };
    editor.send(&[change("A"), change("B"), change("PROGRAM T\nEND\n")]);
    assert_eq!(editor.diagnostics("pick.scol"), []);
}

/// A message without the words that the documentation and the messages of the language have.
fn without_words(value: &Value) -> Value {
    match value {
        Value::Object(fields) => {
            let words = ["value", "detail", "message", "data", "version"];
            let kept = fields.iter().filter(|(name, _)| !words.contains(&name.as_str()));
            Value::Object(
                kept.map(|(name, value)| (name.clone(), without_words(value)))
                    .collect(),
            )
        }
        // Completions have all words of the language.
        Value::Array(list) if list.iter().any(|item| item.get("sortText").is_some()) => json!("completions"),
        Value::Array(list) => Value::Array(list.iter().map(without_words).collect()),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => value.clone(),
    }
}

/// The responses by their requests, and the last diagnostics of each file. Those between depend on what arrives together.
fn outcome(messages: &[Value]) -> BTreeMap<String, Value> {
    let key = |message: &Value| match message.get("method") {
        None => message["id"].to_string(),
        Some(method) => format!("{method} {}", message["params"]["uri"]),
    };
    messages
        .iter()
        .map(|message| (key(message), without_words(message)))
        .collect()
}

#[test]
fn recorded_sessions_are_answered_as_they_were() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/sessions");
    let mut played = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|end| end != "jsonl") {
            continue;
        }
        let settings = Settings {
            model: ArmModel::by_name("ts3100-tv800").unwrap(),
            points: None,
        };
        let mut server = Server::new(Memory::default(), settings);
        let (mut expected, mut found) = (Vec::new(), Vec::new());
        for line in std::fs::read_to_string(&path).unwrap().lines() {
            let entry: Value = serde_json::from_str(line).unwrap();
            match entry.get("editor") {
                Some(message) => found.extend(server.receive([message.to_string().as_bytes()])),
                None => expected.push(entry["server"].clone()),
            }
        }
        let (found, expected) = (outcome(&found), outcome(&expected));
        assert!(found.keys().eq(expected.keys()), "{}", path.display());
        for (key, expected) in expected {
            assert_eq!(found[&key], expected, "{}: {key}", path.display());
        }
        played += 1;
    }
    assert!(played >= 2, "{played} sessions");
}
