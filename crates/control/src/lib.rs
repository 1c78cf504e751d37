//! The HTTP control interface: tests read and change everything about the robot that a real controller does not let
//! them reach.
//!
//! Each resource has a file with its handlers, which the table of `calls` names. A call becomes a request in the driver's
//! queue and waits for the result; nothing here owns or changes a controller. Requests pass `guard` first. Start
//! with `pendant`, a simple resource.

// A new variant of an enum of ours is met at every place that tells them apart.
#![cfg_attr(not(test), warn(clippy::wildcard_enum_match_arm))]

mod alarms;
mod api_names;
mod arm;
mod asset;
mod body;
mod book;
mod breakpoints;
mod channels;
mod check;
pub mod client;
mod clock;
mod controls;
mod coverage;
mod decode;
pub mod event;
mod events;
#[cfg(test)]
#[allow(dead_code, reason = "shared with crates that use all of it")]
#[path = "../../../tests/src/every_event.rs"]
mod every_event;
mod faults;
mod files;
mod guard;
mod handle;
mod jog;
pub mod journal;
mod lines;
mod listener;
mod metrics;
mod noise;
mod panel;
mod parameters;
mod pendant;
mod power;
pub mod printable;
mod problem;
pub mod recorded;
mod resource;
pub mod robots;
mod route_table;
mod scenario;
mod service;
mod settings;
mod snapshots;
mod stack;
mod state;
mod status_frame;
#[cfg(test)]
mod tests;
mod transcript;
mod variables;
mod wires;

pub use body::{MAX_SECONDS, MAX_SNAPSHOT};
pub use clock::{DEFAULT_WALL, MAX_WALL};
pub use faults::fault_kinds;
pub use settings::{ControlChoice, ControlError, ControlSettings, DEFAULT_PORT, MIN_TOKEN};

use asset::{Asset, asset};
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue};
use axum::response::{IntoResponse as _, Response};
use axum::routing::get;
use axum::{Extension, Router};
pub use handle::Handle as DriverHandle;
use listener::{BoundedListener, ConnectionInfo};
use problem::Problem;
use recorded::{Moments, OfRecording};
use robots::{NamedInPath, OfRobot, Robots};
use route_table::{Call, calls};
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use tokio::net::TcpListener;
use tracing::error;

/// The environment variable that says where `ts3100 ctl` finds the interface.
pub const URL_VARIABLE: &str = "TS3100_CONTROL_URL";
/// The page for people, its styles and its scripts by their names.
const UI: &[(&str, Asset)] = &include!(concat!(env!("OUT_DIR"), "/ui.rs"));
/// The file of [`UI`] that is the page.
const PAGE: &str = "index.html";
/// The root of the page, and that of a page that shows a recorded run.
const PAGE_ROOT: &str = "<html lang=\"en\">";
const RECORDED_ROOT: &str = "<html lang=\"en\" data-recorded=\"served\">";
/// The page for people, where there are several robots.
const ROBOTS_PAGE: Asset = asset!("robots.html");
/// The explorer of the calls.
const EXPLORER: Asset = asset!("docs.html");
/// The OpenAPI document of an interface without a token.
const OPEN_API: Asset = asset!("openapi.json");
/// Text in the document for a call that needs no token.
const OPTIONAL_TOKEN: &str = "\"security\": [\n    {},\n";
/// Text in the document for a call that needs the token.
const REQUIRED_TOKEN: &str = "\"security\": [\n";
/// Beginning of the servers in the document.
const SERVERS: &str = "  \"servers\": [\n";
/// Beginning of the part after the servers.
const AFTER_SERVERS: &str = "  \"paths\": {\n";
/// Content security policy of a page: it connects to its own origin only.
const PAGE_POLICY: &str = "default-src 'none'; connect-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; \
    script-src 'self' 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Every call there is: those of the table of controls, and those of the resources.
