//! Compresses the files of `assets` that the binary carries.

use flate2::Compression;
use flate2::write::GzEncoder;
use std::error::Error;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=assets");
    let output = std::env::var("OUT_DIR")?;
    for name in ["control.html", "robots.html", "docs.html", "openapi.json"] {
        let compressed = File::create(Path::new(&output).join(format!("{name}.gz")))?;
        let mut encoder = GzEncoder::new(compressed, Compression::best());
        encoder.write_all(&fs::read(Path::new("assets").join(name))?)?;
        encoder.finish()?;
    }
    Ok(())
}
