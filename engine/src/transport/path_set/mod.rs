//! Which light paths a picture contains: how often light is scattered, by what, and in which order.
//!
//! Errors are measured between pictures of equal path sets only. Notation: Heckbert, "Adaptive Radiosity Textures for Bidirectional Ray
//! Tracing" (SIGGRAPH 1990), section 2, with classes and sides of lobes; the grammar is that of `PathSet`'s `FromStr`, explained in
//! `docs/path-sets.md`. A set is a range of lengths and a finite automaton; sets of the same paths are equal, however they are written. The form that kernels
//! read is that of `transport/path_set.glsl`.

mod automaton;
mod expression;
mod parser;
mod text;

use std::hash::{Hash, Hasher};

use self::automaton::{DEAD, Dfa, SYMBOLS, TooLarge};
use self::expression::Node;
use super::bsdf::{LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, LOBE_SPECULAR, LOBE_TRANSMISSION};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::{
    self, PATH_SET_DEAD, PATH_SET_MAX_SHIFT, PATH_SET_MIN_SHIFT, PATH_SET_STATE_BITS, PATH_SET_STATES,
};
use crate::{Error, Result};

/// Scattering in media, beside the `LOBE_…` bits of surfaces.
pub const LOBE_VOLUME: u32 = constants::LOBE_VOLUME;
/// Every lobe and the media.
pub const PATH_SET_LOBES: u32 = constants::PATH_SET_LOBES;
/// Packed greatest number of bounces that stands for no bound.
pub const PATH_SET_UNBOUNDED: u32 = constants::PATH_SET_UNBOUNDED;

/// The setting's name in errors.
const NAME: &str = "path set";
const STATES: usize = PATH_SET_STATES as usize;
/// Successors of which each is none.
const NO_SUCCESSORS: u32 = (1 << (PATH_SET_STATE_BITS * SYMBOLS as u32)) - 1;

/// Successors after rough scattering, specular scattering and scattering in media.
const fn by_class(rough: u32, specular: u32, volume: u32) -> u32 {
    let (mut word, mut symbol) = (0, 0);
    while symbol < SYMBOLS as u32 {
        let next = match 1 << symbol {
            lobe if lobe & LOBE_VOLUME != 0 => volume,
            lobe if lobe & LOBE_SPECULAR != 0 => specular,
            _ => rough,
        };
        word |= next << (PATH_SET_STATE_BITS * symbol);
        symbol += 1;
    }
    word
}

/// A set of light paths.
///
/// A path is a word of scattering events between light and eye; each event is a lobe: diffuse, glossy or specular, reflected or
/// transmitted, or a scattering in media. The word without events is emitted light seen directly, words of one event are direct lighting.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PathSet {
    min_bounces: u32,
    max_bounces: Option<u32>,
    /// Of each state seven successors, read from the eye to the light; the start is state 0.
    successors: [u32; STATES],
    /// States in which a word may end, a bit each.
    accepting: u32,
}

impl Default for PathSet {
    fn default() -> Self {
        Self::ALL
    }
}

