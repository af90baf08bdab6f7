//! Settings of photon mapping, and the path sets of its two parts.

use super::kernel::{KernelProfile, KernelSettings, KernelShape};
use super::path_classes::PathClasses;
use super::tracer::{PhotonPlan, Stored};
use super::volume::footprint::{EventKernelSettings, event_step};
use super::volume::transmittance::VolumeTransmittance;
use super::volume::ways::BeamLength;
use super::volume::{BEAM_DIMENSIONS, VolumeEstimate, VolumeKernel};
use crate::gpu::shaders::constants::PHOTON_BOUNCE_MAX;
use crate::settings::{Above, AboveTo, OrZero};
use crate::techniques::path::{PhotonRadii, SAMPLES_PER_WAVE};
use crate::transport::PathSet;
use crate::transport::differentials::global_step;
use crate::transport::path_set::PATH_SET_LOBES;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};
use std::f64::consts::PI;

/// Automatic lengths as shares of the diagonal of the scene's box: the radius of fixed kernels, the greatest axis of others, and the unit of
/// the dampening. A room of 6 m × 6 m × 3 m has a diagonal of 9 m; the source's unit and greatest axis are 1 m.
const RADIUS_SHARE: f64 = 1.0 / 50.0;
const UNIT_SHARE: f64 = 1.0 / 9.0;
/// The radius of fixed kernels in media is this share of the least mean free path at most.
const PATH_SHARE: f64 = 1.0 / 4.0;
/// Least photons under a kernel about a point: the last one only says how wide it is.
const NEIGHBORS_MIN: u32 = 2;
/// Passes that neighbours must not yet be the least after, to count as shrinking.
const MANY_PASSES: u32 = 1024;
/// Neighbours are looked for as far as this many times their number would lie.
const NEIGHBORS_MARGIN: f64 = 4.0;
/// Nodes and records of a query, at most: loops stay below [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
const QUERY_QUOTA: u32 = 32_768;
/// Least length of an axis in unit lengths.
const LENGTH_MIN: f64 = 1e-3;

/// Lengths of a scene that kernels in its media are chosen by.
#[derive(Debug, Clone, Copy)]
pub(super) struct MediaLengths {
    /// Of the scene's box, m; 0 without surfaces.
    pub diagonal: f64,
    /// As [`GpuScene::extinctions`](crate::transport::GpuScene::extinctions).
    pub extinctions: Option<[f64; 2]>,
    /// Of the automatic radius, what a pilot has left.
    pub share: f64,
}

impl MediaLengths {
    /// Mean free path of the densest medium, or of the thinnest one, m; a metre where none scatters, since nothing is seen there.
    fn free_path(&self, of_densest: bool) -> f64 {
        self.extinctions
            .map_or(1.0, |range| 1.0 / range[usize::from(of_densest)])
    }
}

/// How points, and rays through media, are looked up in their maps.
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
/// Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapQueue {
    /// An invocation per place of the wave's paths under way; those that ask nothing idle (type I).
    Slots,
    /// Places that ask, listed in order by stream compaction (type II).
    Compacted,
    /// Places that ask, in blocks as wide as subgroups (type III).
    Blocks,
}

/// Whether the closest hits of eye rays, their ways through media and the queries along them are separate kernels (B. Fabianowski,
/// "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4) or one (the engine's own).
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapStages {
    /// A kernel for the closest hits of rays, and others for their ways through media and what they see there.
    Stream,
    /// One kernel for all three.
    Fused,
}

/// Who builds the map. The same bytes either way, where the device rounds numbers of 64 bits as IEEE 754 says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MapBuild {
    /// The device where it can (`shaderFloat64`, and memory for it), else the host.
    Auto,
    /// The device: photons are never read back.
    Device,
    /// The host: photons are read back, and the map is copied to the device.
    Host,
}

