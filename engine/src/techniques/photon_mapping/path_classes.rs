//! How light paths of an expression are parted between eye paths and maps of photons.
//!
//! The automaton of a path set reads a path from the eye to the light. A photon has been scattered by the events that come last, so that it counts where the state that the
//! eye path is in, after the scattering at the photon, is one of those from which the photon's events lead to an accepting state. Photons of the same such states
//! are a class; a further scattering by a lobe takes a class to one that depends on the lobe alone. Classes are numbered as walks of their automaton, from the one at
//! the light on.
//!
//! Eye paths have an automaton of two floors: one of specular and glossy scattering, on which the maps are asked, and one behind a diffuse scattering or one in a medium, where
//! they gather direct light alone. Or they go on behind one in a medium, and share what they find there with the map: then what they find is all but light that a mirror scatters first, for which
//! a state also says whether the last scattering was by one. States of the first floor are numbered as those of the path set that they stand for are met.

use crate::gpu::shaders::constants::{
    ASKING_STATES as ASKING, CLASSES_IN_MEDIA_SHIFT, CLASSES_ON_SURFACES, LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION,
    LOBE_SPECULAR, LOBE_VOLUME, PATH_SET_DEAD, PATH_SET_LOBE_COUNT, PATH_SET_STATE_BITS, PATH_SET_STATES,
    PHOTON_CLASSES,
};
use crate::transport::PathSet;
use std::collections::HashMap;

const STATES: usize = PATH_SET_STATES as usize;
/// States of eye paths that may ask, at most: what queries are told of each is a word.
pub(super) const ASKING_STATES: usize = ASKING as usize;
/// The scatterings after which maps of surfaces and of media are asked.
const SURFACE_LOBE: u32 = LOBE_DIFFUSE & LOBE_REFLECTION;
/// Where the classes that count in media stand in a state's word.
const VOLUME_SHIFT: u32 = CLASSES_IN_MEDIA_SHIFT;

/// Light paths of an expression, parted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PathClasses {
    /// What eye paths gather by themselves; with the states in which they ask.
    pub eye: PathSet,
    /// Of each asking state the classes of photons that count: on surfaces a bit each, in media 16 bits higher.
    pub asks: [u32; ASKING_STATES],
    /// Of each class its successors by lobe, as those of states of path sets.
    pub next: [u32; PHOTON_CLASSES as usize],
}

impl PathClasses {
    /// Parts a set without a range of bounces; the maps have direct light, too, where `direct` says so, and eye paths that go on in media share it where `shares` does.
    ///
    /// # Errors
    /// What there is too much of.
    pub fn new(set: &PathSet, direct: bool, shares: bool) -> Result<Self, &'static str> {
        let after = |state: u32, lobe: u32| {
            set.successors()[state as usize] >> (PATH_SET_STATE_BITS * lobe.trailing_zeros()) & PATH_SET_DEAD
        };
        let lobes = || (0..PATH_SET_LOBE_COUNT).map(|symbol| 1u32 << symbol);
        // Classes: sets of states, a bit each.
        let mut known = HashMap::from([(set.accepting(), 0u32)]);
        let (mut classes, mut next) = (vec![set.accepting()], [u32::MAX; PHOTON_CLASSES as usize]);
        let mut class = 0;
        while class < classes.len() {
            for (symbol, lobe) in lobes().enumerate() {
                let leads = |state: &u32| {
                    let after = after(*state, lobe);
                    after != PATH_SET_DEAD && classes[class] >> after & 1 != 0
                };
                let states = (0..PATH_SET_STATES)
                    .filter(leads)
                    .fold(0u32, |states, state| states | 1 << state);
                let to = if states == 0 {
                    PATH_SET_DEAD
                } else {
                    let count = classes.len() as u32;
                    *known.entry(states).or_insert_with(|| {
                        classes.push(states);
                        count
                    })
                };
                if classes.len() > PHOTON_CLASSES as usize {
                    return Err("tells more histories of photons apart than their records can");
                }
                let shift = PATH_SET_STATE_BITS * symbol as u32;
                next[class] = next[class] & !(PATH_SET_DEAD << shift) | to << shift;
            }
            class += 1;
        }
        let (eye, asking) = eye_states(set, direct, shares)?;
        let counting = |state: u32, lobe: u32| match after(state, lobe) {
            PATH_SET_DEAD => 0,
            after => (0..classes.len()).fold(0u32, |bits, class| bits | (classes[class] >> after & 1) << class),
        };
        let mut asks = [0; ASKING_STATES];
        for (asks, state) in asks.iter_mut().zip(&asking) {
            *asks = counting(*state, SURFACE_LOBE) | counting(*state, LOBE_VOLUME) << VOLUME_SHIFT;
        }
        Ok(Self { eye, asks, next })
    }

    /// The states of eye paths that ask on surfaces, and those that ask in media, a bit each.
    pub fn asking(&self) -> [u32; 2] {
        [0, VOLUME_SHIFT].map(|shift| {
            let asks = |state: usize| self.asks[state] >> shift & CLASSES_ON_SURFACES != 0;
            (0..ASKING_STATES).fold(0, |bits, state| bits | u32::from(asks(state)) << state)
        })
    }

    /// Successors of classes by scattering in a medium, four bits each.
    pub fn next_in_media(&self) -> [u32; 2] {
        let mut words = [u32::MAX; 2];
        for (class, next) in self.next.iter().enumerate() {
            let to = next >> (PATH_SET_STATE_BITS * LOBE_VOLUME.trailing_zeros()) & PATH_SET_DEAD;
            let (word, shift) = (class / 8, PATH_SET_STATE_BITS * (class as u32 % 8));
            words[word] = words[word] & !(PATH_SET_DEAD << shift) | to << shift;
        }
        words
    }
}

