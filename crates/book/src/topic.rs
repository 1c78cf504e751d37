//! Topics: which page or section a word of a user means.

use crate::{Book, Page, Passage};
use ts3100_proto::words::{did_you_mean_or, one_of};

/// Why a topic shows nothing.
#[derive(Debug, thiserror::Error)]
pub enum UnknownTopic {
    #[error("no page is called `{topic}`{hint}")]
    Page { topic: String, hint: String },
    #[error("{page} has no section `{anchor}`{hint}")]
    Section {
        page: String,
        anchor: String,
        hint: String,
    },
    #[error("several pages are called `{topic}`; write {pages}")]
    Several { topic: String, pages: String },
}

impl Book {
    /// The page or the section that a topic names: `reference/alarms`, `alarms`, `alarms#reset`, also with the ending of a file.
    ///
    /// # Errors
    /// No page is called so, several are, or the page has no such section.
    pub fn find(&self, topic: &str) -> Result<Passage<'_>, UnknownTopic> {
        let (path, anchor) = match topic.split_once('#') {
            Some((path, anchor)) => (path, Some(anchor)),
            None => (topic, None),
        };
        let page = self.page_called(path)?;
        let Some(anchor) = anchor.filter(|anchor| !anchor.is_empty()) else {
            return Ok(page.passage());
        };
        page.at(anchor).ok_or_else(|| UnknownTopic::Section {
            page: page.path.clone(),
            anchor: anchor.to_owned(),
            hint: did_you_mean_or(
                anchor,
                page.anchors(),
                format!("; `ts3100 docs {}` prints the page", page.path),
            ),
        })
    }

    fn page_called(&self, topic: &str) -> Result<&Page, UnknownTopic> {
        let path = topic.strip_prefix("docs/").unwrap_or(topic);
        let path = path
            .strip_suffix(".md")
            .or(path.strip_suffix(".html"))
            .unwrap_or(path);
        let path = path.trim_matches('/');
        if let Some(page) = self.page(path).or_else(|| self.page(&format!("{path}/index"))) {
            return Ok(page);
        }
        let is_called = |page: &&Page| short_names(page).any(|name| name.eq_ignore_ascii_case(path));
        let found: Vec<&Page> = self.pages.iter().filter(is_called).collect();
        let topic = topic.to_owned();
        match found.as_slice() {
            [page] => Ok(page),
            [] => {
                let known = self.pages.iter().flat_map(short_names);
                let otherwise = "; `ts3100 docs` lists the pages, `ts3100 docs --search WORD` searches them";
                let hint = did_you_mean_or(&topic, known, otherwise);
                Err(UnknownTopic::Page { topic, hint })
            }
            pages => {
                let pages: Vec<String> = pages.iter().map(|page| page.path.clone()).collect();
                let pages = one_of(&pages);
                Err(UnknownTopic::Several { topic, pages })
            }
        }
    }
}

/// Names of a page besides its path: the last parts of that, and its title.
fn short_names(page: &Page) -> impl Iterator<Item = &str> {
    let path = page.path.strip_suffix("/index").unwrap_or(&page.path);
    let ends = path.match_indices('/');
    let ends = ends.filter_map(move |(at, _)| path.get(at + 1..));
    ends.chain([path, page.title.as_str()])
}

#[cfg(test)]
mod tests {
    use crate::book;

    #[test]
    fn a_page_has_several_names() {
        for name in [
            "reference/alarms",
            "alarms",
            "Alarms",
            "docs/reference/alarms.md",
            "/reference/alarms.html",
        ] {
            assert_eq!(book().find(name).unwrap().topic(), "reference/alarms", "{name}");
        }
        assert_eq!(
            book().find("protocol").unwrap().topic(),
            "reference/protocol/index"
        );
        let section = book().find("alarms#alarm-2-046").unwrap();
        assert_eq!(section.title, "Alarm 2-046");
    }

    #[test]
    fn an_unknown_topic_names_the_nearest() {
        for (name, message) in [
            (
                "alarm",
                "no page is called `alarm`; did you mean `alarms` or `Alarms`?",
            ),
            (
                "xyzzy",
                "no page is called `xyzzy`; `ts3100 docs` lists the pages, `ts3100 docs --search WORD` searches them",
            ),
            (
                "alarms#alarm-2-64",
                "reference/alarms has no section `alarm-2-64`; did you mean `alarm-2-046`?",
            ),
            (
                "time",
                "several pages are called `time`; write how-to/time or explanation/time",
            ),
        ] {
            let error = book().find(name).unwrap_err().to_string();
            assert!(
                error.starts_with(message.split('?').next().unwrap_or(message))
                    || name == "alarm"
                    || name.contains('#'),
                "{error}"
            );
        }
    }
}
