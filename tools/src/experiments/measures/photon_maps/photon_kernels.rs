//! Kernels of photon maps and the surface points that cameras see: the footprints that the photon tracer makes, and stand-ins about the second and
//! third hits of photons that walk through a scene.
//!
//! Source of what stand-ins stand for: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §5.2 and §6. Photons
//! leave a point evenly, surfaces but mirrors scatter them by the cosine with probability [`SURVIVAL`], and hits two and three are kept.
//! Radii go by the fourth root of the photon's way, the source's dampening; their scale is set so that a point of the scene's surfaces
//! lies in a given number of kernels on average. The source's kernels are ellipsoids that lie on the surface; [`Shape`] has them stretched as
//! the footprint of a beam is by its incidence, and spheres of the same area beside them.
//!
//! Guarantee: deterministic.

use clerestory::accel::Aabb;
use clerestory::accel::box_tree::BoxTree;
use clerestory::accel::lbvh::SortedCodes;
use clerestory::accel::morton::MORTON_30_AXIS_BITS;
use clerestory::accel::photon_map::compact_bvh::CompactBvh;
use clerestory::accel::photon_map::complete_bvh::{CompleteBvh, QueryCounters};
use clerestory::accel::photon_map::merge::merged_hierarchy;
use clerestory::accel::yardstick::volume_sweep_tree;
use clerestory::gpu::Gpu;
use clerestory::techniques::photon_mapping::kernel::{PhotonKernel, PhotonRecord, kernel_area, kernel_extent};
use clerestory::{Error, Result, scene};
use glam::{Vec3, Vec4};

use super::photon_scenes::{CASES, Case, Surfaces};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::photons::cases::{mapper, settings};
use crate::random::Random;

/// Probability that a diffuse surface scatters a photon.
const SURVIVAL: f64 = 0.7;
/// Hits after which a photon ends.
const HITS: u32 = 3;

/// What kernels look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Spheres.
    Spheres,
    /// Ellipsoids whose semi-axes on the surface are in the ratio of one to the cosine of incidence, at most [`MOST_STRETCHED`], and have the
    /// product that the sphere's have; as thick as wide.
    Ellipsoids,
    /// Kernels of photons that the photon tracer has followed by their differentials, with the source's settings.
    Footprints,
}

impl Shape {
    /// All.
    pub const ALL: [Self; 3] = [Self::Spheres, Self::Ellipsoids, Self::Footprints];

    /// For a table's cell.
    pub fn word(self) -> &'static str {
        match self {
            Self::Spheres => "spheres",
            Self::Ellipsoids => "ellipsoids",
            Self::Footprints => "footprints",
        }
    }
}

/// The source's shape.
pub const SOURCE_SHAPE: Shape = Shape::Footprints;

/// A spread that says how many kernels lie about a point.
const FIRST_SPREAD: f64 = 20.0;

/// The source's bound on the ratio of a kernel's semi-axes.
const MOST_STRETCHED: f64 = 20.0;

/// An ellipsoid: the points whose way from the centre has products with the three vectors that lie in the unit ball.
#[derive(Debug, Clone, Copy)]
struct Ellipsoid {
    centre: Vec3,
    inverse: [Vec3; 3],
}

impl Ellipsoid {
    fn holds(&self, point: Vec3) -> bool {
        let way = point - self.centre;
        let [a, b, c] = self.inverse.map(|axis| axis.dot(way));
        a * a + b * b + c * c < 1.0
    }
}

fn sphere_holds(sphere: &Vec4, point: Vec3) -> bool {
    (sphere.truncate() - point).length_squared() < sphere.w * sphere.w
}

/// Semi-axes of a kernel on the surface, metres, the longer one first. The two axes that it has there are conjugate: skewed ones are shorter than the
/// ellipse.
fn semi_axes(kernel: &PhotonKernel) -> [f64; 2] {
    let half = 0.5 * (kernel.along.length_squared() + kernel.across.length_squared());
    let product = kernel_area(kernel);
    // Of two squares that add up to 2 half and have the square of the product as theirs.
    let longer = (half + (half * half - product * product).max(0.0).sqrt()).sqrt();
    [longer, product / longer]
}

