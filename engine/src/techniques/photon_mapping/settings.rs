//! Settings of photon mapping, and the path sets of its two parts.

use super::kernel::{KernelProfile, KernelSettings, KernelShape};
use super::tracer::Stored;
use crate::gpu::shaders::constants::PHOTON_BOUNCE_MAX;
use crate::transport::PathSet;
use crate::transport::differentials::global_step;
use crate::transport::path_set::PATH_SET_LOBES;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Most photons of a pass.
const PHOTONS_MAX: u32 = 1 << 24;
/// Most samples of a pixel in a pass.
const SAMPLES_MAX: u32 = 1024;
/// Automatic lengths as shares of the diagonal of the scene's box: the radius of fixed kernels, the greatest axis of others, and the unit of
/// the dampening. A room of 6 m × 6 m × 3 m has a diagonal of 9 m; the source's unit and greatest axis are 1 m.
const RADIUS_SHARE: f64 = 1.0 / 100.0;
const UNIT_SHARE: f64 = 1.0 / 9.0;
/// Most photons under a kernel about a point, and least: the last one only says how wide it is.
const NEIGHBORS_MAX: u32 = 1000;
const NEIGHBORS_MIN: u32 = 2;
/// Neighbours are looked for as far as this many times their number would lie.
const NEIGHBORS_MARGIN: f64 = 4.0;
/// Nodes and records of a query, at most: loops stay below [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
const QUERY_QUOTA: u32 = 32_768;
/// Least length of an axis in unit lengths.
const LENGTH_MIN: f64 = 1e-3;

/// How points are looked up in the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapQuery {
    /// Each by itself.
    Single,
    /// Those of a subgroup together, where the device has votes.
    Packet,
}

/// Which places of a wave the invocations of queries are for.
///
/// Source: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapQueue {
    /// An invocation a place of the wave's paths under way; those that ask nothing idle (type I).
    Slots,
    /// Places that ask, listed in order by stream compaction (type II).
    Compacted,
    /// Places that ask, in blocks as wide as the subgroups that append them, where the device has full subgroups with ballots (type III).
    Blocks,
}

/// Settings of photon mapping.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PhotonSettings {
    /// Which light paths the picture contains: all, or a range of bounces.
    pub path_set: PathSet,
    /// Photons of a pass, 1 to 2²⁴.
    pub photons: u32,
    /// What the kernels' axes are.
    pub shape: KernelShape,
    /// Photons under one kernel about each point that is looked up, in the first pass; 0 for kernels about the photons.
    pub neighbors: u32,
    /// How kernels fall off.
    pub profile: KernelProfile,
    /// Radius of fixed kernels, greatest axis of others, farthest neighbour, in the first pass, m. 0 stands for a hundredth of the scene's
    /// diagonal for fixed kernels, a ninth for others, and four times the neighbours' area if photons were spread evenly.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub radius: f32,
    /// Axes of kernels that follow footprints, as multiples of these, in the first pass.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub spread: f32,
    /// Exponent by which footprints are dampened, in (0, 1]; 1 leaves them as they are.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub dampening: f32,
    /// Unit length of the dampening, m; 0 for a ninth of the scene's diagonal.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub unit_length: f32,
    /// Footprints are flat whose area over the square of their longer axis is less than this, in [0, 1).
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub flatness: f32,
    /// Widens flat footprints, so that no light is lost; the source leaves them without a kernel.
    pub widen_flat: bool,
    /// α of progressive photon mapping (Hachisuka and Jensen 2009; Knaus and Zwicker 2011), in (0, 1]: kernels of pass i + 1 have
    /// (i + α) / (i + 1) of the area of those of pass i. 1 keeps kernels, and their bias.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub reduction: f32,
    /// Eye paths of a pixel in a pass.
    pub samples_per_pass: u32,
    /// Direct light comes from the map too, not from shadow rays.
    pub direct_photons: bool,
    /// The map is seen after one more diffuse reflection; caustics stay directly seen.
    pub final_gather: bool,
    /// How the map is asked. The picture is the same, up to the order of sums where a query's quota stops it; with neighbours, where a quota
    /// is an error, points that ask together meet it sooner.
    pub query: MapQuery,
    /// How queries are queued, and so which points ask together. The picture is the same, as with `query`.
    pub queue: MapQueue,
    /// Random numbers: Owen-scrambled Sobol' or PCG.
    pub sampler: SamplerKind,
    /// Seed of the random numbers; the view's, where settings come as text.
    #[serde(skip)]
    pub seed: u32,
    /// Also gathers albedo, normal and depth of what is seen first; the view's, where settings come as text.
    #[serde(skip)]
    pub aovs: bool,
    /// Nodes and records after which a query of the map is given up and its place goes through all records instead. Changes the order of
    /// sums only.
    #[serde(skip)]
    pub query_quota: u32,
}

