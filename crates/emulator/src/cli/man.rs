//! `ts3100 man`: writes the manual pages, one for each subcommand, from the definition of the command line.

use super::help;
use anyhow::Context as _;
use clap::{Args, Command};
use clap_mangen::Man;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The end of a message where `--install` finds no place.
const WAY_OUT: &str = "; give a directory, as in `ts3100 man ~/.local/share/man/man1`";

/// Write the manual pages, one for each subcommand.
#[derive(Debug, Args)]
pub(super) struct ManArgs {
    /// Directory to write them to; it is created
    #[arg(value_name = "DIR", required_unless_present = "install")]
    directory: Option<PathBuf>,
    /// Write them to where `man` looks for those of programs in the directory of this one
    #[arg(long, conflicts_with = "directory")]
    install: bool,
}

/// Writes the pages; the exit code.
pub(super) fn run(args: &ManArgs) -> anyhow::Result<u8> {
    let directory = match &args.directory {
        Some(directory) => directory.clone(),
        None => beside_the_program()?,
    };
    let way_out = if args.install { WAY_OUT } else { "" };
    let cannot_write = || {
        format!(
            "cannot write the manual pages to {}{way_out}",
            directory.display()
        )
    };
    fs::create_dir_all(&directory).with_context(cannot_write)?;
    let mut program = super::definition().disable_help_subcommand(true);
    program.build();
    write_pages(&program, &directory).with_context(cannot_write)?;
    if args.install {
        super::output::print(format!("{}: try `man ts3100`\n", directory.display()))?;
    }
    Ok(0)
}

/// The directory for manual pages that belongs to that of the program: `share/man` beside `bin`, as of `~/.cargo/bin`.
fn beside_the_program() -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().context("cannot find the program")?;
    let folder = program.parent().filter(|folder| folder.ends_with("bin"));
    let prefix = folder.and_then(Path::parent).with_context(|| {
        format!(
            "{} is not in a directory `bin`, so `man` would not find its pages{WAY_OUT}",
            program.display()
        )
    })?;
    Ok(prefix.join("share/man/man1"))
}

/// Writes the page of a command and those of its subcommands.
fn write_pages(command: &Command, directory: &Path) -> io::Result<()> {
    let visible = command.get_subcommands().filter(|inner| !inner.is_hide_set());
    for inner in visible {
        write_pages(inner, directory)?;
    }
    let name = command.get_display_name().unwrap_or_else(|| command.get_name());
    let mut page = Vec::new();
    write_page(command, &mut page)?;
    fs::write(directory.join(format!("{name}.1")), page)
}

fn write_page(command: &Command, page: &mut Vec<u8>) -> io::Result<()> {
    let man = Man::new(command.clone());
    man.render_title(page)?;
    man.render_name_section(page)?;
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage:").trim();
    write!(page, ".SH SYNOPSIS\n.nf\n{}\n.fi\n", escaped(usage))?;
    man.render_description_section(page)?;
    man.render_options_section(page)?;
    if command.has_subcommands() {
        man.render_subcommands_section(page)?;
    }
    let examples = help::examples(command);
    if !examples.is_empty() {
        let examples = escaped(&examples.join("\n"));
        write!(page, ".SH EXAMPLES\n.nf\n{examples}\n.fi\n")?;
    }
    let documentation = escaped(&help::documentation(command));
    write!(page, ".SH SEE ALSO\n.nf\n{documentation}\n.fi\n")?;
    match command.get_version() {
        Some(_) => man.render_version_section(page),
        None => Ok(()),
    }
}

/// Lines as they are: no requests, and hyphens that can be copied.
fn escaped(lines: &str) -> String {
    let line = |line: &str| {
        let line = line.trim_start().replace('\\', "\\e").replace('-', "\\-");
        format!("\\&{line}")
    };
    lines.lines().map(line).collect::<Vec<_>>().join("\n")
}