/// A kernel of a record: as [`kernel_weight`](clerestory::techniques::photon_mapping::kernel::kernel_weight) reads it.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    centre: Vec3,
    along: Vec3,
    /// Over the product of the axes.
    across: Vec3,
    /// One over the square of the shorter axis.
    inverse: f32,
}

impl Footprint {
    fn holds(&self, point: Vec3) -> bool {
        let way = point - self.centre;
        let q = self.across.dot(way);
        let rest = way - q * self.along;
        q * q + rest.length_squared() * self.inverse < 1.0
    }
}

/// What queries test.
#[derive(Debug, Clone)]
pub struct Records(Form);

#[derive(Debug, Clone)]
enum Form {
    /// Centre and radius.
    Spheres(Vec<Vec4>),
    Ellipsoids(Vec<Ellipsoid>),
    Footprints(Vec<Footprint>),
}

impl Records {
    /// The same in another order.
    fn in_order(&self, order: impl Iterator<Item = usize>) -> Self {
        Self(match &self.0 {
            Form::Spheres(all) => Form::Spheres(order.map(|i| all[i]).collect()),
            Form::Ellipsoids(all) => Form::Ellipsoids(order.map(|i| all[i]).collect()),
            Form::Footprints(all) => Form::Footprints(order.map(|i| all[i]).collect()),
        })
    }

    /// Whether one of them holds a point.
    pub fn holds(&self, record: usize, point: Vec3) -> bool {
        match &self.0 {
            Form::Spheres(all) => sphere_holds(&all[record], point),
            Form::Ellipsoids(all) => all[record].holds(point),
            Form::Footprints(all) => all[record].holds(point),
        }
    }
}

/// Kernels about hits of photons.
pub struct Kernels {
    records: Records,
    /// Areas on the surface, m².
    areas: Vec<f64>,
    /// Ratios of semi-axes on the surface.
    stretches: Vec<f64>,
    /// Their boxes.
    pub boxes: Vec<Aabb>,
}

/// Where a photon's kernel goes.
#[derive(Debug, Clone, Copy)]
struct Deposit {
    point: Vec3,
    normal: Vec3,
    direction: Vec3,
    /// Length of the photon's way, metres.
    way: f32,
}

impl Deposit {
    /// Semi-axes of an ellipsoid whose sphere has the radius: along the incidence, across, along the normal.
    fn axes(&self, radius: f64) -> [Vec3; 3] {
        let stretch = self.stretch();
        let normal = self.normal.as_dvec3();
        let along = self.direction.as_dvec3().reject_from(normal);
        let along = along.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
        let across = normal.cross(along);
        let (long, short) = (radius * stretch.sqrt(), radius / stretch.sqrt());
        [long * along, short * across, short * normal].map(|axis| axis.as_vec3())
    }

    fn stretch(&self) -> f64 {
        let cosine = f64::from(self.normal.dot(self.direction).abs());
        (1.0 / cosine.max(1.0 / MOST_STRETCHED)).max(1.0)
    }
}

impl Kernels {
    /// Those of records.
    pub fn of_records(photons: &[PhotonRecord]) -> Self {
        let kernels: Vec<PhotonKernel> = photons.iter().map(PhotonRecord::kernel).collect();
        let pairs = || photons.iter().zip(&kernels);
        let bounds = |(photon, kernel): (&PhotonRecord, &PhotonKernel)| {
            let extent = kernel_extent(kernel).as_vec3();
            Aabb {
                lower: photon.position - extent,
                upper: photon.position + extent,
            }
        };
        let record = |(photon, kernel): (&PhotonRecord, &PhotonKernel)| Footprint {
            centre: photon.position,
            along: photon.along,
            across: photon.across / kernel_area(kernel) as f32,
            inverse: 1.0 / photon.across.length_squared(),
        };
        Self {
            boxes: pairs().map(bounds).collect(),
            areas: kernels
                .iter()
                .map(|kernel| std::f64::consts::PI * kernel_area(kernel))
                .collect(),
            stretches: kernels
                .iter()
                .map(|kernel| {
                    let [longer, shorter] = semi_axes(kernel);
                    longer / shorter
                })
                .collect(),
            records: Records(Form::Footprints(pairs().map(record).collect())),
        }
    }

