//! Partial weights of the balance heuristic over all ways to make a path from its two ends.
//!
//! A path of n vertices may be made of t vertices from the eye and n − t from a light, for any t ≥ 1 that its mirrors allow. The balance heuristic weighs each way by its
//! density over the sum of all (Veach 1997, 9.2.2). That sum falls into what lies on either side of the joint, and each side follows from the subpath of that side alone: from
//! two numbers, carried from vertex to vertex. Source: I. Georgiev, "Implementing Vertex Connection and Merging", 2012, whose d_vcm and d_vc they are; its delta lobes are
//! taken to be as likely both ways, here a ratio stands for what they are. Twin of `techniques/bidirectional/bdpt_mis.glsl`.
//!
//! Densities are per solid angle; cosines are those to the geometric normal, and positive.
//!
//! A vertex in a medium has no cosine (1 stands for it) and the density of its phase function, the same both ways. The probabilities of free flights stand in no weight: every way to
//! make a path samples the distances of its collisions, by the same densities but for that of the edge that is joined, and a weight may be any function of a path's vertices that sums to one
//! over the ways to make it. So weights stay what they are whatever the media, in all bands and with null collisions, and where boundaries without an interface are passed; what is lost
//! is that ways to make a path over a long way through a dense medium are not known to be rarer.

use crate::catalogue::{Bias, Role, Row, sources};

/// Of a subpath: weights of the other ways to make it, relative to that by which it was made, but for densities that its next edge decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialWeights {
    /// Of the way whose joint is the last edge.
    pub d_vcm: f64,
    /// Of those whose joint comes before, over the density of the last edge backwards.
    pub d_vc: f64,
}

impl PartialWeights {
    /// Where the subpath's ray of a squared length arrives under a cosine; 1 for the length of rays from an end at infinity, whose density is per area across them.
    pub fn mis_arrive(self, squared: f64, cos_here: f64) -> Self {
        Self {
            d_vcm: self.d_vcm * squared / cos_here,
            d_vc: self.d_vc / cos_here,
        }
    }

    /// Scattered with density `forward` under a cosine; `backward` is the density of the way back.
    pub fn mis_scatter(self, cos_out: f64, forward: f64, backward: f64) -> Self {
        Self {
            d_vcm: 1.0 / forward,
            d_vc: cos_out / forward * (self.d_vc * backward + self.d_vcm),
        }
    }

    /// Scattered by a delta lobe, where nothing is joined; `ratio` is the density of the way back over that of the way there.
    pub fn mis_scatter_delta(self, cos_out: f64, ratio: f64) -> Self {
        Self {
            d_vcm: 0.0,
            d_vc: cos_out * ratio * self.d_vc,
        }
    }

    /// What the other ways to make the subpath weigh, but for the density per area of its last vertex from the other side; `backward` is that of its last edge backwards.
    pub fn mis_behind(self, backward: f64) -> f64 {
        self.d_vcm + self.d_vc * backward
    }
}

