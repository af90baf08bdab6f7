//! Which light paths a picture contains: how often light is scattered, and by what.
//!
//! Errors are measured between pictures of equal path sets only. The grammar of the text form is that of [`PathSet::from_str`]; the
//! packed form is that of `transport/path_set.glsl`.

use super::bsdf::{LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, LOBE_SPECULAR, LOBE_TRANSMISSION};
use crate::gpu::shaders::constants::{self, PATH_SET_MAX_SHIFT, PATH_SET_MIN_SHIFT};
use crate::{Error, Result};
use std::fmt;
use std::str::FromStr;

/// The class of scattering in media, beside the `LOBE_…` bits of surfaces.
pub const LOBE_VOLUME: u32 = constants::LOBE_VOLUME;
/// Every lobe and the media.
pub const PATH_SET_LOBES: u32 = constants::PATH_SET_LOBES;
/// Packed greatest number of bounces that stands for no bound.
pub const PATH_SET_UNBOUNDED: u32 = constants::PATH_SET_UNBOUNDED;

/// The setting's name in errors.
const NAME: &str = "path set";
const CLASSES: u32 = LOBE_DIFFUSE | LOBE_GLOSSY | LOBE_SPECULAR;
const SIDES: u32 = LOBE_REFLECTION | LOBE_TRANSMISSION;
const LOBE_NAMES: [(&str, u32); 6] = [
    ("diffuse", LOBE_DIFFUSE),
    ("glossy", LOBE_GLOSSY),
    ("specular", LOBE_SPECULAR),
    ("volume", LOBE_VOLUME),
    ("reflection", LOBE_REFLECTION),
    ("transmission", LOBE_TRANSMISSION),
];
/// Words for ranges of bounces.
const RANGE_NAMES: [(&str, u32, Option<u32>); 3] =
    [("emitted", 0, Some(0)), ("direct", 1, Some(1)), ("indirect", 2, None)];
const GRAMMAR: &str = "is a list of parts with ',' between them: all, emitted (0 bounces), direct (1), indirect (2 and more), \
    bounces=A, bounces=A..B, bounces=A.., lobes=NAME+NAME with the names diffuse, glossy, specular, volume, reflection, transmission";

/// A set of light paths.
///
/// A path belongs to it when its number of bounces (scattering events between light and camera) lies in the range and every event is
/// of an allowed lobe. 0 bounces is emitted light seen directly, 1 is direct lighting.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PathSet {
    min_bounces: u32,
    max_bounces: Option<u32>,
    lobes: u32,
}

impl Default for PathSet {
    fn default() -> Self {
        Self::ALL
    }
}

impl PathSet {
    /// Every path.
    pub const ALL: Self = Self {
        min_bounces: 0,
        max_bounces: None,
        lobes: PATH_SET_LOBES,
    };
    /// Light that is scattered exactly once.
    pub const DIRECT: Self = Self {
        min_bounces: 1,
        max_bounces: Some(1),
        lobes: PATH_SET_LOBES,
    };
    /// Light that is scattered twice or more.
    pub const INDIRECT: Self = Self {
        min_bounces: 2,
        max_bounces: None,
        lobes: PATH_SET_LOBES,
    };

    /// All paths with `min`..=`max` bounces (`None`: no upper bound) by the allowed lobes, `LOBE_…` bits.
    pub fn new(min: u32, max: Option<u32>, lobes: u32) -> Result<Self> {
        let range = || format!("bounces={min}..{}", max.map_or(String::new(), |m| m.to_string()));
        if max.is_some_and(|m| m < min) {
            let cause = "is empty: the first number must not be greater than the second";
            return Err(Error::setting(NAME, range(), cause));
        }
        let most = PATH_SET_UNBOUNDED - 1;
        if min > most || max.is_some_and(|m| m > most) {
            let cause = format!("is too long: {most} bounces can be counted; leave the end open (\"..\")");
            return Err(Error::setting(NAME, range(), cause));
        }
        if lobes & !PATH_SET_LOBES != 0 {
            let cause = format!("has bits beyond {PATH_SET_LOBES:#x}");
            return Err(Error::setting(NAME, format!("lobes={lobes:#x}"), cause));
        }
        Ok(Self {
            min_bounces: min,
            max_bounces: max,
            lobes,
        })
    }

    /// The least number of bounces.
    pub fn min_bounces(&self) -> u32 {
        self.min_bounces
    }

    /// The greatest number of bounces, if there is one.
    pub fn max_bounces(&self) -> Option<u32> {
        self.max_bounces
    }

    /// The allowed lobes, `LOBE_…` bits: the mask of the scattering functions.
    pub fn lobes(&self) -> u32 {
        self.lobes
    }

    /// Whether light that arrives after `bounce` scatterings counts.
    pub fn contains(&self, bounce: u32) -> bool {
        bounce >= self.min_bounces && self.max_bounces.is_none_or(|max| bounce <= max)
    }

    /// Whether paths may have more than `bounce` bounces.
    pub fn continues(&self, bounce: u32) -> bool {
        self.max_bounces.is_none_or(|max| bounce < max)
    }

    /// One word for a push constant: bits 0–5 lobes, 6–17 least and 18–29 greatest number of bounces.
    pub fn packed(&self) -> u32 {
        self.lobes
            | self.min_bounces << PATH_SET_MIN_SHIFT
            | self.max_bounces.unwrap_or(PATH_SET_UNBOUNDED) << PATH_SET_MAX_SHIFT
    }
}

