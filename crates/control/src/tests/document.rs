//! Makes the OpenAPI document: adds to the description of the calls what no handler knows: the refusals that all share,
//! groups, servers, security, examples.
//!
//! The calls and their schemas come from `route_table`. The examples are a recorded session, `assets/examples.json`;
//! a test replays it, and `tests/system/control/openapi_document.py` records it again. The result is `assets/openapi.json`, which the binary
//! carries; after a change of the calls this writes it again:
//!
//! ```sh
//! cargo test -p ts3100-control -- --ignored bless_openapi
//! ```

use crate::DEFAULT_PORT;
use crate::problem::Problem;
use crate::route_table::Call;
use serde::Deserialize;
use serde_json::{Map, Value};
use utoipa::openapi::example::ExampleBuilder;
use utoipa::openapi::path::{Operation, ParameterBuilder, PathItem, Paths};
use utoipa::openapi::schema::{AdditionalProperties, Schema};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::server::{Server, ServerBuilder, ServerVariableBuilder};
use utoipa::openapi::{Components, Content, Info, License, OpenApi, Ref, RefOr, ResponseBuilder, Tag};
use utoipa::{PartialSchema as _, ToSchema as _};

/// The recorded session.
const EXAMPLES: &str = include_str!("../../assets/examples.json");
const TITLE: &str = "TS3100 control interface";
const DESCRIPTION: &str = "Do what a real controller won't let you: inspect and set any state, and control the clock.\n\n\
    When a call returns, all its immediate effects have happened. Durations and moments are seconds \
    of virtual time. A refused call has changed nothing; its response is a `Problem`.\n\n\
    The documentation is at `/book/`.";
const TOKEN_DESCRIPTION: &str = "The token of `--control-token`. Without one, calls need no authorization: by default \
    the interface listens on the loopback only.";
/// Name of the security scheme.
const TOKEN: &str = "token";

/// The groups of calls, by the resource that begins one: a resource without a row belongs to the group before it.
const GROUPS: [(&str, &str); 21] = [
    (
        "robots",
        "The robots of this process. Every other path also exists below `/robots/NAME`.",
    ),
    ("wires", "Wires between the robots of this process."),
    ("state", "The whole state at one moment."),
    (
        "panel",
        "Operating panel: key switch, control right, switches, START and STOP.",
    ),
    (
        "breakpoints",
        "Stop the selected program at a line, and run it step by step.",
    ),
    ("pendant", "What the teach pendant shows, and its keys."),
    ("arm", "The arm: its model, posture, coordinate systems and path."),
    (
        "jog",
        "Move the arm by hand, as with the keys of the teach pendant.",
    ),
    (
        "alarms",
        "Active alarms, the error history, and the table with text, cause and remedy.",
    ),
    (
        "lines",
        "Digital inputs and outputs, by their numbers: 1-64, 101-164, 201-264, 301-364, 401-464.",
    ),
    (
        "variables",
        "GLOBAL and DATA variables of the selected file, and its positions.",
    ),
    ("files", "Files on the RAM drive."),
    (
        "channels",
        "The communication ports HOST, COM1, IP0 to IP3: peers and buffers.",
    ),
    (
        "parameters",
        "The parameters in effect: USER.PAR and ETHERNET.PAR at the last power-on.",
    ),
    (
        "clock",
        "Virtual time: how it passes, advancing it, and waiting for a condition.",
    ),
    ("power", "Power off, on and cycle; reset between tests."),
    (
        "faults",
        "Fault injection: arm faults, disarm them, see their outcome. `/book/reference/faults` explains the kinds.",
    ),
    (
        "snapshots",
        "Save the whole state of the controller, and restore it.",
    ),
    ("events", "Live stream of everything that happens."),
    (
        "transcript",
        "The traffic of all ports and every action at the controller.",
    ),
    (
        "service",
        "Monitoring of the emulator, and findings about its hosts.",
    ),
];

