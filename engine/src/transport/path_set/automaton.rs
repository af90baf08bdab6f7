//! Deterministic automata over the lobes of a path, read from the eye to the light.
//!
//! Method: Thompson's construction and the subset construction (Hopcroft and Ullman, "Introduction to Automata Theory, Languages, and
//! Computation", 1979, 2.3–2.4), Moore's partition refinement for the smallest automaton (3.4), and the register of right languages for
//! unrolled counters (Revuz, "Minimisation of acyclic deterministic automata in linear time", TCS 1992). Guarantees: a [`Dfa`] is the smallest
//! one of its language and numbered by breadth-first search, so equal languages are equal values; work and memory are bounded.

use std::collections::{HashMap, HashSet, VecDeque};

use super::expression::Node;

/// Kinds of scattering events: diffuse, glossy and specular on either side, and media.
pub(super) const SYMBOLS: usize = 7;
/// The successor that no path leaves.
pub(super) const DEAD: u32 = u32::MAX;
/// Bounds on the work of a compilation.
const NFA_STATES_MAX: usize = 4096;
const DFA_STATES_MAX: usize = 1024;
const SUBSET_WORK_MAX: usize = 1 << 21;
const PRODUCT_STATES_MAX: usize = 4096;

/// An automaton grew beyond its bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TooLarge;

/// The smallest automaton of a language, without states that lead nowhere; its start is state 0, and it has none when it accepts nothing.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Dfa {
    pub next: Vec<[u32; SYMBOLS]>,
    pub accepts: Vec<bool>,
}

impl Dfa {
    pub fn len(&self) -> usize {
        self.next.len()
    }

    pub fn is_empty(&self) -> bool {
        self.next.is_empty()
    }

    /// The automaton of an expression in the order of the eye.
    pub fn of_expression(node: &Node) -> Result<Self, TooLarge> {
        let mut nfa = Nfa::default();
        let (start, end) = (nfa.state()?, nfa.state()?);
        nfa.add(node, start, end)?;
        nfa.determined(start, end)
    }

    /// Words of any length over some symbols, a bit each.
    pub fn repeated(symbols: u32) -> Self {
        let next = std::array::from_fn(|s| if symbols >> s & 1 != 0 { 0 } else { DEAD });
        Self {
            next: vec![next],
            accepts: vec![true],
        }
    }

    /// The smallest automaton of any one: Moore's refinement.
    pub fn minimized(next: &[[u32; SYMBOLS]], accepts: &[bool]) -> Self {
        let n = next.len();
        let class_of = |class: &[u32], state: u32| if state == DEAD { n as u32 } else { class[state as usize] };
        let mut class: Vec<u32> = accepts.iter().map(|a| u32::from(*a)).collect();
        // States that lead nowhere, the class n, are known beforehand.
        let live = live_states(next, accepts);
        for (state, live) in live.iter().enumerate() {
            if !live {
                class[state] = n as u32;
            }
        }
        let mut count = 0;
        loop {
            let mut known: HashMap<(u32, [u32; SYMBOLS]), u32> = HashMap::new();
            let refined = (0..n)
                .map(|state| {
                    if !live[state] {
                        return n as u32;
                    }
                    let key = (class[state], next[state].map(|s| class_of(&class, s)));
                    let fresh = known.len() as u32;
                    *known.entry(key).or_insert(fresh)
                })
                .collect();
            let before = std::mem::replace(&mut count, known.len());
            class = refined;
            if count == before {
                break;
            }
        }
        let mut quotient = vec![[DEAD; SYMBOLS]; count];
        let mut accepting = vec![false; count];
        for state in (0..n).filter(|s| live[*s]) {
            let target = class[state] as usize;
            accepting[target] = accepts[state];
            quotient[target] = next[state].map(|s| match class_of(&class, s) {
                dead if dead == n as u32 => DEAD,
                known => known,
            });
        }
        let start = if live.first() == Some(&true) { class[0] } else { DEAD };
        Self::numbered(start, &quotient, &accepting)
    }

    /// The reachable part in breadth-first order.
    fn numbered(start: u32, next: &[[u32; SYMBOLS]], accepts: &[bool]) -> Self {
        let mut result = Self::default();
        if start == DEAD {
            return result;
        }
        let mut number = vec![DEAD; next.len()];
        number[start as usize] = 0;
        let (mut order, mut done) = (vec![start], 0);
        while done < order.len() {
            let state = order[done] as usize;
            done += 1;
            let successors = next[state].map(|s| {
                if s != DEAD && number[s as usize] == DEAD {
                    number[s as usize] = order.len() as u32;
                    order.push(s);
                }
                if s == DEAD { DEAD } else { number[s as usize] }
            });
            result.next.push(successors);
            result.accepts.push(accepts[state]);
        }
        result
    }

