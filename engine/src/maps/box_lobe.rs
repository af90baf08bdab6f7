//! Lobes as sums of boxes: several means of a summed-area table stand for one lobe of a glossy reflection.
//!
//! Source: T. Engelhardt, C. Dachsbacher, "Octahedron Environment Maps", VMV 2008, §5 (one box a lobe; accurate reflectances want several).
//! How the boxes are chosen is the engine's own: a round lobe falls with the solid angle s of the cap about its middle, and n boxes of one
//! middle are a staircase with n steps in s. Thresholds and heights are those with the least ∫ (lobe − staircase)² ds among those of the lobe's
//! own integral, exact on a grid of caps by dynamic programming (R. Bellman, "On the Approximation of Curves by Line Segments Using
//! Dynamic Programming", CACM 4(6), 1961). Weights are positive and sum to 1: constant radiance stays constant, and none is negative.
//!
//! Bias: boxes are squares of the map where caps are discs of the sphere, as dense as the map is in their middles, and a square that
//! reaches over a fold bends with it. Steps alone converge as 1/n; large squares for discs do not converge, so that [`box_lobe`] gains little
//! by more than some four. [`ring_lobe`] divides the steps into rings of sectors, each a small box with a middle of its own: it follows the
//! sphere where the map is sheared. GLSL: `maps/box_lobe.glsl`; twin of the device's look-up: [`SatImage::sat_lobe`].

use super::Parametrization;
use super::directional_map::answer_of;
use super::spherical_sat::{SatImage, SphericalSat, half_width_at};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::Pass;
use crate::gpu::shaders::maps::sat_lobe;
use crate::gpu::shaders::types::{LobeBox, LobeQuery};
use crate::scene::normal_map::orthonormal_basis;
use crate::{Error, Result};
use glam::{DVec3, UVec2, Vec3};
use std::f64::consts::{PI, TAU};

/// A lobe of light that is reflected, round about the mirror direction: what is seen through it is the mean radiance by it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// That of [`ggx_lobe`](super::prefilter::ggx_lobe), with α in (0, 1].
    Ggx {
        /// Roughness squared.
        alpha: f64,
    },
    /// cosⁿ of the angle from the mirror direction (B. T. Phong, CACM 18(6), 1975), with an exponent of at least 0.
    Phong {
        /// n.
        exponent: f64,
    },
}

impl Lobe {
    /// Its value at an angle whose 1 − cos is `t`, not normalised: 1 in the middle, falling, and 0 from a right angle on.
    pub fn value(self, t: f64) -> f64 {
        match self {
            Self::Ggx { alpha } => super::prefilter::lobe(0.5 * t, alpha),
            Self::Phong { exponent } => (1.0 - t).max(0.0).powf(exponent),
        }
    }

    /// About how much of t its middle takes.
    fn width(self) -> f64 {
        match self {
            Self::Ggx { alpha } => 2.0 * alpha * alpha,
            Self::Phong { exponent } => 1.0 / (1.0 + exponent),
        }
    }

    fn check(self) -> Result<()> {
        match self {
            Self::Ggx { alpha } if !(alpha > 0.0 && alpha <= 1.0) => {
                Err(Error::setting("alpha", alpha, "is not in (0, 1]"))
            }
            Self::Phong { exponent } if !(exponent >= 0.0 && exponent.is_finite()) => {
                Err(Error::setting("exponent", exponent, "is not a number from 0 on"))
            }
            _ => Ok(()),
        }
    }
}

/// One of the boxes that stand for a lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedBox {
    /// Its middle in the lobe's frame, whose z is the lobe's direction and whose x and y are those of
    /// [`orthonormal_basis`].
    pub direction: DVec3,
    /// What it holds, sr.
    pub solid_angle: f64,
    /// Its mean's share of the whole.
    pub weight: f64,
}

/// Steps of a lobe at most.
pub const MAX_STEPS: usize = 16;
/// Boxes that the innermost step of a lobe of rings is made of, and each other one.
pub const RING_BOXES: [usize; 2] = [4, 8];
/// Caps among which thresholds are chosen, even in ln(1 + t/width).
const CAPS: usize = 384;
/// Steps of integration from one cap to the next.
const STEPS: usize = 8;

