//! A set of a lamp's directions that loses some and gets others, a few at a time.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::lamp::Domain;
use super::voronoi::{Cell, voronoi_cells, widest_gap};

/// A point moves where the widest gap is wider than so many times the least distance: in spirals it is 1.5 times as wide at most.
const UNEVENNESS_MAX: f64 = 1.75;
/// Turns between consecutive points of a spiral: the golden section of a whole one.
const GOLDEN_TURN: f64 = 0.381_966_011_250_105_1;

/// Points of a domain, each with a number that it keeps.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptDirections {
    domain: Domain,
    points: Vec<Option<DVec3>>,
}

/// What [`KeptDirections::renew`] did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Renewed {
    /// Numbers of the points that are new.
    pub points: Vec<usize>,
    /// Whether all points are there and lie evenly enough.
    pub is_settled: bool,
}

/// Points that are there, and their numbers.
struct Present {
    numbers: Vec<usize>,
    points: Vec<DVec3>,
    cells: Vec<Option<Cell>>,
}

impl KeptDirections {
    /// `count` points in a spiral over the domain, turned about by four random numbers from 0 to 1. Consecutive numbers lie far from each other, so that every range of them is
    /// spread evenly, too.
    pub fn spread(domain: Domain, count: u32, numbers: [f64; 4]) -> Self {
        let [first, second, third, shift] = numbers;
        let angle = |i: u32| TAU * GOLDEN_TURN * f64::from(i);
        let share = |i: u32, within: f64| (f64::from(i) + within) / f64::from(count);
        let on_disc = |i: u32| {
            let (angle, radius) = (angle(i) + TAU * second, share(i, first).sqrt());
            DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
        };
        let rotation = uniform_rotation([first, second, third]);
        let on_sphere = |i: u32| {
            let (angle, z) = (angle(i), 1.0 - 2.0 * share(i, 0.5));
            let radius = (1.0 - z * z).max(0.0).sqrt();
            (rotation * DVec3::new(radius * angle.cos(), radius * angle.sin(), z)).normalize_or(DVec3::Z)
        };
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_by_key(|i| i.reverse_bits());
        let shift = ((shift * f64::from(count)) as usize).min(order.len());
        order.rotate_left(shift);
        let point = |i: u32| match domain {
            Domain::Disc => on_disc(i),
            Domain::Sphere => on_sphere(i),
        };
        Self {
            domain,
            points: order.into_iter().map(|i| Some(point(i))).collect(),
        }
    }

    /// Points by number; none for those that were dropped.
    pub fn points(&self) -> &[Option<DVec3>] {
        &self.points
    }

    /// Moves a point, or drops it. Numbers that there are none of are left alone.
    pub fn set(&mut self, number: usize, point: Option<DVec3>) {
        if let Some(place) = self.points.get_mut(number) {
            *place = point;
        }
    }

    fn present(&self) -> Present {
        let there = self.points.iter().enumerate();
        let (numbers, points): (Vec<usize>, Vec<DVec3>) =
            there.filter_map(|(number, point)| Some((number, (*point)?))).unzip();
        let cells = voronoi_cells(self.domain, &points);
        Present { numbers, points, cells }
    }

    /// Shares of the domain by number, those of the cells; 0 for points that were dropped or lie where another one does. They sum to one, unless there are no points.
    pub fn shares(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.points.len()];
        let present = self.present();
        for (number, cell) in present.numbers.iter().zip(&present.cells) {
            all[*number] = cell.as_ref().map_or(0.0, |cell| cell.share);
        }
        all
    }

    /// Puts points that are missing into the widest gaps, and moves points there that crowd others; `most` in all.
    pub fn renew(&mut self, most: usize) -> Renewed {
        let mut renewed = Vec::new();
        loop {
            let mut present = self.present();
            let missing = self.points.iter().position(Option::is_none);
            let gap = widest_gap(self.domain, &present.points, &present.cells);
            let number = missing.or_else(|| present.crowding(gap.radius / UNEVENNESS_MAX));
            let Some(number) = number.filter(|_| renewed.len() < most) else {
                return Renewed {
                    points: renewed,
                    is_settled: number.is_none(),
                };
            };
            if missing.is_none() {
                self.points[number] = None;
                present = self.present();
            }
            let gap = widest_gap(self.domain, &present.points, &present.cells);
            self.points[number] = Some(gap.at);
            renewed.push(number);
        }
    }

    /// The least distance of two points, and the radius of the widest gap between them.
    pub fn spacing(&self) -> [f64; 2] {
        let present = self.present();
        let closest = present.closest().map_or(f64::INFINITY, |(_, distance)| distance);
        let gap = widest_gap(self.domain, &present.points, &present.cells);
        [closest, gap.radius]
    }
}