    /// Those words of the language that have `min`..=`max` symbols: counters unrolled from their end, equal right languages found in a register.
    pub fn of_lengths(&self, min: u32, max: Option<u32>) -> Self {
        if self.is_empty() || (min == 0 && max.is_none()) {
            return self.clone();
        }
        let (mut next, mut accepts) = (Vec::new(), Vec::new());
        let mut register: HashMap<(bool, [u32; SYMBOLS]), u32> = HashMap::new();
        // Where a count is beyond all bounds: the language itself, or nothing.
        let mut layer: Vec<u32> = match max {
            Some(_) => vec![DEAD; self.len()],
            None => {
                for state in 0..self.len() {
                    register.insert((self.accepts[state], self.next[state]), state as u32);
                }
                (next, accepts) = (self.next.clone(), self.accepts.clone());
                (0..self.len() as u32).collect()
            }
        };
        let first = max.map_or(min, |m| m + 1);
        for count in (0..first).rev() {
            layer = (0..self.len())
                .map(|state| {
                    let accepted = self.accepts[state] && count >= min;
                    let successors = self.next[state].map(|s| if s == DEAD { DEAD } else { layer[s as usize] });
                    if !accepted && successors == [DEAD; SYMBOLS] {
                        return DEAD;
                    }
                    *register.entry((accepted, successors)).or_insert_with(|| {
                        next.push(successors);
                        accepts.push(accepted);
                        next.len() as u32 - 1
                    })
                })
                .collect();
        }
        Self::numbered(layer[0], &next, &accepts)
    }

    /// Words of which `keep` is true, given whether they are in the one and in the other language.
    pub fn product(&self, other: &Self, keep: impl Fn(bool, bool) -> bool) -> Result<Self, TooLarge> {
        let accepts_at = |dfa: &Self, state: u32| state != DEAD && dfa.accepts[state as usize];
        let follow = |dfa: &Self, state: u32, s: usize| {
            if state == DEAD {
                DEAD
            } else {
                dfa.next[state as usize][s]
            }
        };
        let start = |dfa: &Self| if dfa.is_empty() { DEAD } else { 0 };
        let mut number = HashMap::from([((start(self), start(other)), 0u32)]);
        let mut order = vec![(start(self), start(other))];
        let (mut next, mut accepts) = (Vec::new(), Vec::new());
        while next.len() < order.len() {
            let (a, b) = order[next.len()];
            let successors = std::array::from_fn(|s| {
                let pair = (follow(self, a, s), follow(other, b, s));
                *number.entry(pair).or_insert_with(|| {
                    order.push(pair);
                    order.len() as u32 - 1
                })
            });
            if order.len() > PRODUCT_STATES_MAX {
                return Err(TooLarge);
            }
            next.push(successors);
            accepts.push(keep(accepts_at(self, a), accepts_at(other, b)));
        }
        Ok(Self::minimized(&next, &accepts))
    }

    /// Whether every word of the language is one of the other's.
    pub fn is_subset_of(&self, other: &Self) -> bool {
        if self.is_empty() {
            return true;
        }
        let start = (0u32, if other.is_empty() { DEAD } else { 0 });
        let (mut seen, mut queue) = (HashSet::from([start]), VecDeque::from([start]));
        while let Some((a, b)) = queue.pop_front() {
            if self.accepts[a as usize] && !(b != DEAD && other.accepts[b as usize]) {
                return false;
            }
            for (s, &after) in self.next[a as usize].iter().enumerate() {
                let pair = (after, if b == DEAD { DEAD } else { other.next[b as usize][s] });
                if after != DEAD && seen.insert(pair) {
                    queue.push_back(pair);
                }
            }
        }
        true
    }

    /// Lengths of the shortest and longest word (`None`: no bound) and the symbols that occur, a bit each, if there is a word at all.
    pub fn extent(&self) -> Option<(u32, Option<u32>, u32)> {
        let mut shortest = vec![u32::MAX; self.len()];
        *shortest.first_mut()? = 0;
        let mut entries = vec![0u32; self.len()];
        let mut symbols = 0;
        // Numbers are in breadth-first order: shortest ways are known when a state's turn comes.
        for state in 0..self.len() {
            for (s, &after) in self.next[state].iter().enumerate().filter(|(_, after)| **after != DEAD) {
                let after = after as usize;
                shortest[after] = shortest[after].min(shortest[state] + 1);
                entries[after] += 1;
                symbols |= 1 << s;
            }
        }
        let least = (0..self.len())
            .filter(|s| self.accepts[*s])
            .map(|s| shortest[s])
            .min()?;
        // Longest ways by taking off states that nothing enters any more; a cycle is never taken off.
        let mut longest = vec![0u32; self.len()];
        let mut free: Vec<usize> = (0..self.len()).filter(|s| entries[*s] == 0).collect();
        let mut taken = 0;
        while let Some(state) = free.pop() {
            taken += 1;
            for &after in self.next[state].iter().filter(|after| **after != DEAD) {
                let after = after as usize;
                longest[after] = longest[after].max(longest[state] + 1);
                entries[after] -= 1;
                if entries[after] == 0 {
                    free.push(after);
                }
            }
        }
        let most = (taken == self.len())
            .then(|| (0..self.len()).filter(|s| self.accepts[*s]).map(|s| longest[s]).max())
            .flatten();
        Some((least, most, symbols))
    }
}

