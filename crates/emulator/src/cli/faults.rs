//! `ts3100 faults list` and `ts3100 faults check`: lists the kinds of faults and checks fault specifications.
//!
//! The kinds and their parameters are in the controller's `faults` module; reading fault files is
//! [`ts3100_recording::faults`].

use super::exit::{NEGATIVE, UNUSABLE};
use super::output;
use crate::log::print_error;
use clap::{Args, Subcommand};
use serde_json::{Value, json};
use std::path::PathBuf;
use ts3100_controller::faults::Fault;
use ts3100_controller::variation::VARIATIONS;
use ts3100_recording::faults::{self, FaultFileError};

/// List the kinds of faults, or check fault specifications.
#[derive(Debug, Args)]
pub(super) struct FaultsArgs {
    #[command(subcommand)]
    command: FaultsCommand,
}

#[derive(Debug, Subcommand)]
enum FaultsCommand {
    /// List the kinds of faults with their parameters, and the legal variations
    List {
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Check faults and print them with all their parameters; exit code 1 if one is wrong, 2 if a file cannot be read
    Check {
        /// Faults, KIND:key=value,...
        #[arg(value_name = "SPEC")]
        specs: Vec<String>,
        /// TOML file of faults (repeatable)
        #[arg(long, value_name = "FILE")]
        faults: Vec<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

/// Runs it.
pub(super) fn run(args: &FaultsArgs) -> anyhow::Result<u8> {
    match &args.command {
        FaultsCommand::List { json: true } => output::print(format!("{:#}\n", kinds_json()))?,
        FaultsCommand::List { json: false } => output::print(faults::kinds_text())?,
        FaultsCommand::Check { specs, faults, json } => return check(specs, faults, *json),
    }
    Ok(0)
}

/// Every kind and every variation.
fn kinds_json() -> Value {
    let variations = VARIATIONS.iter().map(
        |variation| json!({ "name": variation.name, "what": variation.summary, "source": variation.source }),
    );
    json!({
        "version": 1,
        "kinds": ts3100_control::fault_kinds(),
        "variations": variations.collect::<Vec<_>>(),
    })
}

fn check(specs: &[String], files: &[PathBuf], as_json: bool) -> anyhow::Result<u8> {
    let of_file = |path: &PathBuf| {
        faults::read(path).map_err(|error| match error {
            FaultFileError::File(_) => (UNUSABLE, error.to_string()),
            FaultFileError::Content { .. } => (NEGATIVE, error.to_string()),
        })
    };
    let of_spec = |spec: &String| match spec.parse() {
        Ok(fault) => Ok(vec![fault]),
        Err(error) => Err((NEGATIVE, format!("{spec}: {error}"))),
    };
    let (mut found, mut exit_code) = (Vec::<Fault>::new(), 0);
    for read in files.iter().map(of_file).chain(specs.iter().map(of_spec)) {
        match read {
            Ok(faults) => found.extend(faults),
            Err((code, error)) => {
                print_error(error);
                exit_code = exit_code.max(code);
            }
        }
    }
    output::print(if as_json {
        let faults: Vec<_> = found.iter().map(faults::fault_json).collect();
        format!("{:#}\n", json!({ "version": 1, "faults": faults }))
    } else {
        found.iter().map(|fault| format!("{fault}\n")).collect()
    })?;
    Ok(exit_code)
}
