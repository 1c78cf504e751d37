//! The table of all routes. A resource adds its handlers; the router and the OpenAPI document are both made from
//! the `#[utoipa::path]` at each handler, so they cannot disagree.
//!
//! The error responses that all calls share are added here.

use super::handle::DriverHandle;
use super::problem::Problem;
use axum::Router;
use axum::http::{Method, StatusCode, Uri};
use utoipa::openapi::path::{Operation, PathItem, Paths};
use utoipa::openapi::schema::{AdditionalProperties, Schema};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{Components, Content, Info, License, OpenApi, Ref, RefOr, ResponseBuilder, Tag};
use utoipa::{PartialSchema as _, ToSchema as _};
use utoipa_axum::router::UtoipaMethodRouter;

/// What the OpenAPI document says first.
const DESCRIPTION: &str = "Everything a real controller denies a test: look at all of it, set any of it, move \
    time by hand. Changes go through one queue and are done, with all that follows at once, when the call \
    returns. Durations and moments are seconds of virtual time.";

/// All calls.
pub struct RouteTable {
    router: Router<DriverHandle>,
    paths: Paths,
    schemas: Vec<(String, RefOr<Schema>)>,
    tags: Vec<Tag>,
    tag: String,
}

impl RouteTable {
    /// Empty.
    #[must_use]
    pub fn new() -> RouteTable {
        RouteTable {
            router: Router::new(),
            paths: Paths::new(),
            schemas: vec![(Problem::name().into_owned(), Problem::schema())],
            tags: Vec::new(),
            tag: String::new(),
        }
    }

    /// The calls added from now on belong together.
    #[must_use]
    pub fn group(mut self, name: &str, description: &str) -> RouteTable {
        let mut tag = Tag::new(name);
        tag.description = Some(description.to_owned());
        self.tags.push(tag);
        name.clone_into(&mut self.tag);
        self
    }

    /// Adds what [`utoipa_axum::routes!`] makes of handlers of one path.
    #[must_use]
    pub fn routes(mut self, (schemas, mut paths, methods): UtoipaMethodRouter<DriverHandle>) -> RouteTable {
        self.schemas.extend(schemas);
        for (path, item) in &mut paths.paths {
            self.router = self.router.route(path, methods.clone());
            let PathItem {
                get,
                put,
                post,
                delete,
                ..
            } = item;
            for (operation, changes) in [(get, false), (put, true), (post, true), (delete, true)] {
                if let Some(operation) = operation {
                    operation.tags = Some(vec![self.tag.clone()]);
                    add_error_responses(operation, changes);
                }
            }
        }
        self.paths.merge(paths);
        self
    }

    /// The router, and the document, which is not in it yet and says for all calls whether they need a token.
    pub fn into_parts(self, needs_token: bool) -> (Router<DriverHandle>, OpenApi) {
        let mut info = Info::new("TS3100 control interface", env!("CARGO_PKG_VERSION"));
        info.description = Some(DESCRIPTION.to_owned());
        info.license = Some(License::new("MIT OR Apache-2.0"));
        let mut components = Components::new();
        components.schemas.extend(self.schemas);
        components
            .schemas
            .values_mut()
            .for_each(forbid_additional_properties);
        let scheme = HttpBuilder::new().scheme(HttpAuthScheme::Bearer).build();
        components.add_security_scheme("token", SecurityScheme::Http(scheme));
        let mut document = OpenApi::new(info, self.paths);
        document.components = Some(components);
        document.tags = Some(self.tags);
        let no_scopes: [&str; 0] = [];
        document.security = needs_token.then(|| vec![SecurityRequirement::new("token", no_scopes)]);
        let router = self
            .router
            .fallback(no_such_path)
            .method_not_allowed_fallback(no_such_method);
        (router, document)
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

/// The refusals that every call shares.
fn add_error_responses(operation: &mut Operation, changes: bool) {
    let mut refusals = vec![
        ("400", "The path, the query or the body cannot be read."),
        ("401", "The token is missing or another one."),
        (
            "403",
            "The header `Host`, `Origin` or `Sec-Fetch-Site` tells of a foreign web page.",
        ),
        ("404", "There is no such thing."),
        ("405", "The path has no such method."),
        ("503", "The emulator is ending, or too many listen."),
    ];
    if changes {
        refusals.extend([
            ("408", "The body, or what was waited for, did not come in time."),
            (
                "409",
                "The state of the controller forbids it, or the value does not fit.",
            ),
            ("413", "The body is too large."),
            ("415", "The header `Content-Type` is not `application/json`."),
            ("422", "The body is JSON but not of the form described."),
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

async fn no_such_path(uri: Uri) -> Problem {
    Problem::not_found("path", "a path of /openapi.json", uri.path())
}

async fn no_such_method(method: Method, uri: Uri) -> Problem {
    let expected = format!("a method that /openapi.json lists for {}", uri.path());
    Problem::expected_found(StatusCode::METHOD_NOT_ALLOWED, "method", expected, method)
}
