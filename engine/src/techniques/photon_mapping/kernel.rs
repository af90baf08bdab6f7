//! Kernels of density estimation on surfaces: ellipsoids as large as a photon's footprint, and the record of a photon in the map.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", 2011, §3.4.2, §5.2.1 and §5.2.2. An ellipsoid with the axes A (longer) and B in the
//! tangent plane and C across it, |C| = |B|, is kept as A ([`along`](PhotonKernel::along)) and P ([`across`](PhotonKernel::across)),
//! which is B turned by a right angle in the plane, P·A > 0. Two things follow that the source does without: the Jacobian |A × B| is P·A,
//! and the record may keep fluxes undivided by it, in the narrow range that nine bits serve well. The normal cannot be had from P and A
//! (they are parallel whenever A and B are at right angles) and is kept as well. Guarantees: a kernel integrates to one over the tangent
//! plane; the box is tight; no length is compared with a constant, only with the unit length. Bias: proximity (blur) by the kernel's size,
//! boundary bias at edges, topological bias on curved surfaces. Twin of `techniques/photon_mapping/kernel.glsl`.

#[cfg(test)]
mod room_tests;
#[cfg(test)]
mod tests;

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{
    KERNEL_CONE, KERNEL_EPANECHNIKOV, KERNEL_FIXED, KERNEL_ISOTROPIC, KERNEL_PRINCIPAL, KERNEL_SKEWED, KERNEL_UNIFORM,
    PHOTON_BOUNCE_SHIFT, PHOTON_DIFFUSED_BIT, PHOTON_DIRECTION_BITS, PHOTON_LEAF_END, PHOTON_NORMAL_BITS,
};
use crate::maps::packed_direction::{pack_octahedral, unpack_octahedral};
use crate::transport::differentials::Differentials;
use crate::transport::packing::{pack_rgb9e5, unpack_rgb9e5};
use crate::transport::warp::orthonormal_basis;
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::FRAC_1_PI;

/// How a kernel falls off from its centre to its rim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u32)]
pub enum KernelProfile {
    /// Even: least variance, hard rims.
    Uniform = KERNEL_UNIFORM,
    /// Straight to zero: 1.5 times the variance.
    Cone = KERNEL_CONE,
    /// Parabola to zero: 4/3 of the variance, and rims that do not show.
    Epanechnikov = KERNEL_EPANECHNIKOV,
}

/// What a kernel takes its axes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u32)]
pub enum KernelShape {
    /// The differentials themselves.
    Skewed = KERNEL_SKEWED,
    /// The principal axes of the same ellipse. Damping and thickness then do not depend on the frame that the differentials began in.
    Principal = KERNEL_PRINCIPAL,
    /// A disk of the footprint's area.
    Isotropic = KERNEL_ISOTROPIC,
    /// A disk of the radius [`KernelSettings::length_max`].
    Fixed = KERNEL_FIXED,
}

/// How kernels are made from footprints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelSettings {
    /// Shape.
    pub shape: KernelShape,
    /// Times the footprint, [`global_step`](crate::transport::differentials::global_step) included.
    pub spread: f64,
    /// Exponent of the footprint's length in unit lengths: 1 is undampened, 1/4 the source's.
    pub exponent: f64,
    /// The unit of lengths, m: lengths above shrink by the dampening, lengths below grow. It scales with the scene.
    pub unit_length: f64,
    /// Least length of an axis, in unit lengths.
    pub length_min: f64,
    /// Greatest length of an axis, in unit lengths.
    pub length_max: f64,
    /// Least |z1 × z2| / longer² of a footprint that is not flat; [`FLATNESS_MIN`] if that is more.
    pub flatness: f64,
    /// Widens flat footprints to the least flatness, and points to the least length, instead of leaving them without a kernel.
    pub widens_flat: bool,
}

