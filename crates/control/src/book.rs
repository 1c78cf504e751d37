//! `/book/`: the documentation for browsers. Pages, search and the explanation of codes come from `ts3100-book`; here they get a
//! heading, a list of the pages and links between neighbours. No script runs on these pages, and nothing is loaded from elsewhere.

use axum::Router;
use axum::extract::{Path, Query};
use axum::http::StatusCode;
use axum::http::header::{CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderValue};
use axum::response::{IntoResponse as _, Redirect, Response};
use axum::routing::get;
use serde::Deserialize;
use std::fmt::Write as _;
use ts3100_book::{Book, Page, Passage, book, escaped};

/// Where it begins.
const ROOT: &str = "/book";
/// Page that begins the book.
const FIRST: &str = "introduction";
/// What a page may load and do: the styles of the emulator, and a search there.
const POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; img-src 'self'; style-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'",
);

/// Whether a path is one of the book, which shows nothing of a robot.
pub fn is_in_book(path: &str) -> bool {
    path.strip_prefix(ROOT)
        .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

/// The router with the pages of the book.
pub fn with_book(router: Router) -> Router {
    router
        // Relative, so that it holds below /robots/NAME and behind a proxy.
        .route("/book", get(async || Redirect::permanent("book/")))
        .route("/book/", get(first))
        .route("/book/explain/{code}", get(explain))
        .route("/book/{*path}", get(page))
}

/// Query of the first page.
#[derive(Deserialize)]
struct Search {
    /// Words to search for.
    #[serde(default)]
    search: String,
}

/// The first page, or the results of a search.
async fn first(Query(Search { search }): Query<Search>) -> Response {
    let words = search.trim().to_owned();
    let layout = Layout {
        words,
        ..Layout::new(0)
    };
    if !layout.words.is_empty() {
        return layout.results();
    }
    match book().page(FIRST) {
        Some(page) => layout.page(page),
        None => layout.missing(FIRST, ""),
    }
}

async fn page(Path(path): Path<String>) -> Response {
    let layout = Layout::new(path.matches('/').count());
    let path = path.trim_end_matches('/');
    if let Some(document) = book().document(path) {
        return ([(CONTENT_TYPE, "application/json")], document).into_response();
    }
    let path = path
        .strip_suffix(".html")
        .or(path.strip_suffix(".md"))
        .unwrap_or(path);
    match book().page(path) {
        Some(page) => layout.page(page),
        None => match book().find(path) {
            // Another name of a page: the links of the page are relative to its own path.
            Ok(found) => Redirect::to(&format!("{}{}", layout.root, found.topic())).into_response(),
            Err(error) => layout.missing(path, &error.to_string()),
        },
    }
}

async fn explain(Path(code): Path<String>) -> Response {
    let layout = Layout::new(1);
    let passages = book().explain(&code);
    if passages.is_empty() {
        let hint = book().unknown_code_hint(&code);
        return layout.missing(
            &code,
            &format!("cannot explain `{code}`: the documentation has no such code{hint}"),
        );
    }
    let mut main = String::new();
    for passage in &passages {
        let _ = write!(
            main,
            "<p class=\"from\">{}</p>\n{}",
            layout.link(passage),
            passage.html(&layout.root)
        );
    }
    layout.response(StatusCode::OK, &code, "", &main)
}

/// What surrounds the text of a page.
struct Layout {
    book: &'static Book,
    /// Leads from the page to the beginning of the book.
    root: String,
    /// What was searched for.
    words: String,
}

impl Layout {
    /// The layout of a page below this many folders.
    fn new(depth: usize) -> Layout {
        let root = match depth {
            0 => "./".to_owned(),
            depth => "../".repeat(depth),
        };
        let book = book();
        let words = String::new();
        Layout { book, root, words }
    }

    fn page(&self, page: &Page) -> Response {
        let mut main = page.passage().html(&self.root);
        let pages = self.book.pages();
        let at = pages.iter().position(|other| other.path == page.path);
        let previous = at.and_then(|at| pages.get(at.checked_sub(1)?));
        let next = at.and_then(|at| pages.get(at + 1));
        main += "<p class=\"neighbours\">";
        for (neighbour, relation) in [(previous, "prev"), (next, "next")] {
            if let Some(Page { path, title, .. }) = neighbour {
                let (root, title) = (&self.root, escaped(title));
                let _ = writeln!(main, "<a rel=\"{relation}\" href=\"{root}{path}\">{title}</a>");
            }
        }
        main += "</p>\n";
        self.response(StatusCode::OK, &page.title, &page.path, &main)
    }

    fn results(&self) -> Response {
        let words = &self.words;
        let hits = self.book.search(words);
        let count = match hits.len() {
            1 => "1 section".to_owned(),
            count => format!("{count} sections"),
        };
        let mut main = format!("<h1>{}</h1>\n<p>{count}</p>\n<dl>\n", escaped(words));
        for hit in &hits {
            let _ = writeln!(
                main,
                "<dt>{}</dt><dd>{}</dd>",
                self.link(&hit.passage),
                escaped(&hit.line)
            );
        }
        self.response(StatusCode::OK, words, "", &(main + "</dl>\n"))
    }

    fn missing(&self, path: &str, error: &str) -> Response {
        let main = format!(
            "<h1>{}</h1>\n<p>{}</p>\n",
            escaped(path),
            escaped(error.trim_start_matches("error: "))
        );
        self.response(StatusCode::NOT_FOUND, path, "", &main)
    }

    /// A link to a passage: its title, and the page that it is on.
    fn link(&self, passage: &Passage<'_>) -> String {
        let (root, topic) = (&self.root, passage.topic());
        let (title, page) = (escaped(passage.title), escaped(&passage.page.title));
        match title == page {
            true => format!("<a href=\"{root}{topic}\">{title}</a>"),
            false => format!("<a href=\"{root}{topic}\">{page}: {title}</a>"),
        }
    }

    /// The list of the pages.
    fn contents(&self, path: &str) -> String {
        let mut list = String::new();
        let mut part = "";
        for page in self.book.pages() {
            if page.part != part {
                part = &page.part;
                let _ = writeln!(list, "<h2>{}</h2>", escaped(part));
            }
            let (root, title, depth) = (&self.root, escaped(&page.title), page.depth);
            let current = if page.path == path {
                " aria-current=\"page\""
            } else {
                ""
            };
            let _ = writeln!(
                list,
                "<a data-depth=\"{depth}\"{current} href=\"{root}{}\">{title}</a>",
                page.path
            );
        }
        list
    }

    fn response(&self, status: StatusCode, title: &str, path: &str, main: &str) -> Response {
        let (root, words) = (&self.root, escaped(&self.words));
        let (title, contents) = (escaped(title), self.contents(path));
        let version = env!("CARGO_PKG_VERSION");
        let document = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<title>{title} - ts3100</title>\n\
             <link rel=\"icon\" href=\"{root}../ui/icon.svg\">\n<link rel=\"stylesheet\" href=\"{root}../ui/style.css\">\n<link rel=\"stylesheet\" href=\"{root}../ui/book.css\">\n\
             </head>\n<body>\n<header id=\"top\">\n<h1><a href=\"{root}../\">ts3100</a></h1>\n\
             <form role=\"search\" action=\"{root}\"><input type=\"search\" name=\"search\" aria-label=\"Search\" value=\"{words}\" required> \
             <button>Search</button></form>\n<nav aria-label=\"Documentation\"><a href=\"{root}\">Book</a> <a href=\"{root}../docs\">API</a> <span id=\"version\">{version}</span></nav>\n</header>\n\
             <main>\n{main}</main>\n<nav aria-label=\"Pages\">\n{contents}</nav>\n</body>\n</html>\n"
        );
        let headers = [
            (CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")),
            (CONTENT_SECURITY_POLICY, POLICY),
        ];
        (status, headers, document).into_response()
    }
}
