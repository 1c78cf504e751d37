//! `ts3100 config schema`: the JSON schemas of the files that people write.

use super::output;
use crate::config::schema::{faults, scenario, schema};
use clap::{Args, Subcommand, ValueEnum};

/// Print the JSON schemas of configuration, scenarios and faults.
#[derive(Debug, Args)]
pub(super) struct ConfigArgs {
    #[command(subcommand)]
    what: ConfigCommand,
}

#[derive(Debug, Subcommand)]
enum ConfigCommand {
    /// Print a JSON schema, for editors
    Schema {
        /// Schema to print
        #[arg(value_enum, default_value_t = SchemaOf::Configuration, value_name = "FILE")]
        of: SchemaOf,
    },
}

/// A file that has a schema.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum SchemaOf {
    /// The file of --config
    Configuration,
    /// The file of --scenario
    Scenario,
    /// The file of --faults
    Faults,
}

/// Prints it.
pub(super) fn run(args: &ConfigArgs) -> anyhow::Result<u8> {
    let ConfigCommand::Schema { of } = args.what;
    let document = match of {
        SchemaOf::Configuration => schema(),
        SchemaOf::Scenario => scenario::schema(),
        SchemaOf::Faults => faults::schema(),
    };
    output::print(format!("{document:#}\n")).map(|()| 0)
}