/// Least flatness of all: weights are divided by the product of axes, which keeps ten bits less than they have.
pub const FLATNESS_MIN: f64 = 1.0 / 1024.0;

/// An ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonKernel {
    /// Its longer axis A in the tangent plane, m.
    pub along: DVec3,
    /// In the tangent plane at a right angle to the other axis there, and of its length, m.
    pub across: DVec3,
}

/// Kernel of the squared distance in the unit disk, 1/area of the disk of radius 1.
pub fn kernel_profile(profile: KernelProfile, d2: f64) -> f64 {
    let k = match profile {
        KernelProfile::Uniform => 1.0,
        KernelProfile::Cone => 3.0 - 3.0 * d2.sqrt(),
        KernelProfile::Epanechnikov => 2.0 - 2.0 * d2,
    };
    if d2 < 1.0 { k * FRAC_1_PI } else { 0.0 }
}

/// The ball of a radius, for kernels that footprints do not shape.
pub fn disk_kernel(radius: f64, n: DVec3) -> PhotonKernel {
    let (t, _) = orthonormal_basis(n);
    PhotonKernel {
        along: radius * t,
        across: radius * t,
    }
}

/// The principal axes of the ellipse cos(x) a + sin(x) b, the longer one first.
pub fn principal_axes(a: DVec3, b: DVec3) -> [DVec3; 2] {
    let (aa, bb, ab) = (a.length_squared(), b.length_squared(), a.dot(b));
    let swing = DVec2::new(aa - bb, 2.0 * ab).length();
    if swing <= 0.0 {
        return [a, b];
    }
    let (longer, shorter) = if aa >= bb { (a, b) } else { (b, a) };
    let c = (0.5 + 0.5 * (aa - bb).abs() / swing).sqrt();
    let s = ab / (swing * c);
    [c * longer + s * shorter, c * shorter - s * longer]
}

/// The kernel of a photon with differentials in the tangent plane across the unit normal `n`; `None` for footprints too flat, or without
/// area, unless these are widened.
///
/// In this order: discard or widen, dampen, spread, clamp. Energy is kept by widening and clamping, and lost by discarding.
pub fn photon_kernel(s: &KernelSettings, d: &Differentials, n: DVec3) -> Option<PhotonKernel> {
    if s.shape == KernelShape::Fixed {
        return Some(disk_kernel(s.length_max * s.unit_length, n));
    }
    let (mut a, mut b) = (d.z1 / s.unit_length, d.z2 / s.unit_length);
    if s.shape == KernelShape::Principal {
        [a, b] = principal_axes(a, b);
    }
    if a.length() < b.length() {
        (a, b) = (b, a);
    }
    let mut lengths = DVec2::new(a.length(), b.length());
    let mut area = a.cross(b).length();
    let flatness = s.flatness.max(FLATNESS_MIN);
    if !(area > 0.0 && area >= flatness * lengths.x * lengths.x) {
        if !s.widens_flat {
            return None;
        }
        if lengths.x <= 0.0 {
            return Some(disk_kernel(s.length_min * s.unit_length, n));
        }
        a = principal_axes(a, b)[0];
        b = flatness * n.cross(a);
        lengths = a.length() * DVec2::new(1.0, flatness);
        area = lengths.x * lengths.y;
    }
    if s.shape == KernelShape::Isotropic {
        let radius = s.spread * area.powf(0.5 * s.exponent);
        return Some(disk_kernel(radius.clamp(s.length_min, s.length_max) * s.unit_length, n));
    }
    let wanted = s.spread * lengths.x.powf(s.exponent - 1.0) * lengths;
    let scale = wanted.clamp(DVec2::splat(s.length_min), DVec2::splat(s.length_max)) / lengths * s.unit_length;
    a *= scale.x;
    b *= scale.y;
    let across = b.cross(n);
    Some(PhotonKernel {
        along: a,
        across: if across.dot(a) < 0.0 { -across } else { across },
    })
}

