//! Closest hits without an index: a pass over all rays for each triangle.
//!
//! Source: N. Carr, J. Hall, J. Hart, "The Ray Engine", Graphics Hardware 2002, where rays lie in textures, a triangle is drawn over all of them, and the depth test keeps the nearest. Here a dispatch stands for the
//! draw, and the hit so far for the depth. Work is rays times triangles. The test is the watertight one of [`intersect_triangle`], of equally near triangles the first is kept.
//! Deterministic; hits have the bits of the host's, [`RayEngine::on_host`], where divisions are exact.

use glam::Vec3;

use crate::accel::triangle::{intersect_triangle, ray_shear};
use crate::accel::{Hit, NO_HIT, Ray};
use crate::catalogue::{Role, Row, Source};
use crate::gpu::shaders::accel::ray_engine as kernel;
use crate::gpu::shaders::types::EngineTriangle;
use crate::gpu::{BufferDesc, Category, ComputePipeline, Gpu, Timings, rw_compute_to_compute};
use crate::{Error, Result};

/// Triangles whose dispatches are submitted together: rays are few or many, and no submission takes seconds.
const TOGETHER: usize = 256;
/// Triangles at most: each is a dispatch.
pub const ENGINE_TRIANGLES_MAX: usize = 1 << 16;

/// The kernel.
#[derive(Debug)]
pub struct RayEngine {
    gpu: Gpu,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl RayEngine {
    /// Makes the pipeline.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            pipeline: gpu.compute_pipeline(&())?,
        })
    }

    /// Closest hits of rays with triangles, and the times of the passes. Rays that are not finite or out of range meet nothing.
    ///
    /// # Errors
    /// [`Error::Setting`] for more than [`ENGINE_TRIANGLES_MAX`] triangles; [`Error::LimitExceeded`], [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn trace(&self, triangles: &[[Vec3; 3]], rays: &[Ray]) -> Result<(Vec<Hit>, Vec<Timings>)> {
        if triangles.len() > ENGINE_TRIANGLES_MAX {
            let cause = format!("are more than {ENGINE_TRIANGLES_MAX}, each of which takes a dispatch");
            return Err(Error::setting("triangles", triangles.len(), cause));
        }
        if rays.is_empty() || triangles.is_empty() {
            return Ok((rays.iter().map(|ray| Hit::none(ray.t_max)).collect(), Vec::new()));
        }
        let gpu = &self.gpu;
        gpu.caps().check_storage("ray engine: rays", size_of_val(rays) as u64)?;
        let corners: Vec<EngineTriangle> = triangles
            .iter()
            .map(|[a, b, c]| EngineTriangle {
                a: a.to_array(),
                b: b.to_array(),
                c: c.to_array(),
            })
            .collect();
        let none: Vec<Hit> = rays.iter().map(|ray| Hit::none(ray.t_max)).collect();
        let rays_on_device = gpu.buffer_with("ray engine: rays", Category::Work, rays)?;
        let triangles_on_device = gpu.buffer_with("ray engine: triangles", Category::Geometry, &corners)?;
        let hits = gpu.buffer(&BufferDesc::storage(
            "ray engine: hits",
            size_of_val(&none[..]) as u64,
            Category::Work,
        ))?;
        gpu.upload(&hits, 0, &none)?;
        let count = rays.len() as u32;
        let groups = self.pipeline.groups_over(count);
        let mut timings = Vec::new();
        for first in (0..triangles.len()).step_by(TOGETHER) {
            let mut recorder = gpu.recorder("ray engine")?;
            recorder.pass("ray engine", |pass| {
                for triangle in first..triangles.len().min(first + TOGETHER) {
                    let set = kernel::Set0 {
                        engine_rays: rays_on_device.view(),
                        engine_triangles: triangles_on_device.view(),
                        engine_hits: hits.view(),
                    };
                    let push = kernel::Push {
                        triangle: triangle as u32,
                        rays: count,
                    };
                    pass.dispatch(&self.pipeline, &[&set], &push, groups)?;
                    pass.barrier(&[rw_compute_to_compute(&hits)]);
                }
                Ok(())
            })?;
            timings.push(recorder.submit()?.wait()?);
        }
        Ok((gpu.read(hits.view(), rays.len())?, timings))
    }

    /// Twin of [`RayEngine::trace`] for one ray.
    pub fn on_host(triangles: &[[Vec3; 3]], ray: &Ray) -> Hit {
        let mut nearest = Hit::none(ray.t_max);
        if !ray.is_traceable() {
            return nearest;
        }
        let shear = ray_shear(Vec3::from_array(ray.origin), Vec3::from_array(ray.direction));
        for (triangle, corners) in (0..).zip(triangles) {
            let found = intersect_triangle(&shear, corners, ray.t_min, nearest.t);
            if let Some(found) = found
                && (found.t < nearest.t || nearest.triangle == NO_HIT)
            {
                nearest = Hit {
                    t: found.t,
                    barycentrics: [found.u, found.v],
                    triangle,
                };
            }
        }
        nearest
    }
}

const CARR_2002: Source = Source {
    key: "carr-2002",
    authors: "N. Carr, J. Hall, J. Hart",
    title: "The Ray Engine",
    venue: "Graphics Hardware",
    year: 2002,
};

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-P1",
    name: "the ray engine: closest hits by a pass over all rays for each triangle",
    role: Role::Yardstick,
    limits: "Work is rays times triangles, and a pass for each triangle.",
    sources: &[CARR_2002.whole()],
    shaders: &["shaders/accel/ray_engine.comp"],
    tests: &["tests/tests/accel/ray_index.rs::the_ray_engine_finds_what_indexes_find"],
    api: &["clerestory::accel::yardstick::ray_engine::RayEngine"],
    ..Row::of(file!())
}];