impl Present {
    /// The two that are closest to each other, by place in the lists, and their distance.
    fn closest(&self) -> Option<([usize; 2], f64)> {
        let pairs = self.cells.iter().enumerate().flat_map(|(i, cell)| {
            let neighbours = cell.iter().flat_map(|cell| &cell.neighbours);
            neighbours.map(move |j| [i, *j])
        });
        let distance = |[i, j]: [usize; 2]| self.points[i].distance(self.points[j]);
        pairs
            .map(|pair| (pair, distance(pair)))
            .min_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    /// The number of a point that lies where another one does, or nearer to one than that: of the two that with the smaller share.
    fn crowding(&self, distance: f64) -> Option<usize> {
        if let Some(twin) = self.cells.iter().position(Option::is_none) {
            return Some(self.numbers[twin]);
        }
        let ([i, j], least) = self.closest()?;
        let share = |i: usize| self.cells[i].as_ref().map_or(0.0, |cell| cell.share);
        let smaller = if share(j) < share(i) { j } else { i };
        (least < distance).then(|| self.numbers[smaller])
    }
}

/// Of three random numbers (K. Shoemake, "Uniform Random Rotations", Graphics Gems III, 1992).
fn uniform_rotation([first, second, third]: [f64; 3]) -> DQuat {
    let (small, large) = (first.sqrt(), (1.0 - first).sqrt());
    let (a, b) = (TAU * second, TAU * third);
    DQuat::from_xyzw(large * a.sin(), large * a.cos(), small * b.sin(), small * b.cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    const DOMAINS: [Domain; 2] = [Domain::Disc, Domain::Sphere];

    fn numbers(random: &mut Random) -> [f64; 4] {
        [(); 4].map(|()| f64::from(random.unit()))
    }

    #[test]
    fn spread_sets_have_nothing_to_renew() {
        let mut random = Random(1);
        for domain in DOMAINS {
            for count in [1, 2, 3, 4, 5, 16, 50, 64, 256, 1000] {
                for _ in 0..4 {
                    let mut set = KeptDirections::spread(domain, count, numbers(&mut random));
                    let before = set.clone();
                    let [closest, gap] = set.spacing();
                    println!("{domain:?}, {count}: {closest} {gap}");
                    let renewed = set.renew(8);
                    assert!(
                        renewed.points.is_empty() && renewed.is_settled,
                        "{domain:?}, {count}: {renewed:?}"
                    );
                    assert_eq!(set, before);
                    let sum: f64 = set.shares().iter().sum();
                    assert!((sum - 1.0).abs() < 1e-9, "{domain:?}, {count}: {sum}");
                }
            }
        }
    }

    /// Independent points leave wider gaps, in the mean of 50 sets.
    #[test]
    fn spread_sets_have_narrower_gaps_than_independent_points() {
        let mut random = Random(2);
        for domain in DOMAINS {
            let (mut even, mut independent) = (0.0, 0.0);
            for _ in 0..50 {
                even += KeptDirections::spread(domain, 64, numbers(&mut random)).spacing()[1];
                let mut unit = || f64::from(random.unit());
                let one = |unit: &mut dyn FnMut() -> f64| {
                    KeptDirections::spread(domain, 1, [unit(), unit(), unit(), 0.0]).points()[0]
                };
                let points = (0..64).map(|_| one(&mut unit)).collect();
                independent += KeptDirections { domain, points }.spacing()[1];
            }
            assert!(even < 0.7 * independent, "{domain:?}: {even} {independent}");
        }
    }

    /// Sets that have lost a part, all but one, or all: no more than the quota is new at a time, and in the end all are there and lie evenly.
    #[test]
    fn what_is_lost_comes_back_under_the_quota() {
        let mut random = Random(3);
        for domain in DOMAINS {
            for kept in [0, 1, 2, 20, 63] {
                let mut set = KeptDirections::spread(domain, 64, numbers(&mut random));
                for number in kept..64 {
                    set.set(number, None);
                }
                let mut rounds = 0;
                loop {
                    let before = set.clone();
                    let renewed = set.renew(5);
                    let changed = (0..64).filter(|i| set.points()[*i] != before.points()[*i]).count();
                    assert!(renewed.points.len() <= 5 && changed <= renewed.points.len());
                    let sum: f64 = set.shares().iter().sum();
                    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
                    if renewed.is_settled {
                        break;
                    }
                    assert_eq!(renewed.points.len(), 5);
                    rounds += 1;
                    assert!(rounds < 64, "{domain:?}, {kept} kept: no end");
                }
                let [closest, gap] = set.spacing();
                assert!(
                    gap <= UNEVENNESS_MAX * closest,
                    "{domain:?}, {kept} kept: {closest} {gap}"
                );
                assert!(set.points().iter().all(Option::is_some));
                assert!(rounds >= (64 - kept) / 5, "{rounds}");
            }
        }
    }

    /// Points in one place are told apart again, and the turn of a sphere leaves no direction out: means over seeds of each axis, with their deviation.
    #[test]
    fn twins_part_and_turns_are_even() {
        for domain in DOMAINS {
            let mut set = KeptDirections::spread(domain, 16, [0.5; 4]);
            let first = set.points()[0];
            (1..4).for_each(|number| set.set(number, first));
            assert_eq!(set.shares().iter().filter(|share| **share == 0.0).count(), 3);
            let renewed = set.renew(16);
            assert!(renewed.is_settled && renewed.points.len() >= 3, "{renewed:?}");
        }
        let (mut random, mut sum, turns) = (Random(4), [DVec3::ZERO; 2], 4000);
        for _ in 0..turns {
            let set = KeptDirections::spread(Domain::Sphere, 3, numbers(&mut random));
            let point = set.points()[0].expect("there");
            sum[0] += point;
            sum[1] += point * point;
        }
        // Five deviations of the mean, of 1/√3 and of √(4/45) for one.
        let n = f64::from(turns);
        assert!((sum[0] / n).abs().max_element() < 5.0 * (1.0 / (3.0 * n)).sqrt());
        assert!((sum[1] / n - 1.0 / 3.0).abs().max_element() < 5.0 * (4.0 / (45.0 * n)).sqrt());
    }
}
