//! Which ray index a scene is uploaded with: its name on command lines and in reports, its settings, and the build.
//!
//! The choice changes how long the build and the rays take, and nothing in a picture: every index reports the same hits, ties included
//! (see [`accel`](super)).

use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::time::Instant;

use super::bvh2::{Bvh2, Bvh2Settings};
use super::driver::DriverIndex;
use super::kd::{KdSettings, KdTree};
use super::lbvh::{self, BuildQuality, LbvhBuilder, LbvhSettings};
use super::two_level::{MeshGeometry, Placement, TwoLevelBvh};
use super::wide::{WideBuilder, WideBvh, WideSettings};
use super::{BuildStages, DeviceTraversal, IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::interface::{BindingSet, BoundResource};
use crate::gpu::shaders::sets::{DriverSet, IndexSet};
use crate::gpu::{AccelerationStructure, Caps, Category, Gpu, TexelView};
use crate::{Error, Result};
use glam::Vec3;

/// A ray index that the path tracer can traverse, with the settings of its build.
///
/// As text, by [`FromStr`] and [`Display`](fmt::Display), it is one of [`IndexKind::NAMES`] or [`IndexKind::AUTOMATIC`], with default settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IndexKind {
    /// Binary hierarchy by the binned surface area heuristic.
    Bvh2(Bvh2Settings),
    /// Linear hierarchy along the Morton curve: the shortest build and the slowest rays, unless its quality asks for the tree to be
    /// optimised afterwards.
    Lbvh(LbvhSettings),
    /// The same, built by the device where a scene is uploaded, and left there. Of the settings those of quality are not used.
    LbvhOnDevice(LbvhSettings),
    /// kd-tree: the longest build, and leaves in the order of the ray.
    Kd(KdSettings),
    /// Eight children a node, compressed, made of the optimised linear hierarchy.
    Wide(WideSettings),
    /// The same made of the linear hierarchy as its codes spell it, both by the device where a scene is uploaded, and left there.
    WideOnDevice(WideSettings),
    /// The same for each mesh, and one over the instances that place them: a scene is kept as it is described, where the others flatten it.
    TwoLevel(WideSettings),
    /// One of both: two levels where a scene needs much less memory with them or would not fit without, and the wide hierarchy elsewhere, whose rays are
    /// faster ([`GpuScene::with_index`](crate::transport::GpuScene::with_index) has the rule). The default.
    Automatic(WideSettings),
    /// The driver's acceleration structure, on devices with ray queries.
    Driver,
}

impl Default for IndexKind {
    fn default() -> Self {
        Self::Automatic(WideSettings::default())
    }
}

impl IndexKind {
    /// The names of all that can be built: the binned heuristic, the linear hierarchy as its codes spell it, the same optimised, the former built by
    /// the device, the kd-tree, the wide hierarchy, one built by the device, two levels of it, and the driver's acceleration structure.
    pub const NAMES: [&'static str; 9] = [
        "bvh2",
        "lbvh",
        "lbvh-high",
        "lbvh-device",
        "kd",
        "wide",
        "wide-device",
        "two-level",
        "driver",
    ];

    /// The name of the choice between the wide hierarchy and two levels of it.
    pub const AUTOMATIC: &'static str = "auto";

    /// The linear hierarchy with default settings.
    pub fn lbvh(quality: BuildQuality) -> Self {
        Self::Lbvh(LbvhSettings {
            quality,
            ..LbvhSettings::default()
        })
    }

