//! Everything that light sampling chooses among, and the probabilities of the choice: by power, as [`lights`](crate::transport::lights)
//! has it, with limits for distant ones; then by cell of the environment.

use glam::{DVec3, Mat3, Quat, UVec2, Vec3};

use super::LightKinds;
use super::geometry::{Geometry, corners_of, is_traceable};
use super::light_tree::{TreeOfLights, punctual_bounds, triangle_bounds};
use super::punctual::PunctualLights;
use crate::Result;
use crate::gpu::shaders::constants::{
    EXPONENT_BITS, LIGHT_DARK, LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE,
    MATERIAL_BLEND, MATERIAL_DOUBLE_SIDED, MATERIAL_MASK, MATERIAL_UNLIT, RECIPROCAL_EXPONENTS,
};
use crate::gpu::shaders::types::{SceneEnvironment, SceneLight, SceneMaterial, SceneTriangle};
use crate::gpu::{Buffer, Gpu};
use crate::scene::{Environment, LightKind, Scene, SceneProfile};
use crate::transport::distribution::build_distribution;
use crate::transport::environment::{EnvironmentTables, environment_texel_solid_angle, luminance};
use crate::transport::lights::triangle_power;

/// Everything that light sampling chooses among: emissive triangles, lights without area, the environment last.
pub(super) struct Lights {
    pub(super) records: Vec<SceneLight>,
    /// The scene's lights without area among them.
    pub(super) punctual: PunctualLights,
    /// Cumulative probabilities of the lights, then of the environment's cells, for light sampling.
    pub(super) cdf: Vec<f32>,
    /// The same for the emission of photons, where it differs.
    pub(super) emission_cdf: Option<Vec<f32>>,
    /// The environment's block: header and texels.
    pub(super) environment: Vec<u8>,
    /// Sum of their powers, W of luminance.
    pub(super) power: f64,
    /// What a tree of them is made of.
    pub(super) tree: TreeOfLights,
    /// Some surface shines that is not among the records.
    has_unsampled: bool,
}