    /// Stand-ins of `photons` photons, of which `cover` lie about a surface point on average: spheres, else ellipsoids.
    pub fn trace(surfaces: &Surfaces, light: Vec3, photons: u32, cover: f64, shape: Shape) -> Self {
        let mut random = Random::new(12);
        let mut hits = Vec::new();
        for _ in 0..photons {
            walk(surfaces, light, &mut random, &mut hits);
        }
        // Radius = scale · (way / 1 m)^(1/4).
        let squares: f64 = hits.iter().map(|hit| f64::from(hit.way).sqrt()).sum();
        let scale = (cover * surfaces.area / (std::f64::consts::PI * squares)).sqrt();
        let radius = |hit: &Deposit| scale * f64::from(hit.way).powf(0.25);
        let around = |centre: Vec3, extent: Vec3| Aabb {
            lower: centre - extent,
            upper: centre + extent,
        };
        let disc = |radius: f64| std::f64::consts::PI * radius.powi(2);
        match shape {
            Shape::Spheres => {
                let spheres: Vec<Vec4> = hits.iter().map(|hit| hit.point.extend(radius(hit) as f32)).collect();
                Self {
                    boxes: spheres.iter().map(|s| around(s.truncate(), Vec3::splat(s.w))).collect(),
                    areas: spheres.iter().map(|s| disc(f64::from(s.w))).collect(),
                    stretches: vec![1.0; spheres.len()],
                    records: Records(Form::Spheres(spheres)),
                }
            }
            Shape::Ellipsoids | Shape::Footprints => {
                let axes: Vec<[Vec3; 3]> = hits.iter().map(|hit| hit.axes(radius(hit))).collect();
                let extent = |axes: &[Vec3; 3]| axes.iter().map(|axis| axis * axis).sum::<Vec3>().map(f32::sqrt);
                let record = |(hit, axes): (&Deposit, &[Vec3; 3])| Ellipsoid {
                    centre: hit.point,
                    inverse: axes.map(|axis| axis / axis.length_squared()),
                };
                let pairs = hits.iter().zip(&axes);
                Self {
                    boxes: pairs
                        .clone()
                        .map(|(hit, axes)| around(hit.point, extent(axes)))
                        .collect(),
                    areas: hits.iter().map(|hit| disc(radius(hit))).collect(),
                    stretches: hits.iter().map(Deposit::stretch).collect(),
                    records: Records(Form::Ellipsoids(pairs.map(record).collect())),
                }
            }
        }
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Their areas on the surface, m².
    pub fn areas(&self) -> impl Iterator<Item = f64> + '_ {
        self.areas.iter().copied()
    }

    /// Mean ratio of their semi-axes on the surface.
    pub fn mean_stretch(&self) -> f64 {
        self.stretches.iter().sum::<f64>() / self.stretches.len().max(1) as f64
    }

    /// Their centres.
    pub fn centres(&self) -> Vec<Vec3> {
        match &self.records.0 {
            Form::Spheres(all) => all.iter().map(|sphere| sphere.truncate()).collect(),
            Form::Ellipsoids(all) => all.iter().map(|ellipsoid| ellipsoid.centre).collect(),
            Form::Footprints(all) => all.iter().map(|footprint| footprint.centre).collect(),
        }
    }

    /// No point that a kernel holds is farther from its centre, metres.
    pub fn reach(&self) -> f32 {
        // Area and ratio of the semi-axes give the longer one, and no kernel is thicker than that.
        let squares = self.areas.iter().zip(&self.stretches);
        let widest = squares.map(|(area, stretch)| area * stretch / std::f64::consts::PI);
        // Room for some thousand roundings: those of the kernel's test, and of its axes, which are perpendicular only up to theirs.
        (widest.fold(0.0, f64::max).sqrt() * (1.0 + 1e-4)) as f32
    }

    /// What queries test, in an order of the kernels.
    pub fn in_order(&self, order: impl Iterator<Item = usize>) -> Records {
        self.records.in_order(order)
    }

    /// The tree of the voxel volume heuristic.
    pub fn by_volume(&self, leaf_size: u32) -> BoxTree {
        volume_sweep_tree(&self.boxes, leaf_size)
    }

    /// The linear hierarchy by merging.
    pub fn linear(&self, leaf_size: u32) -> BoxTree {
        let sorted = SortedCodes::of_boxes(&self.boxes, MORTON_30_AXIS_BITS);
        merged_hierarchy(&self.boxes, &sorted, leaf_size, |_| {})
    }
}