crate::settings! {
    /// Settings of photon mapping.
    pub struct PhotonSettings {
        /// Which light paths the picture contains.
        pub path_set: PathSet = PathSet::ALL, in "all | emitted | direct | indirect | bounces=A..B, up to 63 | an expression";
        /// More give less noise, and less bias with kernels that follow footprints.
        pub photons: u32 = 1 << 16, in 1..=1 << 24, unit "photons per pass";
        /// Kernels of one radius, or of each photon's footprint: disks of its area, ellipses by its principal axes or by its differentials.
        ///
        /// Footprints are worth their time only where no one radius suits the whole picture; the experiment `photon-defaults` measures both.
        pub shape: KernelShape = KernelShape::Fixed;
        /// Gathers so many of the photons nearest to each point under one kernel that reaches to the last of them, fewer as passes go on, down
        /// to 2; with 0 photons have kernels of their own.
        pub neighbors: u32 = 0, in OrZero(NEIGHBORS_MIN..=1000), unit "photons";
        /// How kernels fall off: a choice between noise and visible rims.
        pub profile: KernelProfile = KernelProfile::Epanechnikov;
        /// Radius of fixed kernels, greatest axis of others, farthest neighbour, in the first pass; 0 chooses by the size of the scene, for
        /// neighbours by its area and the photons.
        ///
        /// 0 stands for a fiftieth of the scene's diagonal for fixed kernels, a ninth for others, and four times the neighbours' area if
        /// photons were spread evenly.
        pub radius: f32 = 0.0, in 0.0.., unit "m";
        /// Size of kernels that follow footprints, in the first pass: multiples of the footprints' axes.
        pub spread: f32 = 10.0, in Above(0.0), unit "footprints";
        /// Evens out the sizes of footprints, for kernels that follow them; 1 leaves them as they are.
        pub dampening: f32 = 0.25, in AboveTo(0.0, 1.0), unit "exponent";
        /// Size that the dampening leaves as it is; 0 for a ninth of the scene's diagonal.
        pub unit_length: f32 = 0.0, in 0.0.., unit "m";
        /// For kernels that follow footprints: a footprint is flat if its area over the square of its longer axis is less. Values below
        /// 1/1024 stand for 1/1024, as weights are divided by that area.
        pub flatness: f32 = 0.05, in 0.0..1.0;
        /// Widens flat footprints to that flatness; otherwise photons that have them are left out, with their light, in every pass.
        ///
        /// The source leaves them without a kernel.
        pub widen_flat: bool = true;
        /// α of progressive photon mapping: pass i + 1 has kernels of (i + α)/(i + 1) the area; less has less bias and more noise, 1 keeps the
        /// bias.
        ///
        /// Sources: Hachisuka and Jensen 2009; Knaus and Zwicker 2011.
        pub reduction: f32 = 2.0 / 3.0, in AboveTo(0.0, 1.0);
        /// Eye paths per pixel that query the same map.
        pub samples_per_pass: u32 = 1, in 1..=SAMPLES_PER_WAVE, unit "samples";
        /// How photons in media are seen: collisions under disks across each eye ray, one query for all of it, or under balls at places along it; or, in homogeneous
        /// media alone, whole ways, or planes that two flights span, without blur, beside the ways of light that was not scattered twice in a row there; or collisions and ways together, each
        /// weighted by what the other has of the same light, which is good where a medium is dense as well as where it is thin; each has kernels of its own, of one radius in the first pass, and in grids there are collisions alone.
        pub volume: VolumeEstimate = VolumeEstimate::Ray;
        /// How far photon beams reach: to the next surface (`long`), weighted by the transmittance along them, or each to a random end (`short`), drawn from the least extinct
        /// band that scatters.
        ///
        /// Short beams take less time and memory and are noisier: take them where rays meet too many beams.
        pub volume_beams: BeamLength = BeamLength::Long;
        /// What a density grid leaves of light along an eye ray: a walk finds it by ratio tracking, the same for all photons that the ray sees, and unbiased for each; or a table of its
        /// logarithm at 64 places, which has no noise and takes as long in any grid, but errs by what the density does within a 64th of the way.
        ///
        /// Take the table where densities are smooth and the noise of walks shows.
        pub volume_transmittance: VolumeTransmittance = VolumeTransmittance::Walk;
        /// Kernels of photons in media have one radius, that of each photon's footprint, or that within which the nearest of the others lie, which the host finds.
        pub volume_kernel: VolumeKernel = VolumeKernel::Fixed;
        /// Of kernels by neighbours in media: as wide as the distance to the neighbour of this rank. More blur more and have less noise.
        ///
        /// B. Fabianowski, 2011, has 85; T. Engelhardt, 2013, §10.4, has 117.
        pub volume_neighbors: u32 = 85, in 1..=1000, unit "photons";
        /// Radius of fixed kernels of photons in media, greatest one of others, in the first pass; 0 chooses by what rays meet.
        ///
        /// 0 stands for the radius of fixed kernels under which rays meet some tens of them, which a small picture of few photons finds out, at most a fiftieth of the scene's diagonal
        /// and in each medium a quarter of its mean free path, of ways in the densest one for all; and for a ninth of the diagonal for others. With planes, which are met with beams, the same share of all ways has one; with a radius of your own all have.
        pub volume_radius: f32 = 0.0, in 0.0.., unit "m";
        /// Size of kernels in media that follow footprints, in the first pass: multiples of the cube root of a footprint's volume.
        pub volume_spread: f32 = 3.0, in Above(0.0), unit "footprints";
        /// From which size on kernels in media that follow footprints grow slower, by a logarithm: the cube root of a footprint's volume, as for one photon in all, over that of the square of the unit length times the medium's least mean free path; 0 leaves them as they are.
        ///
        /// By the default rays meet about as many kernels as by 85 neighbours; sizes in metres do not carry over from scene to scene.
        pub volume_dampening: f32 = 2.0, in 0.0..;
        /// Eye paths go on behind their first scattering in a medium, and share the light that they find there with photons, each weighted by what the others have of it; for
        /// `unified` and `planes` alone, and not with final_gather.
        ///
        /// Off by default, with planes, too: they take time for a share that is small where there are many photons; most worth it under narrow kernels, and with planes under narrow phase functions,
        /// where these alone have their light by rare spikes and pictures of few passes are too dark.
        pub volume_paths: bool = false;
        /// Takes direct light from the map, too, instead of by shadow rays; cannot be combined with final_gather.
        pub direct_photons: bool = false;
        /// Sees the map after one more diffuse reflection, caustics directly; cannot be combined with direct_photons.
        pub final_gather: bool = false;
        /// Points, and rays through media, query their maps one by one, or those of a subgroup together, which needs subgroup votes; where a query's quota stops it, the last
        /// bits may differ.
        ///
        /// With neighbours, where a quota is an error, points that ask together meet it sooner. Packets are no default since they often lose
        /// (experiments `photon-queues` and `volume-queues`).
        pub query: MapQuery = MapQuery::Single;
        /// Invocations of queries serve every path under way, or only those that query the map in question, found by stream compaction or in blocks that
        /// subgroups collect; changes pictures only as query does. Rays have each queue, single and in packets, with every estimate of volume.
        pub queue: MapQueue = MapQueue::Slots;
        /// In scenes with media a kernel finds the closest hits of eye rays, and others their ways through media and what they see there, or one does all that; without media there is nothing to
        /// fuse. Never changes the picture. With slots and single queries alone, and not over a kd-tree.
        ///
        /// Compare both with `clerestory report volume-queues`; `fused` saves passes, and leaves what a quota stops to the separate kernels.
        pub stages: MapStages = MapStages::Stream;
        /// Who builds the map: the device, which needs shaderFloat64 and never reads photons back, or the host; auto is the device where
        /// it can. Never changes the picture.
        pub map_build: MapBuild = MapBuild::Auto;
        /// Owen-scrambled Sobol' points, such that are jointly even in their first sixteen dimensions, or independent samples (PCG); changes the noise only.
        ///
        /// Photons are samples, too, and the joint points are even in runs of 65,536 of them.
        pub sampler: SamplerKind = SamplerKind::Sobol;
    }
    unlisted {
        /// Seed of the random numbers. A [`View`](crate::techniques::View) gives its own.
        pub seed: u32 = 0;
        /// Also gathers albedo, normal and depth of what is seen first. A [`View`](crate::techniques::View) says whether.
        pub aovs: bool = false;
        /// Nodes and records after which a query of the map is given up and its place goes through all records instead, which changes the order
        /// of sums only; with neighbours the area that is searched is halved instead, and they may be fewer.
        pub query_quota: u32 = QUERY_QUOTA, in 1..=QUERY_QUOTA;
        /// Counts what rays through media fetch of the map ([`MapperCounts::ray_fetches`](super::MapperCounts::ray_fetches)), by other kernels. Never changes the picture: for
        /// measuring.
        pub count_fetches: bool = false;
        /// Work of photons, of eye paths and of queries, in loop iterations, after which a submission begins no further place, as
        /// [`WalkOptions::work`](crate::walk::WalkOptions::work); 0 chooses by the kind of device. Never changes the picture.
        pub submission_work: u64 = 0;
    }
    check PhotonSettings::fits_together;
}