impl PathSet {
    /// Every path.
    pub const ALL: Self = Self::simple(0, None, PATH_SET_LOBES);
    /// Light that is emitted towards the eye.
    pub const EMITTED: Self = Self::simple(0, Some(0), PATH_SET_LOBES);
    /// Light that is scattered exactly once.
    pub const DIRECT: Self = Self::simple(1, Some(1), PATH_SET_LOBES);
    /// Light that is scattered twice or more.
    pub const INDIRECT: Self = Self::simple(2, None, PATH_SET_LOBES);
    /// Light that is emitted towards the eye or scattered once: `bounces=0..1`.
    pub const UP_TO_DIRECT: Self = Self::simple(0, Some(1), PATH_SET_LOBES);
    /// The same, scattered diffusely: `LE|LDE`.
    pub const UP_TO_DIFFUSE: Self = Self::simple(0, Some(1), LOBE_DIFFUSE);
    /// Light that is emitted towards the eye, or scattered once or twice, by no mirror: `bounces=0..2,lobes=diffuse+glossy`.
    pub const UP_TO_TWO_ROUGH: Self = Self::simple(0, Some(2), LOBE_DIFFUSE | LOBE_GLOSSY);
    /// The same, scattered however often: `bounces=0..,lobes=diffuse+glossy`.
    pub const ROUGH: Self = Self::simple(0, None, LOBE_DIFFUSE | LOBE_GLOSSY);
    /// Light that is emitted towards the eye, or scattered up to four times, diffusely each time: `bounces=0..4,lobes=diffuse`.
    pub const UP_TO_FOUR_DIFFUSE: Self = Self::simple(0, Some(4), LOBE_DIFFUSE);
    /// All but light that comes off a mirror to the first rough surface that the eye sees: `!L.*S[DG]S*E`.
    pub const LIT_OFF_NO_MIRROR: Self = Self::LIT_OFF_NO_MIRROR_STATES;
    /// What is seen, direct light, and both in a mirror: `LE|L.E|L.SE`.
    pub const DIRECT_AND_MIRRORED: Self = Self::once_more([1, 2, 1], 2);
    /// What is seen, direct light, and that once more, scattered by a rough surface: `LE|L.E|L.[DG]E`.
    pub const DIRECT_AND_ROUGH: Self = Self::once_more([1, 2, 2], 1);
    /// No path: a black picture.
    pub const EMPTY: Self = Self {
        min_bounces: 0,
        max_bounces: None,
        successors: [NO_SUCCESSORS; STATES],
        accepting: 0,
    };

    /// Through mirrors, at the first rough surface, and beyond, where nothing is left out.
    const LIT_OFF_NO_MIRROR_STATES: Self = {
        let mut successors = [NO_SUCCESSORS; STATES];
        successors[0] = by_class(1, 0, 2);
        successors[1] = by_class(2, PATH_SET_DEAD, 2);
        successors[2] = by_class(2, 2, 2);
        Self {
            min_bounces: 0,
            max_bounces: None,
            successors,
            accepting: 0b111,
        }
    };

    /// One scattering at most, which leads to these states by rough surfaces, specular ones and media, and one more from the state `goes_on`, 1 or 2.
    const fn once_more([rough, specular, volume]: [u32; 3], goes_on: usize) -> Self {
        let mut successors = [NO_SUCCESSORS; STATES];
        let ends = 3 - goes_on as u32;
        successors[0] = by_class(rough, specular, volume);
        successors[goes_on] = by_class(ends, ends, ends);
        Self {
            min_bounces: 0,
            max_bounces: None,
            successors,
            accepting: 0b111,
        }
    }

    /// Any order of some lobes.
    const fn simple(min_bounces: u32, max_bounces: Option<u32>, lobes: u32) -> Self {
        let mut successors = [NO_SUCCESSORS; STATES];
        let mut symbol = 0;
        while symbol < SYMBOLS as u32 {
            if lobes >> symbol & 1 != 0 {
                successors[0] &= !(PATH_SET_DEAD << (PATH_SET_STATE_BITS * symbol));
            }
            symbol += 1;
        }
        Self {
            min_bounces,
            max_bounces,
            successors,
            accepting: 1,
        }
    }

    /// All paths with `min`..=`max` bounces (`None`: no upper bound) by the allowed lobes, a bit each: what `LOBE_…` classes and sides
    /// have in common, and [`LOBE_VOLUME`].
    ///
    /// # Errors
    /// [`Error::Setting`] for a range that is empty or too long to count, or unknown bits.
    pub fn new(min: u32, max: Option<u32>, lobes: u32) -> Result<Self> {
        check_range(min, max)?;
        if lobes & !PATH_SET_LOBES != 0 {
            let cause = format!("has bits beyond {PATH_SET_LOBES:#x}");
            return Err(Error::setting(NAME, format!("lobes={lobes:#x}"), cause));
        }
        Ok(Self::simple_of(min, max, lobes))
    }

