//! Parts of the table of all calls, which is in the head of the crate. The router and the OpenAPI document are both
//! made from the [`call!`] before each handler, so they cannot disagree.
//!
//! The binary carries the document as a file. Only the test that compares them makes it (`tests/document.rs`), so
//! everything of `utoipa` is compiled for tests alone.

use super::problem::Problem;
use axum::Router;
use axum::http::{Method, StatusCode, Uri};
use axum::routing::MethodRouter;

/// A call: what [`calls!`] makes of a handler.
pub struct Call {
    /// The path, with its parameters in braces.
    pub path: &'static str,
    /// The handler by its method.
    pub methods: MethodRouter,
    /// The module of its resource.
    pub resource: &'static str,
    /// The part of the document that describes it.
    #[cfg(test)]
    pub described: utoipa::openapi::OpenApi,
}

/// Comes before a handler: its documentation, method and path, and parameters, body and responses in the words of
/// `utoipa::path`.
///
/// It makes a module with the name of the handler, whose `call` is the [`Call`].
macro_rules! call {
    ($(#[$doc:meta])* $handler:ident = $method:ident($path:literal, $($described:tt)*)) => {
        $(#[$doc])*
        pub mod $handler {
            pub fn call(resource: &'static str) -> $crate::route_table::Call {
                $crate::route_table::Call {
                    path: $path,
                    methods: axum::routing::$method(super::$handler),
                    resource,
                    #[cfg(test)]
                    described: <Described as utoipa::OpenApi>::openapi(),
                }
            }

            #[cfg(test)]
            #[derive(utoipa::OpenApi)]
            #[openapi(paths($handler))]
            struct Described;

            #[cfg(test)]
            #[allow(unused_imports, reason = "not every description names a type of its file")]
            use super::*;

            $(#[$doc])*
            #[cfg(test)]
            #[expect(dead_code, reason = "it only bears the description")]
            #[utoipa::path($method, path = $path, $($described)*)]
            fn $handler() {}
        }
    };
}
pub(crate) use call;

/// Makes a [`Call`] of each handler of these modules.
macro_rules! calls {
    ($($module:ident: $($handler:ident)+;)+) => {
        vec![$($($module::$handler::call(stringify!($module))),+),+]
    };
}
pub(crate) use calls;

/// The router of these calls.
pub fn router(calls: Vec<Call>) -> Router {
    let add = |router: Router, call: Call| router.route(call.path, call.methods);
    calls.into_iter().fold(Router::new(), add)
}

/// Has a [`Problem`] answer what no route does. Call it last: a route that comes later would refuse a method without a word.
pub fn with_refusals(router: Router) -> Router {
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