    /// One of [`IndexKind::NAMES`], or [`IndexKind::AUTOMATIC`].
    pub fn name(&self) -> &'static str {
        match self {
            Self::Bvh2(_) => "bvh2",
            Self::Lbvh(settings) => match settings.quality {
                BuildQuality::Fast => "lbvh",
                BuildQuality::High => "lbvh-high",
            },
            Self::LbvhOnDevice(_) => "lbvh-device",
            Self::Kd(_) => "kd",
            Self::Wide(_) => "wide",
            Self::WideOnDevice(_) => "wide-device",
            Self::TwoLevel(_) => "two-level",
            Self::Automatic(_) => Self::AUTOMATIC,
            Self::Driver => "driver",
        }
    }

    /// Whether a device has what it takes: ray queries, of the driver's structure.
    pub fn is_offered_by(&self, caps: &Caps) -> bool {
        caps.ray_query || *self != Self::Driver
    }

    /// Builds over `triangles` on the host's threads, also what the device would build: the tree is the same. Hits name triangles by their
    /// place in it. Deterministic whatever the number of threads.
    ///
    /// # Errors
    /// As [`Bvh2::build`], [`lbvh::build`], [`KdTree::build`], [`WideBvh::build`] and [`TwoLevelBvh::build`]; [`Error::Setting`] for the driver's structure,
    /// which a device alone has.
    pub fn build(&self, triangles: &[[Vec3; 3]]) -> Result<Box<dyn RayIndex>> {
        Ok(match self {
            Self::Bvh2(settings) => Box::new(Bvh2::build(triangles, settings)?),
            Self::Lbvh(settings) => Box::new(lbvh::build(triangles, settings)?),
            Self::LbvhOnDevice(settings) => Box::new(lbvh::build(triangles, &as_codes_spell_it(settings))?),
            Self::Kd(settings) => Box::new(KdTree::build(triangles, settings)?),
            // Triangles alone have no instances.
            Self::Wide(settings) | Self::Automatic(settings) => Box::new(WideBvh::build(triangles, settings)?),
            Self::WideOnDevice(settings) => {
                let binary = as_codes_spell_it(&settings.binary);
                Box::new(WideBvh::build(triangles, &WideSettings { binary, ..*settings })?)
            }
            Self::TwoLevel(settings) => {
                let mesh = MeshGeometry { triangles, names: None };
                Box::new(TwoLevelBvh::build(&[mesh], &[Placement::identity(0)], settings)?)
            }
            Self::Driver => {
                return Err(Error::setting("index", self, "is built by a device, and no host can"));
            }
        })
    }

    /// Builds, where the kind says and the device can, and says how long that took.
    ///
    /// # Errors
    /// As [`IndexKind::build`], and those of uploads and of submissions; [`Error::LimitExceeded`] for an index that the device cannot bind;
    /// [`Error::MissingFeature`] for the driver's structure on a device without ray queries.
    pub fn build_for(&self, gpu: &Gpu, triangles: &[[Vec3; 3]]) -> Result<IndexOnDevice> {
        self.build_or_read_for(gpu, triangles, None)
    }

    /// As [`IndexKind::build_for`]; with a folder a kd-tree is read from there where the same was kept before, and kept there otherwise
    /// ([`KdTree::kept`]).
    ///
    /// # Errors
    /// As [`IndexKind::build_for`].
    pub fn build_or_read_for(
        &self,
        gpu: &Gpu,
        triangles: &[[Vec3; 3]],
        folder: Option<&Path>,
    ) -> Result<IndexOnDevice> {
        if *self == Self::Driver {
            let begin = Instant::now();
            let built = DriverIndex::build(gpu, triangles)?;
            let build_ms = 1e3 * begin.elapsed().as_secs_f64();
            let report = IndexReport::of(self.name(), build_ms, BuildStages::default(), built.statistics);
            return Ok(IndexOnDevice {
                texels: built.triangles,
                structure: Some(built.structure),
                traversal: DeviceTraversal::Driver,
                report,
            });
        }
        let mut fallback = None;
        let begin = Instant::now();
        match self.build_resident(gpu, triangles) {
            Ok(Resident::Built(texels, traversal, stages, statistics)) => {
                let build_ms = 1e3 * begin.elapsed().as_secs_f64();
                return Ok(IndexOnDevice {
                    texels,
                    structure: None,
                    traversal,
                    report: IndexReport::of(self.name(), build_ms, stages, statistics),
                });
            }
            Ok(Resident::OfHosts) => {}
            Ok(Resident::TooFew) => fallback = Some("fewer than two triangles that rays can meet"),
            // What the build needs is more than what remains of it.
            Err(Error::LimitExceeded { .. }) => {
                fallback = Some("more triangles than the device can bind or dispatch while it builds")
            }
            Err(error) => return Err(error),
        }
        let (index, report) = self.build_timed(triangles, folder)?;
        let host_because = fallback;
        IndexOnDevice::of(gpu, index.as_ref(), IndexReport { host_because, ..report })
    }

    /// Builds on the device, where the kind says so.
    fn build_resident(&self, gpu: &Gpu, triangles: &[[Vec3; 3]]) -> Result<Resident> {
        Ok(match self {
            Self::LbvhOnDevice(settings) => match LbvhBuilder::new(gpu, settings)?.build_resident(triangles)? {
                Some(built) => Resident::Built(built.quarters, DeviceTraversal::Bvh2, built.stages, built.statistics),
                None => Resident::TooFew,
            },
            Self::WideOnDevice(settings) => match WideBuilder::new(gpu, settings)?.build_resident(triangles)? {
                Some(built) => Resident::Built(built.texels, DeviceTraversal::Wide, built.stages, built.statistics),
                None => Resident::TooFew,
            },
            _ => Resident::OfHosts,
        })
    }

    /// Builds on the host, or reads what was kept, and says how long that took.
    fn build_timed(&self, triangles: &[[Vec3; 3]], folder: Option<&Path>) -> Result<(Box<dyn RayIndex>, IndexReport)> {
        let begin = Instant::now();
        let (index, kept): (Box<dyn RayIndex>, _) = match (self, folder) {
            (Self::Kd(settings), Some(folder)) => {
                let kept = KdTree::kept(triangles, settings, folder)?;
                let how = match (kept.was_read, &kept.not_kept) {
                    (true, _) => IndexKept::Read,
                    (false, None) => IndexKept::Written,
                    (false, Some(error)) => {
                        tracing::warn!("kd-tree not kept: {error}");
                        IndexKept::NotWritten
                    }
                };
                (Box::new(kept.tree), Some(how))
            }
            _ => (self.build(triangles)?, None),
        };
        let kind = match self {
            Self::Automatic(_) => index.name(),
            _ => self.name(),
        };
        let build_ms = 1e3 * begin.elapsed().as_secs_f64();
        let report = IndexReport {
            kept,
            ..IndexReport::of(kind, build_ms, index.stages(), index.statistics())
        };
        Ok((index, report))
    }
}