/// A call of the session.
#[derive(Debug, Deserialize)]
struct RecordedCall {
    /// Method and path, as in the document.
    call: String,
    /// Name of this example; needed if a call has several.
    #[serde(default)]
    name: Option<String>,
    /// Values of the parameters in the path and in the query.
    #[serde(default)]
    parameters: Map<String, Value>,
    #[serde(default)]
    request: Option<Value>,
    #[serde(default)]
    response: Option<Value>,
}

/// The document of these calls.
pub fn document(calls: Vec<Call>, needs_token: bool) -> OpenApi {
    let mut components = Components::new();
    let problem = (Problem::name().into_owned(), Problem::schema());
    components.schemas.extend([problem]);
    let mut paths = Paths::new();
    let mut tags: Vec<Tag> = Vec::new();
    let mut group = "";
    for call in calls {
        let mut groups = GROUPS.iter();
        if let Some((name, description)) = groups.find(|(name, _)| *name == call.resource) {
            group = name;
            if tags.iter().all(|tag| tag.name != group) {
                let mut tag = Tag::new(group);
                tag.description = Some((*description).to_owned());
                tags.push(tag);
            }
        }
        let tag = Some(vec![group.to_owned()]);
        let mut described = call.described.paths;
        let schemas = call.described.components.into_iter();
        components
            .schemas
            .extend(schemas.flat_map(|components| components.schemas));
        for item in described.paths.values_mut() {
            for (method, operation) in operations(item) {
                operation.tags.clone_from(&tag);
                add_error_responses(operation, method != "GET");
            }
        }
        paths.merge(described);
    }
    components
        .schemas
        .values_mut()
        .for_each(forbid_additional_properties);
    let scheme = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some(TOKEN_DESCRIPTION))
        .build();
    components.add_security_scheme(TOKEN, SecurityScheme::Http(scheme));

    let examples: Vec<RecordedCall> = serde_json::from_str(EXAMPLES).unwrap();
    for (path, item) in &mut paths.paths {
        for (method, operation) in operations(item) {
            let call = format!("{method} {path}");
            describe_success(operation, &components);
            for example in examples.iter().filter(|example| example.call == call) {
                add_example(operation, example);
            }
        }
    }

    let mut info = Info::new(TITLE, env!("CARGO_PKG_VERSION"));
    info.description = Some(DESCRIPTION.to_owned());
    let mut license = License::new("MIT OR Apache-2.0");
    license.identifier = Some("MIT OR Apache-2.0".to_owned());
    info.license = Some(license);
    let mut document = OpenApi::new(info, paths);
    document.components = Some(components);
    tags.sort_by_key(|tag| GROUPS.iter().position(|(name, _)| *name == tag.name));
    document.tags = Some(tags);
    document.servers = Some(servers());
    document.security = Some(security(needs_token));
    document
}

/// The calls of a path with their methods.
fn operations(item: &mut PathItem) -> impl Iterator<Item = (&'static str, &mut Operation)> {
    let PathItem {
        get,
        put,
        post,
        delete,
        ..
    } = item;
    [("GET", get), ("PUT", put), ("POST", post), ("DELETE", delete)]
        .into_iter()
        .filter_map(|(method, operation)| Some((method, operation.as_mut()?)))
}

fn servers() -> Vec<Server> {
    let served = ServerBuilder::new()
        .url("/")
        .description(Some("The emulator that served this document"))
        .build();
    let default = ServerBuilder::new()
        .url(format!("http://127.0.0.1:{}", DEFAULT_PORT))
        .description(Some("The default of ts3100 serve"))
        .build();
    let name = ServerVariableBuilder::new()
        .default_value("robot-1")
        .description(Some("The name of the robot"))
        .build();
    let robot = ServerBuilder::new()
        .url("/robots/{robot}")
        .description(Some("One of several robots in one process"))
        .parameter("robot", name)
        .build();
    vec![served, default, robot]
}

