//! A recorded run as one HTML file: the page with its styles and scripts, the run as data, and in front of both a summary that
//! needs no script.
//!
//! The file loads nothing: its policy forbids every connection. Scripts are one classic text, because a module that is
//! imported from a data URI costs a browser a parse of its own for each; see [`bundle`].

use crate::data::{Data, data};
use crate::run::Run;
use crate::summary::Summary;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::collections::BTreeSet;
use std::io::Write as _;
use ts3100_control::{ui_names, ui_text};

/// The page, and the views that it loads when they are looked at.
const ROOTS: [&str; 12] = [
    "main.js",
    "recorded.js",
    "embedded.js",
    "timeline.js",
    "jumps.js",
    "arm.js",
    "arm3d.js",
    "program.js",
    "panel.js",
    "pendant.js",
    "lines.js",
    "traffic.js",
];
/// Styles of views that the file does not have.
const LEFT_OUT: [&str; 3] = ["lab.css", "cell.css", "book.css"];
/// Parts of the page that mean nothing before the script fills them.
const PARTS: [&str; 2] = ["fixed", "views"];
/// Nothing is loaded from anywhere.
const POLICY: &str =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

/// Why a page cannot be put together: the page itself is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BundleError {
    #[error("{0}: the page has no such module")]
    Missing(String),
    #[error("{0}: it imports itself over others")]
    Cycle(String),
    #[error("{module}: cannot read the line `{line}`")]
    Line { module: String, line: String },
    #[error("the run has no beginning")]
    Empty,
}

/// The file.
///
/// # Errors
/// The page of this program cannot be put together.
pub fn page(run: &Run) -> Result<String, BundleError> {
    let data = data(run).ok_or(BundleError::Empty)?;
    let index = ui_text("index.html");
    let index = index.replacen(
        "<html lang=\"en\">",
        "<html lang=\"en\" data-recorded=\"embedded\">",
        1,
    );
    let (head, rest) = index.split_once("</head>").unwrap_or((&index, ""));
    let (_, body) = rest.split_once("<body>").unwrap_or(("", rest));
    let (body, _) = body.split_once("<noscript>").unwrap_or((body, ""));
    let is_own = |line: &&str| !line.starts_with("<link") && !line.starts_with("<script");
    let head: Vec<&str> = head.lines().filter(is_own).collect();
    let names = ui_names().filter(|name| name.ends_with(".css") && !LEFT_OUT.contains(name));
    let styles: String = names.map(ui_text).collect();
    // Where scripts are blocked the summary stands alone.
    let mut body = body.to_owned();
    for part in PARTS {
        body = body.replacen(&format!("id=\"{part}\""), &format!("id=\"{part}\" hidden"), 1);
    }
    let shown: String = PARTS
        .iter()
        .map(|part| format!("document.getElementById(\"{part}\").hidden = false;\n"))
        .collect();
    let scripts = shown + &bundle(&ROOTS)?;
    Ok(format!(
        "{}\n<meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n<style>\n{styles}[hidden] {{ display: none !important; }}\n</style>\n</head>\n<body>\n{}{body}\
         <script type=\"text/plain\" id=\"trace\">{}</script>\n<script>\n{scripts}</script>\n</body>\n</html>\n",
        head.join("\n"),
        Summary::new(run).to_html(),
        encoded(&data),
    ))
}

/// The data as the page reads it: compressed, a document of one line and the bytes after it.
fn encoded(data: &Data<'_>) -> String {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    // Into memory, and of words and numbers: neither fails.
    let _ = encoder.write_all(&serde_json::to_vec(data).unwrap_or_default());
    let _ = encoder.write_all(b"\n");
    let _ = encoder.write_all(&data.bytes);
    STANDARD.encode(encoder.finish().unwrap_or_default())
}

/// Modules as one script: each is a function that returns what it exports, after those that it imports.
///
/// # Errors
/// A module is missing, imports itself, or is not written as those of the page are.
pub fn bundle(roots: &[&str]) -> Result<String, BundleError> {
    let mut bundle = Bundle::default();
    for root in roots {
        bundle.add(root)?;
    }
    // A strict function of its own, as a module is.
    Ok(format!(
        "\"use strict\";\n(() => {{\nconst $modules = {{}}, $import = path => Promise.resolve($modules[path.slice(2)]);\n{}}})();\n",
        bundle.text
    ))
}

#[derive(Default)]
struct Bundle {
    text: String,
    done: BTreeSet<String>,
    under_way: Vec<String>,
}

impl Bundle {
    fn add(&mut self, name: &str) -> Result<(), BundleError> {
        if self.done.contains(name) {
            return Ok(());
        }
        if self.under_way.iter().any(|known| known == name) {
            return Err(BundleError::Cycle(name.to_owned()));
        }
        let text = ui_text(name);
        if text.is_empty() {
            return Err(BundleError::Missing(name.to_owned()));
        }
        self.under_way.push(name.to_owned());
        let (mut body, mut exports) = (String::new(), Vec::new());
        for line in text.lines() {
            let wrong = || BundleError::Line {
                module: name.to_owned(),
                line: line.to_owned(),
            };
            if line.starts_with("import {") {
                let (names, from) = imported(line).ok_or_else(wrong)?;
                self.add(from)?;
                body += &format!("const {{{names}}} = $modules[\"{from}\"];\n");
            } else if line.starts_with("import ")
                || line.starts_with("export default")
                || line.starts_with("export {")
            {
                return Err(wrong());
            } else if let Some(declared) = line.strip_prefix("export ") {
                exports.push(exported(declared).ok_or_else(wrong)?.to_owned());
                body += declared;
                body.push('\n');
            } else {
                body += &line.replace("import(", "$import(");
                body.push('\n');
            }
        }
        self.under_way.pop();
        let exports = exports.join(", ");
        self.text += &format!("$modules[\"{name}\"] = (() => {{\n{body}return {{{exports}}};\n}})();\n");
        self.done.insert(name.to_owned());
        Ok(())
    }
}

/// The names and the file of `import {a, b as c} from "./dom.js";`.
fn imported(line: &str) -> Option<(String, &str)> {
    let (names, from) = line.strip_prefix("import {")?.split_once("} from \"./")?;
    Some((names.replace(" as ", ": "), from.strip_suffix("\";")?))
}

/// The name in `async function make(...`.
fn exported(declared: &str) -> Option<&str> {
    let declared = declared.strip_prefix("async ").unwrap_or(declared);
    let kinds = ["function ", "const ", "class "];
    let rest = kinds.iter().find_map(|kind| declared.strip_prefix(kind))?;
    let end = rest.find(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_')?;
    rest.get(..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_module_of_the_page_can_be_bundled() {
        let names: Vec<&str> = ui_names().filter(|name| name.ends_with(".js")).collect();
        let text = bundle(&names).unwrap();
        for line in text.lines() {
            assert!(
                !line.starts_with("import ") && !line.starts_with("export "),
                "{line}"
            );
        }
        let place = |text: &str, name: &str| text.find(&format!("$modules[\"{name}\"] = ")).unwrap();
        assert!(place(&text, "dom.js") < place(&text, "main.js"));
    }

    #[test]
    fn imports_and_exports_are_read() {
        let line = "import {along, chain as links} from \"./links.js\";";
        assert_eq!(
            imported(line),
            Some(("along, chain: links".to_owned(), "links.js"))
        );
        assert_eq!(exported("async function store(robot, file) {"), Some("store"));
        assert_eq!(exported("const place = state => 1;"), Some("place"));
        assert_eq!(exported("class Robot {"), Some("Robot"));
        assert_eq!(exported("let x = 1;"), None);
    }
}
