//! Passages as HTML, with links that lead to the pages that an emulator serves. The build script has made it of the Markdown.

use crate::Passage;
use crate::page::headings;

/// Beginning of the addresses of pages of the book in the HTML of the build script.
pub(crate) const IN_BOOK: &str = "book:";

impl Passage<'_> {
    /// The passage as HTML. `root` leads from where it is served to the beginning of the book: `./`, or `../` for each folder.
    pub fn html(&self, root: &str) -> String {
        let mut text = String::new();
        let mut from = 0;
        let sections = self.page.sections.iter().skip(self.first);
        for (at, section) in headings(&self.html).zip(sections) {
            // After `<h` and its digit.
            let at = at + 3;
            text += self.html.get(from..at).unwrap_or_default();
            text += &format!(" id=\"{}\"", section.anchor);
            from = at;
        }
        text += self.html.get(from..).unwrap_or_default();
        text.replace(&format!("href=\"{IN_BOOK}"), &format!("href=\"{root}"))
    }
}

/// A string as text of HTML or as the value of an attribute.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use crate::book;
    use crate::page::headings;

    /// Every link of the book leads to a page and a section that exist, or to another site.
    #[test]
    fn every_link_of_the_book_leads_somewhere() {
        let mut count = 0;
        for page in book().pages() {
            let html = page.passage().html("book:");
            for link in html
                .split("href=\"")
                .skip(1)
                .filter_map(|rest| rest.split('"').next())
            {
                count += 1;
                match link.strip_prefix("book:") {
                    Some(topic) => assert!(
                        book().find(topic).is_ok() || book().document(topic).is_some(),
                        "{}: {link}",
                        page.path
                    ),
                    None => assert!(link.starts_with("http"), "{}: {link}", page.path),
                }
            }
        }
        assert!(count > 500, "{count}");
    }

    /// The outline by lines and the HTML have the same headings and the same rows.
    #[test]
    fn lines_and_html_agree() {
        for page in book().pages() {
            let passage = page.passage();
            assert_eq!(
                headings(&passage.html).count(),
                page.sections.len(),
                "{}",
                page.path
            );
            let rows = passage.html.matches("<tr><td").count();
            assert_eq!(rows, page.rows.len(), "{}", page.path);
            if let Some(row) = page.rows.last() {
                assert_eq!(page.row(row).html.matches("<tr><td").count(), 1, "{}", page.path);
            }
        }
    }

    #[test]
    fn links_are_relative_to_the_book_and_headings_have_their_anchors() {
        let page = book().page("reference/alarms").unwrap();
        let html = page.passage().html("../");
        assert!(html.contains("<h3 id=\"alarm-2-046\">"), "{html}");
        assert!(html.contains("href=\"../reference/protocol/status\""), "{html}");
        assert!(
            html.contains("href=\"../reference/alarms#alarm-8-002\""),
            "{html}"
        );
        let section = page.at("alarm-2-046").unwrap().html("");
        assert!(section.starts_with("<h3 id=\"alarm-2-046\">"), "{section}");
        assert_eq!(
            headings(&page.at("alarm-2-046").unwrap().html).count(),
            1,
            "{section}"
        );
        let files = book().page("reference/controls").unwrap().passage().html("");
        assert!(files.contains("href=\"reference/controls.json\""), "{files}");
    }
}
