//! What a file itself says about its names and lines: the values of data, and comments.

use crate::prelude::*;

use super::index::{Index, Symbol, SymbolKind};
use super::marks::MarkKind;
use crate::lines::Span;

impl Index {
    /// Kind and numbers of a line of DATA: `("POINT", "400,0,200")`.
    pub fn datum<'s>(&self, source: &'s str, symbol: &Symbol) -> Option<(String, &'s str)> {
        let declared = symbol.declared.filter(|_| symbol.kind == SymbolKind::Data)?;
        let (_, line) = self.line_of(declared.start);
        let before = source.get(line.start..declared.start)?.trim();
        let kind = if before.is_empty() { "POINT" } else { before };
        let numbers = source
            .get(declared.end..line.end)?
            .trim_start()
            .strip_prefix('=')?;
        let end = numbers.find(['/', '\'']).unwrap_or(numbers.len());
        Some((
            kind.to_ascii_uppercase(),
            numbers.get(..end)?.trim().trim_end_matches(','),
        ))
    }

    /// The comment lines directly above a line, from 1, without their marks.
    pub fn comments_above<'s>(&self, source: &'s str, line: u32) -> Vec<&'s str> {
        let above = (1..line).rev();
        let texts = above.map_while(|number| comment(self.line(number)?.text(source)));
        let mut comments: Vec<&str> = texts.collect();
        comments.reverse();
        comments
    }

    /// Comments on a digital line: those that name it, as `DIN(3)`, and those after a statement that does. `words` are the
    /// functions and statements whose numbers are such lines. Each with its line of the file, from 1.
    pub fn comments_on<'s>(&self, source: &'s str, words: &[&str], number: u16) -> Vec<(u32, &'s str)> {
        let comments = self.marks().iter().filter(|mark| mark.kind == MarkKind::Comment);
        let about = comments.filter_map(|mark| {
            let (line, span) = self.line_of(mark.span.start);
            let text = comment(mark.span.text(source)).filter(|text| !text.is_empty())?;
            names_line(span.text(source), words, number).then_some((line, text))
        });
        about.collect()
    }

    /// Name of the PROGRAM that a byte is in or directly after.
    pub fn scope_at(&self, source: &str, byte: usize) -> Option<String> {
        let (line, _) = self.line_of(byte);
        let mut blocks = self.blocks().iter().rev();
        let program = blocks.find(|block| block.is_program() && *block.lines.start() <= line)?;
        Some(program.name.text(source).to_ascii_uppercase())
    }

    /// Runs of lines that are nothing but comments, two and more: first and last, from 1.
    pub fn comment_runs(&self, source: &str) -> Vec<(u32, u32)> {
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for mark in self.marks().iter().filter(|mark| mark.kind == MarkKind::Comment) {
            let (line, span) = self.line_of(mark.span.start);
            if !Span::new(span.start, mark.span.start)
                .text(source)
                .trim()
                .is_empty()
            {
                continue;
            }
            match runs.last_mut() {
                Some((_, last)) if *last + 1 == line => *last = line,
                _ => runs.push((line, line)),
            }
        }
        runs.retain(|(first, last)| first < last);
        runs
    }
}

/// The words of a text that is nothing but a comment.
fn comment(text: &str) -> Option<&str> {
    let text = text.trim();
    let word = text.get(..6).filter(|word| word.eq_ignore_ascii_case("REMARK"));
    let remark = word.and_then(|word| text.get(word.len()..));
    text.strip_prefix('\'').or(remark).map(str::trim)
}

/// Whether a text names a digital line: `DIN(3)`, `din 3`, `DOUT(-5, 3)`.
fn names_line(text: &str, words: &[&str], number: u16) -> bool {
    let text = text.to_ascii_uppercase().replace([' ', '-'], "");
    words.iter().any(|word| {
        text.match_indices(word).any(|(at, _)| {
            let rest = text
                .get(at + word.len()..)
                .unwrap_or_default()
                .trim_start_matches('(');
            let numbers = rest
                .split(|letter: char| !letter.is_ascii_digit() && letter != ',')
                .next();
            let mut numbers = numbers.unwrap_or_default().split(',');
            numbers.any(|found| found.parse() == Ok(number))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Arm;

    const SOURCE: &str = "' DIN 3: a part is there\n' DIN(13): no part\nREMARK third\nPROGRAM T\n  DOUT(5, -3) ' valve\n  WAIT DIN(3)\n  MOVE P\n  ' alone\nEND\n\
        DATA\n  point P = 400, 0 ,2,,/ ' home\n  TRANS T1=1,2,3/\nEND\n";

    #[test]
    fn data_and_comments_are_found() {
        let index = Index::new(SOURCE, Arm::Scara, &[]);
        let symbol = |name: &str| index.symbols().iter().find(|symbol| symbol.name == name).unwrap();
        assert_eq!(
            index.datum(SOURCE, symbol("P")),
            Some(("POINT".into(), "400, 0 ,2"))
        );
        assert_eq!(index.datum(SOURCE, symbol("T1")), Some(("TRANS".into(), "1,2,3")));
        assert_eq!(index.datum(SOURCE, symbol("T")), None);
        assert_eq!(
            index.comments_above(SOURCE, 4),
            ["DIN 3: a part is there", "DIN(13): no part", "third"]
        );
        assert_eq!(
            index.comments_on(SOURCE, &["DIN"], 3),
            [(1, "DIN 3: a part is there")]
        );
        assert_eq!(index.comments_on(SOURCE, &["DOUT"], 3), [(5, "valve")]);
        assert_eq!(index.comment_runs(SOURCE), [(1, 3)]);
        assert_eq!(
            index.scope_at(SOURCE, SOURCE.find("WAIT").unwrap()),
            Some("T".into())
        );
        assert_eq!(index.scope_at(SOURCE, 0), None);
    }
}