/// Behind the first floor.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Behind {
    /// Of the path set.
    state: u32,
    /// Light counts where the path set has it.
    counts: bool,
    /// The path may be scattered further.
    goes_on: bool,
}

/// States behind a scattering in a medium from which light counts sooner or later where paths go on: of the path set, and whether it counts there.
fn fruitful(set: &PathSet, after: impl Fn(u32, u32) -> u32) -> impl Fn(u32, bool) -> bool {
    let accepts = |state: u32| set.accepting() >> state & 1 != 0;
    let mut fruitful = [[false; 2]; STATES];
    loop {
        let before = fruitful;
        for state in 0..PATH_SET_STATES {
            let leads = |symbol: u32| {
                let lobe = 1u32 << symbol;
                let to = after(state, lobe);
                to != PATH_SET_DEAD && before[to as usize][usize::from(lobe & LOBE_SPECULAR == 0)]
            };
            let goes_on = (0..PATH_SET_LOBE_COUNT).any(leads);
            fruitful[state as usize] = [goes_on, goes_on || accepts(state)];
        }
        if fruitful == before {
            return move |state: u32, counts: bool| fruitful[state as usize][usize::from(counts)];
        }
    }
}

/// The automaton of eye paths, and the states of the path set that its asking states stand for.
fn eye_states(set: &PathSet, direct: bool, shares: bool) -> Result<(PathSet, Vec<u32>), &'static str> {
    let on_first_floor = |lobe: u32| lobe & (LOBE_SPECULAR | LOBE_GLOSSY) != 0;
    let after = |state: u32, lobe: u32| {
        set.successors()[state as usize] >> (PATH_SET_STATE_BITS * lobe.trailing_zeros()) & PATH_SET_DEAD
    };
    // The first floor, then the second.
    let mut first = vec![0u32];
    let mut at = 0;
    while at < first.len() {
        for lobe in (0..PATH_SET_LOBE_COUNT)
            .map(|symbol| 1u32 << symbol)
            .filter(|lobe| on_first_floor(*lobe))
        {
            let to = after(first[at], lobe);
            if to != PATH_SET_DEAD && !first.contains(&to) {
                first.push(to);
            }
        }
        at += 1;
    }
    if first.len() > ASKING_STATES {
        return Err("tells more of what comes before the maps apart than queries can");
    }
    let fruitful = fruitful(set, after);
    // Where a path is after a scattering that leads off the first floor, or one behind it; `None` where no light counts any more.
    let behind = |from: Option<Behind>, to: u32, lobe: u32| {
        let next = match from {
            None if shares && lobe == LOBE_VOLUME => Behind {
                state: to,
                counts: !direct,
                goes_on: true,
            },
            None => Behind {
                state: to,
                counts: !direct,
                goes_on: false,
            },
            Some(from) => Behind {
                state: to,
                counts: lobe & LOBE_SPECULAR == 0,
                goes_on: from.goes_on,
            },
        };
        let counts = next.counts && set.accepting() >> to & 1 != 0;
        let kept = if next.goes_on {
            fruitful(to, next.counts)
        } else {
            counts
        };
        kept.then_some(next)
    };
    let mut second: Vec<Behind> = Vec::new();
    let mut successors = [u32::MAX; STATES];
    let mut accepting = 0;
    let mut from = 0;
    while from < first.len() + second.len() {
        let here = from.checked_sub(first.len()).map(|place| second[place]);
        let state = here.map_or_else(|| first[from], |here| here.state);
        let counts = here.is_none_or(|here| here.counts);
        accepting |= (set.accepting() >> state & u32::from(counts)) << from;
        for (symbol, lobe) in (0..PATH_SET_LOBE_COUNT).map(|symbol| (symbol, 1u32 << symbol)) {
            let to = after(state, lobe);
            let place = if to == PATH_SET_DEAD || here.is_some_and(|here| !here.goes_on) {
                PATH_SET_DEAD
            } else if here.is_none() && on_first_floor(lobe) {
                first.iter().position(|other| *other == to).unwrap_or(STATES) as u32
            } else if let Some(next) = behind(here, to, lobe) {
                let place = second.iter().position(|other| *other == next).unwrap_or_else(|| {
                    second.push(next);
                    second.len() - 1
                });
                (first.len() + place) as u32
            } else {
                PATH_SET_DEAD
            };
            if first.len() + second.len() > STATES {
                return Err("needs more states of eye paths than there are");
            }
            let shift = PATH_SET_STATE_BITS * symbol;
            successors[from] = successors[from] & !(PATH_SET_DEAD << shift) | place << shift;
        }
        from += 1;
    }
    Ok((PathSet::of_states(successors, accepting), first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// The events that come before the first place, seen from the eye, at which a map is asked, or all; from the eye on.
    fn parted(events: &[u32]) -> Option<usize> {
        events
            .iter()
            .position(|event| event & (LOBE_SPECULAR | LOBE_GLOSSY) == 0)
    }

    #[test]
    fn eye_paths_and_maps_have_every_path_once() {
        let mut random = Random(23);
        for text in [
            "L.*V.*E",
            "LS+VE",
            "LS+DE",
            "LD.*E",
            "L(S|V)*DE",
            "!LDE",
            "LV[DS]*E|LSE",
            "L.*E",
        ] {
            let set: PathSet = text.parse().unwrap();
            for [direct, shares] in [[false, false], [true, false], [false, true], [true, true]] {
                let classes = PathClasses::new(&set, direct, shares).unwrap();
                let (mut inside, mut by_maps, mut shared) = (0, 0, 0);
                for _ in 0..20_000 {
                    // From the eye to the light.
                    let length = random.below(6);
                    let events: Vec<u32> = (0..length)
                        .map(|_| 1 << random.below(PATH_SET_LOBE_COUNT as usize))
                        .collect();
                    let from_light: Vec<u32> = events.iter().rev().copied().collect();
                    let by_eye = classes.eye.contains(&from_light);
                    let by_map = parted(&events).is_some_and(|place| {
                        // Transmission through a diffuse surface is asked as its reflection is: the map knows no sides.
                        let lobe = if events[place] == LOBE_VOLUME {
                            LOBE_VOLUME
                        } else {
                            SURFACE_LOBE
                        };
                        if events[place] != lobe {
                            return false;
                        }
                        let walk = events[..place].iter().try_fold(0u32, |state, event| {
                            let to = classes.eye.successors()[state as usize]
                                >> (PATH_SET_STATE_BITS * event.trailing_zeros())
                                & PATH_SET_DEAD;
                            (to != PATH_SET_DEAD).then_some(to)
                        });
                        let class = events[place + 1..].iter().rev().try_fold(0u32, |class, event| {
                            let to = classes.next[class as usize] >> (PATH_SET_STATE_BITS * event.trailing_zeros())
                                & PATH_SET_DEAD;
                            (to != PATH_SET_DEAD).then_some(to)
                        });
                        // Photons that come straight from lights are there only where the maps have direct light.
                        let stored = direct || place + 1 < events.len();
                        let shift = if lobe == LOBE_VOLUME { VOLUME_SHIFT } else { 0 };
                        stored
                            && walk
                                .zip(class)
                                .is_some_and(|(state, class)| classes.asks[state as usize] >> (class + shift) & 1 != 0)
                    });
                    if parted(&events).is_some_and(|place| events[place] & (SURFACE_LOBE | LOBE_VOLUME) == 0) {
                        continue;
                    }
                    let contained = set.contains(&from_light);
                    inside += u32::from(contained);
                    by_maps += u32::from(by_map);
                    // What is scattered further behind a medium, and first not by a mirror, both have where they share it.
                    let further = parted(&events).is_some_and(|at| events[at] == LOBE_VOLUME && at + 1 < events.len());
                    if shares && further && from_light[0] & LOBE_SPECULAR == 0 {
                        assert_eq!(
                            [by_eye, by_map],
                            [contained; 2],
                            "{text}, direct {direct}: {events:?} shared"
                        );
                        shared += u32::from(contained);
                        continue;
                    }
                    assert!(!(by_eye && by_map), "{text}, direct {direct}: {events:?} twice");
                    assert_eq!(by_eye || by_map, contained, "{text}, direct {direct}: {events:?}");
                }
                assert!(inside > 0 && by_maps > 0, "{text}: {inside} {by_maps}");
                let some = shares && !["LS+VE", "LS+DE", "L(S|V)*DE", "LD.*E", "LV[DS]*E|LSE"].contains(&text);
                assert!(!some || shared > 0, "{text}: {shared}");
            }
        }
    }

    #[test]
    fn scattering_in_media_is_one_of_the_successors() {
        let classes = PathClasses::new(&"L.*V.*E".parse().unwrap(), false, false).unwrap();
        let next = |class: u32| classes.next_in_media()[0] >> (PATH_SET_STATE_BITS * class) & PATH_SET_DEAD;
        // After a scattering in a medium every state accepts, before it only one behind one.
        assert_eq!([next(0), next(1)], [1, 1]);
        assert_eq!(classes.asking(), [1, 1]);
        assert_eq!(classes.asks[0], 0b10 | 0b11 << VOLUME_SHIFT);
    }
}