impl Default for PhotonSettings {
    fn default() -> Self {
        Self {
            path_set: PathSet::ALL,
            photons: 1 << 16,
            shape: KernelShape::Fixed,
            neighbors: 0,
            profile: KernelProfile::Epanechnikov,
            radius: 0.0,
            spread: 20.0,
            dampening: 0.25,
            unit_length: 0.0,
            flatness: 0.05,
            widen_flat: true,
            reduction: 2.0 / 3.0,
            samples_per_pass: 1,
            direct_photons: false,
            final_gather: false,
            query: MapQuery::Single,
            queue: MapQueue::Slots,
            sampler: SamplerKind::Sobol,
            seed: 0,
            aovs: false,
            query_quota: QUERY_QUOTA,
        }
    }
}

impl PhotonSettings {
    /// Refuses what is out of range.
    pub(super) fn check(&self) -> Result<()> {
        let in_range = |name: &str, value: u32, range: RangeInclusive<u32>| {
            let cause = || format!("is not in {range:?}");
            range
                .contains(&value)
                .then_some(())
                .ok_or_else(|| Error::setting(name, value, cause()))
        };
        in_range("photons", self.photons, 1..=PHOTONS_MAX)?;
        in_range("samples_per_pass", self.samples_per_pass, 1..=SAMPLES_MAX)?;
        if self.neighbors > 0 {
            in_range("neighbors", self.neighbors, NEIGHBORS_MIN..=NEIGHBORS_MAX)?;
        }
        in_range("query_quota", self.query_quota, 1..=QUERY_QUOTA)?;
        let fits = |name: &str, value: f32, fits: bool, cause: &str| {
            fits.then_some(()).ok_or_else(|| Error::setting(name, value, cause))
        };
        let length = |value: f32| value >= 0.0 && value.is_finite();
        fits("radius", self.radius, length(self.radius), "is no length")?;
        fits(
            "unit_length",
            self.unit_length,
            length(self.unit_length),
            "is no length",
        )?;
        fits(
            "spread",
            self.spread,
            self.spread > 0.0 && self.spread.is_finite(),
            "is not positive",
        )?;
        fits(
            "dampening",
            self.dampening,
            self.dampening > 0.0 && self.dampening <= 1.0,
            "is not in (0, 1]",
        )?;
        fits(
            "flatness",
            self.flatness,
            (0.0..1.0).contains(&self.flatness),
            "is not in [0, 1)",
        )?;
        fits(
            "reduction",
            self.reduction,
            self.reduction > 0.0 && self.reduction <= 1.0,
            "is not in (0, 1]",
        )?;
        if self.direct_photons && self.final_gather {
            let cause = "cannot be had with direct_photons: direct light would be seen twice";
            return Err(Error::setting("final_gather", true, cause));
        }
        Ok(())
    }

    /// Whether kernels follow the photons' footprints.
    pub(super) fn follows_footprints(&self) -> bool {
        self.shape != KernelShape::Fixed && self.neighbors == 0
    }

    /// Neighbours of a point in a pass.
    pub(super) fn neighbors_in(&self, pass: u32) -> u32 {
        let kept = shrinkage(pass, f64::from(self.reduction)).powi(2);
        ((f64::from(self.neighbors) * kept).round() as u32).max(NEIGHBORS_MIN)
    }