/// With a token, every call needs it; otherwise none does, and one is ignored.
fn security(needs_token: bool) -> Vec<SecurityRequirement> {
    let no_scopes: [&str; 0] = [];
    let token = SecurityRequirement::new(TOKEN, no_scopes);
    if needs_token {
        vec![token]
    } else {
        vec![SecurityRequirement::default(), token]
    }
}

/// Exactly one of several keys: the document says of each alternative that it has no others.
fn forbid_additional_properties(schema: &mut RefOr<Schema>) {
    let RefOr::T(Schema::OneOf(alternatives)) = schema else {
        return;
    };
    for alternative in &mut alternatives.items {
        if let RefOr::T(Schema::Object(object)) = alternative
            && !object.properties.is_empty()
        {
            object.additional_properties = Some(Box::new(AdditionalProperties::FreeForm(false)));
        }
    }
}

/// A response that does not describe itself has the description of its schema.
fn describe_success(operation: &mut Operation, components: &Components) {
    let Some(RefOr::T(response)) = operation.responses.responses.get_mut("200") else {
        return;
    };
    if !response.description.is_empty() {
        return;
    }
    let contents = response.content.values();
    let mut descriptions = contents.filter_map(|content| {
        let RefOr::T(Content {
            schema: Some(RefOr::Ref(reference)),
            ..
        }) = content
        else {
            return None;
        };
        let (_, name) = reference.ref_location.rsplit_once('/')?;
        let RefOr::T(Schema::Object(object)) = components.schemas.get(name)? else {
            return None;
        };
        object.description.clone()
    });
    if let Some(description) = descriptions.next() {
        drop(descriptions);
        response.description = description;
    }
}

fn add_example(operation: &mut Operation, example: &RecordedCall) {
    for parameter in operation.parameters.iter_mut().flatten() {
        if let RefOr::T(parameter) = parameter
            && let Some(value) = example.parameters.get(&parameter.name)
        {
            *parameter = ParameterBuilder::from(parameter.clone())
                .example(Some(value.clone()))
                .build();
        }
    }
    if let (Some(RefOr::T(body)), Some(value)) = (&mut operation.request_body, &example.request) {
        body.content
            .values_mut()
            .for_each(|content| add_value(content, example, value));
    }
    if let (Some(RefOr::T(response)), Some(value)) =
        (operation.responses.responses.get_mut("200"), &example.response)
        && let Some(content) = response.content.values_mut().next()
    {
        add_value(content, example, value);
    }
}

fn add_value(content: &mut RefOr<Content>, example: &RecordedCall, value: &Value) {
    let RefOr::T(content) = content else {
        return;
    };
    let name = example.name.as_deref().unwrap_or("example");
    let value = ExampleBuilder::new().value(Some(value.clone())).build();
    content.examples.insert(name.to_owned(), value.into());
}

/// Adds the refusals that every call shares.
fn add_error_responses(operation: &mut Operation, changes: bool) {
    let mut refusals = vec![
        ("400", "The path, the query or the body is malformed."),
        ("401", "The token is missing or wrong."),
        (
            "403",
            "The header `Host`, `Origin` or `Sec-Fetch-Site` is that of a foreign web page.",
        ),
        ("404", "There is no such path, line, variable, file or alarm."),
        ("405", "The path does not have this method."),
        ("503", "The emulator is ending, or 32 event streams are open."),
    ];
    if changes {
        refusals.extend([
            (
                "408",
                "The body did not arrive in time, or a wait took longer than `wall` allows.",
            ),
            (
                "409",
                "The state of the controller forbids it, or the value does not fit.",
            ),
            ("413", "The body is too large."),
            ("415", "The header `Content-Type` is not `application/json`."),
            ("422", "The body is JSON, but does not match its schema."),
            (
                "507",
                "The directory of `--drive` did not accept the change of a file.",
            ),
        ]);
    }
    for (status, description) in refusals {
        let content = Content::new(Some(Ref::from_schema_name(Problem::name())));
        let response = ResponseBuilder::new()
            .description(description)
            .content("application/json", content)
            .build();
        operation
            .responses
            .responses
            .entry(status.to_owned())
            .or_insert(response.into());
    }
}