/// Weight of a path, by what those of the other ways weigh whose joint is nearer to the light, and nearer to the eye.
pub fn mis_weight(to_light: f64, to_eye: f64) -> f64 {
    1.0 / (1.0 + to_light + to_eye)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-BDPT-WEIGHTS",
    name: "balance heuristic over all ways to make a path from both ends, by two partial weights a subpath",
    role: Role::PartOf("CL-BDPT"),
    limits: "Weights of paths with a few samples of one way and many of another count each way once, but for light subpaths that meet the camera.",
    sources: &[sources::GEORGIEV_2012.whole(), sources::VEACH_1997.at("9.2.2 and 10.2")],
    shaders: &[
        "shaders/techniques/bidirectional/bdpt_mis.glsl",
        "shaders/techniques/bidirectional/bdpt_both_ways.glsl",
    ],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/techniques/bidirectional/mis.rs::weights_are_those_of_the_balance_heuristic_and_sum_to_one",
        "engine/src/techniques/bidirectional/mis.rs::collisions_have_squared_distances_and_no_cosines",
        "engine/src/techniques/bidirectional/rod.rs::all_ways_to_make_paths_through_fog_find_what_it_lets_through",
        "engine/src/techniques/bidirectional/mis.rs::behind_mirrors_only_joints_before_them_count",
        "tests/tests/twins/lights.rs::partial_weights_agree_with_their_twins",
        "tests/tests/bidirectional/strategies.rs::each_way_to_make_a_path_finds_the_same_light",
    ],
    api: &["clerestory::techniques::bidirectional::mis"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// What ends a path.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Lamp {
        Area,
        Point,
        Sky,
        Sun,
    }

    /// A path from the eye (vertex 0) to a light (the last vertex), by the densities of its vertices.
    #[derive(Debug)]
    struct Path {
        lamp: Lamp,
        /// Light subpaths of a pass.
        walks: f64,
        /// Squared lengths of edges, from the eye on.
        squared: Vec<f64>,
        /// Cosines at both ends of each edge, that nearer to the eye first.
        cosines: Vec<[f64; 2]>,
        /// Densities of each vertex towards the light, and back; of the first vertex that of the camera.
        on: Vec<f64>,
        back: Vec<f64>,
        delta: Vec<bool>,
        /// Density of light sampling, and those of walks, for the place or direction, and for the other of both.
        direct: f64,
        emitted: [f64; 2],
    }

    impl Path {
        fn random(random: &mut Random) -> Self {
            let edges = 1 + random.below(6);
            let lamp = random.choose(&[Lamp::Area, Lamp::Point, Lamp::Sky, Lamp::Sun]);
            let mut positive = || f64::from(random.range(-4.0, 4.0)).exp2();
            let squared = (0..edges).map(|_| positive()).collect();
            let on = (0..=edges).map(|_| positive()).collect();
            let back = (0..=edges).map(|_| positive()).collect();
            // Light sampling and walks may choose by other tables.
            let (direct, emitted) = (positive(), [positive(), positive()]);
            let walks = positive().ceil();
            let mut cosines: Vec<[f64; 2]> = (0..edges)
                .map(|_| [0, 1].map(|_| 0.05 + 0.95 * f64::from(random.unit())))
                .collect();
            // The camera's cosine is in its density, and lights without an area have none.
            cosines[0][0] = 1.0;
            if lamp != Lamp::Area {
                cosines[edges - 1][1] = 1.0;
            }
            let delta = (0..=edges)
                .map(|i| i > 0 && i < edges && random.below(3) == 0)
                .collect();
            Self {
                lamp,
                walks,
                squared,
                cosines,
                on,
                back,
                delta,
                direct,
                emitted,
            }
        }

        /// Fails unless its weights are those of the balance heuristic and sum to one; the ways to make it.
        fn check(&self) -> usize {
            let n = self.edges() + 1;
            // With two vertices light is sampled from the camera, which is no way here: what it sees is what it meets.
            let first = if n == 2 { 2 } else { 1 };
            let densities: Vec<Option<f64>> = (first..=n).map(|eye| self.density(eye)).collect();
            let total: f64 = densities.iter().flatten().sum();
            let (mut sum, mut ways) = (0.0, 0);
            for (i, density) in densities.iter().enumerate() {
                if let Some(density) = density {
                    let (found, expected) = (self.weight(first + i), density / total);
                    assert!(
                        (found / expected - 1.0).abs() < 1e-9,
                        "{self:?}, {}: {found}, {expected}",
                        first + i
                    );
                    sum += found;
                    ways += 1;
                }
            }
            assert!(total == 0.0 || (sum - 1.0).abs() < 1e-9, "{self:?}: {sum}");
            ways
        }

        fn edges(&self) -> usize {
            self.squared.len()
        }

        fn is_infinite(&self) -> bool {
            matches!(self.lamp, Lamp::Sky | Lamp::Sun)
        }

        fn has_extent(&self) -> bool {
            matches!(self.lamp, Lamp::Area | Lamp::Sky)
        }

        /// What densities per solid angle are multiplied by along an edge to be those of its far end: per area, but for a light at infinity.
        fn measure(&self, edge: usize, towards_light: bool) -> f64 {
            let [near, far] = self.cosines[edge];
            let last = edge + 1 == self.edges();
            match (towards_light, last && self.is_infinite()) {
                (true, true) => 1.0,
                (true, false) => far / self.squared[edge],
                // Walks from infinity have a density per area across their beam.
                (false, true) => near,
                (false, false) => near / self.squared[edge],
            }
        }

        /// Density of making it with `eye` vertices from the eye, the camera one of them; none where it cannot be made so.
        fn density(&self, eye: usize) -> Option<f64> {
            let n = self.edges() + 1;
            let light = n - eye;
            let joined = |vertex: usize| vertex == 0 || vertex + 1 == n || !self.delta[vertex];
            if light == 0 && !self.has_extent() || light > 0 && !(joined(eye - 1) && joined(eye)) {
                return None;
            }
            // Lamps do not meet the camera.
            if eye == 1 && n == 2 {
                return None;
            }
            let mut density = if eye == 1 { self.walks } else { 1.0 };
            for vertex in 0..eye - 1 {
                density *= self.on[vertex] * self.measure(vertex, true);
            }
            match light {
                0 => {}
                1 => density *= self.direct,
                _ => {
                    density *= self.emitted[0] * self.emitted[1] * self.measure(n - 2, false);
                    for vertex in eye + 1..n - 1 {
                        density *= self.back[vertex] * self.measure(vertex - 1, false);
                    }
                }
            }
            Some(density)
        }

        /// Partial weights of eye subpaths where they arrive, by vertex from the first behind the camera on; and those before the last edge.
        fn eye_weights(&self) -> (Vec<PartialWeights>, PartialWeights) {
            let mut weights = PartialWeights {
                d_vcm: self.walks / self.on[0],
                d_vc: 0.0,
            };
            let mut arrived = vec![weights];
            let mut before = weights;
            for vertex in 1..=self.edges() {
                before = weights;
                weights = weights.mis_arrive(self.squared[vertex - 1], self.cosines[vertex - 1][1]);
                arrived.push(weights);
                if vertex < self.edges() {
                    let cos_out = self.cosines[vertex][0];
                    weights = self.scattered(weights, vertex, cos_out, self.on[vertex], self.back[vertex]);
                }
            }
            (arrived, before)
        }

        fn scattered(&self, w: PartialWeights, vertex: usize, cos: f64, forward: f64, backward: f64) -> PartialWeights {
            if self.delta[vertex] {
                w.mis_scatter_delta(cos, backward / forward)
            } else {
                w.mis_scatter(cos, forward, backward)
            }
        }

        /// Those of light subpaths, by vertex.
        fn light_weights(&self) -> Vec<PartialWeights> {
            let last = self.edges();
            let emitted = self.emitted[0] * self.emitted[1];
            let mut weights = PartialWeights {
                d_vcm: self.direct / emitted,
                d_vc: if self.has_extent() {
                    self.cosines[last - 1][1] / emitted
                } else {
                    0.0
                },
            };
            let mut arrived = vec![weights; last + 1];
            for vertex in (1..last).rev() {
                let is_first = vertex + 1 == last;
                let squared = if is_first && self.is_infinite() {
                    1.0
                } else {
                    self.squared[vertex]
                };
                weights = weights.mis_arrive(squared, self.cosines[vertex][0]);
                arrived[vertex] = weights;
                let cos_out = self.cosines[vertex - 1][1];
                weights = self.scattered(weights, vertex, cos_out, self.back[vertex], self.on[vertex]);
            }
            arrived
        }

        /// Its weight with `eye` vertices from the eye, as the kernels have it.
        fn weight(&self, eye: usize) -> f64 {
            let n = self.edges() + 1;
            let ((eye_weights, before), light_weights) = (self.eye_weights(), self.light_weights());
            let emitted = self.emitted[0] * self.emitted[1];
            match (n - eye, eye) {
                // A lamp that the camera sees is made in one way.
                (0, 2) => 1.0,
                (0, _) => {
                    let w = if self.is_infinite() { before } else { eye_weights[n - 1] };
                    mis_weight(0.0, self.direct * w.d_vcm + emitted * w.d_vc)
                }
                (1, _) => {
                    let (at, edge) = (n - 2, n - 2);
                    // Per solid angle at the point.
                    let direct = self.direct / self.measure(edge, true);
                    let met = if self.has_extent() { self.on[at] / direct } else { 0.0 };
                    let walked = emitted / (direct * self.cosines[edge][1]) * self.cosines[edge][0];
                    mis_weight(met, walked * eye_weights[at].mis_behind(self.back[at]))
                }
                (_, 1) => {
                    let shown = self.on[0] * self.measure(0, true) / self.walks;
                    mis_weight(shown * light_weights[1].mis_behind(self.on[1]), 0.0)
                }
                (_, eye) => {
                    let (here, there) = (eye - 1, eye);
                    let to_light = self.on[here] * self.measure(here, true);
                    let to_eye = self.back[there] * self.measure(here, false);
                    mis_weight(
                        to_light * light_weights[there].mis_behind(self.on[there]),
                        to_eye * eye_weights[here].mis_behind(self.back[here]),
                    )
                }
            }
        }
    }

    /// Paths of up to seven vertices to lights of all kinds, with mirrors among them, by densities over eight powers of two.
    #[test]
    fn weights_are_those_of_the_balance_heuristic_and_sum_to_one() {
        let mut random = Random(17);
        let mut ways = 0;
        for _ in 0..20_000 {
            ways += Path::random(&mut random).check();
        }
        assert!(ways > 40_000, "{ways}");
    }

    /// The kernel's recursion at a collision, by hand: light subpath of a point light of one collision at distance 2, scattered by a density of 1/8 and joined at distance 3.
    #[test]
    fn collisions_have_squared_distances_and_no_cosines() {
        let emitted = PartialWeights { d_vcm: 4.0, d_vc: 0.0 };
        let arrived = emitted.mis_arrive(4.0, 1.0);
        assert_eq!(arrived, PartialWeights { d_vcm: 16.0, d_vc: 0.0 });
        let scattered = arrived.mis_scatter(1.0, 0.125, 0.125);
        assert_eq!(
            scattered,
            PartialWeights {
                d_vcm: 8.0,
                d_vc: 128.0
            }
        );
        assert_eq!(
            scattered.mis_arrive(9.0, 1.0),
            PartialWeights {
                d_vcm: 72.0,
                d_vc: 128.0
            }
        );
    }

    #[test]
    fn behind_mirrors_only_joints_before_them_count() {
        let w = PartialWeights { d_vcm: 3.0, d_vc: 5.0 };
        let mirrored = w.mis_scatter_delta(0.5, 2.0);
        assert_eq!(mirrored, PartialWeights { d_vcm: 0.0, d_vc: 5.0 });
        assert_eq!(mirrored.mis_behind(7.0), 35.0);
        assert_eq!(mis_weight(1.0, 2.0), 0.25);
    }
}