/// What a device was asked to build.
enum Resident {
    Built(TexelView, DeviceTraversal, BuildStages, IndexStatistics),
    TooFew,
    /// The kind is built by the host.
    OfHosts,
}

/// The settings of the tree that devices build.
fn as_codes_spell_it(settings: &LbvhSettings) -> LbvhSettings {
    LbvhSettings {
        quality: BuildQuality::Fast,
        ..*settings
    }
}

impl fmt::Display for IndexKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for IndexKind {
    type Err = Error;

    /// # Errors
    /// [`Error::Setting`] that lists the names, for one that is not among them.
    fn from_str(name: &str) -> Result<Self> {
        [
            Self::Bvh2(Bvh2Settings::default()),
            Self::lbvh(BuildQuality::Fast),
            Self::lbvh(BuildQuality::High),
            Self::LbvhOnDevice(LbvhSettings::default()),
            Self::Kd(KdSettings::default()),
            Self::Wide(WideSettings::default()),
            Self::WideOnDevice(WideSettings::default()),
            Self::TwoLevel(WideSettings::default()),
            Self::Automatic(WideSettings::default()),
            Self::Driver,
        ]
        .into_iter()
        .find(|kind| kind.name() == name)
        .ok_or_else(|| {
            let known = Self::NAMES.join(", ");
            Error::setting(
                "index",
                name,
                format!("is not known; there is: {known}, {}", Self::AUTOMATIC),
            )
        })
    }
}

/// A ray index in device memory.
#[derive(Debug)]
pub struct IndexOnDevice {
    /// What kernels read, as [`RayIndex::texels`] has it; with a structure, the triangles that [`DriverIndex`] has.
    pub texels: TexelView,
    /// The driver's structure, of an index that is one.
    pub structure: Option<AccelerationStructure>,
    /// How they traverse it.
    pub traversal: DeviceTraversal,
    /// How it was built.
    pub report: IndexReport,
}

impl IndexOnDevice {
    /// Set 1 of the kernels that traverse it.
    pub fn set(&self) -> IndexBinding<'_> {
        IndexBinding::new(&self.texels, self.structure.as_ref())
    }
}

/// Set 1 as the kernels of an index have it ([`DeviceTraversal::pipeline`]).
#[derive(Debug, Clone, Copy)]
pub enum IndexBinding<'a> {
    /// Of the engine's own indexes.
    Own(IndexSet<'a>),
    /// Of the driver's structure.
    Driver(DriverSet<'a>),
}

impl<'a> IndexBinding<'a> {
    /// Of texels, or, with a structure, of triangles as [`DriverIndex`] has both.
    pub fn new(texels: &'a TexelView, structure: Option<&'a AccelerationStructure>) -> Self {
        match structure {
            None => Self::Own(IndexSet { index_texels: texels }),
            Some(driver_boxes) => Self::Driver(DriverSet {
                driver_triangles: texels,
                driver_boxes,
            }),
        }
    }
}

impl<'a> BindingSet<'a> for IndexBinding<'a> {
    fn set(&self) -> u32 {
        match self {
            Self::Own(set) => set.set(),
            Self::Driver(set) => set.set(),
        }
    }

    fn resources(&self) -> Vec<(u32, BoundResource<'a>)> {
        match self {
            Self::Own(set) => set.resources(),
            Self::Driver(set) => set.resources(),
        }
    }
}

