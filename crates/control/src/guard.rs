//! Decides which requests are served: checks the token and the headers that reveal that a web page sends a request. No
//! page of another origin may read or drive a robot, whatever address its name resolves to.
//!
//! The settings it enforces are made and validated in [`super::settings`].

use super::listener::ConnectionInfo;
use super::problem::Problem;
use super::robots;
use super::settings::ControlSettings;
use axum::extract::{ConnectInfo, Request, State};
use axum::http::header::{
    AUTHORIZATION, CONTENT_LENGTH, CONTENT_TYPE, HOST, HeaderName, HeaderValue, ORIGIN, TRANSFER_ENCODING,
};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, Method, StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::fmt::Display;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

/// Host names of the loopback, always accepted.
const OWN_NAMES: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];
/// Reveals a page of another site even without `Origin`: browsers omit that for images, forms and scripts.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");
/// Says what a browser does with the response; `iframe` is a document in a frame.
const FETCH_DEST: HeaderName = HeaderName::from_static("sec-fetch-dest");
/// The part of every page's policy that refuses frames.
const UNFRAMED: &str = "frame-ancestors 'none'";

/// Lets a request through or refuses it.
pub async fn check(
    State(settings): State<Arc<ControlSettings>>,
    ConnectInfo(connection): ConnectInfo<ConnectionInfo>,
    request: Request,
    next: Next,
) -> Response {
    let _request = connection.begin_request();
    match settings.admit(&request, connection.reached_at) {
        Ok(()) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

impl ControlSettings {
    fn admit(&self, request: &Request, reached_at: Option<SocketAddr>) -> Result<(), Problem> {
        let headers = request.headers();
        let authority = self.check_host(headers, request.uri(), reached_at)?;
        let path = request.uri().path();
        let own = robots::own_path(path).map_or(path, |(_, own)| own);
        let is_page = robots::is_page(own);
        check_origin(headers, &authority)?;
        // A page tells nothing of a robot before its own scripts ask, and its policy says which frames show it.
        if !(is_page && request.method() == Method::GET && self.is_frame(headers)) {
            check_site(headers)?;
        }
        if !is_page {
            self.check_token(headers)?;
        }
        check_content_type(request.method(), headers)
    }

    /// Whether a browser asks for the document of a frame, and some page may show one.
    fn is_frame(&self, headers: &HeaderMap) -> bool {
        !self.frame_ancestors.is_empty() && the_one(headers, FETCH_DEST).is_ok_and(|found| found == "iframe")
    }

    /// The authority of the one `Host` header, whose name must be one of this machine. With a token it may be any: a page
    /// whose name resolves to this machine does not have the token, and what is served without it tells nothing.
    fn check_host(
        &self,
        headers: &HeaderMap,
        uri: &Uri,
        reached_at: Option<SocketAddr>,
    ) -> Result<String, Problem> {
        let refused = |found: &str| {
            let expected = "localhost, 127.0.0.1, [::1], the address listened on or a name of --control-host";
            forbidden("header Host", expected, found)
        };
        let host = the_one(headers, HOST).map_err(refused)?;
        let host = host.to_str().map_err(|_| refused("no text"))?;
        if self.open || self.token.is_some() {
            return Ok(host.to_ascii_lowercase());
        }
        let target = uri.authority().map(Authority::as_str);
        for authority in std::iter::once(host).chain(target) {
            if !self.is_own(host_name(authority), reached_at) {
                return Err(refused(authority));
            }
        }
        Ok(host.to_ascii_lowercase())
    }

    fn is_own(&self, name: &str, reached_at: Option<SocketAddr>) -> bool {
        let name = name.to_ascii_lowercase();
        let address = name
            .trim_start_matches('[')
            .trim_end_matches(']')
            .parse::<IpAddr>()
            .ok();
        let reached = reached_at.map(|place| place.ip().to_canonical());
        OWN_NAMES.contains(&name.as_str())
            || self.hosts.iter().any(|host| host.eq_ignore_ascii_case(&name))
            || address.is_some_and(|address| Some(address.to_canonical()) == reached)
    }

    fn check_token(&self, headers: &HeaderMap) -> Result<(), Problem> {
        let Some(token) = &self.token else {
            return Ok(());
        };
        let refused = |found| {
            let expected = "`Bearer` and the token of --control-token";
            let status = StatusCode::UNAUTHORIZED;
            Problem::expected_found(status, "header Authorization", expected, found)
        };
        let presented = the_one(headers, AUTHORIZATION).map_err(refused)?.as_bytes();
        let (scheme, rest) = presented
            .split_at_checked("Bearer ".len())
            .unwrap_or((presented, b""));
        if scheme.eq_ignore_ascii_case(b"Bearer ") && constant_time_eq(rest, token.as_bytes()) {
            Ok(())
        } else {
            Err(refused("another one"))
        }
    }
}

fn forbidden(place: &str, expected: impl Display, found: impl Display) -> Problem {
    Problem::expected_found(StatusCode::FORBIDDEN, place, expected, found)
}

/// The value of a header that a request has once.
///
/// # Errors
/// How many there are instead.
fn the_one(headers: &HeaderMap, name: HeaderName) -> Result<&HeaderValue, &'static str> {
    let mut all = headers.get_all(name).iter();
    match (all.next(), all.next()) {
        (Some(value), None) => Ok(value),
        (None, _) => Err("none"),
        (Some(_), Some(_)) => Err("several"),
    }
}

/// Compares in a time that does not depend on where the two differ.
fn constant_time_eq(presented: &[u8], expected: &[u8]) -> bool {
    let differences = presented
        .iter()
        .zip(expected)
        .fold(0_u8, |sum, (presented, expected)| sum | (presented ^ expected));
    presented.len() == expected.len() && differences == 0
}

/// `name`, `name:port`, `[address]:port`.
fn host_name(authority: &str) -> &str {
    match authority.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => authority,
    }
}