    /// Kernels of a pass, in a scene of that diagonal, m, and that area, m².
    pub(super) fn kernel(&self, pass: u32, diagonal: f64, area: f64) -> KernelSettings {
        let automatic = |setting: f32, length: f64| match f64::from(setting) {
            0.0 if length > 0.0 => length,
            0.0 => 1.0,
            set => set,
        };
        let shrunk = shrinkage(pass, f64::from(self.reduction));
        let unit_length = automatic(self.unit_length, UNIT_SHARE * diagonal);
        let length_max = if self.neighbors > 0 {
            // As far as so many times the neighbours would be if a deposit of each photon were spread evenly.
            let share = NEIGHBORS_MARGIN * f64::from(self.neighbors) / f64::from(self.photons);
            automatic(self.radius, (share * area / PI).sqrt())
        } else if self.shape == KernelShape::Fixed {
            automatic(self.radius, RADIUS_SHARE * diagonal)
        } else {
            automatic(self.radius, UNIT_SHARE * diagonal)
        };
        KernelSettings {
            shape: if self.follows_footprints() {
                self.shape
            } else {
                KernelShape::Fixed
            },
            spread: f64::from(self.spread) * global_step(f64::from(self.photons)) * shrunk,
            exponent: f64::from(self.dampening),
            unit_length,
            length_min: LENGTH_MIN.min(length_max / unit_length) * shrunk,
            length_max: length_max / unit_length * shrunk,
            flatness: f64::from(self.flatness),
            widens_flat: self.widen_flat,
        }
    }

    /// What is stored of photons, scattered so often before they land.
    pub(super) fn stored(&self) -> Stored {
        Stored {
            first_bounce: u32::from(!self.direct_photons),
            // They are scattered once more where they are seen.
            last_bounce: self
                .path_set
                .max_bounces()
                .map_or(u32::MAX, |max| max.saturating_sub(1)),
        }
    }

    /// Whether the picture has anything of a map.
    pub(super) fn needs_photons(&self) -> bool {
        self.path_set
            .max_bounces()
            .is_none_or(|max| max > u32::from(!self.direct_photons))
    }

    /// What eye paths gather by themselves: light seen through specular and glossy scattering, and direct light at the first diffuse surface
    /// (with a final gather, at the second too).
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a path set that is more than a range of bounces.
    pub(super) fn eye_paths(&self) -> Result<PathSet> {
        if self.path_set != PathSet::new(self.path_set.min_bounces(), self.path_set.max_bounces(), PATH_SET_LOBES)? {
            return Err(Error::Unsupported {
                technique: "photon".into(),
                reasons: vec![format!(
                    "its pictures contain all paths of a range of bounces (bounces=A..B), but {} is more than that",
                    self.path_set
                )],
            });
        }
        let (min, max) = (self.path_set.min_bounces(), self.path_set.max_bounces());
        if min.max(max.unwrap_or(0)) > PHOTON_BOUNCE_MAX {
            let cause = format!("counts more than {PHOTON_BOUNCE_MAX} bounces, which records of photons cannot");
            return Err(Error::setting("path_set", self.path_set, cause));
        }
        let seen = match (self.direct_photons, self.final_gather) {
            (true, _) => "L[SG]*E",
            (false, false) => "LD?[SG]*E",
            (false, true) => "L[SG]*E|LD[SG]*E|LD[SG]*D[SG]*E",
        };
        let seen: PathSet = seen.parse()?;
        if !self.needs_photons() {
            return self.path_set.intersection(&seen);
        }
        // The range stays beside the automaton: folded into it, it would end eye paths whose own light is too short for the range, but which
        // gather photons that are not.
        Ok(seen.in_range(self.path_set.min_bounces(), self.path_set.max_bounces()))
    }
}

/// Length of kernels in a pass relative to the first: the square root of the product of (k + reduction) / (k + 1) for k = 1 … pass, which
/// falls as pass^((reduction - 1) / 2).
///
/// Source: C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM TOG 30(3), 2011, §4.
pub(super) fn shrinkage(pass: u32, reduction: f64) -> f64 {
    let step = |k: u32| (f64::from(k) + reduction) / (f64::from(k) + 1.0);
    (1..=pass).map(step).product::<f64>().sqrt()
}
