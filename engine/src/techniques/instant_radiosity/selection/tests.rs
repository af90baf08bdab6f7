//! Orders by themselves, and in the unit box the shares, rays and errors that were found there independently of the engine.

use glam::{DVec2, DVec3, Vec3};

use super::*;
use crate::accel::bvh2::{Bvh2, Bvh2Settings};
use crate::accel::{Ray, RayIndex};
use crate::scene::builtin::generate;
use crate::test_random::Random;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::environment::luminance;

/// Walks of those figures, and their bound of distances, m.
const WALKS: u32 = 20;
const BOUND: EdgeBound = EdgeBound::Distance(0.01);
/// Points of the picture: their view of 96 by 60, every second of them both ways.
const SIZE: [u32; 2] = [48, 30];
/// How far from surfaces rays begin, m.
const OFFSET: f64 = 1e-6;
const RHO: f64 = 0.8;

/// The unit box, as rays meet it.
struct UnitBox {
    triangles: Vec<[Vec3; 3]>,
    index: Bvh2,
}

impl UnitBox {
    fn new() -> Self {
        let scene = generate("builtin:unit-box").expect("scene");
        let triangles: Vec<[Vec3; 3]> = scene.triangles().map(|(triangle, _)| triangle).collect();
        let index = Bvh2::build(&triangles, &Bvh2Settings::default()).expect("index");
        Self { triangles, index }
    }

    fn meet(&self, origin: DVec3, direction: DVec3) -> Option<WalkHit> {
        let hit = self.index.closest_hit(&Ray::new(origin.as_vec3(), direction.as_vec3()));
        let [a, b, c] = self
            .triangles
            .get(hit.triangle as usize)?
            .map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        Some(WalkHit {
            position: origin + direction * f64::from(hit.t) + OFFSET * normal,
            normal,
            reflectance: DVec3::splat(RHO),
        })
    }

    fn sees(&self, point: &LitPoint, light: &SurfaceLight) -> bool {
        let (from, to) = (point.position, light.position + OFFSET * light.normal);
        let way = to - from;
        let mut ray = Ray::new(from.as_vec3(), way.as_vec3());
        ray.t_max = 1.0;
        !self.index.any_hit(&ray)
    }

    fn lights(&self, walks: u32, seed: u32, survival: Survival) -> Vec<SurfaceLight> {
        let plan = LightWalks { walks, seed, survival };
        let lamp = |u: DVec2| {
            (
                DVec3::new(0.35 + 0.3 * u.x, 1.0 - OFFSET, 0.35 + 0.3 * u.y),
                DVec3::NEG_Y,
            )
        };
        plan.lights(lamp, DVec3::ONE, |origin, direction| self.meet(origin, direction))
    }

    fn points(&self) -> Vec<LitPoint> {
        let [width, height] = SIZE;
        let eye = DVec3::new(0.5, 0.55, 0.02);
        let mut points = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let at = |i: u32, n: u32| 0.9 * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
                let way = DVec3::new(at(x, width), -at(y, height), 1.0).normalize();
                let hit = self.meet(eye, way).expect("closed");
                points.push(LitPoint {
                    position: hit.position,
                    normal: hit.normal,
                    reflectance: hit.reflectance,
                });
            }
        }
        points
    }
}

/// A picture's points with all potentials, what is seen, and what all lights bring.
struct Pixels {
    potentials: Vec<Vec<DVec3>>,
    keys: Vec<Vec<f64>>,
    seen: Vec<Vec<bool>>,
    whole: Vec<DVec3>,
}

impl Pixels {
    fn new(scene: &UnitBox, lights: &[SurfaceLight], bound: EdgeBound) -> Self {
        let mut pixels = Self {
            potentials: Vec::new(),
            keys: Vec::new(),
            seen: Vec::new(),
            whole: Vec::new(),
        };
        for point in scene.points() {
            let potentials: Vec<DVec3> = lights
                .iter()
                .map(|light| potential_contribution(light, &point, bound))
                .collect();
            let seen: Vec<bool> = lights
                .iter()
                .zip(&potentials)
                .map(|(light, potential)| *potential != DVec3::ZERO && scene.sees(&point, light))
                .collect();
            let brought = potentials.iter().zip(&seen).filter(|(_, seen)| **seen);
            pixels.whole.push(brought.map(|(potential, _)| *potential).sum());
            pixels.keys.push(potentials.iter().map(|p| luminance(*p)).collect());
            pixels.potentials.push(potentials);
            pixels.seen.push(seen);
        }
        pixels
    }