/// Follows one photon and keeps its second and third hits on diffuse surfaces with the length of its way.
fn walk(surfaces: &Surfaces, light: Vec3, random: &mut Random, hits: &mut Vec<Deposit>) {
    let (mut origin, mut direction) = (light, random.direction().as_vec3());
    let mut way = 0.0;
    for hit in 1..=HITS {
        let Some(meeting) = surfaces.meet(origin, direction) else {
            return;
        };
        way += meeting.distance;
        if meeting.is_mirror {
            direction = direction.reflect(meeting.normal);
        } else {
            if hit > 1 {
                hits.push(Deposit {
                    point: meeting.point,
                    normal: meeting.normal,
                    direction,
                    way,
                });
            }
            if random.unit() >= SURVIVAL {
                return;
            }
            // Cosine about the normal: a point of the unit sphere that touches the surface.
            let cosine = meeting.normal.as_dvec3() + random.direction();
            direction = cosine.as_vec3().normalize_or(meeting.normal);
        }
        origin = meeting.point + surfaces.offset * meeting.normal;
    }
}

/// Work of queries.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Of the tree.
    pub tree: QueryCounters,
    /// Kernels tested.
    pub tests: u64,
    /// Kernels that hold the point.
    pub contributions: u64,
}

/// A way to query a [`Map`] at a point.
pub type Gather = fn(&Map, Vec3, &mut Work);

/// A photon map in both layouts, records in leaf order.
pub struct Map {
    /// Complete nodes.
    pub complete: CompleteBvh,
    /// Compact pairs.
    pub compact: CompactBvh,
    records: Records,
}

impl Map {
    /// Lays a tree over kernels out.
    pub fn new(kernels: &Kernels, tree: &BoxTree) -> Result<Self> {
        let complete = CompleteBvh::new(tree)?;
        let compact = CompactBvh::encode(&complete)
            .map_err(|fault| Error::setting("tree", "compact", format!("is not tight: {fault:?}")))?;
        Ok(Self {
            records: kernels.in_order(complete.order.iter().map(|i| *i as usize)),
            complete,
            compact,
        })
    }

    fn leaf(&self, point: Vec3, first: u32, work: &mut Work) {
        match &self.records.0 {
            Form::Spheres(all) => self.test(all, first, work, |sphere| sphere_holds(sphere, point)),
            Form::Ellipsoids(all) => self.test(all, first, work, |ellipsoid| ellipsoid.holds(point)),
            Form::Footprints(all) => self.test(all, first, work, |footprint| footprint.holds(point)),
        }
    }

    fn test<T>(&self, records: &[T], first: u32, work: &mut Work, holds: impl Fn(&T) -> bool) {
        for (record, is_last) in records.iter().zip(&self.complete.ends).skip(first as usize) {
            work.tests += 1;
            work.contributions += u64::from(holds(record));
            if *is_last {
                break;
            }
        }
    }

    /// Gathers at a point by complete nodes.
    pub fn gather_complete(&self, point: Vec3, work: &mut Work) {
        let mut tree = work.tree;
        self.complete
            .point_query(point, &mut tree, |first| self.leaf(point, first, work));
        work.tree = tree;
    }

    /// As [`Self::gather_complete`], without the kernels.
    pub fn visit_complete(&self, point: Vec3, work: &mut Work) {
        self.complete.point_query(point, &mut work.tree, |_| {});
    }

    /// As [`Self::gather_compact`], without the kernels.
    pub fn visit_compact(&self, point: Vec3, work: &mut Work) {
        self.compact.point_query(point, &mut work.tree, |_| {});
    }

    /// Work of queries at all points.
    pub fn work(&self, points: &[Vec3], gather: Gather) -> Work {
        let mut work = Work::default();
        points.iter().for_each(|point| gather(self, *point, &mut work));
        work
    }

    /// Nanoseconds of a query, by one run over all points.
    pub fn nanoseconds(&self, points: &[Vec3], gather: Gather) -> f64 {
        nanoseconds_once(points, |point| {
            let mut work = Work::default();
            gather(self, *point, &mut work);
            work
        })
    }

    /// Gathers at a point by compact pairs.
    pub fn gather_compact(&self, point: Vec3, work: &mut Work) {
        let mut tree = work.tree;
        self.compact
            .point_query(point, &mut tree, |first| self.leaf(point, first, work));
        work.tree = tree;
    }
}

