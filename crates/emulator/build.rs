//! How the optimised binary is linked. What only unwinding needs is left out, a tenth of it: a panic ends the process
//! there. The rest is about a quick start: the binary has a fixed address, as programs of Go have, because moving its
//! twelve thousand pointers to another one takes a fifth of a start; and it loads one library less.

use std::error::Error;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// The tables of unwinding, but for those of the C runtime, which some linkers insist on, and of the unwinder itself: a
/// backtrace begins in it, and it ends the process if it cannot find its own.
const SCRIPT: &str = "\
SECTIONS { /DISCARD/ : { *(EXCLUDE_FILE(*crt*.o *crtbegin*.o *crtend*.o *libgcc_eh.a:*) .eh_frame) } }
INSERT AFTER .text;
";
/// LLD drops the tables of all files or of none.
const SELECTIVE_LINKER: &str = "-fuse-ld=bfd";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if !is("CARGO_CFG_TARGET_OS", "linux") || !is("PROFILE", "release") {
        return Ok(());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let gnu = is("CARGO_CFG_TARGET_ENV", "gnu");
    let static_unwinder = gnu && links_static_unwinder(&out);
    if gnu {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
    if static_unwinder {
        // In place of libgcc_s, which the standard library would have loaded.
        println!("cargo::rustc-link-lib=gcc_eh");
        println!("cargo::rustc-link-arg-bins={SELECTIVE_LINKER}");
    }
    // With debug information the tables serve profilers.
    if is("DEBUG", "false") {
        let script = out.join("no-unwinding.ld");
        fs::write(&script, SCRIPT)?;
        if !static_unwinder {
            println!("cargo::rustc-link-arg-bins=-Wl,--no-eh-frame-hdr");
        }
        println!("cargo::rustc-link-arg-bins=-Wl,-T,{}", script.display());
    }
    Ok(())
}

/// Whether this machine has the unwinder of GCC as a static library, and the linker that keeps its tables alone.
fn links_static_unwinder(out: &Path) -> bool {
    println!("cargo::rerun-if-env-changed=RUSTC_LINKER");
    let linker = env::var_os("RUSTC_LINKER").unwrap_or_else(|| OsString::from("cc"));
    let words = format!("{SELECTIVE_LINKER} -shared -x c /dev/null -lgcc_eh -o");
    let mut probe = Command::new(linker);
    let probed = probe.args(words.split(' ')).arg(out.join("probe")).output();
    probed.is_ok_and(|probed| probed.status.success())
}
