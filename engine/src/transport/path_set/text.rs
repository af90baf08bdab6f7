//! The text form of path sets: a list of words whose meanings are intersected.

use std::fmt;
use std::str::FromStr;

use super::automaton::{Dfa, SYMBOLS};
use super::expression::{Node, count_text, set_text};
use super::parser::{self, COUNT_MAX};
use super::{
    LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, LOBE_SPECULAR, LOBE_TRANSMISSION, LOBE_VOLUME, NAME, PATH_SET_LOBES,
    PathSet, too_large,
};
use crate::{Error, Result};

const CLASS_NAMES: [(&str, u32); 3] = [
    ("diffuse", LOBE_DIFFUSE),
    ("glossy", LOBE_GLOSSY),
    ("specular", LOBE_SPECULAR),
];
const SIDE_NAMES: [(&str, u32); 2] = [("reflection", LOBE_REFLECTION), ("transmission", LOBE_TRANSMISSION)];
const VOLUME: &str = "volume";
const SURFACES: u32 = PATH_SET_LOBES & !LOBE_VOLUME;
/// Words for ranges of bounces.
const RANGE_NAMES: [(&str, u32, Option<u32>); 3] =
    [("emitted", 0, Some(0)), ("direct", 1, Some(1)), ("indirect", 2, None)];
const GRAMMAR: &str = "is a list of parts with ',' between them: all, none, emitted (0 bounces), direct (1), indirect (2 and more), \
    bounces=A, bounces=A..B, bounces=A.., lobes=NAME+NAME with the names diffuse, glossy, specular, volume, reflection, transmission, or \
    paths from light to eye such as LDE, L(D|S)+E, LS+DE, !L.*S.*E";

impl PathSet {
    /// The lobes as names, if they are some classes on some sides.
    fn lobe_names(lobes: u32) -> Option<String> {
        let there = |names: &[(&'static str, u32)]| -> (Vec<&'static str>, u32) {
            let there: Vec<_> = names.iter().filter(|(_, bits)| lobes & bits & SURFACES != 0).collect();
            let union = there.iter().fold(0, |union, (_, bits)| union | bits);
            (there.iter().map(|(name, _)| *name).collect(), union)
        };
        let ((mut names, classes), (sides_named, sides)) = (there(&CLASS_NAMES), there(&SIDE_NAMES));
        if classes & sides & SURFACES != lobes & SURFACES {
            return None;
        }
        if lobes & LOBE_VOLUME != 0 {
            names.push(VOLUME);
        }
        names.extend(sides_named);
        Some(names.join("+"))
    }

    /// The range in words; nothing where there is none.
    pub(super) fn range_text(min: u32, max: Option<u32>) -> String {
        let named = RANGE_NAMES.iter().find(|(_, a, b)| (*a, *b) == (min, max));
        match (named, min, max) {
            (Some((name, ..)), ..) => (*name).into(),
            (_, 0, None) => String::new(),
            (_, min, None) => format!("bounces={min}.."),
            (_, min, Some(max)) if min == max => format!("bounces={min}"),
            (_, min, Some(max)) => format!("bounces={min}..{max}"),
        }
    }
}

impl fmt::Display for PathSet {
    /// The words of [`PathSet::from_str`] where they suffice, else an expression from light to eye, beside a range where that is shorter.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (min, max) = (self.min_bounces(), self.max_bounces());
        let range = Self::range_text(min, max);
        if self.is_empty() {
            return f.write_str("none");
        }
        if self.has_automaton() {
            let node = Node::of_automaton(&self.automaton()).ok_or(fmt::Error)?.reversed();
            let comma = if range.is_empty() { "" } else { "," };
            return write!(f, "{range}{comma}L{}E", node.text());
        }
        let lobes = self.lobes();
        match Self::lobe_names(lobes) {
            _ if lobes == PATH_SET_LOBES || max == Some(0) => {
                f.write_str(if range.is_empty() { "all" } else { &range })
            }
            Some(names) => write!(f, "{},lobes={names}", if range.is_empty() { "all" } else { &range }),
            None if min.max(max.unwrap_or(0)) <= COUNT_MAX => {
                write!(f, "L{}{}E", set_text(lobes), count_text(min, max))
            }
            None => write!(f, "{range},L{}*E", set_text(lobes)),
        }
    }
}

/// Parts of a text with the character at which each begins; commas in braces are counts'.
fn parts(text: &str) -> Vec<(usize, &str)> {
    let (mut parts, mut depth, mut first, mut first_character) = (Vec::new(), 0u32, 0, 0);
    for (character, (at, c)) in text.char_indices().enumerate() {
        match c {
            '{' => depth += 1,
            '}' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                parts.push((first_character, &text[first..at]));
                (first, first_character) = (at + 1, character + 1);
            }
            _ => {}
        }
    }
    parts.push((first_character, &text[first..]));
    parts
        .into_iter()
        .map(|(at, part)| {
            let blanks = part.chars().take_while(|c| c.is_whitespace()).count();
            (at + blanks, part.trim())
        })
        .collect()
}

impl FromStr for PathSet {
    type Err = Error;