/// A case with its photons and what its camera sees.
pub struct Prepared {
    /// The case.
    pub case: &'static Case,
    /// Its scene.
    pub surfaces: Surfaces,
    /// Kernels of the photons.
    pub kernels: Kernels,
    /// Their shape.
    pub shape: Shape,
    /// Points that the camera sees.
    pub points: Vec<Vec3>,
    /// As many points anywhere on the surfaces, by area.
    pub anywhere: Vec<Vec3>,
}

/// Footprints of so many photons by the photon tracer, with the source's settings, spread so that about as many lie about a surface point as in its
/// table.
fn traced_footprints(gpu: &Gpu, case: &Case, surfaces: &Surfaces, photons: u32) -> Result<Kernels> {
    let scene = scene::load(case.scene)?;
    let traced = |spread: f64| -> Result<Kernels> {
        let mut mapper = mapper(gpu, &scene, [1; 2], settings(photons, spread as f32, false)?)?;
        let records: Vec<PhotonRecord> = mapper.photons(0)?.iter().map(|photon| photon.record).collect();
        Ok(Kernels::of_records(&records))
    };
    let cover = traced(FIRST_SPREAD)?.areas().sum::<f64>() / surfaces.area;
    // Areas go by the square of the spread; those that their greatest length bounds stay behind.
    traced(FIRST_SPREAD * (case.cover / cover).sqrt())
}