/// A page served here may call; a page of any other origin may not, whatever it asks.
fn check_origin(headers: &HeaderMap, authority: &str) -> Result<(), Problem> {
    for origin in headers.get_all(ORIGIN) {
        let text = String::from_utf8_lossy(origin.as_bytes()).to_ascii_lowercase();
        if text.strip_prefix("http://") != Some(authority) {
            let expected = format!("none, or http://{authority}");
            return Err(forbidden("header Origin", expected, text));
        }
    }
    Ok(())
}

/// A page of another site is refused, even where its browser sends no `Origin`.
fn check_site(headers: &HeaderMap) -> Result<(), Problem> {
    for site in headers.get_all(FETCH_SITE) {
        if site != "same-origin" && site != "none" {
            let found = String::from_utf8_lossy(site.as_bytes());
            return Err(forbidden("header Sec-Fetch-Site", "same-origin or none", found));
        }
    }
    Ok(())
}

/// The policy of a page that pages of these origins may show in a frame; `None` if it is not one of a page.
pub fn policy_with_ancestors(policy: &HeaderValue, ancestors: &[String]) -> Option<HeaderValue> {
    let text = policy.to_str().ok().filter(|text| text.contains(UNFRAMED))?;
    let framed = text.replace(UNFRAMED, &format!("frame-ancestors {}", ancestors.join(" ")));
    HeaderValue::from_str(&framed).ok()
}

/// A form of a web page cannot send JSON.
fn check_content_type(method: &Method, headers: &HeaderMap) -> Result<(), Problem> {
    if method == Method::GET || method == Method::HEAD || method == Method::OPTIONS {
        return Ok(());
    }
    let length = headers.get(CONTENT_LENGTH);
    let has_body = headers.contains_key(TRANSFER_ENCODING) || length.is_some_and(|length| length != "0");
    let content_type = headers
        .get(CONTENT_TYPE)
        .map(|value| String::from_utf8_lossy(value.as_bytes()));
    let essence = content_type.as_ref().and_then(|value| value.split(';').next());
    let is_json = essence.is_some_and(|value| value.trim().eq_ignore_ascii_case("application/json"));
    if is_json || (content_type.is_none() && !has_body) {
        return Ok(());
    }
    Err(Problem::expected_found(
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "header Content-Type",
        "application/json",
        content_type.as_deref().unwrap_or("none"),
    ))
}