/// A step of a staircase: from one cap to a larger one the lobe is as high.
#[derive(Debug, Clone, Copy)]
struct Stair {
    /// Solid angles of the caps, sr.
    from: f64,
    to: f64,
    height: f64,
}

/// The nearest staircase of a lobe, of integral 1.
fn staircase(lobe: Lobe, steps: usize) -> Result<Vec<Stair>> {
    lobe.check()?;
    if !(1..=MAX_STEPS).contains(&steps) {
        return Err(Error::setting("steps", steps, format!("are not 1 to {MAX_STEPS}")));
    }
    let caps = Caps::of(lobe);
    let thresholds = caps.thresholds(steps);
    let end = *thresholds.last().unwrap_or(&CAPS);
    // What the staircase leaves out goes evenly over all of it: the best there is with the lobe's own integral.
    let lift = (1.0 - caps.held[end]) / caps.angles[end];
    let begins = [0].into_iter().chain(thresholds.iter().copied());
    let stairs = begins.zip(&thresholds).map(|(from, to)| Stair {
        from: caps.angles[from],
        to: caps.angles[*to],
        height: caps.mean(from, *to) + lift,
    });
    Ok(stairs.collect())
}

/// A lobe of as many boxes as steps, all about its middle, from the smallest to the largest.
///
/// # Errors
/// [`Error::Setting`] for a lobe out of range, or for a number of steps that is not in 1 to [`MAX_STEPS`].
pub fn box_lobe(lobe: Lobe, steps: usize) -> Result<Vec<WeightedBox>> {
    let stairs = staircase(lobe, steps)?;
    let next = stairs.iter().skip(1).map(|stair| stair.height).chain([0.0]);
    let boxes = stairs.iter().zip(next).map(|(stair, next)| WeightedBox {
        direction: DVec3::Z,
        solid_angle: stair.to,
        // Means of a falling lobe fall, but for their rounding where it is even.
        weight: (stair.height - next).max(0.0) * stair.to,
    });
    Ok(boxes.collect())
}

/// A lobe whose steps are divided into sectors, each of them a box at its centroid: [`RING_BOXES`] of each step.
///
/// # Errors
/// As [`box_lobe`].
pub fn ring_lobe(lobe: Lobe, steps: usize) -> Result<Vec<WeightedBox>> {
    let mut boxes = Vec::new();
    for (ring, stair) in staircase(lobe, steps)?.into_iter().enumerate() {
        let count = RING_BOXES[ring.min(1)];
        let sectors = count as f64;
        // In the chart of equal areas whose radius is √s a ring is one of the plane: the centroid of its sector.
        let (inner, outer) = (stair.from.sqrt(), stair.to.sqrt());
        let middle = 2.0 / 3.0 * (outer.powi(3) - inner.powi(3)) / (stair.to - stair.from);
        let half = PI / sectors;
        let radius = middle * half.sin() / half;
        let cos = 1.0 - radius * radius / TAU;
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        // Rings are turned by half a sector, one against the next.
        let turn = if ring % 2 == 0 { half } else { 0.0 };
        for sector in 0..count {
            let (y, x) = (2.0 * half * sector as f64 + turn).sin_cos();
            boxes.push(WeightedBox {
                direction: DVec3::new(sin * x, sin * y, cos),
                solid_angle: (stair.to - stair.from) / sectors,
                weight: stair.height * (stair.to - stair.from) / sectors,
            });
        }
    }
    Ok(boxes)
}

/// A lobe by growing caps about its middle.
struct Caps {
    /// Solid angles, from 0 on.
    angles: Vec<f64>,
    /// What of the lobe each holds, up to 1.
    held: Vec<f64>,
}

