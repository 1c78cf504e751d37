//! JSON-RPC 2.0: a message of an editor and its kind, responses and their errors. `ts3100 mcp` answers with them too.

use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// The number or text of a request.
pub type RequestId = Value;

/// A message of the editor.
#[derive(Debug)]
pub(crate) enum Message {
    Request {
        id: RequestId,
        method: String,
        params: Value,
    },
    Notification {
        method: String,
        params: Value,
    },
    Response,
    /// Anything else, with the response it gets.
    Invalid(RequestId, ResponseError),
}

impl Message {
    pub fn parse(bytes: &[u8]) -> Message {
        let mut message: Value = match serde_json::from_slice(bytes) {
            Ok(message) => message,
            Err(error) => {
                let error = ResponseError::not_json(format!("the message is not JSON: {error}"));
                return Message::Invalid(Value::Null, error);
            }
        };
        let id = message.get_mut("id").map(Value::take);
        let params = message.get_mut("params").map_or(Value::Null, Value::take);
        let method = message.get("method").and_then(Value::as_str).map(str::to_owned);
        match (id, method) {
            (Some(id), Some(method)) if id.is_number() || id.is_string() => {
                Message::Request { id, method, params }
            }
            (None, Some(method)) => Message::Notification { method, params },
            (Some(_), None) if message.get("result").is_some() || message.get("error").is_some() => {
                Message::Response
            }
            (id, _) => {
                let id = id
                    .filter(|id| id.is_number() || id.is_string())
                    .unwrap_or_default();
                Message::Invalid(
                    id,
                    ResponseError::invalid_request("the message is neither request nor notification"),
                )
            }
        }
    }

    /// The request that the message cancels.
    pub fn cancels(&self) -> Option<RequestId> {
        match self {
            Message::Notification { method, params } if method == "$/cancelRequest" => {
                params.get("id").cloned()
            }
            Message::Request { .. }
            | Message::Notification { .. }
            | Message::Response
            | Message::Invalid(..) => None,
        }
    }
}

/// An answer that something cannot be done.
#[derive(Debug)]
pub struct ResponseError {
    code: i64,
    pub(crate) message: String,
}

impl ResponseError {
    fn new(code: i64, message: impl Into<String>) -> ResponseError {
        let message = message.into();
        ResponseError { code, message }
    }

    /// The message is not JSON.
    pub fn not_json(message: impl Into<String>) -> ResponseError {
        ResponseError::new(-32_700, message)
    }

    /// The message is JSON and not a request, or a request at the wrong time.
    pub fn invalid_request(message: &str) -> ResponseError {
        ResponseError::new(-32_600, message)
    }

    /// No such method.
    pub fn unknown_method(message: impl Into<String>) -> ResponseError {
        ResponseError::new(-32_601, message)
    }

    /// The parameters do not fit the method.
    pub fn invalid_params(message: impl Into<String>) -> ResponseError {
        ResponseError::new(-32_602, message)
    }

    pub(crate) fn not_open(uri: &str) -> ResponseError {
        ResponseError::invalid_params(format!("{uri} is not open"))
    }

    pub(crate) fn not_initialized() -> ResponseError {
        ResponseError::new(-32_002, "the server is not initialized; send initialize first")
    }

    pub(crate) fn cancelled() -> ResponseError {
        ResponseError::new(-32_800, "cancelled")
    }

    /// The request is valid and cannot be carried out.
    pub(crate) fn failed(message: impl Into<String>) -> ResponseError {
        ResponseError::new(-32_803, message)
    }
}

/// The parameters of a request.
pub(crate) struct Params(pub(crate) Value);

impl Params {
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, ResponseError> {
        T::deserialize(&self.0).map_err(|error| ResponseError::invalid_params(error.to_string()))
    }

    /// The text at a JSON pointer; empty where there is none.
    pub fn text(&self, pointer: &str) -> &str {
        self.0
            .pointer(pointer)
            .and_then(Value::as_str)
            .unwrap_or_default()
    }

    pub fn is_set(&self, pointer: &str) -> bool {
        self.0.pointer(pointer) == Some(&Value::Bool(true))
    }

    /// The addresses in a list of folders.
    pub fn uris(&self, pointer: &str) -> Vec<String> {
        let folders = self
            .0
            .pointer(pointer)
            .and_then(Value::as_array)
            .into_iter()
            .flatten();
        folders
            .filter_map(|folder| Some(folder.get("uri")?.as_str()?.to_owned()))
            .collect()
    }
}

/// A response: the result, or the error.
pub fn response(id: &RequestId, result: Result<Value, ResponseError>) -> Value {
    match result {
        Ok(result) => json!({ "jsonrpc": "2.0", "id": id, "result": result }),
        Err(ResponseError { code, message }) => {
            json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
        }
    }
}

pub(crate) fn notification(method: &str, params: &Value) -> Value {
    json!({ "jsonrpc": "2.0", "method": method, "params": params })
}
