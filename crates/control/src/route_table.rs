//! The table of all routes. A resource adds its handlers; the router and the OpenAPI document are both made from
//! the `#[utoipa::path]` at each handler, so they cannot disagree.
//!
//! The error responses that all calls share are added here; `document` adds the rest.

use super::document;
use super::problem::Problem;
use axum::Router;
use axum::http::{Method, StatusCode, Uri};
use utoipa::openapi::path::{Operation, Paths};
use utoipa::openapi::schema::Schema;
use utoipa::openapi::{Content, OpenApi, Ref, RefOr, ResponseBuilder, Tag};
use utoipa::{PartialSchema as _, ToSchema as _};
use utoipa_axum::router::UtoipaMethodRouter;

/// All calls.
pub struct RouteTable {
    router: Router,
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
    pub fn routes(mut self, (schemas, mut paths, methods): UtoipaMethodRouter) -> RouteTable {
        self.schemas.extend(schemas);
        for (path, item) in &mut paths.paths {
            self.router = self.router.route(path, methods.clone());
            for (method, operation) in document::operations(item) {
                operation.tags = Some(vec![self.tag.clone()]);
                add_error_responses(operation, method != "GET");
            }
        }
        self.paths.merge(paths);
        self
    }

    /// The router, and the document of its calls. The document itself is not one of them yet.
    pub fn into_parts(self, needs_token: bool) -> (Router, OpenApi) {
        let document = document::build(self.paths, self.schemas, self.tags, needs_token);
        let router = self
            .router
            .fallback(no_such_path)
            .method_not_allowed_fallback(no_such_method);
        (router, document)
    }
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

async fn no_such_path(uri: Uri) -> Problem {
    Problem::not_found("path", "a path of /openapi.json", uri.path())
}

async fn no_such_method(method: Method, uri: Uri) -> Problem {
    let expected = format!("a method that /openapi.json lists for {}", uri.path());
    let told = format!(
        "{} does not accept {method}; /openapi.json lists its methods",
        uri.path()
    );
    Problem::expected_found(StatusCode::METHOD_NOT_ALLOWED, "method", expected, method).told(told)
}