impl Lights {
    pub(super) fn collect(
        scene: &Scene,
        profile: &SceneProfile,
        geometry: &mut Geometry,
        materials: &[SceneMaterial],
        [lower, upper]: [Vec3; 2],
    ) -> Result<Self> {
        let mut records = Vec::new();
        let mut powers = Vec::new();
        let mut bounds = Vec::new();
        let emits = |triangle: &SceneTriangle| {
            let material = &materials[triangle.material as usize];
            material.emission.iter().any(|e| *e > 0.0) && material.flags & MATERIAL_UNLIT == 0
        };
        let first_copies = geometry.first_copies(emits);
        let mut has_unsampled = false;
        for index in 0..geometry.in_world() {
            let triangle = geometry.triangles[index];
            if !emits(&triangle) {
                continue;
            }
            let material = &materials[triangle.material as usize];
            let [a, b, c] = corners_of(&triangle).map(|p| p.as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            // Of triangles in one place rays meet the first that is there, so only the first one may be a light. What is behind one
            // with alpha shines too, but light sampling cannot tell how much of it: its hits alone count, in full.
            // Rays never meet what the index leaves out.
            if !corners_of(&triangle).iter().all(is_traceable) {
                continue;
            }
            let first = first_copies
                .get(&Geometry::coincidence_key(&triangle))
                .copied()
                .unwrap_or(index);
            if first != index {
                let other = geometry.triangles[first];
                if materials[other.material as usize].flags & (MATERIAL_MASK | MATERIAL_BLEND) != 0 {
                    has_unsampled |= area > 0.0;
                } else if other.material == triangle.material {
                    geometry.triangles[index].light = other.light;
                }
                continue;
            }
            if area > 0.0 && !is_sampleable(corners_of(&triangle)) {
                // What it shows to rays that meet it counts in full.
                has_unsampled = true;
            } else if area > 0.0 {
                let emission = DVec3::from_array(material.emission.map(f64::from));
                let double_sided = material.flags & MATERIAL_DOUBLE_SIDED != 0;
                geometry.triangles[index].light = records.len() as u32;
                powers.push(luminance(triangle_power(emission, area, double_sided)));
                bounds.push(Some(triangle_bounds([a, b, c], luminance(emission), double_sided)));
                records.push(SceneLight {
                    kind: LIGHT_TRIANGLE,
                    triangle: geometry.name(index),
                    ..SceneLight::default()
                });
            }
        }
        let radius = 0.5 * (upper - lower).as_dvec3().length();
        let mut punctual = PunctualLights::new(radius);
        for light in &scene.lights {
            let power = punctual.add(&light.kind, records.len());
            if power > 0.0 {
                powers.push(power);
                bounds.push(punctual_bounds(&light.kind));
                records.push(light_record(&light.kind));
            }
        }
        let mut environment = Vec::new();
        let mut tables = None;
        if let Some(map) = scene.environment.as_ref().filter(|_| profile.has_environment()) {
            let found = sampled_environment(map, !records.is_empty())?;
            powers.push(environment_power(map, radius));
            bounds.push(None);
            records.push(SceneLight {
                kind: LIGHT_ENVIRONMENT,
                ..SceneLight::default()
            });
            environment = environment_block(map, &found);
            tables = Some(found);
        }
        let power = powers.iter().sum();
        // Photons leave by all of a light's power.
        let mut sampled = powers.clone();
        if let (Some(tables), Some(of_environment)) = (&tables, sampled.last_mut()) {
            *of_environment *= tables.share;
        }
        share_choices(&records, &mut powers);
        share_choices(&records, &mut sampled);
        let tree = TreeOfLights::new(&bounds, &sampled);
        if has_unsampled && records.is_empty() {
            // Kernels that know of emission also sample lights: a dark one to choose.
            sampled.push(0.0);
            records.push(SceneLight {
                kind: LIGHT_DARK,
                ..SceneLight::default()
            });
        }
        let mut cdf = if records.is_empty() {
            Vec::new()
        } else {
            build_distribution("lights", &sampled)?
        };
        let mut emission_cdf = None;
        if let Some(tables) = tables {
            cdf.extend(tables.cdf);
            if let Some(cells) = tables.emission_cdf {
                let mut all = build_distribution("lights", &powers)?;
                all.extend(cells);
                emission_cdf = Some(all);
            }
        }
        Ok(Self {
            records,
            punctual,
            cdf,
            emission_cdf,
            environment,
            power,
            tree,
            has_unsampled,
        })
    }

    pub(super) fn kinds(&self) -> LightKinds {
        let some = |wanted: &[u32]| self.records.iter().any(|light| wanted.contains(&light.kind));
        LightKinds {
            area: self.has_unsampled || some(&[LIGHT_TRIANGLE]),
            punctual: some(&[LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL]),
            environment: some(&[LIGHT_ENVIRONMENT]),
        }
    }
}

/// Limits the choices of distant lights, whose power grows with the square of the scene's radius while what they add to a picture does not:
/// where there are others, distant ones have half of the choices at most; where there are none, the environment, which scattered rays may
/// find too, has half at most.
///
/// One of the limits is enough, since an environment among distant lights has no more than they. So no light keeps less than half of its
/// probability by power alone, and the second moment of what it adds, in inverse proportion to that, at most doubles.
fn share_choices(records: &[SceneLight], powers: &mut [f64]) {
    let is_environment = |kind: u32| kind == LIGHT_ENVIRONMENT;
    let is_distant = |kind: u32| kind == LIGHT_ENVIRONMENT || kind == LIGHT_DIRECTIONAL;
    let has_near = records
        .iter()
        .zip(powers.iter())
        .any(|(light, power)| !is_distant(light.kind) && *power > 0.0);
    let is_limited = |kind: u32| {
        if has_near {
            is_distant(kind)
        } else {
            is_environment(kind)
        }
    };
    let (mut own, mut others) = (0.0f64, 0.0f64);
    for (light, power) in records.iter().zip(powers.iter()) {
        if is_limited(light.kind) {
            own += *power;
        } else {
            others += *power;
        }
    }
    if others > 0.0 && own > others {
        for (light, power) in records.iter().zip(powers.iter_mut()) {
            if is_limited(light.kind) {
                *power *= others / own;
            }
        }
    }
}

/// Whether `surface_at` has a normal and an area of the triangle in its f32 arithmetic, clear of what devices may flush to zero.
fn is_sampleable([a, b, c]: [Vec3; 3]) -> bool {
    /// Least length of the normal of a triangle whose longest edge is 1 to 2, and least double area in m²: 2⁻⁶⁰ and 2⁻¹⁰⁰.
    const LEAST: (f32, f32) = (8.673_617_4e-19, 7.888_609e-31);
    let (e1, e2) = (b - a, c - a);
    let longest = e1.abs().max(e2.abs()).max_element();
    let scale = f32::from_bits(RECIPROCAL_EXPONENTS - (longest.to_bits() & EXPONENT_BITS));
    let size = (scale * e1).cross(scale * e2).length();
    size >= LEAST.0 && size / scale / scale >= LEAST.1
}

pub(crate) fn light_record(kind: &LightKind) -> SceneLight {
    match *kind {
        LightKind::Point { position, intensity } => SceneLight {
            kind: LIGHT_POINT,
            position: position.to_array(),
            strength: intensity.to_array(),
            ..SceneLight::default()
        },
        LightKind::Spot {
            position,
            direction,
            intensity,
            inner,
            outer,
        } => SceneLight {
            kind: LIGHT_SPOT,
            position: position.to_array(),
            direction: direction.to_array(),
            strength: intensity.to_array(),
            cos_inner: inner.cos(),
            cos_outer: outer.cos(),
            ..SceneLight::default()
        },
        LightKind::Directional { direction, irradiance } => SceneLight {
            kind: LIGHT_DIRECTIONAL,
            direction: direction.to_array(),
            strength: irradiance.to_array(),
            ..SceneLight::default()
        },
    }
}

/// Flux of an environment through the disk of the scene's bounding sphere, as for directional lights.
fn environment_power(map: &Environment, radius: f64) -> f64 {
    let mut integral = 0.0;
    for (row, texels) in map.radiance.chunks(map.width as usize).enumerate() {
        let solid_angle = environment_texel_solid_angle(UVec2::new(map.width, map.height), row as u32);
        integral += texels.iter().map(|texel| luminance(texel.as_dvec3())).sum::<f64>() * solid_angle;
    }
    let radius = if radius > 0.0 { radius } else { 1.0 };
    integral * f64::from(map.strength) * std::f64::consts::PI * radius * radius
}

/// Luminance over the mean from which on a part of a map has to be aimed at, however little light it has.
const NEARLY_EVEN: f64 = 2.0;

/// The tables of a map: its mean luminance is left to scattered rays. Where next to nothing is left, a nearly even map is left to them whole if there are other
/// lights to aim at; any other is sampled whole, since rays meet a small bright part too rarely.
fn sampled_environment(map: &Environment, has_others: bool) -> Result<EnvironmentTables> {
    let tables = EnvironmentTables::build(map, true)?;
    let luminances = tables.texels.iter().map(|texel| luminance(texel.truncate().as_dvec3()));
    let greatest = luminances.fold(0.0, f64::max);
    let is_nearly_even = greatest <= NEARLY_EVEN * f64::from(tables.left_out);
    if tables.share > 0.0 || has_others && is_nearly_even {
        return Ok(tables);
    }
    EnvironmentTables::build(map, false)
}

/// The header `SceneEnvironment` (axes, size, what is left to scattered rays), then the texels of the tables.
fn environment_block(map: &Environment, tables: &EnvironmentTables) -> Vec<u8> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| (map.rotation * axis).to_array());
    let header = SceneEnvironment {
        right: axes[0],
        width: map.width,
        up: axes[1],
        height: map.height,
        back: axes[2],
        left_out: tables.left_out,
    };
    let mut block = bytemuck::bytes_of(&header).to_vec();
    block.extend_from_slice(bytemuck::cast_slice(&tables.texels));
    block
}