    /// Reads a list of parts with `,` between them; the set is what all of them have in common.
    ///
    /// - `all`, `none`, `emitted`, `direct`, `indirect`, `bounces=2`, `bounces=1..3` (both ends included), `bounces=2..`, `bounces=..3` give the
    ///   range of bounces; several of them are joined and must leave no gap.
    /// - `lobes=diffuse+glossy` allows only these lobes (`none` for none): without a class (`diffuse`, `glossy`, `specular`) all classes
    ///   are meant, without a side (`reflection`, `transmission`) both sides; media count when `volume` is named.
    /// - A path expression, from the light to the eye: `L`, then events, then `E`; or from the eye, `E`, events, `L`. Events: `D` diffuse,
    ///   `G` glossy, `S` specular, each with `r` (reflected) or `t` (transmitted) after it for one side; `V` volume; `.` any; `[DGt]` one of
    ///   these, `[^S]` one of all others; `(…|…)` a choice. After an event or parenthesis `*`, `+`, `?`, `{n}`, `{n,m}`, `{n,}` repeat it.
    ///   `|` joins whole paths, and `!` at the beginning means all paths but these.
    ///
    /// # Errors
    /// [`Error::Setting`] that names the column, and for a set that needs too large an automaton.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = |value: &str, cause: &str| Error::setting(NAME, format!("{value:?}"), cause);
        let mut ranges: Vec<(u32, Option<u32>)> = Vec::new();
        let mut lobes = None;
        let mut language = Dfa::repeated(PATH_SET_LOBES);
        for (at, part) in parts(text) {
            if let Some((_, min, max)) = RANGE_NAMES.iter().find(|(name, ..)| *name == part) {
                ranges.push((*min, *max));
            } else if part == "all" {
                ranges.push((0, None));
            } else if part == "none" {
                language = Dfa::default();
            } else if let Some(range) = part.strip_prefix("bounces=") {
                ranges.push(parse_range(range).ok_or_else(|| {
                    wrong(
                        part,
                        "is not a range of bounces: write bounces=2, bounces=1..3, bounces=2.. or bounces=..3",
                    )
                })?);
            } else if let Some(names) = part.strip_prefix("lobes=") {
                if lobes.replace(parse_lobes(names)?).is_some() {
                    return Err(wrong(text, "names lobes twice: join them with '+'"));
                }
            } else if part.starts_with(|c: char| c.is_uppercase() || "!([.".contains(c)) {
                let read = parser::read(part).map_err(|error| {
                    let cause = format!(
                        "is not a path expression: column {}: {}",
                        at + error.at + 1,
                        error.cause
                    );
                    wrong(text, &cause)
                })?;
                language = language.product(&read, |a, b| a && b).map_err(too_large)?;
            } else {
                return Err(wrong(part, &format!("is not known: a path set {GRAMMAR}")));
            }
        }
        ranges.sort_unstable_by_key(|r| r.0);
        let mut joined = ranges.first().copied().unwrap_or((0, None));
        for &(min, max) in ranges.iter().skip(1) {
            if joined.1.is_some_and(|end| min > end.saturating_add(1)) {
                return Err(wrong(
                    text,
                    "leaves a gap between its ranges of bounces: give one range, or render twice",
                ));
            }
            joined.1 = joined.1.zip(max).map(|(a, b)| a.max(b));
        }
        super::check_range(joined.0, joined.1)?;
        if let Some(lobes) = lobes {
            language = language
                .product(&Dfa::repeated(lobes), |a, b| a && b)
                .map_err(too_large)?;
        }
        Self::normalized(joined.0, joined.1, &language).map_err(|error| match error {
            Error::Setting { cause, .. } => wrong(text, &cause),
            other => other,
        })
    }
}

/// `2`, `1..3`, `1..=3`, `2..`, `..3`.
fn parse_range(text: &str) -> Option<(u32, Option<u32>)> {
    let Some((first, last)) = text.split_once("..") else {
        let only = text.trim().parse().ok()?;
        return Some((only, Some(only)));
    };
    let (first, last) = (first.trim(), last.trim().trim_start_matches('='));
    let min = if first.is_empty() { 0 } else { first.parse().ok()? };
    let max = if last.is_empty() {
        None
    } else {
        Some(last.parse().ok()?)
    };
    Some((min, max))
}

fn parse_lobes(text: &str) -> Result<u32> {
    let (mut classes, mut sides, mut volume) = (0, 0, 0);
    for name in text.split('+').map(str::trim) {
        let find = |names: &[(&str, u32)]| names.iter().find(|(n, _)| *n == name).map(|(_, bits)| *bits);
        if let Some(class) = find(&CLASS_NAMES) {
            classes |= class;
        } else if let Some(side) = find(&SIDE_NAMES) {
            sides |= side;
        } else if name == VOLUME {
            volume = LOBE_VOLUME;
        } else if name != "none" {
            let cause = format!("is not a lobe: a path set {GRAMMAR}");
            return Err(Error::setting(NAME, format!("{name:?}"), cause));
        }
    }
    if classes != 0 && sides == 0 {
        sides = SURFACES;
    } else if sides != 0 && classes == 0 {
        classes = SURFACES;
    }
    Ok(classes & sides | volume)
}

impl TryFrom<String> for PathSet {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        text.parse()
    }
}

impl From<PathSet> for String {
    fn from(set: PathSet) -> Self {
        set.to_string()
    }
}

const _: () = assert!(1 << SYMBOLS == PATH_SET_LOBES + 1);
