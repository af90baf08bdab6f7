//! The order in which a point takes its lights, and where it stops.
//!
//! Source: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware, §6.3 (`MET-V3` … `MET-V6`, `MET-V8`). Lights
//! are taken in the order of their potential contributions until those taken carry a share of the sum of all. What they bring is then rescaled by what they
//! carry of it: the source calls that a compensation, but it holds only if the lights left out are seen as often as those taken, which they seldom are.
//!
//! Guarantees: deterministic; ties by index; with a share of one all lights are taken.

use glam::DVec3;

use crate::transport::environment::luminance;

/// Lights by potential, the strongest first; of equal ones in the order of their indices.
pub fn order_by_potential(keys: &[f64]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..keys.len() as u32).collect();
    order.sort_by(|a, b| keys[*b as usize].total_cmp(&keys[*a as usize]));
    order
}

/// One pass over neighbours from the strongest end on, which takes what has become weak down and lets the others up by a place: in time linear in the number of
/// lights.
pub fn bubble_pass(order: &mut [u32], keys: &[f64]) {
    for place in 1..order.len() {
        if keys[order[place] as usize] > keys[order[place - 1] as usize] {
            order.swap(place, place - 1);
        }
    }
}

/// How many lights of an order carry a share of the sum of all potentials: the least such number. All of them for a share of one.
pub fn lights_for_share(order: &[u32], keys: &[f64], share: f64) -> usize {
    let total: f64 = keys.iter().sum();
    if share >= 1.0 || total <= 0.0 {
        return if total > 0.0 { order.len() } else { 0 };
    }
    let mut taken = 0.0;
    for (place, light) in order.iter().enumerate() {
        taken += keys[*light as usize];
        if taken >= share * total {
            return place + 1;
        }
    }
    order.len()
}

/// Lights on the wrong side of where an order stops: those taken that are weaker than the last one taken, and those left out that are stronger.
pub fn misplaced_lights(order: &[u32], keys: &[f64], taken: usize) -> usize {
    let Some(last) = taken.checked_sub(1) else {
        return 0;
    };
    let critical = keys[order[last] as usize];
    let key = |light: &u32| keys[*light as usize];
    let weak = order[..taken].iter().filter(|light| key(light) < critical);
    let strong = order[taken..].iter().filter(|light| key(light) > critical);
    weak.count() + strong.count()
}

/// When lights are sorted anew, from point to point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resorting {
    /// At every so many points, at every one for 1 or 0; those between take the order as it is.
    Period(u32),
    /// After a bubble pass at each point, where more than this share of all lights is misplaced.
    Misplaced(f64),
}

/// An order that is kept from point to point.
#[derive(Debug, Clone)]
pub struct KeptOrder {
    resorting: Resorting,
    order: Vec<u32>,
    points: u32,
    /// Points at which lights were sorted.
    pub sorts: u64,
    /// Lights that might bring something and would have been taken where a limit had them sorted, had it been found exceeded only after their shadow rays.
    pub rolled_back: u64,
}

impl KeptOrder {
    /// Before the first point.
    pub fn new(resorting: Resorting) -> Self {
        Self {
            resorting,
            order: Vec::new(),
            points: 0,
            sorts: 0,
            rolled_back: 0,
        }
    }

    /// The lights that the next point takes, by their potentials there, in their order, so that they carry a share of the sum. The potentials alone tell how many
    /// they are and how many are misplaced, before any shadow ray is sent.
    pub fn next(&mut self, keys: &[f64], share: f64) -> &[u32] {
        let is_new = self.order.len() != keys.len();
        let taken = match self.resorting {
            Resorting::Period(period) => {
                let sorts = is_new || self.points.is_multiple_of(period.max(1));
                self.points = self.points.wrapping_add(1);
                if sorts {
                    self.sort(keys);
                }
                lights_for_share(&self.order, keys, share)
            }
            Resorting::Misplaced(limit) => {
                if is_new {
                    self.sort(keys);
                } else {
                    bubble_pass(&mut self.order, keys);
                }
                let taken = lights_for_share(&self.order, keys, share);
                if misplaced_lights(&self.order, keys, taken) as f64 > limit * keys.len() as f64 {
                    let in_vain = self.order[..taken].iter().filter(|light| keys[**light as usize] > 0.0);
                    self.rolled_back += in_vain.count() as u64;
                    self.sort(keys);
                    lights_for_share(&self.order, keys, share)
                } else {
                    taken
                }
            }
        };
        &self.order[..taken]
    }

    fn sort(&mut self, keys: &[f64]) {
        self.order = order_by_potential(keys);
        self.sorts += 1;
    }
}

/// What lights brought to a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gathered {
    /// Sum of the contributions of those that are seen, W·m⁻²·sr⁻¹.
    pub radiance: DVec3,
    /// Potential of those taken, seen or not, and of all, in luminance.
    pub taken: f64,
    /// Of all lights.
    pub total: f64,
    /// Shadow rays: lights taken that might bring something.
    pub rays: u32,
}

impl Gathered {
    /// As if the lights left out were seen as often as those taken: biased, by up to a few hundredths too bright, since they are weak for being far, and so
    /// seen less often.
    pub fn rescaled(&self) -> DVec3 {
        if self.taken > 0.0 {
            self.radiance * (self.total / self.taken)
        } else {
            self.radiance
        }
    }
}

/// Lets a point gather the lights in this order, each with a shadow ray where it might bring something; stops early once the sum's luminance has reached
/// `saturation`, beyond which a picture of low dynamic range is white.
pub fn gather_in_order(
    potentials: &[DVec3],
    order: &[u32],
    saturation: Option<f64>,
    mut is_seen: impl FnMut(u32) -> bool,
) -> Gathered {
    let mut gathered = Gathered {
        total: potentials.iter().map(|potential| luminance(*potential)).sum(),
        ..Gathered::default()
    };
    for light in order {
        let potential = potentials[*light as usize];
        if potential == DVec3::ZERO {
            continue;
        }
        gathered.rays += 1;
        gathered.taken += luminance(potential);
        if is_seen(*light) {
            gathered.radiance += potential;
        }
        if saturation.is_some_and(|limit| luminance(gathered.radiance) >= limit) {
            break;
        }
    }
    gathered
}

/// Lights whose potential is above a threshold, in the order of their indices: the rest gets no shadow ray and is left out.
pub fn above_threshold(keys: &[f64], threshold: f64) -> Vec<u32> {
    let all = (0u32..).zip(keys);
    all.filter(|(_, key)| **key > threshold)
        .map(|(light, _)| light)
        .collect()
}
