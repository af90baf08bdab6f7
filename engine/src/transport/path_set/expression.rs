//! Path expressions: their tree, their smallest readable text, and the way back from an automaton.
//!
//! After Heckbert, "Adaptive Radiosity Textures for Bidirectional Ray Tracing" (SIGGRAPH 1990), section 2: regular expressions over the
//! events between a light (L) and the eye (E). From an automaton an expression comes by Arden's rule, one state after another (Arden, "Delayed-logic
//! and finite-state machines", 1961). Guarantees: what is printed reads as the same set; its size is bounded.

use std::fmt::Write;

use super::automaton::{DEAD, Dfa};
use super::{
    LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, LOBE_SPECULAR, LOBE_TRANSMISSION, LOBE_VOLUME, PATH_SET_LOBES,
};

/// Letters of the classes.
pub(super) const CLASSES: [(char, u32); 4] = [
    ('D', LOBE_DIFFUSE),
    ('G', LOBE_GLOSSY),
    ('S', LOBE_SPECULAR),
    ('V', LOBE_VOLUME),
];
/// Suffixes of the sides.
pub(super) const SIDES: [(char, u32); 2] = [('r', LOBE_REFLECTION), ('t', LOBE_TRANSMISSION)];
/// Most nodes of an expression that is made from an automaton.
const NODES_MAX: usize = 512;

/// A regular expression over sets of lobes, a bit each. The empty word is a sequence of nothing, the empty language a choice among nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Node {
    Set(u32),
    Cat(Vec<Node>),
    Alt(Vec<Node>),
    Repeat(Box<Node>, u32, Option<u32>),
}

impl Node {
    pub const EMPTY: Self = Self::Cat(Vec::new());
    const NEVER: Self = Self::Alt(Vec::new());

    /// The words read from their other end.
    pub fn reversed(&self) -> Self {
        match self {
            Self::Set(set) => Self::Set(*set),
            Self::Cat(parts) => Self::Cat(parts.iter().rev().map(Self::reversed).collect()),
            Self::Alt(parts) => Self::Alt(parts.iter().map(Self::reversed).collect()),
            Self::Repeat(part, min, max) => Self::Repeat(Box::new(part.reversed()), *min, *max),
        }
    }

    fn nodes(&self) -> usize {
        1 + match self {
            Self::Set(_) => 0,
            Self::Cat(parts) | Self::Alt(parts) => parts.iter().map(Self::nodes).sum(),
            Self::Repeat(part, ..) => part.nodes(),
        }
    }

    fn accepts_empty(&self) -> bool {
        match self {
            Self::Set(_) => false,
            Self::Cat(parts) => parts.iter().all(Self::accepts_empty),
            Self::Alt(parts) => parts.iter().any(Self::accepts_empty),
            Self::Repeat(part, min, _) => *min == 0 || part.accepts_empty(),
        }
    }

    /// The parts of a sequence.
    fn parts(self) -> Vec<Self> {
        match self {
            Self::Cat(parts) => parts,
            other => vec![other],
        }
    }

    fn of_parts(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 {
            parts.remove(0)
        } else {
            Self::Cat(parts)
        }
    }

    /// A part with the number of times it is there.
    fn times(self) -> (Self, u32, Option<u32>) {
        match self {
            Self::Repeat(part, min, max) => (*part, min, max),
            other => (other, 1, Some(1)),
        }
    }

    fn of_times(part: Self, min: u32, max: Option<u32>) -> Self {
        match (min, max) {
            (_, Some(0)) => Self::EMPTY,
            (1, Some(1)) => part,
            _ => Self::Repeat(Box::new(part), min, max),
        }
    }

    /// One after the other; equal neighbours become a count.
    fn then(self, other: Self) -> Self {
        if self == Self::NEVER || other == Self::NEVER {
            return Self::NEVER;
        }
        let mut parts = self.parts();
        for part in other.parts() {
            let Some(last) = parts.pop() else {
                parts.push(part);
                continue;
            };
            let ((a, a_min, a_max), (b, b_min, b_max)) = (last.clone().times(), part.clone().times());
            if a == b {
                let max = a_max.zip(b_max).map(|(x, y)| x + y);
                parts.push(Self::of_times(a, a_min + b_min, max));
            } else {
                parts.extend([last, part]);
            }
        }
        Self::of_parts(parts)
    }

    /// Either; what both begin or end with is taken out.
    fn or(self, other: Self) -> Self {
        if self == Self::NEVER || self == other {
            return other;
        }
        if other == Self::NEVER {
            return self;
        }
        if self == Self::EMPTY {
            return other.optional();
        }
        if other == Self::EMPTY {
            return self.optional();
        }
        if let (Self::Set(a), Self::Set(b)) = (&self, &other) {
            return Self::Set(a | b);
        }
        let (mut a, mut b) = (self.clone().parts(), other.clone().parts());
        if a.first() == b.first() {
            let first = a.remove(0);
            b.remove(0);
            return first.then(Self::of_parts(a).or(Self::of_parts(b)));
        }
        if a.last() == b.last()
            && let Some(last) = a.pop()
        {
            b.pop();
            return Self::of_parts(a).or(Self::of_parts(b)).then(last);
        }
        let mut choices = match self {
            Self::Alt(choices) => choices,
            one => vec![one],
        };
        let more = match other {
            Self::Alt(choices) => choices,
            one => vec![one],
        };
        for choice in more {
            let same = choices.iter_mut().find_map(|known| match (known, &choice) {
                (Self::Set(known), Self::Set(set)) => {
                    *known |= set;
                    Some(())
                }
                (known, choice) => (known == choice).then_some(()),
            });
            if same.is_none() {
                choices.push(choice);
            }
        }
        Self::Alt(choices)
    }

