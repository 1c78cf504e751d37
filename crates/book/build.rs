//! Packs the pages of the book into one compressed file: the summary first, then its pages in their order.
//!
//! Each begins with a line of a form feed and its path. Comments, which only the tests of the pages read, are left out. In a
//! package of this crate the pages are in `pages`, where `packaging/crates.py` puts them; in the repository they are in `docs`.

use flate2::Compression;
use flate2::write::GzEncoder;
use std::error::Error;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

const SUMMARY: &str = "SUMMARY.md";

fn main() -> Result<(), Box<dyn Error>> {
    let crate_root = std::env::var("CARGO_MANIFEST_DIR")?;
    let packaged = Path::new(&crate_root).join("pages");
    let folder = match packaged.exists() {
        true => packaged,
        false => Path::new(&crate_root).join("../../docs"),
    };
    let summary = fs::read_to_string(folder.join(SUMMARY))?;
    let linked = summary.split("](").skip(1);
    let names = linked.filter_map(|rest| rest.split(')').next());
    let mut archive = String::new();
    for name in std::iter::once(SUMMARY).chain(names) {
        let path = folder.join(name);
        println!("cargo::rerun-if-changed={}", path.display());
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        archive += &format!("\x0c{name}\n{}", without_comments(&text));
    }
    let output = Path::new(&std::env::var("OUT_DIR")?).join("book.gz");
    let mut encoder = GzEncoder::new(File::create(output)?, Compression::best());
    encoder.write_all(archive.as_bytes())?;
    encoder.finish()?;
    Ok(())
}

/// The page without the lines outside of code blocks that are comments.
fn without_comments(page: &str) -> String {
    let mut in_block = false;
    let kept = page.lines().filter(|line| {
        in_block ^= line.trim_start().starts_with("```");
        in_block || !(line.starts_with("<!--") && line.ends_with("-->"))
    });
    kept.map(|line| format!("{line}\n")).collect()
}
