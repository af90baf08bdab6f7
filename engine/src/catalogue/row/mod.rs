//! Rows: what stands beside a module's code and says what it is, where it was published, what it cannot do, and how it is tested and
//! measured. [`catalogue`](crate::catalogue) gathers them; the card of a technique ([`Card`](crate::techniques::Card)) holds those of its
//! folder.
//!
//! A row names publications by the constants of [`sources`], or by a [`Source`] of its own beside it.

pub mod sources;

use std::fmt;

/// How the expected result of an estimator relates to the truth; for a technique's picture, to that on its own path set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", content = "cause")]
pub enum Bias {
    /// The expected picture is right at any number of samples.
    Unbiased,
    /// The error goes to zero with more work, but the expected picture is wrong before.
    Consistent(&'static str),
    /// An error stays, for this reason.
    Biased(&'static str),
}

impl fmt::Display for Bias {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unbiased => f.write_str("unbiased"),
            Self::Consistent(cause) => write!(f, "consistent: {cause}"),
            Self::Biased(cause) => write!(f, "biased: {cause}"),
        }
    }
}

/// What a row is to whoever looks for something to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind", content = "of")]
pub enum Role {
    /// Makes pictures: `render --technique` reaches it.
    Technique,
    /// Part of the row with this id.
    PartOf(&'static str),
    /// A building block that a host can use by itself: kernels, their twins, indexes, maps.
    Kernel,
    /// What the engine does around techniques and kernels: scenes, files, metrics, recording, choices.
    Service,
    /// Only measured, as something to compare with; no picture and no other row rests on it.
    Yardstick,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Technique => f.write_str("technique"),
            Self::PartOf(id) => write!(f, "part of {id}"),
            Self::Kernel => f.write_str("kernel"),
            Self::Service => f.write_str("service"),
            Self::Yardstick => f.write_str("yardstick"),
        }
    }
}

/// A publication.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Source {
    /// Unique key: first authors and year, such as `veach-1997`.
    pub key: &'static str,
    /// Initials and names, or the organization.
    pub authors: &'static str,
    /// Title.
    pub title: &'static str,
    /// Journal, conference, publisher or university.
    pub venue: &'static str,
    /// Year; 0 for a page that is revised without one.
    pub year: u16,
}

impl Source {
    /// The source as a whole.
    pub const fn whole(self) -> Cite {
        self.at("")
    }

    /// A place in it, such as `chapter 9`, or what was taken of it.
    pub const fn at(self, place: &'static str) -> Cite {
        Cite { source: self, place }
    }
}

impl fmt::Display for Source {
    /// Authors: title, venue, year.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.authors, self.title)?;
        if !self.venue.is_empty() {
            write!(f, ", {}", self.venue)?;
        }
        if self.year > 0 {
            write!(f, ", {}", self.year)?;
        }
        Ok(())
    }
}

/// A source as a row cites it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Cite {
    /// What is cited.
    #[serde(flatten)]
    pub source: Source,
    /// Where in it; empty for the whole.
    pub place: &'static str,
}

/// One system: a technique, a part of one, or something that stands by itself.
///
/// Written as `Row { id, name, role, limits, sources, tests, api, settings, ..Row::of(file!()) }`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Row {
    /// Unique id with its prefix, such as `BG-3`.
    pub id: &'static str,
    /// What it is.
    pub name: &'static str,
    /// What it is to whoever looks for something to use.
    pub role: Role,
    /// What it cannot do, or where it is inexact: one sentence.
    pub limits: &'static str,
    /// Where it was published; empty for the engine's own.
    pub sources: &'static [Cite],
    /// Its main file, from the repository's root.
    pub module: &'static str,
    /// Its kernels and includes, from the repository's root: files, or folders that end with a slash. Empty for what runs on the host alone.
    pub shaders: &'static [&'static str],
    /// The light paths of its picture, as [`PathSet`](crate::transport::PathSet) writes them; `None` for what makes no picture by itself.
    pub path_set: Option<&'static str>,
    /// Its bias as an estimator; `None` for what is evaluated, not estimated.
    pub bias: Option<Bias>,
    /// Device features beyond the baseline, by their Vulkan names.
    pub needs: &'static [&'static str],
    /// Its tests as `file::function`, the file from the repository's root.
    pub tests: &'static [&'static str],
    /// A command that measures it beside the experiments of `tools/experiments/`, whose `systems` name it; empty for none. From the repository's root.
    pub experiment: &'static str,
    /// What a host calls: public paths of this crate, such as `clerestory::kernels::RadixSort`, or a module of functions.
    pub api: &'static [&'static str],
    /// What can be chosen: public paths of this crate, command lines that begin with `clerestory`, and names of settings of the technique that
    /// it is a part of.
    pub settings: &'static [&'static str],
}

impl Row {
    /// An unnamed row of a module, given as `file!()`, with nothing in it: no estimate, no picture, on every device.
    pub const fn of(file: &'static str) -> Self {
        Self {
            id: "",
            name: "",
            role: Role::Kernel,
            limits: "",
            sources: &[],
            module: from_root(file),
            shaders: &[],
            path_set: None,
            bias: None,
            needs: &[],
            tests: &[],
            experiment: "",
            api: &[],
            settings: &[],
        }
    }
}

/// The path from the repository's root, of one that may begin elsewhere: compilers name files from where they were called.
const fn from_root(file: &'static str) -> &'static str {
    let root = b"engine/src/";
    let bytes = file.as_bytes();
    let mut start = bytes.len();
    while start > 0 {
        start -= 1;
        let mut same = 0;
        while same < root.len() && start + same < bytes.len() && bytes[start + same] == root[same] {
            same += 1;
        }
        if same == root.len() {
            return file.split_at(start).1;
        }
    }
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modules_are_named_from_the_root() {
        assert_eq!(Row::of(file!()).module, "engine/src/catalogue/row/mod.rs");
        assert_eq!(from_root("/home/me/engine/src/film/exr.rs"), "engine/src/film/exr.rs");
        // A host's own file stays as it is.
        assert_eq!(from_root("src/even.rs"), "src/even.rs");
        assert_eq!(from_root(""), "");
    }

    #[test]
    fn sources_are_written_without_what_they_lack() {
        let page = Source {
            key: "page",
            authors: "Someone",
            title: "A Page",
            venue: "",
            year: 0,
        };
        assert_eq!(page.to_string(), "Someone: A Page");
        assert_eq!(
            sources::KAJIYA_1986.to_string(),
            "J. Kajiya: The Rendering Equation, SIGGRAPH, 1986"
        );
    }
}