fn calls() -> Vec<Call> {
    let mut calls = controls::calls();
    calls.extend(calls! {
        robots: get_robots get_robot;
        wires: get_wires put_outside;
        state: get_state;
        breakpoints: put_breakpoints run_to;
        stack: get_program_stack evaluate assign step_task;
        pendant: press_keys;
        jog: jog;
        alarms: raise_alarm get_alarm_table get_alarm_row;
        lines: get_input put_input pulse_input force_input release_input get_output
            put_output pulse_output force_output release_output;
        variables: get_variable put_variable get_positions get_position put_position teach_position;
        files: get_file put_file delete_file select_file;
        check: check;
        channels: get_channel inject drop_peer;
        decode: decode;
        clock: put_clock advance advance_until wait;
        power: power_off power_on power_cycle reset;
        faults: arm_fault clear_faults get_fault_kinds get_fault disarm_fault;
        snapshots: get_snapshots get_named put_snapshot delete_snapshot restore_snapshot get_snapshot load_snapshot;
        events: get_events;
        transcript: get_transcript;
        service: get_health get_version get_metrics get_findings;
        coverage: get_coverage;
        scenario: get_scenario;
    });
    calls
}

/// The bound socket of the interface; it answers once it is served.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    settings: ControlSettings,
}

impl Server {
    /// Binds the socket.
    ///
    /// # Errors
    /// The system's.
    pub fn bind(settings: &ControlSettings) -> io::Result<Server> {
        let socket = std::net::TcpListener::bind(settings.address)?;
        socket.set_nonblocking(true)?;
        let listener = TcpListener::from_std(socket)?;
        let address = listener.local_addr()?;
        Ok(Server {
            listener,
            address,
            settings: settings.clone(),
        })
    }

    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Answers in tasks of the present runtime until that ends.
    pub fn serve(self, robots: Arc<dyn Robots>) {
        self.serve_with(move |settings| {
            let calls = calls_router(settings.token.is_some());
            guarded(
                calls.layer(axum::middleware::from_fn_with_state(robots, robots::find)),
                settings,
            )
        });
    }

    /// Answers for a recorded run; `own` has calls about the run as a whole.
    pub fn serve_recorded(self, moments: Arc<dyn Moments>, own: Router) {
        self.serve_with(move |settings| {
            let calls = calls_router(settings.token.is_some());
            let calls = calls.layer(axum::middleware::from_fn_with_state(moments, recorded::find));
            guarded(own.fallback_service(calls), settings)
        });
    }

    fn serve_with(self, router: impl FnOnce(ControlSettings) -> Router + Send + 'static) {
        tokio::spawn(async move {
            // The table of calls takes long to build beside everything else of a start: a robot whose interface nobody
            // asks is up without it.
            let listener = BoundedListener::after_first_connection(self.listener).await;
            let router = router(self.settings);
            let service = router.into_make_service_with_connect_info::<ConnectionInfo>();
            if let Err(reason) = axum::serve(listener, service).await {
                error!("the control interface has ended: {reason}");
            }
        });
    }
}

/// Every call, and the pages. A layer sees each request before it is looked up, so it can change the path.
fn calls_router(needs_token: bool) -> Router {
    let open_api = async move |named: Option<Extension<NamedInPath>>| {
        let document = open_api_text(needs_token, named.as_ref().map(|named| named.0.0.as_str()));
        ([(CONTENT_TYPE, "application/json")], document)
    };
    let calls = route_table::router(calls())
        .route("/openapi.json", get(open_api))
        .route("/", get(front_page))
        .route(
            "/ui/{file}",
            get(async |Path(file): Path<String>, headers: HeaderMap| ui_file(&file, &headers)),
        )
        .route("/docs", get(async |headers: HeaderMap| page(&EXPLORER, &headers)));
    Router::new().fallback_service(route_table::with_refusals(book::with_book(calls)))
}

