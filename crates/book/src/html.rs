//! Passages as HTML, with links that lead to the pages that an emulator serves.

use crate::{Book, Page, Passage};
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd, html};

/// Markdown as the pages use it.
pub(crate) fn parsed(markdown: &str) -> Parser<'_> {
    Parser::new_ext(markdown, Options::ENABLE_TABLES)
}

/// Where a link leads.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// An address outside of the book.
    Outside(String),
    /// A page of the book, with `#` and the anchor if it has one.
    Topic(String),
    /// A file of the repository.
    File,
}

impl Book {
    /// Where a link on a page leads.
    pub(crate) fn target(&self, page: &Page, link: &str) -> Target {
        if link.contains("://") || link.starts_with("mailto:") {
            return Target::Outside(link.to_owned());
        }
        let (path, anchor) = link.split_at(link.find('#').unwrap_or(link.len()));
        if path.is_empty() {
            return Target::Topic(format!("{}{anchor}", page.path));
        }
        let mut parts: Vec<&str> = page.path.split('/').collect();
        parts.pop();
        for part in path.split('/') {
            match part {
                ".." => drop(parts.pop()),
                "." => {}
                part => parts.push(part),
            }
        }
        let path = parts.join("/");
        let page = path.strip_suffix(".md").and_then(|path| self.page(path));
        page.map_or(Target::File, |page| {
            Target::Topic(format!("{}{anchor}", page.path))
        })
    }
}

impl Passage<'_> {
    /// The passage as HTML. `root` leads from where it is served to the beginning of the book: empty, or `../` for each folder.
    pub fn html(&self, book: &Book, root: &str) -> String {
        let begin = self.page.text.find(&self.text).unwrap_or(0);
        let sections = self.page.sections.iter();
        let mut anchors = sections.filter(|section| section.whole.start >= begin);
        let mut is_link = Vec::new();
        let events = parsed(&self.text).filter_map(|event| match event {
            Event::Start(Tag::Heading {
                level,
                classes,
                attrs,
                ..
            }) => {
                let id = anchors.next().map(|section| CowStr::from(section.anchor.clone()));
                Some(Event::Start(Tag::Heading {
                    level,
                    id,
                    classes,
                    attrs,
                }))
            }
            Event::Start(Tag::Link {
                link_type,
                dest_url,
                title,
                id,
            }) => {
                let address = match book.target(self.page, &dest_url) {
                    Target::Outside(address) => Some(address),
                    Target::Topic(topic) => Some(format!("{root}{topic}")),
                    Target::File => None,
                };
                is_link.push(address.is_some());
                address.map(|address| {
                    let dest_url = CowStr::from(address);
                    Event::Start(Tag::Link {
                        link_type,
                        dest_url,
                        title,
                        id,
                    })
                })
            }
            Event::End(TagEnd::Link) => is_link.pop().unwrap_or(false).then_some(event),
            event => Some(event),
        });
        let mut text = String::new();
        html::push_html(&mut text, events);
        text
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
    use super::*;
    use crate::book;

    /// Every link of the book leads to a page and a section that exist, to another site, or to a schema or table beside the pages.
    #[test]
    fn every_link_of_the_book_leads_somewhere() {
        let mut count = 0;
        for page in book().pages() {
            for event in parsed(&page.text) {
                let Event::Start(Tag::Link { dest_url, .. }) = event else {
                    continue;
                };
                count += 1;
                match book().target(page, &dest_url) {
                    Target::Outside(address) => assert!(address.starts_with("http"), "{address}"),
                    Target::Topic(topic) => {
                        let found = book().find(&topic);
                        assert!(found.is_ok(), "{}: {dest_url}", page.path);
                    }
                    Target::File => assert!(dest_url.ends_with(".json"), "{}: {dest_url}", page.path),
                }
            }
        }
        assert!(count > 500, "{count}");
    }

    #[test]
    fn links_are_relative_to_the_book_and_headings_have_their_anchors() {
        let page = book().page("reference/alarms").unwrap();
        let html = page.passage().html(book(), "../");
        assert!(html.contains("<h3 id=\"alarm-2-046\">"), "{html}");
        assert!(html.contains("href=\"../reference/protocol/status\""), "{html}");
        assert!(
            html.contains("href=\"../reference/alarms#alarm-8-002\""),
            "{html}"
        );
        let section = page.at("alarm-2-046").unwrap().html(book(), "");
        assert!(section.starts_with("<h3 id=\"alarm-2-046\">"), "{section}");
        let files = book()
            .page("reference/controls")
            .unwrap()
            .passage()
            .html(book(), "");
        assert!(
            files.contains("controls.json") && !files.contains(".json\""),
            "{files}"
        );
    }
}