    /// [`Self::simple`] with one value for each set.
    fn simple_of(min: u32, max: Option<u32>, lobes: u32) -> Self {
        match (min, max, lobes) {
            (0, Some(0), _) | (0, _, 0) => Self::EMITTED,
            (1.., _, 0) => Self::EMPTY,
            _ => Self::simple(min, max, lobes),
        }
    }

    /// The paths of a set without a range of its own that have `min`..=`max` events. States stay as they are, so that the result is not in the
    /// one form that equal sets otherwise share.
    pub(crate) fn in_range(&self, min: u32, max: Option<u32>) -> Self {
        Self {
            min_bounces: min,
            max_bounces: max,
            ..*self
        }
    }

    /// A set by its automaton: of each state seven successors, four bits each, and the accepting states. States stay as they are, so that the result is not in the
    /// one form that equal sets otherwise share.
    pub(crate) fn of_states(successors: [u32; STATES], accepting: u32) -> Self {
        Self {
            min_bounces: 0,
            max_bounces: None,
            // Of seven successors.
            successors: successors.map(|word| word & NO_SUCCESSORS),
            accepting,
        }
    }

    /// The words of a language that have `min`..=`max` events.
    fn normalized(min: u32, max: Option<u32>, dfa: &Dfa) -> Result<Self> {
        if max.is_some_and(|max| max < min) {
            return Ok(Self::EMPTY);
        }
        if dfa.len() == 1 && dfa.accepts[0] {
            return Ok(Self::simple_of(
                min,
                max,
                dfa.extent().map_or(0, |(.., symbols)| symbols),
            ));
        }
        let whole = dfa.of_lengths(min, max);
        let Some((least, most, symbols)) = whole.extent() else {
            return Ok(Self::EMPTY);
        };
        if most == Some(0) {
            return Ok(Self::EMITTED);
        }
        if check_range(least, most).is_ok() && Dfa::repeated(symbols).of_lengths(least, most) == whole {
            return Ok(Self::simple(least, most, symbols));
        }
        // A range beside a short expression, or all in one: what is shorter to say. Bounds that change nothing are left out.
        let shortest = dfa.extent().map_or(0, |(shortest, ..)| shortest);
        let (min, max) = (if shortest >= min { 0 } else { least }, max.and(most));
        let length = |dfa: &Dfa, range: usize| {
            let node = Some(dfa).filter(|dfa| dfa.len() <= STATES).and_then(Node::of_automaton);
            node.map(|node| node.text().len() + range)
        };
        let lengths = (length(&whole, 0), length(dfa, Self::range_text(min, max).len() + 1));
        let (min, max, kept) = match lengths {
            (None, None) => return Err(too_many_states(dfa.len())),
            (Some(one), both) if both.is_none_or(|both| one <= both) => (0, None, &whole),
            _ => (min, max, dfa),
        };
        Ok(Self::of_automaton(kept).in_range(min, max))
    }

    /// The words of an automaton of at most [`PATH_SET_STATES`] states.
    fn of_automaton(dfa: &Dfa) -> Self {
        let mut set = Self::EMPTY;
        for (state, (next, accepts)) in dfa.next.iter().zip(&dfa.accepts).enumerate() {
            set.accepting |= u32::from(*accepts) << state;
            for (s, &after) in next.iter().enumerate().filter(|(_, after)| **after != DEAD) {
                let shift = PATH_SET_STATE_BITS * s as u32;
                set.successors[state] &= !(PATH_SET_DEAD << shift);
                set.successors[state] |= after << shift;
            }
        }
        set
    }

    /// The same paths by states alone, without a range beside them; `None` where that takes more than [`PATH_SET_STATES`].
    pub(crate) fn by_states(&self) -> Option<Self> {
        Some(self.whole())
            .filter(|whole| whole.len() <= STATES)
            .map(|whole| Self::of_automaton(&whole))
    }

