//! What the table of all routes is made of. A resource lists its handlers; the router and the OpenAPI document are both made
//! from the `#[utoipa::path]` at each handler, so they cannot disagree.
//!
//! The binary carries the document as a file; only the test that compares them makes it (`tests/document.rs`).

use super::problem::Problem;
use axum::Router;
use axum::extract::Request;
use axum::http::{Method, StatusCode, Uri};
use axum::response::Response;
use axum::routing::MethodRouter;
use futures_util::future::BoxFuture;

/// A handler with its extractors, of one type for all calls: the router is compiled for it once, and not for each.
pub type AnyHandler = fn(Request) -> BoxFuture<'static, Response>;

/// The handlers of one path: what [`routes!`] makes of them.
pub struct PathRoutes {
    /// The path, with its parameters in braces.
    pub path: String,
    /// The handlers by their methods.
    pub methods: MethodRouter,
    /// The same for the document.
    #[cfg(test)]
    pub described: utoipa_axum::router::UtoipaMethodRouter,
}

/// Makes [`PathRoutes`] of handlers with `#[utoipa::path]` that share a path.
macro_rules! routes {
    ($first:ident $(, $more:ident)*) => {{
        use utoipa::Path as _;
        let methods = axum::routing::MethodRouter::new();
        utoipa_axum::paste! {
            let path = [<__path_ $first>]::path();
            let methods = $crate::route_table::routes!(@add [<__path_ $first>] $first methods);
            $(let methods = $crate::route_table::routes!(@add [<__path_ $more>] $more methods);)*
        }
        $crate::route_table::PathRoutes {
            path,
            methods,
            #[cfg(test)]
            described: utoipa_axum::routes!($first $(, $more)*),
        }
    }};
    (@add $description:ident $handler:ident $methods:ident) => {
        $description::methods().iter().fold($methods, |methods, method| {
            let handler: $crate::route_table::AnyHandler =
                |request| Box::pin(axum::handler::Handler::call($handler, request, ()));
            methods.on(utoipa_axum::PathItemExt::to_method_filter(method), handler)
        })
    };
}
pub(crate) use routes;

/// The router of these calls.
pub fn router(calls: Vec<PathRoutes>) -> Router {
    let add = |router: Router, routes: PathRoutes| router.route(&routes.path, routes.methods);
    let router = calls.into_iter().fold(Router::new(), add);
    router
        .fallback(no_such_path)
        .method_not_allowed_fallback(no_such_method)
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
