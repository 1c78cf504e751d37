//! How the optimised binary is linked. What only unwinding needs is left out, a tenth of it: a panic ends the process
//! there. And the binary has a fixed address, as programs of Go have: moving its twelve thousand pointers to another one
//! takes a fifth of a start.

use std::error::Error;
use std::path::Path;
use std::{env, fs};

/// The tables of unwinding, but for those of the C runtime, which some linkers insist on.
const SCRIPT: &str = "\
SECTIONS { /DISCARD/ : { *(EXCLUDE_FILE(*crt*.o *crtbegin*.o *crtend*.o) .eh_frame) } }
INSERT AFTER .text;
";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if is("CARGO_CFG_TARGET_OS", "linux") && is("CARGO_CFG_TARGET_ENV", "gnu") && is("PROFILE", "release") {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
    // With debug information the tables serve profilers.
    if is("CARGO_CFG_TARGET_OS", "linux") && is("PROFILE", "release") && is("DEBUG", "false") {
        let script = Path::new(&env::var("OUT_DIR")?).join("no-unwinding.ld");
        fs::write(&script, SCRIPT)?;
        println!("cargo::rustc-link-arg-bins=-Wl,--no-eh-frame-hdr");
        println!("cargo::rustc-link-arg-bins=-Wl,-T,{}", script.display());
    }
    Ok(())
}
