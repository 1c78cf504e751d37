//! Passages for a terminal: lines that are wrapped, and tables in columns, made of the HTML.
//!
//! A table that does not fit becomes a list, one line a cell. Widths are counted in characters.

use crate::Passage;
use crate::html::IN_BOOK;

/// Begin and end of emphasis, of code and of their absence, as a terminal takes them.
#[derive(Debug, Clone, Copy)]
pub struct Styles {
    pub bold: [&'static str; 2],
    pub code: [&'static str; 2],
}

/// Without colours: code is between backquotes.
pub const PLAIN: Styles = Styles {
    bold: ["", ""],
    code: ["`", "`"],
};

/// Marks in text that is not laid out yet, which have no width: begin and end of bold, begin and end of code.
const BOLD: [char; 2] = ['\x01', '\x02'];
const CODE: [char; 2] = ['\x03', '\x04'];
/// Narrowest column that a table is wrapped to.
const NARROWEST: usize = 14;
/// Characters between two columns.
const GAP: usize = 2;

/// A list that is open.
struct List {
    /// Number of the next item of an ordered one.
    next: Option<u64>,
}

struct Layout {
    width: usize,
    /// Whether code keeps its backquotes.
    quotes: bool,
    out: String,
    /// The present paragraph, heading or cell.
    text: String,
    lists: Vec<List>,
    /// Mark of the item that begins.
    mark: String,
    /// Address of the open link, shown after its words.
    after_link: String,
    in_code: bool,
    table: Vec<Vec<String>>,
    in_table: bool,
}

impl Passage<'_> {
    /// The passage in lines of at most this width, as far as code allows.
    pub fn terminal(&self, width: usize, styles: &Styles) -> String {
        let mut layout = Layout {
            width: width.max(40),
            quotes: styles.code[0] == "`",
            out: String::new(),
            text: String::new(),
            lists: Vec::new(),
            mark: String::new(),
            after_link: String::new(),
            in_code: false,
            table: Vec::new(),
            in_table: false,
        };
        let mut rest = self.html.as_str();
        while let Some((text, more)) = rest.split_once('<') {
            layout.text(&unescaped(text));
            let (tag, after) = more.split_once('>').unwrap_or((more, ""));
            layout.tag(tag);
            rest = after;
        }
        let text = layout.out.trim_end().to_owned() + "\n";
        let marks = BOLD.into_iter().zip(styles.bold);
        let marks = marks.chain(CODE.into_iter().zip(styles.code));
        marks.fold(text, |text, (mark, style)| {
            match layout.quotes && CODE.contains(&mark) {
                true => text.replace(mark, ""),
                false => text.replace(mark, style),
            }
        })
    }
}

impl Layout {
    fn text(&mut self, text: &str) {
        if self.in_code {
            let indent = " ".repeat(self.indent() + 4);
            for line in text.lines() {
                self.out += &format!("{indent}{line}\n").replace(&format!("{indent}\n"), "\n");
            }
        } else {
            // Lines of the source are words of one paragraph.
            self.text += &text.replace('\n', " ");
        }
    }

    /// A tag without its brackets.
    fn tag(&mut self, tag: &str) {
        let (name, attributes) = tag.split_once(' ').unwrap_or((tag, ""));
        let quote = if self.quotes { "`" } else { "" };
        match name {
            "h1" | "h2" | "h3" | "h4" | "h5" | "h6" => {
                let level = name.trim_start_matches('h').parse().unwrap_or(1);
                self.text = format!("{}{} ", BOLD[0], "#".repeat(level));
            }
            "/h1" | "/h2" | "/h3" | "/h4" | "/h5" | "/h6" => {
                self.text.push(BOLD[1]);
                self.end_block();
            }
            "p" => self.flush(),
            "/p" => self.end_block(),
            "strong" => self.text.push(BOLD[0]),
            "/strong" => self.text.push(BOLD[1]),
            "pre" => {
                self.flush();
                self.in_code = true;
            }
            "/pre" => {
                self.in_code = false;
                self.out.push('\n');
            }
            "code" if !self.in_code => self.text += &format!("{}{quote}", CODE[0]),
            "/code" if !self.in_code => self.text += &format!("{quote}{}", CODE[1]),
            "br" => self.text.push('\n'),
            "hr" => self.out += "---\n\n",
            "ul" | "ol" => {
                self.flush();
                let first = attributes.trim_start_matches("start=").trim_matches('"');
                let next = (name == "ol").then(|| first.parse().unwrap_or(1));
                self.lists.push(List { next });
            }
            "/ul" | "/ol" => {
                self.lists.pop();
                if !self.out.ends_with("\n\n") {
                    self.out.push('\n');
                }
            }
            "li" => self.begin_item(),
            "/li" => self.flush(),
            "table" => {
                self.flush();
                self.in_table = true;
            }
            "thead" | "tr" => self.table.push(Vec::new()),
            "th" | "td" => self.text.clear(),
            "/th" | "/td" => {
                let cell = std::mem::take(&mut self.text);
                if let Some(row) = self.table.last_mut() {
                    row.push(cell);
                }
            }
            "/table" => {
                self.in_table = false;
                self.text.clear();
                let mut rows = std::mem::take(&mut self.table);
                rows.retain(|row| !row.is_empty());
                self.out += &table(&rows, self.width, self.indent());
                self.out.push('\n');
            }
            "a" => self.after_link = self.beside(attributes),
            "/a" => {
                let address = std::mem::take(&mut self.after_link);
                if address.is_empty() || !self.text.ends_with(address.trim_matches([' ', '<', '>'])) {
                    self.text += &address;
                }
            }
            _ => {}
        }
    }

