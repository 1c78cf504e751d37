//! Lines of the user files executed, in the tracefile format of lcov that `genhtml` and coverage services read.
//! A file of the drive that is not a file of the PC is written beside the tracefile, so that it can be shown.

use super::write_report;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use ts3100_controller::statement_coverage::FileVersion;
use ts3100_controller::{Config, StatementCoverage};
use ts3100_driver::files::{self, PathError, cannot};
use ts3100_driver::pc_file::{MAX_PC_FILE, drive_content, drive_name};
use ts3100_proto::name::FileName;
use ts3100_proto::parameter::LineEnd;

/// Writes the tracefile, and the sources of its files where there are none yet. `loaded` are files of the PC.
///
/// # Errors
/// A file that cannot be written.
pub fn write(
    path: &Path,
    executed: &StatementCoverage,
    config: &Config,
    loaded: &[PathBuf],
) -> Result<(), PathError> {
    let mut trace = String::from("TN:ts3100\n");
    for version in executed.versions() {
        let Some(record) = record(version, config) else {
            continue;
        };
        let source = match find_source(version, loaded) {
            Some(path) => path,
            None => write_source(path, version)?,
        };
        let _ = writeln!(trace, "SF:{}", source.display());
        trace.push_str(&record);
    }
    write_report(path, &trace)
}

/// What the tracefile says of one content of a file, but for its name; `None` for one that is no program.
fn record(version: &FileVersion, config: &Config) -> Option<String> {
    if FileName::parse(&version.name).is_ok_and(|name| name.is_parameter()) {
        return None;
    }
    let source = String::from_utf8_lossy(&version.content);
    let program = config.compile(&source).program?;
    let count = |line: &u32| version.lines.get(line).copied().unwrap_or_default();
    let mut record = String::new();
    let programs = program.program_lines();
    for (name, line) in &programs {
        let _ = writeln!(record, "FN:{line},{name}");
    }
    for (name, line) in &programs {
        let _ = writeln!(record, "FNDA:{},{name}", count(line));
    }
    let called = programs.iter().filter(|(_, line)| count(line) > 0).count();
    let _ = writeln!(record, "FNF:{}\nFNH:{called}", programs.len());
    let lines = program.statement_lines();
    for line in &lines {
        let _ = writeln!(record, "DA:{line},{}", count(line));
    }
    let hit = lines.iter().filter(|line| count(line) > 0).count();
    let _ = writeln!(record, "LF:{}\nLH:{hit}\nend_of_record", lines.len());
    Some(record)
}

/// The file of the PC that has this content.
fn find_source(version: &FileVersion, loaded: &[PathBuf]) -> Option<PathBuf> {
    let has_it = |path: &&PathBuf| {
        drive_name(path).is_ok_and(|name| name == version.name)
            && files::read(path, MAX_PC_FILE).is_ok_and(|bytes| {
                [LineEnd::Cr, LineEnd::Lf]
                    .into_iter()
                    .any(|line_end| drive_content(&bytes, line_end) == version.content)
            })
    };
    let path = loaded.iter().find(has_it)?;
    std::path::absolute(path).ok()
}

/// Writes the content into a directory beside the tracefile: `run.info.src/PICK`, further contents `PICK.2`.
fn write_source(trace: &Path, version: &FileVersion) -> Result<PathBuf, PathError> {
    let mut directory = trace.as_os_str().to_owned();
    directory.push(".src");
    let directory = std::path::absolute(&directory).unwrap_or_else(|_| PathBuf::from(directory));
    files::make_directory(&directory).map_err(cannot("write", &directory))?;
    let name = match version.number {
        1 => version.name.clone(),
        number => format!("{}.{number}", version.name),
    };
    let path = directory.join(name);
    let text = String::from_utf8_lossy(&version.content);
    write_report(&path, &text.replace("\r\n", "\n").replace('\r', "\n"))?;
    Ok(path)
}
