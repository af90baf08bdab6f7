//! The ray index of a scene: over its triangles, or over instances that are kept.

use std::path::Path;
use std::time::Instant;

use super::geometry::Geometry;
use super::{Kept, ray_iterations};
use crate::accel::bvh2::Bvh2Settings;
use crate::accel::wide::WideSettings;
use crate::accel::{DeviceTraversal, IndexKind, IndexOnDevice, IndexReport, RayIndex};
use crate::gpu::{Gpu, SOFTWARE_LOOP_CAP};
use crate::scene::SceneProfile;
use crate::{Error, Result};

/// The index that was asked for, or the default one where rays in that could not be stopped in time.
pub(super) fn index_for(
    gpu: &Gpu,
    geometry: &Geometry,
    profile: &SceneProfile,
    kind: &IndexKind,
    folder: Option<&Path>,
) -> Result<IndexOnDevice> {
    let corners = geometry.corners();
    let asked = kind.build_or_read_for(gpu, &corners, folder)?;
    // Techniques may trace two rays in a dispatch.
    let iterations = ray_iterations(profile).min(SOFTWARE_LOOP_CAP / 2);
    match asked
        .traversal
        .quota_within(gpu.caps(), 1, iterations, profile.has_alpha())
    {
        Ok(_) => Ok(asked),
        Err(Error::LimitExceeded { .. }) => {
            let because = match asked.traversal {
                DeviceTraversal::Wide | DeviceTraversal::TwoLevel => {
                    "a round of its rays is longer than the loops of a software device"
                }
                _ => "a leaf of the kd-tree is longer than the loops of a software device",
            };
            drop(asked);
            let mut index = IndexKind::Bvh2(Bvh2Settings::default()).build_for(gpu, &corners)?;
            index.report.instead_because = Some(because);
            Ok(index)
        }
        Err(error) => Err(error),
    }
}

/// The index of two levels over kept instances.
pub(super) fn index_over_instances(
    gpu: &Gpu,
    geometry: &mut Geometry,
    profile: &SceneProfile,
    settings: &WideSettings,
) -> Result<Option<(IndexOnDevice, Kept)>> {
    let Some(mut instances) = geometry.kept.clone() else {
        return Ok(None);
    };
    let begin = Instant::now();
    let index = instances.index(&geometry.triangles, settings)?;
    let build_ms = 1e3 * begin.elapsed().as_secs_f64();
    let report = IndexReport::of("two-level", build_ms, index.stages(), index.statistics());
    let on_device = IndexOnDevice::of(gpu, &index, report)?;
    let iterations = ray_iterations(profile).min(SOFTWARE_LOOP_CAP / 2);
    on_device
        .traversal
        .quota_within(gpu.caps(), 1, iterations, profile.has_alpha())?;
    geometry.kept = Some(instances.clone());
    Ok(Some((on_device, Kept { instances, index })))
}