    /// Writes the open paragraph, and an empty line after it.
    fn end_block(&mut self) {
        if !self.text.trim().is_empty() {
            self.flush();
            self.out.push('\n');
        }
    }

    fn begin_item(&mut self) {
        self.text.clear();
        self.mark = match self.lists.last_mut() {
            Some(List { next: Some(number) }) => {
                *number += 1;
                format!("{}. ", *number - 1)
            }
            _ => "- ".to_owned(),
        }
    }

    /// The address shown after the words of a link: a page, or an address outside. In a table the words have to do, as they have
    /// for a section, whose name they are.
    fn beside(&self, attributes: &str) -> String {
        let Some(address) = attributes.strip_prefix("href=\"") else {
            return String::new();
        };
        let address = address.split('"').next().unwrap_or_default();
        match address.strip_prefix(IN_BOOK) {
            Some(topic) if self.in_table || topic.contains('#') => String::new(),
            Some(topic) => format!(" ({topic})"),
            None => format!(" <{}>", unescaped(address)),
        }
    }

    /// Columns by which lists indent.
    fn indent(&self) -> usize {
        let marks = self.lists.iter();
        marks.map(|list| if list.next.is_some() { 3 } else { 2 }).sum()
    }

    /// Writes the open paragraph.
    fn flush(&mut self) {
        let text = std::mem::take(&mut self.text);
        if text.trim().is_empty() {
            return;
        }
        let mark = std::mem::take(&mut self.mark);
        let indent = self.indent();
        let first = " ".repeat(indent.saturating_sub(mark.len())) + &mark;
        for (at, line) in wrapped(&text, self.width.saturating_sub(indent))
            .iter()
            .enumerate()
        {
            let margin = if at == 0 { &first } else { &" ".repeat(indent) };
            self.out += &format!("{margin}{line}\n");
        }
    }
}

/// Text of HTML as it is.
fn unescaped(text: &str) -> String {
    text.replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&quot;", "\"")
        .replace("&amp;", "&")
}

/// Characters that a terminal shows of a text.
fn width(text: &str) -> usize {
    let is_mark = |letter: &char| BOLD.contains(letter) || CODE.contains(letter);
    text.chars().filter(|letter| !is_mark(letter)).count()
}

/// Lines of at most this many characters; a longer word is cut.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let most = most.max(1);
    let mut lines = Vec::new();
    for paragraph in text.split('\n') {
        let mut line = String::new();
        for word in paragraph.split(' ').filter(|word| !word.is_empty()) {
            if !line.is_empty() && width(&line) + 1 + width(word) > most {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            let mut word = word.to_owned();
            while width(&word) > most {
                let at = word.char_indices().nth(most).map_or(word.len(), |(at, _)| at);
                let rest = word.split_off(at);
                lines.push(std::mem::replace(&mut word, rest));
            }
            line += &word;
        }
        lines.push(line);
    }
    lines
}

/// A table in columns, or as a list if its columns would be too narrow.
fn table(rows: &[Vec<String>], most: usize, indent: usize) -> String {
    let most = most.saturating_sub(indent);
    let margin = " ".repeat(indent);
    let Some(widths) = column_widths(rows, most) else {
        return list(rows, most, &margin);
    };
    let mut out = String::new();
    let mut line = |cells: Vec<String>| {
        let padded = cells.iter().zip(&widths).map(|(cell, wide)| {
            let blanks = wide.saturating_sub(width(cell));
            format!("{cell}{}", " ".repeat(blanks + GAP))
        });
        out += &format!("{margin}{}\n", padded.collect::<String>().trim_end());
    };
    for (at, row) in rows.iter().enumerate() {
        let cells: Vec<Vec<String>> = row
            .iter()
            .zip(&widths)
            .map(|(cell, wide)| wrapped(cell, *wide))
            .collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(0);
        for number in 0..height {
            let part = |cell: &Vec<String>| cell.get(number).cloned().unwrap_or_default();
            line(cells.iter().map(part).collect());
        }
        if at == 0 {
            line(widths.iter().map(|wide| "-".repeat(*wide)).collect());
        }
    }
    out
}

