//! Fuzzes a session of an editor with the language server: the first byte says what happens to its messages, the rest are the
//! messages, one a line.
//!
//! Whatever an editor sends, cut, in another order, or cancelled: each request has one response, nothing else has one, and the
//! server answers `shutdown` at the end. The same bytes are cut into messages as a stream, too.

use serde_json::{Value, json};
use std::io;
use std::path::{Path, PathBuf};
use ts3100_controller::model::ArmModel;
use ts3100_workbench::framing;
use ts3100_workbench::lsp::{Project, Server, Settings, SettingsError};

/// Most messages of a session.
const MAX_MESSAGES: usize = 60;
/// Taught points beside each program.
const POINTS: &str = "NAME,X,Y,Z,A,B,C,U,V,CONFIG\nUP,300,100,50,0,0,0,0,0,\n";

/// What happens to the messages, by the bits of the first byte.
const REVERSED: u8 = 1;
const CANCELLED: u8 = 2;
const TOGETHER: u8 = 4;
const CUT: u8 = 8;

#[derive(Debug)]
struct Disk;

impl Project for Disk {
    fn read(&self, path: &Path) -> io::Result<String> {
        match path.ends_with("points.csv") {
            true => Ok(POINTS.to_owned()),
            false => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn programs(&self, folder: &Path) -> Vec<PathBuf> {
        vec![folder.join("other.scol")]
    }

    fn model(&self, name: &str) -> Result<ArmModel, SettingsError> {
        ArmModel::by_name(name).ok_or_else(|| SettingsError::Model(name.to_owned()))
    }

    fn explanation(&self, _: &str) -> Option<String> {
        None
    }
}

/// Plays a session.
///
/// # Panics
/// When what must hold does not.
pub fn check(data: &[u8]) {
    let mut stream = data;
    while let Ok(Some(_)) = framing::read(&mut stream) {}
    let [choice, content @ ..] = data else {
        return;
    };
    let lines = content
        .split(|byte| *byte == b'\n')
        .filter(|line| !line.is_empty());
    let mut messages: Vec<Vec<u8>> = lines.take(MAX_MESSAGES).map(<[u8]>::to_vec).collect();
    let place = usize::from(choice >> 4);
    if choice & REVERSED != 0 {
        // Without its beginning nothing is answered.
        if let Some(rest) = messages.get_mut(2..) {
            rest.reverse();
        }
    }
    if choice & CUT != 0
        && let Some(message) = messages.get_mut(place)
    {
        message.truncate(message.len() / 2);
    }
    if choice & CANCELLED != 0 {
        let ids: Vec<Value> = messages.iter().filter_map(|message| id(message)).collect();
        messages.extend(ids.into_iter().skip(place).map(|id| {
            let cancel = json!({ "jsonrpc": "2.0", "method": "$/cancelRequest", "params": { "id": id } });
            cancel.to_string().into_bytes()
        }));
    }
    let model = ArmModel::by_name("ts3100-tv800").expect("it is built in");
    let mut server = Server::new(Disk, Settings { model, points: None });
    let batch = if choice & TOGETHER != 0 {
        messages.len().max(1)
    } else {
        1
    };
    let (mut expected, mut found) = (0, 0);
    for batch in messages.chunks(batch) {
        for message in batch {
            if server.ended().is_some() {
                break;
            }
            expected += usize::from(wants_response(message));
            if is_exit(message) {
                break;
            }
        }
        let answers = server.receive(batch.iter().map(Vec::as_slice));
        found += answers
            .iter()
            .filter(|answer| answer.get("method").is_none())
            .count();
    }
    assert_eq!(found, expected);
    if server.ended().is_none() {
        let last = json!({ "jsonrpc": "2.0", "id": "last", "method": "shutdown" }).to_string();
        let answers = server.receive([last.as_bytes()]);
        assert_eq!(answers[0]["id"], "last");
    }
}

/// The id of a request.
fn id(message: &[u8]) -> Option<Value> {
    let message: Value = serde_json::from_slice(message).ok()?;
    message.get("method")?;
    message.get("id").cloned()
}

/// Whether a message is answered: a request is, and everything that is none of JSON-RPC.
fn wants_response(message: &[u8]) -> bool {
    let Ok(message) = serde_json::from_slice::<Value>(message) else {
        return true;
    };
    let is_method = message.get("method").is_some_and(Value::is_string);
    let is_response = message.get("result").is_some() || message.get("error").is_some();
    match message.get("id") {
        None => !is_method,
        Some(_) => is_method || !is_response,
    }
}

fn is_exit(message: &[u8]) -> bool {
    let message = serde_json::from_slice::<Value>(message).unwrap_or_default();
    message.get("id").is_none() && message.get("method") == Some(&json!("exit"))
}
