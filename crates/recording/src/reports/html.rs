//! Coverage of the permission tables as one self-contained HTML page: a table for each port, commands by modes.

use super::coverage::{CellReport, CoverageReport};
use std::fmt::Write as _;
use ts3100_book::escaped;

const STYLE: &str = "body{font:15px system-ui,sans-serif;margin:2rem;color:#222;background:#fff}\
    table{border-collapse:collapse;margin:1rem 0 2rem}th,td{border:1px solid #bbb;padding:.25rem .6rem;\
    text-align:left}th{background:#eee}td.all{background:#c8ecc8}td.some{background:#fff1b8}\
    td.none{background:#f6caca}td.out{background:#f4f4f4;color:#777}\
    @media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}th{background:#333}\
    td.all{background:#1e5a2a}td.some{background:#6b5a10}td.none{background:#6b2020}td.out{background:#222}}";

pub(super) fn page(report: &CoverageReport) -> String {
    let mut page = String::from("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n");
    let _ = writeln!(
        page,
        "<title>ts3100 coverage</title><style>{STYLE}</style></head><body>"
    );
    let _ = writeln!(
        page,
        "<h1>Coverage of the permission tables: {:.1} %</h1>\n<p>{} of {} cells: a command in a master mode on a \
         port, and its outcome. <i>served</i>: OK or FL; <i>not-valid</i>: NG because of tables 5.3 and 5.4; \
         <i>refused</i>: NG for another reason, which does not count. Green: every outcome the tables allow was \
         seen; yellow: some; red: none.</p>",
        report.percent, report.reached, report.reachable
    );
    for port in distinct(&report.cells, |cell| &cell.port) {
        let cells: Vec<&CellReport> = report.cells.iter().filter(|cell| &cell.port == port).collect();
        table(&mut page, port, &cells);
    }
    page.push_str("</body></html>\n");
    page
}

fn table(page: &mut String, port: &str, cells: &[&CellReport]) {
    let countable = cells.iter().filter(|cell| cell.reachable);
    let reached = countable.clone().filter(|cell| cell.count > 0).count();
    let modes = distinct(cells.iter().copied(), |cell| &cell.mode);
    let _ = writeln!(
        page,
        "<h2>{}: {reached} of {}</h2>\n<table><tr><th>Command</th>",
        escaped(port),
        countable.count()
    );
    for mode in &modes {
        let _ = writeln!(page, "<th>{}</th>", escaped(mode));
    }
    page.push_str("</tr>\n");
    for command in distinct(cells.iter().copied(), |cell| &cell.command) {
        let _ = write!(page, "<tr><th>{}</th>", escaped(command));
        for mode in &modes {
            let here = cells
                .iter()
                .filter(|cell| &cell.command == command && cell.mode == **mode);
            cell(page, &here.copied().collect::<Vec<_>>());
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table>\n");
}

/// One command in one mode.
fn cell(page: &mut String, outcomes: &[&CellReport]) {
    let wanted = outcomes.iter().filter(|outcome| outcome.reachable);
    let missing = wanted.clone().filter(|outcome| outcome.count == 0).count();
    let class = match (wanted.count(), missing) {
        (0, _) => "out",
        (_, 0) => "all",
        (wanted, missing) if wanted == missing => "none",
        _ => "some",
    };
    let words = outcomes.iter().map(|outcome| {
        let times = match outcome.count {
            0 => "-".to_owned(),
            count => count.to_string(),
        };
        format!("{} {times}", escaped(&outcome.outcome))
    });
    let words: Vec<String> = words.collect();
    let _ = write!(page, "<td class=\"{class}\">{}</td>", words.join("<br>"));
}

/// The different words in the order in which they come.
fn distinct<'a>(
    cells: impl IntoIterator<Item = &'a CellReport>,
    word: impl Fn(&'a CellReport) -> &'a String,
) -> Vec<&'a String> {
    let mut words: Vec<&String> = Vec::new();
    for cell in cells {
        let word = word(cell);
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(outcome: &str, count: u64, reachable: bool) -> CellReport {
        CellReport {
            port: "IP0".to_owned(),
            command: "UL".to_owned(),
            mode: "EXT <ETHER>".to_owned(),
            outcome: outcome.to_owned(),
            count,
            reachable,
        }
    }

    #[test]
    fn a_cell_shows_by_its_colour_what_is_missing() {
        for (served, not_valid, class) in [(0, 0, "none"), (3, 0, "some"), (3, 1, "all")] {
            let report = CoverageReport::merged([CoverageReport {
                version: 1,
                reached: 0,
                reachable: 0,
                percent: 0.0,
                cells: vec![
                    cell("served", served, true),
                    cell("not-valid", not_valid, true),
                    cell("refused", 2, false),
                ],
            }]);
            let page = page(&report);
            assert!(page.contains(&format!("<td class=\"{class}\">")), "{page}");
            assert!(
                page.contains("refused 2") && page.contains("EXT &lt;ETHER&gt;"),
                "{page}"
            );
        }
    }
}
