//! Compresses the files of `assets` that the binary carries, and lists those of the page for people.

use flate2::Compression;
use flate2::write::GzEncoder;
use std::error::Error;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=assets");
    let output = std::env::var("OUT_DIR")?;
    let output = Path::new(&output);
    for name in ["robots.html", "docs.html", "openapi.json"] {
        compress(&Path::new("assets").join(name), output)?;
    }
    let files = fs::read_dir("assets/ui")?.collect::<Result<Vec<_>, _>>()?;
    let mut names = files
        .iter()
        .map(|file| file.file_name().into_string())
        .collect::<Result<Vec<_>, _>>()
        .map_err(|name| format!("assets/ui has a file with a strange name: {}", name.display()))?;
    names.sort();
    let mut list = String::from("[\n");
    for name in &names {
        compress(&Path::new("assets/ui").join(name), output)?;
        list += &format!("    ({name:?}, asset!({name:?})),\n");
    }
    fs::write(output.join("ui.rs"), list + "]\n")?;
    Ok(())
}

/// Writes a file with the ending `.gz` to `output`.
fn compress(path: &Path, output: &Path) -> Result<(), Box<dyn Error>> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let compressed = File::create(output.join(format!("{name}.gz")))?;
    let mut encoder = GzEncoder::new(compressed, Compression::best());
    encoder.write_all(&fs::read(path)?)?;
    encoder.finish()?;
    Ok(())
}