impl Caps {
    fn of(lobe: Lobe) -> Self {
        let width = lobe.width();
        let at = |step: usize| {
            let share = step as f64 / (CAPS * STEPS) as f64;
            width * (share * (1.0 / width).ln_1p()).exp_m1()
        };
        let (mut angles, mut held, mut sum) = (vec![0.0], vec![0.0], 0.0);
        for step in 0..CAPS * STEPS {
            let (from, to) = (at(step), at(step + 1));
            // By Simpson's rule.
            let values = [from, 0.5 * (from + to), to].map(|t| lobe.value(t.min(1.0)));
            sum += (to - from) / 6.0 * (values[0] + 4.0 * values[1] + values[2]);
            if (step + 1).is_multiple_of(STEPS) {
                angles.push(TAU * to);
                held.push(sum);
            }
        }
        held.iter_mut().for_each(|part| *part /= sum);
        Self { angles, held }
    }

    /// The lobe's mean between two caps.
    fn mean(&self, from: usize, to: usize) -> f64 {
        (self.held[to] - self.held[from]) / (self.angles[to] - self.angles[from])
    }

    /// What a step between two caps takes off ∫ lobe² ds.
    fn gain(&self, from: usize, to: usize) -> f64 {
        self.mean(from, to) * (self.held[to] - self.held[from])
    }

    /// Ends of the steps of the best staircase.
    fn thresholds(&self, count: usize) -> Vec<usize> {
        // By number of steps and end: what they take off at most, and where the last begins.
        let first = |to: usize| (if to == 0 { 0.0 } else { self.gain(0, to) }, 0);
        let mut best = vec![(0..=CAPS).map(first).collect::<Vec<_>>()];
        for steps in 1..count {
            let before = &best[steps - 1];
            let row = (0..=CAPS).map(|to| {
                let from = |from: usize| (before[from].0 + self.gain(from, to), from);
                // A step ends behind those before it.
                let all = (steps..to).map(from);
                all.fold((f64::NEG_INFINITY, 0), |a, b| if b.0 > a.0 { b } else { a })
            });
            let row = row.collect();
            best.push(row);
        }
        let left = |end: usize| (1.0 - self.held[end]).powi(2) / self.angles[end];
        let mut end = (count..=CAPS)
            .max_by(|a, b| {
                let value = |end: usize| best[count - 1][end].0 - left(end);
                value(*a).total_cmp(&value(*b))
            })
            .unwrap_or(CAPS);
        let mut thresholds = vec![end];
        for row in best.iter().skip(1).rev() {
            end = row[end].1;
            thresholds.push(end);
        }
        thresholds.reverse();
        thresholds
    }
}

/// The least border, in texels, that none of the boxes leaves, wherever its lobe looks; at most the map's smaller side, at which boxes
/// end.
///
/// # Errors
/// [`Error::Setting`] for a map of several layers or of discs, which have no border.
pub fn sat_border(map: Parametrization, size: UVec2, boxes: &[WeightedBox]) -> Result<u32> {
    if map.layers() > 1 || map.is_disc() {
        return Err(Error::setting("map", map, "has several layers, or discs"));
    }
    /// Places along a side: densities are smooth between folds, which these meet.
    const PLACES: u32 = 128;
    let largest = boxes.iter().fold(0.0f64, |most, one| most.max(one.solid_angle));
    let rows = f64::from(size.y);
    let mut most = 0.0f64;
    for (x, y) in (0..=PLACES).flat_map(|y| (0..=PLACES).map(move |x| (x, y))) {
        let uv = UVec2::new(x, y).as_dvec2() / f64::from(PLACES);
        let reach = rows * half_width_at(map, size, uv, largest);
        let inside = (uv.min(1.0 - uv) * size.as_dvec2()).min_element();
        most = most.max(reach - inside);
    }
    // A place between those asked is less than half their distance nearer to an edge.
    let slack = 0.5 * rows / f64::from(PLACES);
    Ok(((most + slack).ceil().clamp(1.0, f64::from(size.min_element()))) as u32)
}