    /// The automaton without the range.
    fn automaton(&self) -> Dfa {
        if self.is_empty() {
            return Dfa::default();
        }
        // States are numbered without gaps, and each leads on or accepts.
        let there = |state: &usize| self.successors[*state] != NO_SUCCESSORS || self.accepts(*state as u32);
        let states = (0..STATES).rev().find(there).map_or(1, |last| last + 1);
        let next = (0..states).map(|state| {
            std::array::from_fn(|s| match self.successor(state as u32, 1 << s) {
                PATH_SET_DEAD => DEAD,
                after => after,
            })
        });
        Dfa {
            next: next.collect(),
            accepts: (0..states as u32).map(|state| self.accepts(state)).collect(),
        }
    }

    /// The automaton of the set itself.
    fn whole(&self) -> Dfa {
        self.automaton().of_lengths(self.min_bounces, self.max_bounces)
    }

    fn accepts(&self, state: u32) -> bool {
        self.accepting >> state & 1 != 0
    }

    /// Twin of `path_set_successor`.
    fn successor(&self, state: u32, lobe: u32) -> u32 {
        let shift = PATH_SET_STATE_BITS * lobe.trailing_zeros();
        self.successors[state as usize] >> shift & PATH_SET_DEAD
    }

    /// The least number of bounces that is counted for beside the automaton.
    pub fn min_bounces(&self) -> u32 {
        self.min_bounces
    }

    /// The greatest number of bounces that is counted for beside the automaton, if there is one.
    pub fn max_bounces(&self) -> Option<u32> {
        self.max_bounces
    }

    /// The lobes that occur in paths of the set, a bit each.
    pub fn lobes(&self) -> u32 {
        let dead = |state: &u32, s: u32| state >> (PATH_SET_STATE_BITS * s) & PATH_SET_DEAD == PATH_SET_DEAD;
        (0..SYMBOLS as u32)
            .filter(|s| self.successors.iter().any(|state| !dead(state, *s)))
            .fold(0, |lobes, s| lobes | 1 << s)
    }

    /// Whether the set is more than a range of bounces and a set of lobes, so that paths have to carry a state.
    pub fn has_automaton(&self) -> bool {
        self.fields() != Self::simple(self.min_bounces, self.max_bounces, self.lobes()).fields()
    }

    /// Whether paths may go on after both a diffuse and a glossy reflection, but not in the same way: as these overlap in direction, a
    /// sampled one then has to be given to one of them.
    pub fn tells_reflections_apart(&self) -> bool {
        (0..STATES as u32).any(|state| {
            let after = |class: u32| self.successor(state, class & LOBE_REFLECTION);
            let (base, microfacets) = (after(LOBE_DIFFUSE), after(LOBE_GLOSSY));
            base != microfacets && base != PATH_SET_DEAD && microfacets != PATH_SET_DEAD
        })
    }

    /// The successors of each state, four bits for each lobe in the order of their bits.
    pub fn successors(&self) -> [u32; STATES] {
        self.successors
    }

    /// The states in which light counts, a bit each.
    pub fn accepting(&self) -> u32 {
        self.accepting
    }

    /// Whether a path belongs to the set: its events from the light to the eye, each one bit of [`PATH_SET_LOBES`].
    pub fn contains(&self, events: &[u32]) -> bool {
        let length = u32::try_from(events.len()).unwrap_or(u32::MAX);
        let mut state = 0;
        for event in events.iter().rev() {
            if event.count_ones() != 1 || event & PATH_SET_LOBES == 0 {
                return false;
            }
            state = self.successor(state, *event);
            if state == PATH_SET_DEAD {
                return false;
            }
        }
        self.accepts(state) && length >= self.min_bounces && self.max_bounces.is_none_or(|max| length <= max)
    }

    /// Whether no path belongs to it.
    pub fn is_empty(&self) -> bool {
        self.accepting == 0
    }

    /// Whether every path of it belongs to `other`.
    pub fn is_subset_of(&self, other: &Self) -> bool {
        self.whole().is_subset_of(&other.whole())
    }