/// What became of an index that was to be kept on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum IndexKept {
    /// It was read, not built.
    Read,
    /// It was built, and written for the next time.
    Written,
    /// It was built, and could not be written; the log has the cause.
    NotWritten,
}

/// The ray index of a scene, as frame reports have it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct IndexReport {
    /// One of [`IndexKind::NAMES`].
    pub kind: &'static str,
    /// Wall-clock milliseconds of its build, or of reading what was kept, without the upload of what the host has built. Pipelines are made
    /// before it begins, but drivers that compile at the first dispatch, as Mesa's software driver does, do so within a device's first build.
    pub build_ms: f64,
    /// Where these went; all zero of the driver's structure.
    pub stages: BuildStages,
    /// Why the host has built what the device was to build.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_because: Option<&'static str>,
    /// Why it is of another kind than was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instead_because: Option<&'static str>,
    /// What became of it, where it was to be kept on disk.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<IndexKept>,
    /// Size and quality.
    #[serde(flatten)]
    pub statistics: IndexStatistics,
}

impl IndexOnDevice {
    /// Uploads an index that the host has built.
    pub(crate) fn of(gpu: &Gpu, index: &dyn RayIndex, report: IndexReport) -> Result<Self> {
        let format = vk::Format::R32G32B32A32_UINT;
        Ok(Self {
            texels: gpu.texels_with(index.name(), Category::Index, format, index.texels())?,
            structure: None,
            traversal: index.device_traversal(),
            report,
        })
    }
}

impl IndexReport {
    /// Of an index that is what was asked for, built where it was asked for.
    pub(crate) fn of(kind: &'static str, build_ms: f64, stages: BuildStages, statistics: IndexStatistics) -> Self {
        Self {
            kind,
            build_ms,
            stages,
            host_because: None,
            instead_because: None,
            kept: None,
            statistics,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for name in IndexKind::NAMES {
            assert_eq!(name.parse::<IndexKind>().unwrap().to_string(), name);
        }
        assert_eq!(IndexKind::AUTOMATIC.parse::<IndexKind>().unwrap(), IndexKind::default());
        for unknown in ["", "BVH2", "lbvh-fast", "bvh2 "] {
            let message = unknown.parse::<IndexKind>().unwrap_err().to_string();
            assert!(message.contains("bvh2, lbvh, lbvh-high"), "{message}");
        }
    }

    #[test]
    fn kinds_build_what_they_name_and_report_it_in_one_object() {
        let triangles: Vec<[Vec3; 3]> = (0..40u8)
            .map(|i| {
                let corner = Vec3::new(f32::from(i % 7), f32::from(i % 5), f32::from(i));
                [corner, corner + Vec3::X, corner + Vec3::Y]
            })
            .collect();
        // That of the driver alone no host builds.
        let of_hosts = IndexKind::NAMES.into_iter().filter(|name| *name != "driver");
        assert_eq!(of_hosts.clone().count(), 8);
        for (name, builder) in of_hosts.zip(["bvh2", "lbvh", "lbvh", "lbvh", "kd", "wide", "wide", "two-level"]) {
            let (index, report) = name
                .parse::<IndexKind>()
                .unwrap()
                .build_timed(&triangles, None)
                .unwrap();
            assert_eq!(index.name(), builder);
            assert_eq!(report.statistics, index.statistics());
            assert!(report.build_ms > 0.0 && report.stages.total() <= report.build_ms);
            let json = serde_json::to_value(report).unwrap();
            assert_eq!(json["kind"], name);
            assert_eq!(json["triangles"], 40);
            assert_eq!(json["leaves"], index.statistics().leaves);
        }
        let folder = tempfile::tempdir().unwrap();
        let kept = |kind: &str| {
            let kind = kind.parse::<IndexKind>().unwrap();
            kind.build_timed(&triangles, Some(folder.path())).unwrap().1
        };
        assert_eq!(
            ["kd", "kd", "bvh2"].map(|kind| kept(kind).kept),
            [Some(IndexKept::Written), Some(IndexKept::Read), None]
        );
        assert_eq!(serde_json::to_value(kept("kd")).unwrap()["kept"], "read");
        let wrong = IndexKind::Bvh2(Bvh2Settings { leaf_size: 0, bins: 16 });
        for refused in [wrong, IndexKind::Driver] {
            assert!(matches!(refused.build(&triangles), Err(Error::Setting { .. })));
        }
    }
}