    /// Of pixels with light: rays of each, mean relative error and bias with and without rescaling, and sorts of each.
    fn by(&self, resorting: Resorting, share: f64) -> Found {
        let mut order = KeptOrder::new(resorting);
        let (mut found, mut lit) = (Found::default(), 0.0);
        for (i, whole) in self.whole.iter().enumerate() {
            let taken = order.next(&self.keys[i], share);
            let gathered = gather_in_order(&self.potentials[i], taken, None, |light| self.seen[i][light as usize]);
            found.rays += f64::from(gathered.rays);
            if *whole == DVec3::ZERO {
                continue;
            }
            lit += 1.0;
            let relative = |radiance: DVec3| luminance(radiance) / luminance(*whole) - 1.0;
            found.error += relative(gathered.rescaled()).abs();
            found.bias += relative(gathered.rescaled());
            found.plain_error += relative(gathered.radiance).abs();
        }
        let all = self.whole.len() as f64;
        Found {
            rays: found.rays / all,
            error: found.error / lit,
            bias: found.bias / lit,
            plain_error: found.plain_error / lit,
            sorts: order.sorts as f64 / all,
        }
    }

    /// Share of the lights that carries a share of the potential, and of pairs that face each other; means over the points.
    fn lights_for(&self, share: f64) -> [f64; 2] {
        let (mut taken, mut facing) = (0.0, 0.0);
        for keys in &self.keys {
            taken += lights_for_share(&order_by_potential(keys), keys, share) as f64 / keys.len() as f64;
            facing += keys.iter().filter(|key| **key > 0.0).count() as f64 / keys.len() as f64;
        }
        [taken, facing].map(|sum| sum / self.keys.len() as f64)
    }
}

#[derive(Debug, Default)]
struct Found {
    rays: f64,
    error: f64,
    bias: f64,
    plain_error: f64,
    sorts: f64,
}

const EVERY: Resorting = Resorting::Period(1);

/// Figures of other walks in the same box, computed independently of the engine: means over three seeds lie within the ranges of those.
#[test]
fn a_share_of_the_potential_needs_the_published_share_of_lights_and_rays() {
    let scene = UnitBox::new();
    let mut sums = [0.0; 12];
    for seed in 0..3 {
        let lights = scene.lights(WALKS, seed, Survival::Roulette);
        let pixels = Pixels::new(&scene, &lights, BOUND);
        let [ninety, facing] = pixels.lights_for(0.9);
        let [eighty, _] = pixels.lights_for(0.8);
        let [all, at_ninety, at_eighty] = [1.0, 0.9, 0.8].map(|share| pixels.by(EVERY, share));
        let of_seed = [
            ninety,
            eighty,
            facing,
            at_ninety.error,
            at_eighty.error,
            at_ninety.plain_error,
            at_eighty.plain_error,
            at_ninety.rays / all.rays,
            at_eighty.rays / all.rays,
            at_ninety.bias,
            at_eighty.bias,
            lights.len() as f64,
        ];
        for (sum, value) in sums.iter_mut().zip(of_seed) {
            *sum += value / 3.0;
        }
        assert!(all.error < 1e-12 && all.plain_error < 1e-12);
    }
    let within = |what: &str, value: f64, [low, high]: [f64; 2]| {
        assert!((low..=high).contains(&value), "{what}: {value}");
    };
    within("lights for 90 %", sums[0], [0.45, 0.49]);
    within("lights for 80 %", sums[1], [0.33, 0.37]);
    within("pairs that face each other", sums[2], [0.68, 0.71]);
    within("error at 90 %", sums[3], [0.017, 0.023]);
    within("error at 80 %", sums[4], [0.032, 0.049]);
    within("error at 90 % without rescaling", sums[5], [0.08, 0.10]);
    within("error at 80 % without rescaling", sums[6], [0.16, 0.19]);
    assert!(sums[7] <= 0.75 && sums[8] <= 0.60, "rays: {} {}", sums[7], sums[8]);
    within("bias at 90 %", sums[9], [0.008, 0.021]);
    within("bias at 80 %", sums[10], [0.021, 0.044]);
    // 1 + 1 / (1 − ρ) of a walk.
    within("lights", sums[11], [105.0, 134.0]);
}

/// Which lights are strong hardly depends on the bound.
#[test]
fn shares_of_lights_hardly_depend_on_the_bound() {
    let scene = UnitBox::new();
    let points = scene.points();
    let lights = scene.lights(WALKS, 0, Survival::Roulette);
    let shares = [0.02f64, 0.1, 0.2].map(|distance| {
        let bound = EdgeBound::Distance(distance * distance);
        let (mut ninety, mut eighty) = (0.0, 0.0);
        for point in &points {
            let keys = lights
                .iter()
                .map(|light| luminance(potential_contribution(light, point, bound)));
            let keys: Vec<f64> = keys.collect();
            let order = order_by_potential(&keys);
            ninety += lights_for_share(&order, &keys, 0.9) as f64;
            eighty += lights_for_share(&order, &keys, 0.8) as f64;
        }
        [ninety, eighty].map(|taken| taken / (points.len() * lights.len()) as f64)
    });
    for other in [shares[0], shares[2]] {
        for (other, tenth) in other.iter().zip(shares[1]) {
            assert!((other - tenth).abs() < 0.01, "{shares:?}");
        }
    }
}

