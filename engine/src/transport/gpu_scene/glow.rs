//! Media that emit: where photons of theirs start, and with which power.
//!
//! Each medium has a source: a parallelepiped that holds all of it that emits, which is the grid of its density, or the box around its bodies. Places in it are drawn
//! evenly, or by the density; those that turn out to be in another medium carry nothing. Guarantee: over all places power is that of the medium, exactly.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;

use super::bodies::{Bodies, boxes_meet};
use crate::gpu::shaders::constants::GLOW_TRIES;
use crate::gpu::shaders::types::{GlowBody, GlowSource};
use crate::scene::{Medium, Scene};
use crate::transport::environment::luminance;

/// Sources of photons in media that emit, as `transport/glow.glsl` reads them.
#[derive(Debug, Default)]
pub(crate) struct Glow {
    pub sources: Vec<GlowSource>,
    /// Those that some source reaches into, from the least one on.
    pub bodies: Vec<GlowBody>,
    /// Nine numbers for each of their triangles, m.
    pub corners: Vec<f32>,
    /// Of all places in the sources, W of luminance.
    pub power: f64,
}

/// A parallelepiped.
struct Region {
    corner: DVec3,
    edges: [DVec3; 3],
}

impl Region {
    fn volume(&self) -> f64 {
        let [x, y, z] = self.edges;
        x.cross(y).dot(z).abs()
    }

    fn bounds(&self) -> [DVec3; 2] {
        let ends =
            |end: fn(DVec3, DVec3) -> DVec3| self.edges.iter().map(|edge| end(*edge, DVec3::ZERO)).sum::<DVec3>();
        [self.corner + ends(DVec3::min), self.corner + ends(DVec3::max)]
    }
}

impl Glow {
    /// Of a scene with these bodies; `None` where no medium that is somewhere emits. A medium outside all bodies that emits everywhere is none.
    pub(super) fn new(scene: &Scene, surrounding: Option<u32>, bodies: &Bodies) -> Option<Self> {
        let regions: Vec<(u32, Region)> = (0u32..)
            .zip(&scene.media)
            .filter(|(_, medium)| medium.emission != Vec3::ZERO && !medium.is_empty())
            .filter_map(|(index, medium)| Some((index, region(scene, surrounding, bodies, index, medium)?)))
            .filter(|(_, region)| region.volume() > 0.0)
            .collect();
        let sends = |(index, region): &(u32, Region)| {
            let medium = &scene.media[*index as usize];
            let density = medium.density.as_ref().map_or(1.0, |grid| grid.mean());
            medium.emission.as_dvec3() * (4.0 * PI * density * region.volume())
        };
        let power: f64 = regions.iter().map(|source| luminance(sends(source))).sum();
        if power <= 0.0 {
            return None;
        }
        let mut until = 0.0;
        let sources = regions.iter().map(|source| {
            let (index, region) = source;
            let sent = sends(source);
            let probability = luminance(sent) / power;
            until += probability;
            let grid = scene.media[*index as usize].density.as_ref();
            let found = grid.map_or(1.0, |grid| found(grid.mean() / f64::from(grid.max())));
            let [x, y, z] = region.edges.map(|edge| edge.as_vec3().to_array());
            GlowSource {
                corner: region.corner.as_vec3().to_array(),
                until: until as f32,
                edge_x: x,
                medium: *index,
                edge_y: y,
                side: region.volume().cbrt() as f32,
                edge_z: z,
                probability: probability as f32,
                power: (sent / (probability * found)).as_vec3().to_array(),
                spare: 0.0,
            }
        });
        let sources = sources.collect();
        let boxes: Vec<_> = regions.iter().map(|(_, region)| region.bounds()).collect();
        let reached = |bounds: &[DVec3; 2]| boxes.iter().any(|other| boxes_meet(bounds, other));
        let (bodies, corners) = bodies.glow_bodies(scene, reached);
        Some(Self {
            sources,
            bodies,
            corners,
            power,
        })
    }

    /// Triangles of its bodies.
    pub fn triangles(&self) -> usize {
        self.corners.len() / 9
    }
}

/// Where a medium is that emits, and more.
fn region(scene: &Scene, surrounding: Option<u32>, bodies: &Bodies, index: u32, medium: &Medium) -> Option<Region> {
    let around = bodies.bounds_of(|material| scene.materials[material as usize].interior == Some(index));
    match &medium.density {
        Some(grid) if around.is_some() || surrounding == Some(index) => {
            let to_world = grid.to_world;
            Some(Region {
                corner: to_world.translation,
                edges: [0, 1, 2].map(|axis| to_world.matrix3.col(axis)),
            })
        }
        Some(_) => None,
        None => around.map(|[lower, upper]| Region {
            corner: lower,
            edges: [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * (upper - lower)),
        }),
    }
}

/// Probability that one of the tries finds a place, where each does with the probability `share`.
fn found(share: f64) -> f64 {
    -(f64::from(GLOW_TRIES) * (-share).ln_1p()).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tries_find_places_as_often_as_they_should() {
        assert_eq!(found(1.0), 1.0);
        assert!((found(0.5) - (1.0 - 0.5f64.powi(16))).abs() < 1e-15);
        // Hardly ever: each try by itself.
        assert!((found(1e-12) / 16e-12 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn regions_have_their_volume_and_box() {
        let region = Region {
            corner: DVec3::new(1.0, 2.0, 3.0),
            edges: [DVec3::X * 2.0, DVec3::new(-1.0, 3.0, 0.0), DVec3::NEG_Z],
        };
        assert_eq!(region.volume(), 6.0);
        assert_eq!(region.bounds(), [DVec3::new(0.0, 2.0, 2.0), DVec3::new(3.0, 5.0, 3.0)]);
    }
}
