//! Parts of the table of all calls, which is in the head of the crate. The router and the OpenAPI document are both
//! made from the `#[utoipa::path]` at each handler, so they cannot disagree.
//!
//! The binary carries the document as a file; only the test that compares them makes it (`tests/document.rs`).

use super::problem::Problem;
use axum::Router;
use axum::handler::Handler;
use axum::http::{Method, StatusCode, Uri};
use axum::routing::MethodRouter;
use utoipa::openapi::HttpMethod;
use utoipa_axum::PathItemExt as _;

/// A call: what [`calls!`] makes of a handler.
pub struct Call {
    /// The path, with its parameters in braces.
    pub path: String,
    /// The handler by its method.
    pub methods: MethodRouter,
    /// The module of its resource.
    #[cfg(test)]
    pub resource: &'static str,
    /// The same for the document.
    #[cfg(test)]
    pub described: utoipa_axum::router::UtoipaMethodRouter,
}

/// Makes a [`Call`] of a handler with `#[utoipa::path]`, in this group of the document.
macro_rules! call {
    ($group:expr, $module:ident::$handler:ident) => {
        utoipa_axum::paste! {
            $crate::route_table::Call {
                path: <$module::[<__path_ $handler>] as utoipa::Path>::path(),
                methods: $crate::route_table::methods(
                    &<$module::[<__path_ $handler>] as utoipa::Path>::methods(),
                    &$module::$handler,
                ),
                #[cfg(test)]
                resource: $group,
                #[cfg(test)]
                described: utoipa_axum::routes!($module::$handler),
            }
        }
    };
}
pub(crate) use call;

/// Makes a [`Call`] of each handler of these modules.
macro_rules! calls {
    ($($module:ident: $($handler:ident)+;)+) => {
        vec![$($($crate::route_table::call!(stringify!($module), $module::$handler)),+),+]
    };
}
pub(crate) use calls;

/// The handler by the methods that its `#[utoipa::path]` names.
pub fn methods<T: 'static>(names: &[HttpMethod], handler: &impl Handler<T, ()>) -> MethodRouter {
    names.iter().fold(MethodRouter::new(), |methods, name| {
        methods.on(name.to_method_filter(), handler.clone())
    })
}

/// The router of these calls.
pub fn router(calls: Vec<Call>) -> Router {
    let add = |router: Router, call: Call| router.route(&call.path, call.methods);
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