/// Rays grow with the period, since more of what is taken is weak; a bubble pass with a limit sorts seldom and takes few more rays than sorting always.
#[test]
fn orders_that_are_kept_cost_the_published_rays() {
    let scene = UnitBox::new();
    let lights = scene.lights(WALKS, 0, Survival::Roulette);
    let pixels = Pixels::new(&scene, &lights, BOUND);
    let found = [1, 2, 5, 10, 20].map(|period| pixels.by(Resorting::Period(period), 0.9));
    for pair in found.windows(2) {
        assert!(pair[1].rays > pair[0].rays && pair[1].error < 1.05 * pair[0].error);
    }
    // Of those figures 52.2 at every point and 56.2 at every fifth, of points half as far apart.
    let more = found[2].rays / found[0].rays;
    assert!((1.03..1.2).contains(&more), "{more}");
    for limit in [0.05, 0.1, 0.2, 0.3] {
        let kept = pixels.by(Resorting::Misplaced(limit), 0.9);
        assert!(
            kept.sorts < 0.3 && kept.rays < 1.05 * found[0].rays,
            "{limit}: {kept:?}"
        );
    }
}

/// Where everything sees everything, what is left out is seen as often as what is taken.
#[test]
fn rescaling_is_exact_where_nothing_is_hidden() {
    let mut random = Random(91);
    for _ in 0..50 {
        let grey: Vec<f64> = (0..80).map(|_| f64::from(random.magnitude(-12, 0))).collect();
        let potentials: Vec<DVec3> = grey.iter().map(|value| DVec3::splat(*value)).collect();
        let keys: Vec<f64> = potentials.iter().map(|p| luminance(*p)).collect();
        let order = order_by_potential(&keys);
        let whole: f64 = grey.iter().sum();
        let mut taken_before = 0;
        for share in [0.1, 0.5, 0.9, 0.99, 1.0] {
            let taken = lights_for_share(&order, &keys, share);
            let gathered = gather_in_order(&potentials, &order[..taken], None, |_| true);
            assert!((gathered.rescaled().y / whole - 1.0).abs() < 1e-12);
            assert!(gathered.taken >= share * gathered.total * (1.0 - 1e-12));
            // One light less does not carry the share.
            let less: f64 = order[..taken - 1].iter().map(|light| keys[*light as usize]).sum();
            assert!(share == 1.0 || less < share * gathered.total);
            assert!(taken >= taken_before);
            taken_before = taken;
        }
        assert_eq!(taken_before, 80);
    }
    // Nothing to gather.
    let dark = gather_in_order(&[DVec3::ZERO; 3], &[0, 1, 2], None, |_| true);
    assert_eq!((dark.rays, dark.rescaled()), (0, DVec3::ZERO));
    assert_eq!(lights_for_share(&[0, 1, 2], &[0.0; 3], 0.9), 0);
}

#[test]
fn orders_tell_what_is_misplaced() {
    let keys = [3.0, 1.0, 4.0, 1.0, 5.0, 9.0];
    let order = order_by_potential(&keys);
    assert_eq!(order, [5, 4, 2, 0, 1, 3]);
    assert_eq!(misplaced_lights(&order, &keys, 3), 0);
    // The first three of the indices' order: the last, 4, has two weaker before it and two stronger behind it.
    let mut other: Vec<u32> = (0..6).collect();
    assert_eq!(misplaced_lights(&other, &keys, 3), 4);
    assert_eq!(misplaced_lights(&other, &keys, 0), 0);
    // One pass takes the weakest to the end; as many as there are lights sort them.
    bubble_pass(&mut other, &keys);
    assert_eq!(other, [0, 2, 1, 4, 5, 3]);
    for _ in 0..5 {
        bubble_pass(&mut other, &keys);
    }
    assert_eq!(other, order);
    // A limit of nothing sorts wherever a light is misplaced, one of all never after the first.
    for (limit, sorts) in [(0.0, 2), (1.0, 1)] {
        let mut kept = KeptOrder::new(Resorting::Misplaced(limit));
        kept.next(&keys, 0.5);
        let mut turned = keys;
        turned.reverse();
        kept.next(&turned, 0.5);
        assert_eq!((kept.sorts, kept.rolled_back > 0), (sorts, sorts > 1), "{limit}");
    }
    assert_eq!(above_threshold(&keys, 3.0), [2, 4, 5]);
}

