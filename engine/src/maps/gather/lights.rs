//! Texels of a coarse map as area lights, and sums over them: the twin of `maps/gather.glsl`.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, UVec2};

use super::Reflectivity;
use crate::gpu::shaders::constants::{
    GATHER_BLOCK, GATHER_DISC, GATHER_FEW, GATHER_NORMALS, GATHER_RATIO, PACKED_NORMAL_BITS,
};
use crate::maps::impostor::ImpostorImage;
use crate::maps::packed_direction::unpack_octahedral;
use crate::maps::{MapImage, Parametrization, Texel};
use crate::{Error, Result};

/// Texels along a side of a layer of lights at most: loops over all of them stay below the cap of software drivers.
pub const MAX_SIDE: u32 = 64;

/// How the solid angle of a light is carried from the map's place to a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SolidAngleForm {
    /// By the ratio of squared distances: without bound close to a light.
    Ratio,
    /// As that of a disc on the axis through the point, whose angle to it is that to the map's place.
    #[default]
    Disc,
    /// As that of a disc with the surface's own angle to the point; what is seen from behind gives nothing. Takes an impostor with normals.
    DiscWithNormals,
}

impl SolidAngleForm {
    /// The number by which the kernel knows it.
    pub fn number(self) -> u32 {
        match self {
            Self::Ratio => GATHER_RATIO,
            Self::Disc => GATHER_DISC,
            Self::DiscWithNormals => GATHER_NORMALS,
        }
    }
}

/// Which lights a sum takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Terms {
    /// All.
    #[default]
    All,
    /// The five of the greatest reflectivity times solid angle, scaled to the lobe's whole.
    Five,
    /// The same without scaling, as it was published: loses what the others hold.
    FiveUnscaled,
}

/// The lobe of a gather, (s + 1)/(2π) max(0, cos)ˢ about a point's axis, and where a light's reflectivity is taken of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe<'a> {
    /// In the direction of the light's middle, of this exponent s.
    Middles(f64),
    /// As its mean over the light's cone, of the table's exponent.
    Cones(&'a Reflectivity),
}

/// Settings of a gather.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GatherSettings {
    /// Which lights count.
    pub terms: Terms,
    /// Whether reflectivities are means over cones from a table, or those of the lights' middles.
    pub cones: bool,
}

/// A texel of the coarse map as a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherLight {
    /// Mean position of what is seen, from the map's place; very far for the sky.
    pub position: DVec3,
    /// What the form takes over the squared distance: Δω |y|² for ratios, else the disc's area times the cosine at the map's place over π; with normals
    /// without that cosine.
    pub area: f64,
    /// Mean radiance by solid angle.
    pub radiance: DVec3,
    /// Mean normal, a unit vector; towards the map's place where there is none.
    pub normal: DVec3,
}

/// A point to be lit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherPoint {
    /// From the map's place.
    pub position: DVec3,
    /// The lobe's axis, a unit vector: the normal for diffuse reflection, the mirrored direction for glossy one.
    pub axis: DVec3,
}

/// The lights of a coarse map.
#[derive(Debug, Clone, PartialEq)]
pub struct GatherLights {
    form: SolidAngleForm,
    lights: Vec<GatherLight>,
    solid_angles: Vec<f64>,
}

/// Solid angle of a light at a point, by the squared distance; `cosine` is that of the surface's normal with the direction to the point, and only
/// counts with normals. At most a hemisphere's for discs.
pub fn gather_solid_angle(form: SolidAngleForm, area: f64, squared: f64, cosine: f64) -> f64 {
    let ratio = area / squared;
    match form {
        SolidAngleForm::Ratio => ratio,
        SolidAngleForm::Disc => disc(ratio),
        SolidAngleForm::DiscWithNormals if cosine > 0.0 => disc(ratio * cosine),
        SolidAngleForm::DiscWithNormals => 0.0,
    }
}

/// 2π (1 − 1/√(1 + t)), without the difference that cancels for small t, and without products that overflow for great ones.
fn disc(t: f64) -> f64 {
    let root = (1.0 + t).sqrt();
    if t < f64::INFINITY {
        TAU / (root + 1.0) * (t / root)
    } else {
        TAU
    }
}

/// The few greatest terms and their radiance, greatest first; of equal ones the first: twin of `maps/gather_few.glsl`.
#[derive(Default)]
struct GatherFew([(f64, DVec3); GATHER_FEW as usize]);