/// What [`environment_block`] has put there.
pub(super) fn read_environment(gpu: &Gpu, block: &Buffer) -> Result<Environment> {
    let header_bytes = size_of::<SceneEnvironment>() as u64;
    let header = gpu.read::<SceneEnvironment>(block.slice(0, header_bytes), 1)?[0];
    let texels = header.width as usize * header.height as usize;
    let texel_bytes = size_of::<[f32; 4]>() * texels;
    let texels = gpu.read::<[f32; 4]>(block.slice(header_bytes, texel_bytes as u64), texels)?;
    let [right, up, back] = [header.right, header.up, header.back].map(Vec3::from_array);
    Ok(Environment {
        name: "environment".into(),
        width: header.width,
        height: header.height,
        radiance: texels.iter().map(|[r, g, b, _]| Vec3::new(*r, *g, *b)).collect(),
        rotation: Quat::from_mat3(&Mat3::from_cols(right, up, back)),
        strength: 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// Probabilities by power alone, and as they are shared.
    fn choices(lights: &[(u32, f64)]) -> (Vec<f64>, Vec<f64>) {
        let records: Vec<SceneLight> = lights
            .iter()
            .map(|(kind, _)| SceneLight {
                kind: *kind,
                ..SceneLight::default()
            })
            .collect();
        let powers: Vec<f64> = lights.iter().map(|(_, power)| *power).collect();
        let shares = |powers: &[f64]| -> Vec<f64> {
            let total: f64 = powers.iter().sum();
            powers.iter().map(|power| power / total).collect()
        };
        let mut shared = powers.clone();
        share_choices(&records, &mut shared);
        (shares(&powers), shares(&shared))
    }

    // A disc of a hundredth of a sky's light: rays meet it once in tens of thousands, lamps or not.
    #[test]
    fn small_bright_parts_of_a_sky_are_aimed_at_beside_lamps() {
        let sky = |disc: f32| {
            let (width, height) = (256, 128);
            let mut radiance = vec![Vec3::ONE; width * height];
            radiance[40 * width + 100] = Vec3::splat(disc);
            Environment {
                name: "sky".into(),
                width: width as u32,
                height: height as u32,
                radiance,
                ..Environment::uniform(Vec3::ONE)
            }
        };
        for has_others in [false, true] {
            let bright = sampled_environment(&sky(200.0), has_others).unwrap();
            assert!(bright.share > 0.0, "{has_others}: {bright:?}");
        }
        // An even one is left to scattered rays only where there is something else to aim at.
        assert!(sampled_environment(&sky(1.5), false).unwrap().share > 0.0);
        assert_eq!(sampled_environment(&sky(1.5), true).unwrap().share, 0.0);
    }

    #[test]
    fn no_light_loses_more_than_half_of_its_choices() {
        let mut random = Random(31);
        let mut least = 1.0f64;
        for _ in 0..5000 {
            let mut lights: Vec<(u32, f64)> = Vec::new();
            for (kind, most) in [
                (LIGHT_POINT, 2),
                (LIGHT_TRIANGLE, 2),
                (LIGHT_DIRECTIONAL, 3),
                (LIGHT_ENVIRONMENT, 1),
            ] {
                lights.extend((0..random.below(most + 1)).map(|_| (kind, f64::from(random.magnitude(-20, 40)))));
            }
            if lights.is_empty() {
                continue;
            }
            let (by_power, shared) = choices(&lights);
            for (before, after) in by_power.iter().zip(&shared) {
                assert!(*after >= 0.5 * before * (1.0 - 1e-12), "{lights:?}: {before}, {after}");
                least = least.min(after / before);
            }
            let of = |wanted: &[u32]| -> f64 {
                let of = lights
                    .iter()
                    .zip(&shared)
                    .filter(|(light, _)| wanted.contains(&light.0));
                of.map(|(_, share)| share).sum()
            };
            let (environment, sun) = (of(&[LIGHT_ENVIRONMENT]), of(&[LIGHT_DIRECTIONAL]));
            let near = 1.0 - environment - sun;
            assert!(
                environment <= 0.5 + 1e-12 || lights.len() == 1,
                "{lights:?}: {environment}"
            );
            assert!(
                environment + sun <= 0.5 + 1e-12 || near < 1e-12,
                "{lights:?}: {environment} and {sun}"
            );
        }
        // The bound is reached.
        assert!(least < 0.501, "{least}");
        // A sky far above a sun far above a lamp.
        let (by_power, shared) = choices(&[(LIGHT_POINT, 1.0), (LIGHT_DIRECTIONAL, 1e4), (LIGHT_ENVIRONMENT, 1e8)]);
        assert!(
            by_power[2] > 0.99 && shared[2] > 0.49 && (shared[0] - 0.5).abs() < 1e-12,
            "{shared:?}"
        );
    }
}