/// Rows of each case in each shape, each made when its turn comes, until the measure is stopped.
///
/// # Errors
/// Those of scenes, and the first of a case.
pub fn of_each_prepared<R>(context: &Context<'_>, mut rows: impl FnMut(&Prepared) -> Result<Vec<R>>) -> Result<Vec<R>> {
    // Photons sent out, and pixels on a side of the camera.
    let (photons, side) = context.pick((1 << 17, 96), (1 << 9, 8));
    let cases: &'static [Case] = &CASES;
    let cases = context.first(cases, 1).iter();
    let all: Vec<(&'static Case, Shape)> = cases.flat_map(|case| Shape::ALL.map(|shape| (case, shape))).collect();
    let name = |(case, shape): &(&Case, Shape)| format!("{}, {}", case.name(), shape.word());
    let gpu = (context.gpu)()?;
    context.each(&all, name, |(case, shape)| {
        let surfaces = Surfaces::load(case.scene)?;
        let points = surfaces.seen(side)?;
        let kernels = match shape {
            Shape::Footprints => traced_footprints(&gpu, case, &surfaces, photons)?,
            stand_ins => Kernels::trace(&surfaces, case.light, photons, case.cover, *stand_ins),
        };
        rows(&Prepared {
            case,
            shape: *shape,
            kernels,
            anywhere: surfaces.anywhere(points.len()),
            points,
            surfaces,
        })
    })
}

/// Records of skewed kernels, some tenths of a metre wide, on a sphere about the origin.
#[cfg(test)]
pub fn skewed_records(random: &mut Random, count: usize) -> Vec<PhotonRecord> {
    let mut some = || 0.3 * random.direction().as_vec3();
    let record = |_| {
        let normal = some().normalize();
        let along = some().reject_from(normal);
        let across = (0.5 * along + 0.7 * normal.cross(along)).reject_from(normal);
        PhotonRecord {
            position: some(),
            normal,
            direction: -normal,
            flux: Vec3::ONE,
            along,
            across,
        }
    };
    (0..count).map(record).collect()
}

#[cfg(test)]
mod tests {
    use clerestory::techniques::photon_mapping::kernel::{KernelProfile, kernel_weight};

    use super::*;

    #[test]
    fn points_lie_in_as_many_kernels_as_asked_for() {
        let case = &CASES[0];
        let surfaces = Surfaces::load(case.scene).unwrap();
        let seen = surfaces.seen(16).unwrap();
        assert_eq!(seen.len(), 256);
        for shape in [Shape::Spheres, Shape::Ellipsoids] {
            let kernels = Kernels::trace(&surfaces, case.light, 2000, 50.0, shape);
            let cover = kernels.areas().sum::<f64>() / surfaces.area;
            // Radii of spheres are rounded to f32.
            assert!((cover / 50.0 - 1.0).abs() < 1e-6, "{cover}");
            assert!(kernels.len() > 0 && kernels.len() <= 2 * 2000);
            assert_eq!(kernels.mean_stretch() > 1.0, shape == Shape::Ellipsoids);
            let map = Map::new(&kernels, &kernels.linear(8)).unwrap();
            let one_leaf = Map::new(&kernels, &kernels.linear(u32::MAX)).unwrap();
            let (mut complete, mut compact, mut brute) = (Work::default(), Work::default(), Work::default());
            for point in &seen {
                map.gather_complete(*point, &mut complete);
                map.gather_compact(*point, &mut compact);
                one_leaf.leaf(*point, 0, &mut brute);
            }
            assert_eq!(brute.tests, (seen.len() * kernels.len()) as u64);
            let found = [complete, compact, brute].map(|work| work.contributions);
            assert_eq!(found, [found[0]; 3]);
            assert_eq!(complete.tests, compact.tests);
            assert!(found[0] > 0 && compact.tree.bytes < complete.tree.bytes);
        }
    }

    #[test]
    fn footprints_hold_the_points_that_the_engines_kernels_weigh() {
        let mut random = Random::new(14);
        let records = skewed_records(&mut random, 200);
        let mut some = || 0.3 * random.direction().as_vec3();
        let kernels = Kernels::of_records(&records);
        let map = Map::new(&kernels, &kernels.linear(4)).unwrap();
        let mut held = 0;
        for _ in 0..300 {
            let point = some();
            let mut work = Work::default();
            map.gather_compact(point, &mut work);
            let weighs = |record: &&PhotonRecord| {
                let way = (point - record.position).as_dvec3();
                kernel_weight(KernelProfile::Uniform, &record.kernel(), way) > 0.0
            };
            let expected = records.iter().filter(weighs).count() as u64;
            // A point on a rim may fall to either side.
            assert!(
                work.contributions.abs_diff(expected) <= 1,
                "{} {expected}",
                work.contributions
            );
            held += expected;
        }
        assert!(held > 100, "{held}");
    }

    #[test]
    fn skewed_kernels_reach_farther_than_their_axes() {
        let (along, beside) = (2.0 * Vec3::X, Vec3::new(0.9, 1.5, 0.0));
        let record = PhotonRecord {
            position: Vec3::new(1.0, 2.0, 3.0),
            normal: Vec3::Z,
            direction: Vec3::NEG_Z,
            flux: Vec3::ONE,
            along,
            across: beside.cross(Vec3::Z),
        };
        let kernels = Kernels::of_records(&[record]);
        let records = kernels.in_order(0..1);
        // The ellipse of both, a thousandth smaller.
        let rim = (0..720_u16).map(|i| {
            let (sin, cos) = (f32::from(i) * std::f32::consts::PI / 360.0).sin_cos();
            0.999 * (cos * along + sin * beside)
        });
        let held = rim.filter(|way| records.holds(0, record.position + *way));
        let farthest = held.map(Vec3::length).fold(0.0, f32::max);
        assert!(farthest > 1.1 * along.length(), "{farthest}");
        let reach = kernels.reach();
        assert!(reach > farthest && reach < 1.002 * farthest, "{reach} {farthest}");
    }

    #[test]
    fn ellipsoids_reach_their_boxes_and_have_the_area_of_their_discs() {
        let deposit = Deposit {
            point: Vec3::new(1.0, 2.0, 3.0),
            normal: Vec3::new(0.6, 0.0, 0.8),
            direction: Vec3::new(0.3, -0.5, -0.8).normalize(),
            way: 2.0,
        };
        let axes = deposit.axes(0.5);
        let lengths = axes.map(|axis| axis.length());
        // f32 axes: a few roundings.
        assert!((lengths[0] * lengths[1] - 0.25).abs() < 1e-6 && lengths[1] == lengths[2]);
        assert!((f64::from(lengths[0] / lengths[1]) / deposit.stretch() - 1.0).abs() < 1e-5);
        assert!(axes[0].dot(axes[1]).abs() < 1e-6 && axes[0].dot(deposit.normal).abs() < 1e-6);
        let grazing = Deposit {
            direction: Vec3::new(0.8, 0.0, -0.6),
            ..deposit
        };
        assert_eq!(grazing.stretch(), MOST_STRETCHED);
    }
}