impl GatherFew {
    /// Adds a term, and leaves the least out.
    fn add(&mut self, term: f64, radiance: DVec3) {
        let mut entry = (term, radiance);
        for kept in &mut self.0 {
            if entry.0 > kept.0 {
                std::mem::swap(&mut entry, kept);
            }
        }
    }

    /// Terms times radiance, and terms, in all.
    fn sum(&self) -> (DVec3, f64) {
        let sum = self.0.iter().map(|(term, radiance)| *term * *radiance).sum();
        (sum, self.0.iter().map(|(term, _)| term).sum())
    }
}

impl GatherLights {
    /// Lights of `side`² texels of each layer, from radiance and distances of the same map, whose own texels are a multiple of it.
    ///
    /// Where more than half of a texel's solid angle is sky, the light is as far as the sky; else its position and normal are the means of those of all
    /// surfaces in the texel, so that over one plane it lies on it, and over a silhouette between what is near and what is far.
    ///
    /// # Errors
    /// [`Error::Setting`] for maps that differ, that have other than square layers or that the side does not divide, for sides of 0 or above 64, for
    /// one texel alone, which lies about the map's place, for impostors of several layers, for a form that takes normals of an impostor without, and for radiance that is not finite and at least 0.
    pub fn new(radiance: &MapImage, impostor: &ImpostorImage, side: u32, form: SolidAngleForm) -> Result<Self> {
        Self::of(radiance, impostor, side, form, false)
    }

    /// As [`GatherLights::new`], with lights where they were published to be: at the mean of all distances in the direction of the texel's middle, with the mean
    /// radiance of equal weights. Over planes they lie off them, over silhouettes between what is near and what is far as well.
    ///
    /// # Errors
    /// As [`GatherLights::new`].
    pub fn as_printed(radiance: &MapImage, impostor: &ImpostorImage, side: u32, form: SolidAngleForm) -> Result<Self> {
        Self::of(radiance, impostor, side, form, true)
    }

    fn of(
        radiance: &MapImage,
        impostor: &ImpostorImage,
        side: u32,
        form: SolidAngleForm,
        as_printed: bool,
    ) -> Result<Self> {
        let (map, size) = (impostor.map(), impostor.size());
        if radiance.map() != map || radiance.size() != size {
            let value = format!("{} of {}", radiance.map(), radiance.size());
            return Err(Error::setting("radiance", value, format!("is not {map} of {size}")));
        }
        let is_square = matches!(
            map,
            Parametrization::Cube | Parametrization::OctahedronQuadratic | Parametrization::EqualArea
        );
        if !is_square {
            return Err(Error::setting(
                "map",
                map,
                "has no square layers; cube, octahedron and equal areas have",
            ));
        }
        if !(1..=MAX_SIDE).contains(&side) || !size.x.is_multiple_of(side) {
            let cause = format!("is not in 1..={MAX_SIDE}, or does not divide {}", size.x);
            return Err(Error::setting("side of lights", side, cause));
        }
        if side == 1 && map.layers() == 1 {
            let cause = format!("is one light about the place of a {map}; at least 2");
            return Err(Error::setting("side of lights", side, cause));
        }
        if impostor.layers() != 1 {
            return Err(Error::setting("impostor layers", impostor.layers(), "are not one"));
        }
        if form == SolidAngleForm::DiscWithNormals && impostor.normals().is_none() {
            return Err(Error::setting(
                "solid angle form",
                "with normals",
                "needs an impostor with normals",
            ));
        }
        let bad = |(_, value): &(usize, &glam::Vec3)| !(value.is_finite() && value.min_element() >= 0.0);
        if let Some((i, value)) = radiance.texels().iter().enumerate().find(bad) {
            return Err(Error::setting(
                format!("radiance of texel {i}"),
                value,
                "is not finite and at least 0",
            ));
        }
        let coarse = UVec2::splat(side);
        let made = map
            .texels(coarse)
            .map(|texel| light(radiance, impostor, coarse, texel, form, as_printed));
        let (lights, solid_angles) = made.unzip();
        Ok(Self {
            form,
            lights,
            solid_angles,
        })
    }

    /// How solid angles are carried over.
    pub fn form(&self) -> SolidAngleForm {
        self.form
    }

    /// The lights, in the order of texels.
    pub fn lights(&self) -> &[GatherLight] {
        &self.lights
    }

    /// Their solid angles at the map's place, sr: exact, 4π in all.
    pub fn solid_angles(&self) -> &[f64] {
        &self.solid_angles
    }

