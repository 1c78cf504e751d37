//! URIs in reports and of editors (RFC 3986): of files, and names of codes.

use std::path::{Path, PathBuf};
use ts3100_proto::escape::hex_byte;

/// Percent-encodes one segment of a path; unreserved characters stay.
pub fn percent_encoded(segment: &str) -> String {
    segment.bytes().fold(String::new(), |mut text, byte| {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            text.push(char::from(byte));
        } else {
            text.push_str(&format!("%{byte:02X}"));
        }
        text
    })
}

/// A file: `file://` with an absolute path, else a reference relative to where the run began, as code hosts expect it.
pub fn of_file(path: &Path) -> String {
    let text = path.to_string_lossy().replace('\\', "/");
    let segments: Vec<String> = text.split('/').map(percent_encoded).collect();
    let encoded = segments.join("/");
    if text.starts_with('/') {
        return format!("file://{encoded}");
    }
    let mut drive = text.chars();
    match (drive.next(), drive.next(), drive.next()) {
        // C:/robots/pick.scol
        (Some(letter), Some(':'), Some('/')) if letter.is_ascii_alphabetic() => {
            format!("file:///{}", encoded.replacen("%3A", ":", 1))
        }
        _ => encoded,
    }
}

/// The file of a URI `file://`; `None` for any other, which has no place on the disk.
pub fn to_path(uri: &str) -> Option<PathBuf> {
    let rest = uri.strip_prefix("file://")?;
    let (host, path) = rest.split_at(rest.find('/')?);
    if !matches!(host, "" | "localhost") {
        return None;
    }
    let mut bytes = Vec::new();
    let mut letters = path.bytes();
    while let Some(letter) = letters.next() {
        bytes.push(match letter {
            b'%' => {
                let digits = [letters.next()?, letters.next()?];
                hex_byte(std::str::from_utf8(&digits).ok()?)?
            }
            letter => letter,
        });
    }
    let text = String::from_utf8(bytes).ok()?;
    // /C:/robots/pick.scol
    let drive = text.strip_prefix('/').filter(|rest| {
        let mut letters = rest.chars();
        letters.next().is_some_and(|letter| letter.is_ascii_alphabetic()) && letters.next() == Some(':')
    });
    Some(PathBuf::from(drive.unwrap_or(&text)))
}

/// The name of a code that `ts3100 explain` explains. A report has no address of the documentation, which is in the program.
pub fn of_code(code: &str) -> String {
    format!("urn:ts3100:explain:{code}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_keeps_its_unreserved_characters() {
        assert_eq!(percent_encoded("A(1,2)"), "A%281%2C2%29");
        assert_eq!(percent_encoded("USER.PAR"), "USER.PAR");
        assert_eq!(percent_encoded("a/../b ü"), "a%2F..%2Fb%20%C3%BC");
    }

    #[test]
    fn a_uri_of_a_file_leads_back_to_it() {
        for path in [
            "/tmp/a b/run.txt",
            "/g/gr\u{f6}\u{df}e%.scol",
            "C:/robots/pick.scol",
        ] {
            assert_eq!(to_path(&of_file(Path::new(path))).unwrap(), Path::new(path));
        }
        assert_eq!(to_path("file:///c%3A/x.scol").unwrap(), Path::new("c:/x.scol"));
        for uri in [
            "untitled:Untitled-1",
            "file://server/x",
            "file:///%",
            "file:///%F",
            "file:///%FF",
        ] {
            assert_eq!(to_path(uri), None, "{uri}");
        }
    }

    #[test]
    fn files_by_where_they_lie() {
        for (path, uri) in [
            ("pick.scol", "pick.scol"),
            ("a b/pick.scol", "a%20b/pick.scol"),
            ("./runs/t:1.txt", "./runs/t%3A1.txt"),
            ("/tmp/a b/run.txt", "file:///tmp/a%20b/run.txt"),
            ("C:\\robots\\run 1.txt", "file:///C:/robots/run%201.txt"),
            ("größe.txt", "gr%C3%B6%C3%9Fe.txt"),
        ] {
            assert_eq!(of_file(Path::new(path)), uri);
        }
    }
}