impl fmt::Display for PathSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = RANGE_NAMES
            .iter()
            .find(|(_, min, max)| (*min, *max) == (self.min_bounces, self.max_bounces));
        match (named, self.min_bounces, self.max_bounces) {
            (Some((name, ..)), ..) => f.write_str(name)?,
            (_, 0, None) => f.write_str("all")?,
            (_, min, None) => write!(f, "bounces={min}..")?,
            (_, min, Some(max)) if min == max => write!(f, "bounces={min}")?,
            (_, min, Some(max)) => write!(f, "bounces={min}..{max}")?,
        }
        if self.lobes != PATH_SET_LOBES {
            let names: Vec<_> = LOBE_NAMES
                .iter()
                .filter(|(_, bit)| self.lobes & bit != 0)
                .map(|(name, _)| *name)
                .collect();
            let names = if names.is_empty() { vec!["none"] } else { names };
            write!(f, ",lobes={}", names.join("+"))?;
        }
        Ok(())
    }
}

impl FromStr for PathSet {
    type Err = Error;

    /// Reads a list of parts with `,` between them.
    ///
    /// `all`, `emitted`, `direct`, `indirect`, `bounces=2`, `bounces=1..3` (both ends included), `bounces=2..`, `bounces=..3` give the
    /// range; several of them are joined and must leave no gap. `lobes=diffuse+glossy` gives the lobes (`none` for none): without a
    /// class (`diffuse`, `glossy`, `specular`) all classes are meant, without a side (`reflection`, `transmission`) both sides; media
    /// count when `volume` is named or no `lobes` part is given.
    fn from_str(text: &str) -> Result<Self> {
        let wrong = |value: &str, cause: &str| Error::setting(NAME, format!("{value:?}"), cause);
        let mut ranges: Vec<(u32, Option<u32>)> = Vec::new();
        let mut lobes = None;
        for part in text.split(',').map(str::trim) {
            if let Some((_, min, max)) = RANGE_NAMES.iter().find(|(name, ..)| *name == part) {
                ranges.push((*min, *max));
            } else if part == "all" {
                ranges.push((0, None));
            } else if let Some(range) = part.strip_prefix("bounces=") {
                ranges.push(parse_range(range).ok_or_else(|| {
                    wrong(
                        part,
                        "is no range of bounces: write bounces=2, bounces=1..3, bounces=2.. or bounces=..3",
                    )
                })?);
            } else if let Some(names) = part.strip_prefix("lobes=") {
                if lobes.replace(parse_lobes(names)?).is_some() {
                    return Err(wrong(text, "names lobes twice: join them with '+'"));
                }
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
        Self::new(joined.0, joined.1, lobes.unwrap_or(PATH_SET_LOBES))
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
    let mut lobes = 0;
    for name in text.split('+').map(str::trim) {
        if name == "none" {
            continue;
        }
        let (_, bit) = LOBE_NAMES
            .iter()
            .find(|(n, _)| *n == name)
            .ok_or_else(|| Error::setting(NAME, format!("{name:?}"), format!("is no lobe: a path set {GRAMMAR}")))?;
        lobes |= bit;
    }
    if lobes & CLASSES != 0 && lobes & SIDES == 0 {
        lobes |= SIDES;
    } else if lobes & SIDES != 0 && lobes & CLASSES == 0 {
        lobes |= CLASSES;
    }
    Ok(lobes)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_round_trips() {
        for (text, canonical) in [
            ("all", "all"),
            ("direct", "direct"),
            ("indirect", "indirect"),
            ("emitted, direct", "bounces=0..1"),
            ("direct,indirect", "bounces=1.."),
            ("bounces=1..3", "bounces=1..3"),
            ("bounces=..=3", "bounces=0..3"),
            ("bounces=2", "bounces=2"),
            ("bounces=1..1", "direct"),
            (
                "lobes=diffuse+specular",
                "all,lobes=diffuse+specular+reflection+transmission",
            ),
            (
                "lobes=reflection,direct",
                "direct,lobes=diffuse+glossy+specular+reflection",
            ),
            ("lobes=volume", "all,lobes=volume"),
            ("lobes=none", "all,lobes=none"),
            ("lobes=diffuse+glossy+specular+volume", "all"),
        ] {
            let set: PathSet = text.parse().unwrap();
            assert_eq!(set.to_string(), canonical);
            assert_eq!(canonical.parse::<PathSet>().unwrap(), set);
            let json = serde_json::to_string(&set).unwrap();
            assert_eq!(serde_json::from_str::<PathSet>(&json).unwrap(), set);
        }
        assert_eq!(PathSet::default(), "all".parse().unwrap());
        assert_eq!(PathSet::DIRECT, "direct".parse().unwrap());
        assert_eq!(PathSet::INDIRECT, "bounces=2..".parse().unwrap());
    }

    #[test]
    fn errors_teach() {
        for (text, word) in [
            ("", "emitted"),
            ("dirct", "indirect (2 and more)"),
            ("bounces=3..1", "empty"),
            ("bounces=x", "bounces=1..3"),
            ("bounces=0..5000", "4094"),
            ("emitted,indirect", "gap"),
            ("lobes=shiny", "glossy"),
            ("lobes=diffuse,lobes=glossy", "'+'"),
        ] {
            let message = text.parse::<PathSet>().unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
        assert!(PathSet::new(0, None, 64).is_err());
    }

    #[test]
    fn packed_form_holds_everything() {
        let set = PathSet::new(3, Some(9), LOBE_GLOSSY | LOBE_TRANSMISSION).unwrap();
        let p = set.packed();
        assert_eq!((p & PATH_SET_LOBES, (p >> 6) & 0xfff, p >> 18), (18, 3, 9));
        assert_eq!(PathSet::ALL.packed() >> 18, PATH_SET_UNBOUNDED);
        assert!(!set.contains(2) && set.contains(3) && set.contains(9) && !set.contains(10));
        assert!(set.continues(8) && !set.continues(9) && PathSet::ALL.continues(1 << 20));
    }
}