    /// The paths of both sets.
    ///
    /// # Errors
    /// [`Error::Setting`] when that needs too large an automaton.
    pub fn intersection(&self, other: &Self) -> Result<Self> {
        let dfa = self.automaton().product(&other.automaton(), |a, b| a && b);
        let max = match (self.max_bounces, other.max_bounces) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
        Self::normalized(self.min_bounces.max(other.min_bounces), max, &dfa.map_err(too_large)?)
    }

    /// The paths of either set.
    ///
    /// # Errors
    /// [`Error::Setting`] when that needs too large an automaton.
    pub fn union(&self, other: &Self) -> Result<Self> {
        let dfa = self.whole().product(&other.whole(), |a, b| a || b);
        Self::normalized(0, None, &dfa.map_err(too_large)?)
    }

    /// The paths of this set that are not in `other`.
    ///
    /// # Errors
    /// [`Error::Setting`] when that needs too large an automaton.
    pub fn without(&self, other: &Self) -> Result<Self> {
        let dfa = self.whole().product(&other.whole(), |a, b| a && !b);
        Self::normalized(0, None, &dfa.map_err(too_large)?)
    }

    /// One word for a push constant: bits 0–6 lobes, 7–18 least and 19–30 greatest number of bounces.
    pub fn packed(&self) -> u32 {
        self.lobes()
            | self.min_bounces << PATH_SET_MIN_SHIFT
            | self.max_bounces.unwrap_or(PATH_SET_UNBOUNDED) << PATH_SET_MAX_SHIFT
    }

    /// What tells most sets apart without work.
    fn fields(&self) -> (u32, Option<u32>, [u32; STATES], u32) {
        (self.min_bounces, self.max_bounces, self.successors, self.accepting)
    }

    /// Whether a range stands beside an automaton: such sets have more than one form.
    fn has_both(&self) -> bool {
        (self.min_bounces, self.max_bounces) != (0, None) && self.has_automaton()
    }
}

impl PartialEq for PathSet {
    fn eq(&self, other: &Self) -> bool {
        self.fields() == other.fields() || ((self.has_both() || other.has_both()) && self.whole() == other.whole())
    }
}

impl Eq for PathSet {}

impl Hash for PathSet {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        // Equal sets of different forms have automata.
        if !self.has_automaton() {
            self.fields().hash(hasher);
        }
    }
}

fn too_large(_: TooLarge) -> Error {
    let cause = "needs too large an automaton: use smaller counts, or render the parts one by one";
    Error::setting(NAME, "the expression", cause)
}

fn too_many_states(states: usize) -> Error {
    let cause = if states <= STATES {
        "has no expression of a reasonable length: render the parts one by one".into()
    } else {
        format!(
            "needs an automaton of {states} states, but a path can carry {STATES}: use smaller counts, leave long counts to \
             bounces=A..B, or render the parts one by one"
        )
    };
    Error::setting(NAME, "the expression", cause)
}

/// Refuses ranges of bounces that are empty or too long to count.
fn check_range(min: u32, max: Option<u32>) -> Result<()> {
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
    Ok(())
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PATHSET",
    name: "restriction of a picture to a set of light paths",
    role: Role::Service,
    limits: "Expressions of more than 512 terms, or whose automata have more than 1024 states, are refused.",
    sources: &[sources::HECKBERT_1990.at("path notation")],
    shaders: &["shaders/transport/path_set.glsl"],
    tests: &[
        "engine/src/transport/path_set/tests.rs::text_round_trips",
        "engine/src/transport/path_set/tests.rs::automata_accept_what_backtracking_accepts",
        "tests/tests/paths/path_sets.rs::glass_casts_caustics_that_are_a_part",
        "tests/tests/paths/path_sets.rs::coats_over_diffuse_bases_are_told_apart",
        "tests/tests/paths/path_sets.rs::rough_metal_is_a_part",
        "tests/tests/paths/path_tracer.rs::path_sets_are_a_partition",
        "engine/src/transport/bsdf/tests.rs::masks_divide_the_whole",
    ],
    api: &["clerestory::transport::PathSet"],
    settings: &["clerestory render --path-set direct"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