    fn optional(self) -> Self {
        match self {
            node if node.accepts_empty() => node,
            Self::Repeat(part, 1, max) => Self::Repeat(part, 0, max),
            node => Self::of_times(node, 0, Some(1)),
        }
    }

    fn any_number(self) -> Self {
        match self {
            node if node == Self::NEVER || node == Self::EMPTY => Self::EMPTY,
            Self::Repeat(part, 0 | 1, _) => Self::Repeat(part, 0, None),
            node => Self::Repeat(Box::new(node), 0, None),
        }
    }

    /// An expression for an automaton, in the order it reads; `None` when it would be too long to be of use.
    pub fn of_automaton(dfa: &Dfa) -> Option<Self> {
        let n = dfa.len();
        let mut to = vec![vec![Self::NEVER; n]; n];
        let mut end: Vec<Self> = (dfa.accepts.iter())
            .map(|a| if *a { Self::EMPTY } else { Self::NEVER })
            .collect();
        for (state, successors) in dfa.next.iter().enumerate() {
            for (s, &after) in successors.iter().enumerate().filter(|(_, after)| **after != DEAD) {
                let way = &mut to[state][after as usize];
                *way = std::mem::replace(way, Self::NEVER).or(Self::Set(1 << s));
            }
        }
        for k in (0..n).rev() {
            let around = std::mem::replace(&mut to[k][k], Self::NEVER).any_number();
            if k == 0 {
                return Some(around.then(end[0].clone())).filter(|node| node.nodes() <= NODES_MAX);
            }
            for i in 0..k {
                let into = std::mem::replace(&mut to[i][k], Self::NEVER);
                if into == Self::NEVER {
                    continue;
                }
                let into = into.then(around.clone());
                for j in 0..k {
                    let way = into.clone().then(to[k][j].clone());
                    to[i][j] = std::mem::replace(&mut to[i][j], Self::NEVER).or(way);
                }
                end[i] = std::mem::replace(&mut end[i], Self::NEVER).or(into.then(end[k].clone()));
                if to[i].iter().chain(&end[i..=i]).any(|node| node.nodes() > NODES_MAX) {
                    return None;
                }
            }
        }
        Some(Self::NEVER)
    }

    /// The text between L and E.
    pub fn text(&self) -> String {
        let mut text = String::new();
        self.write(&mut text, true);
        text
    }

    /// `bound`: what stands beside it cannot take parts away from it, unless it is a choice.
    fn write(&self, text: &mut String, bound: bool) {
        match self {
            Self::Set(set) => text.push_str(&set_text(*set)),
            Self::Cat(parts) if bound => parts.iter().for_each(|part| part.write(text, true)),
            Self::Alt(parts) => {
                text.push('(');
                for (i, part) in parts.iter().enumerate() {
                    if i > 0 {
                        text.push('|');
                    }
                    part.write(text, true);
                }
                text.push(')');
            }
            Self::Cat(_) | Self::Repeat(..) if !bound => {
                text.push('(');
                self.write(text, true);
                text.push(')');
            }
            Self::Cat(_) => {}
            Self::Repeat(part, min, max) => {
                part.write(text, false);
                text.push_str(&count_text(*min, *max));
            }
        }
    }
}

/// `*`, `+`, `?`, `{2}`, `{2,}`, `{2,4}`.
pub(super) fn count_text(min: u32, max: Option<u32>) -> String {
    match (min, max) {
        (0, None) => "*".into(),
        (1, None) => "+".into(),
        (0, Some(1)) => "?".into(),
        (1, Some(1)) => String::new(),
        (n, None) => format!("{{{n},}}"),
        (n, Some(m)) if n == m => format!("{{{n}}}"),
        (n, Some(m)) => format!("{{{n},{m}}}"),
    }
}

/// `.`, `D`, `Gt`, `[DG]`, `[^S]`.
pub(super) fn set_text(set: u32) -> String {
    let items = |set: u32| -> Vec<String> {
        let mut items = Vec::new();
        for (letter, class) in CLASSES {
            if set & class == class {
                items.push(letter.to_string());
                continue;
            }
            for (suffix, side) in SIDES {
                if set & class & side != 0 {
                    items.push(format!("{letter}{suffix}"));
                }
            }
        }
        items
    };
    if set == PATH_SET_LOBES {
        return ".".into();
    }
    if let Some((suffix, _)) = SIDES.iter().find(|(_, side)| *side == set) {
        return format!(".{suffix}");
    }
    let (those, others) = (items(set), items(PATH_SET_LOBES & !set));
    if those.len() == 1 {
        return those.concat();
    }
    let mut text = String::from("[");
    if others.len() < those.len() {
        let _ = write!(text, "^{}", others.concat());
    } else {
        text.push_str(&those.concat());
    }
    text.push(']');
    text
}