/// States from which an accepting one can be reached.
fn live_states(next: &[[u32; SYMBOLS]], accepts: &[bool]) -> Vec<bool> {
    let mut before = vec![Vec::new(); next.len()];
    for (state, successors) in next.iter().enumerate() {
        for &s in successors.iter().filter(|s| **s != DEAD) {
            before[s as usize].push(state);
        }
    }
    let mut live = accepts.to_vec();
    let mut open: Vec<usize> = (0..next.len()).filter(|s| accepts[*s]).collect();
    while let Some(state) = open.pop() {
        for &from in &before[state] {
            if !std::mem::replace(&mut live[from], true) {
                open.push(from);
            }
        }
    }
    live
}

/// An automaton with free moves.
#[derive(Default)]
struct Nfa {
    free: Vec<Vec<u32>>,
    /// Symbols, a bit each, and where they lead.
    moves: Vec<Vec<(u32, u32)>>,
}

impl Nfa {
    fn state(&mut self) -> Result<u32, TooLarge> {
        if self.free.len() >= NFA_STATES_MAX {
            return Err(TooLarge);
        }
        self.free.push(Vec::new());
        self.moves.push(Vec::new());
        Ok(self.free.len() as u32 - 1)
    }

    fn skip(&mut self, from: u32, to: u32) {
        self.free[from as usize].push(to);
    }

    /// Ways from one state to another by the words of an expression.
    fn add(&mut self, node: &Node, from: u32, to: u32) -> Result<(), TooLarge> {
        match node {
            Node::Set(symbols) => self.moves[from as usize].push((*symbols, to)),
            Node::Cat(parts) => {
                let mut at = from;
                for part in parts {
                    let after = self.state()?;
                    self.add(part, at, after)?;
                    at = after;
                }
                self.skip(at, to);
            }
            Node::Alt(parts) => {
                for part in parts {
                    // States of their own keep a loop within one alternative.
                    let (first, last) = (self.state()?, self.state()?);
                    self.skip(from, first);
                    self.add(part, first, last)?;
                    self.skip(last, to);
                }
            }
            Node::Repeat(part, min, max) => {
                let mut at = from;
                for _ in 0..*min {
                    let after = self.state()?;
                    self.add(part, at, after)?;
                    at = after;
                }
                match max {
                    Some(max) => {
                        for _ in *min..*max {
                            let after = self.state()?;
                            self.skip(at, to);
                            self.add(part, at, after)?;
                            at = after;
                        }
                    }
                    None => {
                        let (first, last) = (self.state()?, self.state()?);
                        self.skip(at, first);
                        self.add(part, first, last)?;
                        self.skip(last, first);
                        at = first;
                    }
                }
                self.skip(at, to);
            }
        }
        Ok(())
    }

    /// Closes a set of states under free moves.
    fn closed(&self, mut states: Vec<u32>) -> Vec<u32> {
        let mut seen = vec![false; self.free.len()];
        states.retain(|s| !std::mem::replace(&mut seen[*s as usize], true));
        let mut done = 0;
        while done < states.len() {
            for &s in &self.free[states[done] as usize] {
                if !std::mem::replace(&mut seen[s as usize], true) {
                    states.push(s);
                }
            }
            done += 1;
        }
        states.sort_unstable();
        states
    }

    fn determined(&self, start: u32, end: u32) -> Result<Dfa, TooLarge> {
        let first = self.closed(vec![start]);
        let mut number = HashMap::from([(first.clone(), 0u32)]);
        let mut order = vec![first];
        let (mut next, mut accepts) = (Vec::new(), Vec::new());
        let mut work = 0;
        while next.len() < order.len() {
            let states = order[next.len()].clone();
            let mut successors = [DEAD; SYMBOLS];
            for (s, successor) in successors.iter_mut().enumerate() {
                let moves = states.iter().flat_map(|state| &self.moves[*state as usize]);
                let targets: Vec<u32> = moves.filter(|(on, _)| on >> s & 1 != 0).map(|(_, to)| *to).collect();
                if targets.is_empty() {
                    continue;
                }
                let closed = self.closed(targets);
                work += closed.len();
                let fresh = order.len() as u32;
                *successor = *number.entry(closed.clone()).or_insert(fresh);
                if *successor == fresh {
                    order.push(closed);
                }
            }
            if order.len() > DFA_STATES_MAX || work > SUBSET_WORK_MAX {
                return Err(TooLarge);
            }
            next.push(successors);
            accepts.push(states.binary_search(&end).is_ok());
        }
        Ok(Dfa::minimized(&next, &accepts))
    }
}