impl SatImage {
    /// Twin of `maps/sat_lobe.comp`: the mean by a lobe's boxes about a unit direction; `None` where the map holds none.
    pub fn sat_lobe(&self, map: Parametrization, direction: DVec3, boxes: &[WeightedBox]) -> Option<DVec3> {
        let d = direction.try_normalize()?;
        let (x, y) = orthonormal_basis(d);
        let of = |one: &WeightedBox| -> Option<DVec3> {
            let middle = one.direction.x * x + one.direction.y * y + one.direction.z * d;
            let uv = map.encode(middle)?.uv;
            let half = half_width_at(map, self.size, uv, one.solid_angle);
            Some(one.weight * self.sat_mean(uv, half))
        };
        boxes.iter().map(of).sum()
    }
}

impl SphericalSat {
    /// Means by lobes about unit directions of the map's axes, by the device: of each direction, which of the lobes.
    ///
    /// # Errors
    /// [`Error::Setting`] for a lobe that is not there; [`Error::DeviceLost`], [`Error::OutOfMemory`], and as [`Pass::dispatch`].
    pub fn look_up_lobes(&self, queries: &[(Vec3, usize)], lobes: &[Vec<WeightedBox>]) -> Result<Vec<Vec3>> {
        let mut boxes = Vec::new();
        let mut ranges = Vec::new();
        for lobe in lobes {
            ranges.push((boxes.len() as u32, lobe.len() as u32));
            boxes.extend(lobe.iter().map(|one| LobeBox {
                direction: one.direction.as_vec3().to_array(),
                solid_angle: one.solid_angle as f32,
                weight: one.weight as f32,
            }));
        }
        let mut asked = Vec::with_capacity(queries.len());
        for (direction, lobe) in queries {
            let none = || Error::setting("lobe", lobe, format!("is not among {}", lobes.len()));
            let (first_box, box_count) = *ranges.get(*lobe).ok_or_else(none)?;
            asked.push(LobeQuery {
                direction: direction.to_array(),
                first_box,
                box_count,
            });
        }
        if asked.is_empty() || boxes.is_empty() {
            return Ok(vec![Vec3::ZERO; queries.len()]);
        }
        let constants = self.constants();
        let pipeline = self.gpu().compute_pipeline::<sat_lobe::Kernel>(&sat_lobe::Spec {
            directional_kind: constants.kind,
            directional_border: constants.border,
            sat_numbers: self.numbers(),
        })?;
        let boxes = self
            .gpu()
            .buffer_with("summed-area table: boxes", crate::gpu::Category::Light, &boxes)?;
        answer_of(self.gpu(), &asked, |pass: &mut Pass<'_>, queries, values, count| {
            let set = sat_lobe::Set0 {
                queries: queries.view(),
                boxes: boxes.view(),
                values: values.view(),
            };
            let groups = [pipeline.groups_for(count), 1, 1];
            pass.dispatch(&pipeline, &[&set, &self.set()], &sat_lobe::Push { count }, groups)
        })
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-BOX-LOBE",
    name: "lobes of glossy reflections as staircases of boxes of a summed-area table",
    role: Role::PartOf("OEM-6"),
    limits: "Squares of the map stand for discs of the sphere: more than some four gain little, unless they are rings of sectors.",
    sources: &[sources::BELLMAN_1961.at("the best staircase; boxes as lobes are the engine's own")],
    shaders: &["shaders/maps/box_lobe.glsl", "shaders/maps/sat_lobe.comp"],
    tests: &[
        "engine/src/maps/tests/box_lobes.rs::weights_share_the_lobe",
        "engine/src/maps/tests/box_lobes.rs::the_staircase_is_the_best_one",
        "engine/src/maps/tests/box_lobes.rs::borders_hold_the_largest_box",
        "engine/src/maps/tests/box_lobes.rs::constant_radiance_is_constant_through_every_lobe",
        "tests/tests/maps/directional_maps.rs::lobes_are_their_twins",
    ],
    api: &[
        "clerestory::maps::box_lobe::box_lobe",
        "clerestory::maps::box_lobe::ring_lobe",
    ],
    ..Row::of(file!())
}];