/// Light that is enough ends the gathering; the sum is that of the lights taken.
#[test]
fn a_saturated_point_stops() {
    let potentials = [DVec3::splat(4.0), DVec3::splat(2.0), DVec3::splat(1.0)];
    let stopped = gather_in_order(&potentials, &[0, 1, 2], Some(5.0), |_| true);
    assert_eq!((stopped.rays, stopped.radiance), (2, DVec3::splat(6.0)));
    // What is hidden does not count.
    let hidden = gather_in_order(&potentials, &[0, 1, 2], Some(5.0), |light| light > 0);
    assert_eq!((hidden.rays, hidden.radiance), (3, DVec3::splat(3.0)));
}

/// Power of one watt: with each scattering ρ of it, by number to the last walk, and by roulette as often as chance has it.
#[test]
fn fractional_walks_end_by_number() {
    let scene = UnitBox::new();
    let walks = 500;
    let left = |lights: &[SurfaceLight], bounce| lights.iter().filter(|light| light.bounce == bounce).count() as f64;
    let by_number = scene.lights(walks, 5, Survival::Fractional);
    for bounce in 1..10 {
        // Each scattered once more than those that went on before it.
        let arrived = f64::from(walks) * RHO.powi(bounce as i32 - 1);
        assert!((left(&by_number, bounce) - arrived).abs() <= 1.0, "{bounce}");
        let of = by_number.iter().filter(|light| light.bounce == bounce);
        let power: f64 = of.map(|light| light.power.x).sum();
        assert!((power * f64::from(walks) - RHO * left(&by_number, bounce)).abs() < 1e-9);
    }
    assert_eq!((left(&by_number, 0), by_number[0].power), (500.0, DVec3::splat(0.002)));
    let by_roulette = scene.lights(walks, 5, Survival::Roulette);
    // Five standard deviations of a binomial number; and it is not that by number.
    let second = left(&by_roulette, 2);
    assert!(
        (second - 400.0).abs() < 5.0 * (500.0f64 * 0.8 * 0.2).sqrt() && (second - 400.0).abs() > 1.0,
        "{second}"
    );
    // Other seeds are other walks.
    assert_ne!(by_number, scene.lights(walks, 6, Survival::Fractional));
}

/// Without a bound corners have spikes; a bound of a tenth of the box removes them for less than 3 % of the light.
#[test]
fn bounds_of_distance_remove_spikes() {
    let scene = UnitBox::new();
    let points = scene.points();
    let (mut greatest, mut sums) = ([0.0f64; 2], [0.0; 2]);
    for seed in 0..6 {
        let lights = scene.lights(WALKS, seed, Survival::Roulette);
        let mut values = [EdgeBound::Unbounded, BOUND].map(|_| Vec::new());
        for point in &points {
            let seen = lights.iter().filter(|light| {
                potential_contribution(light, point, EdgeBound::Unbounded) != DVec3::ZERO && scene.sees(point, light)
            });
            let seen: Vec<&SurfaceLight> = seen.collect();
            for (values, bound) in values.iter_mut().zip([EdgeBound::Unbounded, BOUND]) {
                let brought = seen.iter().map(|light| potential_contribution(light, point, bound).y);
                values.push(brought.sum::<f64>());
            }
        }
        for (i, values) in values.iter_mut().enumerate() {
            sums[i] += values.iter().sum::<f64>();
            values.sort_by(f64::total_cmp);
            // Over the value that a hundredth of all is above.
            greatest[i] = greatest[i].max(values[values.len() - 1] / values[values.len() * 99 / 100]);
        }
    }
    assert!(greatest[0] > 5.0 && greatest[1] < 2.0, "{greatest:?}");
    assert!(sums[1] < sums[0] && sums[1] > 0.97 * sums[0], "{sums:?}");
}

#[test]
fn points_in_one_place_bring_nothing_to_each_other() {
    let light = SurfaceLight {
        position: DVec3::ONE,
        normal: DVec3::NEG_Y,
        power: DVec3::ONE,
        bounce: 0,
    };
    let mut point = LitPoint {
        position: DVec3::ONE,
        normal: DVec3::Y,
        reflectance: DVec3::new(0.2, 0.4, 0.8),
    };
    for bound in [EdgeBound::Unbounded, EdgeBound::Geometry(1.0), EdgeBound::Distance(0.1)] {
        assert_eq!(potential_contribution(&light, &point, bound), DVec3::ZERO);
    }
    // Two metres below: ρ Φ / (4 π²).
    point.position.y = -1.0;
    let found = potential_contribution(&light, &point, EdgeBound::Unbounded);
    let expected = point.reflectance / (4.0 * std::f64::consts::PI.powi(2));
    assert!((found - expected).abs().max_element() < 1e-15);
    point.normal = DVec3::NEG_Y;
    assert_eq!(
        potential_contribution(&light, &point, EdgeBound::Unbounded),
        DVec3::ZERO
    );
}