/// Checks each request before it is served.
fn guarded(router: Router, settings: ControlSettings) -> Router {
    let settings = Arc::new(settings);
    let check = axum::middleware::from_fn_with_state(Arc::clone(&settings), guard::check);
    let headers = axum::middleware::map_response_with_state(settings, with_security_headers);
    router.layer(check).layer(headers)
}

/// The OpenAPI document. With a token, every call needs it. One that was asked for below `/robots/NAME` names that robot as
/// its server.
fn open_api_text(needs_token: bool, robot: Option<&str>) -> String {
    let mut text = OPEN_API.text();
    if let Some(robot) = robot
        && let Some(begin) = text.find(SERVERS)
        && let Some(length) = text.get(begin..).and_then(|rest| rest.find(AFTER_SERVERS))
    {
        // Relative to the address of the document, so it holds under a prefix that a proxy puts in front; without a slash
        // at its end, because each path begins with one.
        let server = format!(
            "  \"servers\": [\n    {{\n      \"url\": \"../{robot}\",\n      \
             \"description\": \"The robot that served this document\"\n    }}\n  ],\n"
        );
        text.replace_range(begin..begin + length, &server);
    }
    if needs_token {
        text.replacen(OPTIONAL_TOKEN, REQUIRED_TOKEN, 1)
    } else {
        text
    }
}

async fn front_page(
    one: Option<Extension<OfRobot>>,
    recorded: Option<Extension<OfRecording>>,
    headers: HeaderMap,
) -> Response {
    if recorded.is_some() {
        let text = ui_text(PAGE).replacen(PAGE_ROOT, RECORDED_ROOT, 1);
        return (page_headers(), text).into_response();
    }
    match one {
        Some(_) => ui_file(PAGE, &headers),
        None => page(&ROBOTS_PAGE, &headers),
    }
}

/// A file of the page for people.
fn ui_file(name: &str, headers: &HeaderMap) -> Response {
    let Some((_, asset)) = UI.iter().find(|(known, _)| *known == name) else {
        return Problem::not_found("file", "a file of the page", name).into_response();
    };
    let media_type = match name.rsplit_once('.') {
        Some((_, "js")) => "text/javascript; charset=utf-8",
        Some((_, "svg")) => "image/svg+xml",
        Some((_, "css")) => "text/css; charset=utf-8",
        _ => return page(asset, headers),
    };
    ([(CONTENT_TYPE, media_type)], asset.response(headers)).into_response()
}

/// The text of a file of the page for people; empty if there is none of this name.
pub fn ui_text(name: &str) -> String {
    let found = UI.iter().find(|(known, _)| *known == name);
    found.map(|(_, asset)| asset.text()).unwrap_or_default()
}

/// The names of the files of the page for people.
pub fn ui_names() -> impl Iterator<Item = &'static str> {
    UI.iter().map(|(name, _)| *name)
}

fn page_headers() -> [(HeaderName, &'static str); 2] {
    [
        (CONTENT_TYPE, "text/html; charset=utf-8"),
        (CONTENT_SECURITY_POLICY, PAGE_POLICY),
    ]
}

fn page(page: &Asset, request: &HeaderMap) -> Response {
    (page_headers(), page.response(request)).into_response()
}

/// Nothing is kept by a browser, guessed at, or read by a page of another origin; the settings alone say who may frame a
/// page.
async fn with_security_headers(
    State(settings): State<Arc<ControlSettings>>,
    mut response: Response,
) -> Response {
    let headers = response.headers_mut();
    for (name, value) in [
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("x-content-type-options"), "nosniff"),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            "same-origin",
        ),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if !settings.frame_ancestors.is_empty()
        && let Some(policy) = headers.get_mut(CONTENT_SECURITY_POLICY)
        && let Some(framed) = guard::policy_with_ancestors(policy, &settings.frame_ancestors)
    {
        *policy = framed;
    }
    response
}