/// |A × B|, the area of the ellipse over π, m².
pub fn kernel_area(k: &PhotonKernel) -> f64 {
    k.along.dot(k.across)
}

/// Half of the sides of the ellipsoid's box, m.
pub fn kernel_extent(k: &PhotonKernel) -> DVec3 {
    let squared = k.along * k.along + (k.across.length_squared() - k.across * k.across).max(DVec3::ZERO);
    DVec3::new(squared.x.sqrt(), squared.y.sqrt(), squared.z.sqrt())
}

/// Kernel at `delta` from the photon, 1/m².
pub fn kernel_weight(profile: KernelProfile, k: &PhotonKernel, delta: DVec3) -> f64 {
    let inverse_area = 1.0 / kernel_area(k);
    let q = k.across.dot(delta) * inverse_area;
    let rest = delta - q * k.along;
    kernel_profile(profile, q * q + rest.length_squared() / k.across.length_squared()) * inverse_area
}

/// A photon of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhotonRecord {
    /// Where it landed, m.
    pub position: Vec3,
    /// The geometric normal there, to the side that it came from.
    pub normal: Vec3,
    /// The unit direction in which it came.
    pub direction: Vec3,
    /// Flux by band, relative to the lights' flux / n, and not divided by the kernel's area.
    pub flux: Vec3,
    /// Longer axis of its kernel, m: [`PhotonKernel::along`].
    pub along: Vec3,
    /// [`PhotonKernel::across`], m.
    pub across: Vec3,
}

impl PhotonRecord {
    /// Its kernel.
    pub fn kernel(&self) -> PhotonKernel {
        PhotonKernel {
            along: self.along.as_dvec3(),
            across: self.across.as_dvec3(),
        }
    }
}

/// Words of a record in the map.
pub type PhotonWords = [[u32; 4]; 3];

/// A record as the map keeps it: position, normal | across, direction | along, flux. The end of a leaf is not marked.
pub fn pack_photon(p: &PhotonRecord) -> PhotonWords {
    let quarter = |v: Vec3, word: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word];
    [
        quarter(p.position, pack_octahedral(p.normal, PHOTON_NORMAL_BITS)),
        quarter(p.across, pack_octahedral(p.direction, PHOTON_DIRECTION_BITS)),
        quarter(p.along, pack_rgb9e5(p.flux)),
    ]
}

/// The record of these words. Normal and direction are good to 1.3·10⁻⁴ and 5.2·10⁻⁴ radians, flux to 2⁻⁹ of its largest band.
pub fn unpack_photon(words: &PhotonWords) -> PhotonRecord {
    let vector = |q: [u32; 4]| Vec3::new(f32::from_bits(q[0]), f32::from_bits(q[1]), f32::from_bits(q[2]));
    PhotonRecord {
        position: vector(words[0]),
        normal: unpack_octahedral(words[0][3], PHOTON_NORMAL_BITS).as_vec3(),
        direction: unpack_octahedral(words[1][3], PHOTON_DIRECTION_BITS).as_vec3(),
        flux: unpack_rgb9e5(words[2][3]).as_vec3(),
        along: vector(words[2]),
        across: vector(words[1]),
    }
}

/// How often the photon of these words had been scattered before it landed, and whether diffusely.
pub fn photon_history(words: &PhotonWords) -> (u32, bool) {
    (
        words[1][3] >> PHOTON_BOUNCE_SHIFT,
        words[0][3] & PHOTON_DIFFUSED_BIT != 0,
    )
}

/// Whether the record is the last one of a leaf.
pub fn photon_ends_leaf(words: &PhotonWords) -> bool {
    words[0][3] & PHOTON_LEAF_END != 0
}

