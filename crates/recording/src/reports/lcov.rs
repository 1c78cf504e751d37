//! Lines of the user files executed, in the tracefile format of lcov that `genhtml` and coverage services read.
//! A file of the drive that is not a file of the PC is written beside the tracefile, so that it can be shown.

use super::write_report;
use std::collections::BTreeSet;
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
    let names = executed.versions().iter().map(|version| version.name.clone());
    let mut taken: BTreeSet<String> = names.collect();
    for version in executed.versions() {
        let Some(record) = record(version, config) else {
            continue;
        };
        let source = match find_source(version, loaded) {
            Some(path) => path,
            None => write_source(path, version, &mut taken)?,
        };
        let _ = writeln!(trace, "SF:{}", source.display());
        trace.push_str(&record);
    }
    write_report(path, &trace)
}

/// The record of one version of a file without its name; `None` for a file that is not a program.
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
        // `run` takes files, too, whose names are none of the drive.
        drive_name(path).map_or(true, |name| name == version.name)
            && files::read(path, MAX_PC_FILE).is_ok_and(|bytes| {
                [LineEnd::Cr, LineEnd::Lf]
                    .into_iter()
                    .any(|line_end| drive_content(&bytes, line_end) == version.content)
            })
    };
    let path = loaded.iter().find(has_it)?;
    std::path::absolute(path).ok()
}

/// Writes the content into a directory beside the tracefile.
fn write_source(
    trace: &Path,
    version: &FileVersion,
    taken: &mut BTreeSet<String>,
) -> Result<PathBuf, PathError> {
    let mut directory = trace.as_os_str().to_owned();
    directory.push(".src");
    let directory = std::path::absolute(&directory).unwrap_or_else(|_| PathBuf::from(directory));
    files::make_directory(&directory).map_err(cannot("write", &directory))?;
    let path = directory.join(source_name(version, taken));
    let text = String::from_utf8_lossy(&version.content);
    write_report(&path, &text.replace("\r\n", "\n").replace('\r', "\n"))?;
    Ok(path)
}

/// The name of a content beside the tracefile: `PICK`, further contents `PICK.2`, or the next number that is free. `taken`
/// holds the names of all files, because one of them may be called `PICK.2`.
fn source_name(version: &FileVersion, taken: &mut BTreeSet<String>) -> String {
    if version.number == 1 {
        return version.name.clone();
    }
    let mut number = version.number;
    loop {
        let name = format!("{}.{number}", version.name);
        if taken.insert(name.clone()) {
            return name;
        }
        number = number.saturating_add(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_content_has_a_name_of_its_own() {
        let mut executed = StatementCoverage::default();
        for (name, content) in [
            ("PICK", "1"),
            ("PICK", "2"),
            ("PICK.2", "1"),
            ("PICK", "3"),
            ("PICK.2", "2"),
        ] {
            executed.note_stored(name, content.as_bytes());
        }
        let versions = executed.versions();
        let mut taken = versions.iter().map(|version| version.name.clone()).collect();
        let names: Vec<String> = versions
            .iter()
            .map(|version| source_name(version, &mut taken))
            .collect();
        assert_eq!(names, ["PICK", "PICK.3", "PICK.2", "PICK.4", "PICK.2.2"]);
    }
}