impl PhotonSettings {
    fn fits_together(&self) -> Result<()> {
        if self.stores_ways() && self.volume_kernel != VolumeKernel::Fixed {
            let cause = format!(
                "cannot be combined with \"volume\": \"{}\", whose beams have one radius: take \"fixed\"",
                self.volume.word()
            );
            return Err(Error::setting("volume_kernel", self.volume_kernel.word(), cause));
        }
        if self.stages == MapStages::Fused && (self.queue != MapQueue::Slots || self.query != MapQuery::Single) {
            let cause = "needs \"queue\": \"slots\" and \"query\": \"single\": a queue is filled between the kernels that it fuses";
            return Err(Error::setting("stages", "fused", cause));
        }
        if self.volume_paths && !self.volume.shares_with_paths() {
            let cause = format!(
                "needs \"volume\": \"unified\" or \"planes\", but that is \"{}\"",
                self.volume.word()
            );
            return Err(Error::setting("volume_paths", true, cause));
        }
        if self.volume_paths && self.final_gather {
            let cause = "cannot be combined with final_gather, behind which the map is seen";
            return Err(Error::setting("volume_paths", true, cause));
        }
        if self.direct_photons && self.final_gather {
            let cause = "cannot be combined with direct_photons: direct light would be seen twice";
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

    /// Whether kernels shrink from pass to pass, for many passes.
    pub(super) fn kernels_shrink(&self) -> bool {
        self.reduction < 1.0 && (self.neighbors == 0 || self.neighbors_in(MANY_PASSES) > NEIGHBORS_MIN)
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

    /// Greatest radius of the kernels of events in media, m, in a pass: the area of disks, the width of beams or the volume of balls falls from pass to pass as
    /// [`reduction`](PhotonSettings::reduction) says.
    ///
    /// Source: C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM TOG 30(3), 2011.
    pub(super) fn event_radius(&self, pass: u32, lengths: &MediaLengths) -> f64 {
        self.first_event_radius(lengths) * self.event_shrinkage(pass)
    }

    /// The same of beams and of collisions, which shrink at rates of their own where they stand beside each other.
    pub(super) fn event_radii(&self, pass: u32, lengths: &MediaLengths) -> PhotonRadii {
        let collisions = self.event_radius(pass, lengths);
        let beams = if self.stores_ways() {
            self.first_event_radius(lengths) * self.shrinkage_of(pass, BEAM_DIMENSIONS)
        } else {
            collisions
        };
        PhotonRadii { beams, collisions }
    }

    fn first_event_radius(&self, lengths: &MediaLengths) -> f64 {
        // Beams have one radius in all media, events each medium's own.
        let free_path = lengths.free_path(self.stores_ways());
        match (f64::from(self.volume_radius), self.volume_kernel) {
            (0.0, VolumeKernel::Fixed) => {
                let by_path = PATH_SHARE * free_path;
                let by_scene = RADIUS_SHARE * lengths.diagonal;
                lengths.share * if by_scene > 0.0 { by_path.min(by_scene) } else { by_path }
            }
            (0.0, VolumeKernel::Footprint | VolumeKernel::Neighbor) => self.event_unit_length(lengths),
            (set, _) => set,
        }
    }

    /// Radius of the kernels of events over the mean free path of their medium where it is densest, at most, in a pass; 0 for any.
    ///
    /// Within a boundary's reach events lack on one side, which must be little of a mean free path.
    pub(super) fn event_path_share(&self, pass: u32, lengths: &MediaLengths) -> f64 {
        if self.radius_is_automatic() && !self.stores_ways() {
            PATH_SHARE * lengths.share * self.event_shrinkage(pass)
        } else {
            0.0
        }
    }

    /// Whether the radius of kernels in media is for a pilot to choose.
    pub(super) fn radius_is_automatic(&self) -> bool {
        self.volume_radius == 0.0 && self.volume_kernel == VolumeKernel::Fixed
    }

    /// Unit of lengths for kernels in media that follow footprints, m.
    fn event_unit_length(&self, lengths: &MediaLengths) -> f64 {
        match f64::from(self.unit_length) {
            0.0 if lengths.diagonal > 0.0 => UNIT_SHARE * lengths.diagonal,
            0.0 => lengths.free_path(false),
            set => set,
        }
    }

    /// Power of the width of kernels in media with which the number that a ray meets goes, where they lie evenly: disks and balls by their area, beams by their width.
    pub(super) fn event_dimensions(&self) -> f64 {
        if self.stores_ways() { BEAM_DIMENSIONS } else { 2.0 }
    }

    /// Radius of events' kernels in a pass relative to the first.
    pub(super) fn event_shrinkage(&self, pass: u32) -> f64 {
        self.shrinkage_of(pass, self.volume.dimensions())
    }

    /// The same of kernels of so many dimensions.
    fn shrinkage_of(&self, pass: u32, dimensions: f64) -> f64 {
        shrinkage(pass, f64::from(self.reduction)).powf(2.0 / dimensions)
    }

    /// Whether the ways of photons through media are stored, instead of their collisions or beside them.
    pub(super) fn stores_ways(&self) -> bool {
        self.volume.stores_ways()
    }

    /// Kernels of events in media in a pass.
    pub(super) fn event_kernel(&self, pass: u32, lengths: &MediaLengths) -> EventKernelSettings {
        let unit_length = self.event_unit_length(lengths);
        let (length_max, shrunk) = (self.event_radius(pass, lengths), self.event_shrinkage(pass));
        EventKernelSettings {
            spread: f64::from(self.volume_spread) * event_step(f64::from(self.photons)) * shrunk,
            dampening: f64::from(self.volume_dampening),
            unit_length,
            length_min: match self.volume_kernel {
                VolumeKernel::Fixed => length_max,
                VolumeKernel::Footprint | VolumeKernel::Neighbor => (LENGTH_MIN * unit_length * shrunk).min(length_max),
            },
            length_max,
        }
    }

    /// How photons are traced.
    pub(super) fn plan(&self, has_media: bool) -> PhotonPlan {
        let in_media = has_media && self.volume_kernel == VolumeKernel::Footprint && !self.stores_ways();
        PhotonPlan {
            photons: self.photons,
            sampler: self.sampler,
            seed: self.seed,
            submission_work: self.submission_work,
            follows_footprints: self.follows_footprints() || in_media,
            tells_caustics: self.final_gather,
            even_survival: false,
            stores_lights: false,
            only_rough: false,
            carries_light_distance: has_media && self.volume_paths,
            stored: self.stored(),
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

    /// The least and the greatest number of bounces that are counted, of paths that no classes part.
    pub(super) fn counted_bounces(&self, classes: Option<&PathClasses>) -> (u32, Option<u32>) {
        match classes {
            Some(_) => (0, None),
            None => (self.path_set.min_bounces(), self.path_set.max_bounces()),
        }
    }

    /// Whether the picture has anything of a map.
    pub(super) fn needs_photons(&self) -> bool {
        self.path_set
            .max_bounces()
            .is_none_or(|max| max > u32::from(!self.direct_photons))
    }

    /// How an expression's light paths are parted; `None` for a range of bounces. `shares`: eye paths go on in media.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for an expression behind a final gather, beside a long range of bounces, and one that tells too much apart.
    pub(super) fn classes(&self, shares: bool) -> Result<Option<PathClasses>> {
        let (min, max) = (self.path_set.min_bounces(), self.path_set.max_bounces());
        if self.path_set == PathSet::new(min, max, PATH_SET_LOBES)? {
            return Ok(None);
        }
        let refuse = |why: &str| Error::Unsupported {
            technique: "photon".into(),
            reasons: vec![format!(
                "its pictures contain the paths of a range of bounces (bounces=A..B) or of an expression, but {} {why}",
                self.path_set
            )],
        };
        if self.final_gather {
            return Err(refuse("is none that a final gather can part"));
        }
        let set = self.path_set.by_states();
        let set = set.ok_or_else(|| refuse("counts more bounces than light paths have states"))?;
        PathClasses::new(&set, self.direct_photons, shares)
            .map(Some)
            .map_err(refuse)
    }

    /// What eye paths gather by themselves: light seen through specular and glossy scattering, and direct light at the first diffuse surface
    /// (with a final gather, at the second too), in scenes with media also at the first scattering in a medium; where it `shares` light with photons all behind that, but light that a mirror
    /// scatters first.
    ///
    /// # Errors
    /// [`Error::Unsupported`] as [`classes`](PhotonSettings::classes), [`Error::Setting`] for more bounces than records can count.
    pub(super) fn eye_paths(&self, has_media: bool, shares: bool) -> Result<PathSet> {
        if let Some(classes) = self.classes(shares)? {
            return Ok(classes.eye);
        }
        let (min, max) = (self.path_set.min_bounces(), self.path_set.max_bounces());
        if min.max(max.unwrap_or(0)) > PHOTON_BOUNCE_MAX {
            let cause = format!("counts more than {PHOTON_BOUNCE_MAX} bounces, which records of photons cannot");
            return Err(Error::setting("path_set", self.path_set, cause));
        }
        let seen = match (self.direct_photons, self.final_gather, has_media) {
            (true, _, _) if shares => "L[SG]*E|L[DGV].*V[SG]*E",
            (false, _, true) if shares => "L[DV]?[SG]*E|L[DGV].*V[SG]*E",
            (true, _, _) => "L[SG]*E",
            (false, false, false) => "LD?[SG]*E",
            (false, true, false) => "L[SG]*E|LD[SG]*E|LD[SG]*D[SG]*E",
            (false, false, true) => "L[DV]?[SG]*E",
            (false, true, true) => "L[SG]*E|L[DV][SG]*E|L[DV][SG]*D[SG]*E",
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