/// What a unit of the photon's flux counts for at `x` on a surface of normal `n`, 1/m²; 0 where the cosine between the normals is not above
/// `normal_cos_min`.
pub fn photon_weight(profile: KernelProfile, words: &PhotonWords, x: DVec3, n: DVec3, normal_cos_min: f64) -> f64 {
    let p = unpack_photon(words);
    if unpack_octahedral(words[0][3], PHOTON_NORMAL_BITS).dot(n) > normal_cos_min {
        kernel_weight(profile, &p.kernel(), x - p.position.as_dvec3())
    } else {
        0.0
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-DE-2",
        name: "kernels: uniform, cone, Epanechnikov",
        role: Role::PartOf("PM-SYS-1"),
        limits: "No profile takes the bias away: they trade noise for visible rims.",
        sources: &[
            sources::JENSEN_2001.whole(),
            sources::SILVERMAN_1986.whole(),
            sources::FABIANOWSKI_2011.at("§3.4.2"),
        ],
        shaders: &["shaders/techniques/photon_mapping/kernel.glsl"],
        tests: &[
            "engine/src/techniques/photon_mapping/kernel/tests.rs::profiles_integrate_to_one_with_their_variance",
            "tests/tests/twins/photons.rs::weights_agree_with_their_twins",
            "tests/tests/photon/sphere.rs::all_reflections_sum_up_for_every_kernel",
            "tests/tests/photon/convergence.rs::bias_and_variance_fall_as_radii_foretell",
            "engine/src/techniques/photon_mapping/card.rs::laws_follow_the_settings",
        ],
        settings: &["profile"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-5",
        name: "kernels as skewed ellipsoids of footprints, in nine numbers and a normal",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Flat in the tangent plane, so curved surfaces are misjudged; the printed way to recover the normal does not hold and is not used.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.2.1")],
        shaders: &["shaders/techniques/photon_mapping/kernel.glsl"],
        bias: Some(Bias::Biased(
            "blur and light lost at edges and on curved surfaces, as far as footprints",
        )),
        tests: &[
            "engine/src/techniques/photon_mapping/kernel/tests.rs::weights_are_those_of_the_inverse_matrix",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::kernels_integrate_to_one_over_the_tangent_plane",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::boxes_hold_the_ellipsoid_and_touch_it",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::the_normal_is_no_product_of_the_axes",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::records_come_back",
            "tests/tests/twins/photons.rs::kernels_agree_with_their_twins",
            "tests/tests/twins/photons.rs::records_agree_with_their_twins",
        ],
        settings: &["shape", "spread"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-6",
        name: "dampening, clamp and discard of kernels",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Discarding loses the light of footprints that are too flat and widening blurs it; no kernel is flatter than 1/1024.",
        sources: &[sources::FABIANOWSKI_2011.at("§5.2.2")],
        shaders: &["shaders/techniques/photon_mapping/kernel.glsl"],
        bias: Some(Bias::Biased(
            "light of flat footprints is spread wider than it fell, or left out without `widen_flat`",
        )),
        tests: &[
            "engine/src/techniques/photon_mapping/kernel/tests.rs::flat_footprints_are_widened_where_asked_for",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::records_keep_the_area_of_the_flattest_kernels",
            "tests/tests/twins/photons.rs::kernels_agree_with_their_twins",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::dampening_takes_the_root_of_the_longer_axis",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::flat_and_empty_footprints_have_no_kernel_and_long_ones_are_clamped",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::scaling_the_scene_and_the_unit_scales_the_kernel",
            "engine/src/techniques/photon_mapping/kernel/room_tests.rs::kernels_cover_the_room_as_published",
            "engine/src/techniques/photon_mapping/kernel/room_tests.rs::stronger_dampening_means_fewer_kernels_over_a_point",
            "engine/src/techniques/photon_mapping/kernel/room_tests.rs::the_room_looks_the_same_at_every_scale_when_the_unit_goes_with_it",
        ],
        settings: &["dampening", "unit_length", "flatness", "widen_flat", "radius"],
        ..Row::of(file!())
    },
];