/// Widths of the columns: each has its longest word, and those that need more share the rest. `None` if too little is left.
fn column_widths(rows: &[Vec<String>], most: usize) -> Option<Vec<usize>> {
    let columns = rows.first()?.len();
    let widest = |column: usize, measure: fn(&str) -> usize| {
        let cells = rows.iter().filter_map(move |row| row.get(column));
        cells.map(|cell| measure(cell)).max().unwrap_or(0)
    };
    let longest_word = |cell: &str| cell.split([' ', '\n']).map(width).max().unwrap_or(0);
    // A column with its least width, and what it needs besides.
    let mut parts: Vec<(usize, usize, usize)> = (0..columns)
        .map(|column| {
            let least = widest(column, longest_word);
            (column, least, widest(column, width).saturating_sub(least))
        })
        .collect();
    let least: usize = parts.iter().map(|(_, least, _)| least + GAP).sum();
    let mut left = (most + GAP).checked_sub(least)?;
    parts.sort_by_key(|(_, _, more)| *more);
    for (done, (_, wide, more)) in parts.iter_mut().enumerate() {
        let given = (*more).min(left / (columns - done));
        *wide += given;
        left -= given;
        if given < *more && *wide < NARROWEST {
            return None;
        }
    }
    parts.sort_unstable();
    Some(parts.into_iter().map(|(_, wide, _)| wide).collect())
}

/// A table as a list: of each row the heading and the text of each cell.
fn list(rows: &[Vec<String>], most: usize, margin: &str) -> String {
    let Some((head, rows)) = rows.split_first() else {
        return String::new();
    };
    let mut out = String::new();
    for row in rows {
        for (at, (name, cell)) in head.iter().zip(row).enumerate() {
            let begin = if at == 0 { "- " } else { "  " };
            for (number, line) in wrapped(&format!("{name}: {cell}"), most.saturating_sub(4))
                .iter()
                .enumerate()
            {
                let begin = if number == 0 { begin } else { "    " };
                out += &format!("{margin}{begin}{line}\n");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::book;

    fn shown(html: &str, width: usize, styles: &Styles) -> String {
        let page = book().page("reference/alarms").unwrap();
        let html = html.to_owned();
        let passage = Passage {
            html,
            ..page.passage()
        };
        passage.terminal(width, styles)
    }

    #[test]
    fn lines_are_wrapped_and_links_name_their_pages() {
        let html = "<h2>Two</h2>\n<p>See <a href=\"book:reference/protocol/status\">Status replies</a> and <strong><code>this</code></strong>, \
            which is\nlong enough.</p>\n<ul>\n<li>one</li>\n<li>two &lt; 3</li>\n</ul>\n";
        assert_eq!(
            shown(html, 44, &PLAIN),
            "## Two\n\nSee Status replies\n(reference/protocol/status) and `this`,\nwhich is long enough.\n\n- one\n- two < 3\n"
        );
    }

    #[test]
    fn tables_have_columns_and_a_wide_one_is_a_list() {
        let html = "<table><thead><tr><th>A</th><th>Meaning</th></tr></thead><tbody>\n<tr><td><code>x | y</code></td>\
            <td>one two three four five six seven</td></tr>\n</tbody></table>\n";
        assert_eq!(
            shown(html, 40, &PLAIN),
            "A        Meaning\n-------  -------------------------------\n`x | y`  one two three four five six\n         seven\n"
        );
        let cells = |tag: &str, words: [&str; 5]| words.map(|word| format!("<{tag}>{word}</{tag}>")).concat();
        let head = cells("th", ["A", "B", "C", "D", "E"]);
        let row = cells(
            "td",
            [
                "first first",
                "second second",
                "third third",
                "fourth fourth",
                "fifth",
            ],
        );
        let html =
            format!("<table><thead><tr>{head}</tr></thead><tbody>\n<tr>{row}</tr>\n</tbody></table>\n");
        assert!(shown(&html, 40, &PLAIN).starts_with("- A: first first\n  B: second second\n"));
    }

    #[test]
    fn styles_replace_marks() {
        let styles = Styles {
            bold: ["<b>", "</b>"],
            code: ["<c>", "</c>"],
        };
        assert_eq!(
            shown("<p><strong>a</strong> <code>b</code></p>\n", 80, &styles),
            "<b>a</b> <c>b</c>\n"
        );
        assert_eq!(
            shown("<pre><code>x\n\ny\n</code></pre>\n", 80, &styles),
            "    x\n\n    y\n"
        );
    }

    /// No page loses words, and none is wider than asked for, other than in code blocks.
    #[test]
    fn every_page_is_laid_out() {
        for page in book().pages() {
            let text = page.passage().terminal(80, &PLAIN);
            for line in text.lines().filter(|line| !line.starts_with("    ")) {
                assert!(width(line) <= 80, "{}: {line}", page.path);
            }
            assert!(text.contains(&page.sections[0].heading), "{}", page.path);
        }
    }
}