    /// Radiance by the lobe about a point's axis, from all lights or the five greatest; the irradiance over π for an exponent of 1 about a normal.
    pub fn gather(&self, point: &GatherPoint, lobe: Lobe<'_>, terms: Terms) -> DVec3 {
        let term = |light: &GatherLight| {
            let v = light.position - point.position;
            let squared = v.length_squared();
            let Some(direction) = v.try_normalize() else {
                return 0.0;
            };
            let angle = gather_solid_angle(self.form, light.area, squared, -light.normal.dot(direction));
            let cosine = point.axis.dot(direction);
            let reflectivity = match lobe {
                Lobe::Cones(table) => table.at(1.0 - angle / TAU, cosine),
                Lobe::Middles(exponent) => (exponent + 1.0) / TAU * cosine.max(0.0).powf(exponent),
            };
            reflectivity * angle
        };
        if terms == Terms::All {
            let blocks = self.lights.chunks(GATHER_BLOCK as usize);
            let block = |lights: &[GatherLight]| lights.iter().map(|light| term(light) * light.radiance).sum::<DVec3>();
            return blocks.map(block).sum();
        }
        let mut few = GatherFew::default();
        for light in &self.lights {
            few.add(term(light), light.radiance);
        }
        let (sum, whole) = few.sum();
        match terms {
            Terms::Five if whole > 0.0 => sum / whole,
            _ => sum,
        }
    }

    /// Irradiance about a point's axis, W·m⁻² where radiance is in W·m⁻²·sr⁻¹: π times the gather by an exponent of 1 at the lights' middles.
    pub fn irradiance(&self, point: &GatherPoint) -> DVec3 {
        PI * self.gather(point, Lobe::Middles(1.0), Terms::All)
    }
}

/// The light of a texel, and its solid angle at the map's place.
fn light(
    radiance: &MapImage,
    impostor: &ImpostorImage,
    coarse: UVec2,
    texel: Texel,
    form: SolidAngleForm,
    as_printed: bool,
) -> (GatherLight, f64) {
    let (map, size) = (impostor.map(), impostor.size());
    let factor = size / coarse;
    let solid_angle = map.texel_solid_angle(coarse, texel);
    let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
    let (mut positions, mut normals) = (DVec3::ZERO, DVec3::ZERO);
    let (mut distances, mut near) = (0.0, 0.0);
    for i in 0..factor.element_product() {
        let fine = Texel {
            layer: texel.layer,
            x: texel.x * factor.x + i % factor.x,
            y: texel.y * factor.y + i / factor.x,
        };
        let weight = if as_printed {
            1.0
        } else {
            map.texel_solid_angle(size, fine)
        };
        sum += weight * radiance.at(fine).as_dvec3();
        whole += weight;
        let at = ((fine.layer * size.y + fine.y) * size.x + fine.x) as usize;
        let distance = impostor.distances()[at];
        let Some(direction) = map
            .texel_direction(size, fine)
            .filter(|_| distance < ImpostorImage::NOTHING)
        else {
            continue;
        };
        positions += weight * f64::from(distance) * direction;
        distances += weight * f64::from(distance);
        near += weight;
        if let Some(packed) = impostor.normals() {
            let n = unpack_octahedral(packed[at], PACKED_NORMAL_BITS);
            // Surfaces have two sides; the one that is seen counts.
            normals += weight * if n.dot(direction) > 0.0 { -n } else { n };
        }
    }
    let middle = map.texel_direction(coarse, texel).unwrap_or(DVec3::Z);
    let position = if near <= 0.5 * whole {
        f64::from(ImpostorImage::NOTHING) * middle
    } else if as_printed {
        distances / near * middle
    } else {
        positions / near
    };
    let squared = position.length_squared();
    let towards = -position.normalize_or_zero();
    let normal = if near > 0.5 * whole {
        normals.try_normalize()
    } else {
        None
    };
    let normal = normal.filter(|normal| normal.dot(towards) > 0.0).unwrap_or(towards);
    let area = match form {
        SolidAngleForm::Ratio => solid_angle * squared,
        _ => {
            let whole = TAU / (TAU - solid_angle);
            let cosine = if form == SolidAngleForm::Disc {
                1.0
            } else {
                normal.dot(towards)
            };
            (whole * whole - 1.0) * squared / cosine
        }
    };
    let light = GatherLight {
        position,
        area,
        radiance: sum / whole,
        normal,
    };
    (light, solid_angle)
}
