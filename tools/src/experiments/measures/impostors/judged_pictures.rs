//! Pictures by several ways beside the path tracer's of the same light paths, and beside exact rays through the same samples.

use std::ops::Range;
use std::time::Instant;

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::gpu::Gpu;
use clerestory::maps::impostor::ImpostorRay;
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::raster::curved_mirror::VirtualTriangle;
use clerestory::render::Renderer;
use clerestory::scene::{Camera, Scene};
use glam::{DVec2, DVec3};

use crate::experiments::findings::rows;
use crate::experiments::measures::pictures::Image;
use crate::experiments::reference::SEED;
use crate::metal_forms::sheet;

/// Sine of the incidence beyond which points of a sphere are not judged: there its triangles show.
pub(super) const RIM: f64 = 0.95;
/// What is white in shown pictures, over their mean, where nothing is brighter.
const WHITE: f64 = 4.0;
/// What exact rays are called among ways.
pub(super) const EXACT: &str = "exact rays";
/// What a way is called that is compared with none.
const NONE: &str = "–";

rows! {
    /// A picture by a way.
    struct Row = "Older ways beside the path tracer" by [picture, way] {
        picture: String = "picture",
        way: String = "way",
        pixels: u64 = "pixels",
        beside_paths: f64 = "RMS beside the path tracer, over the mean (%)",
        noise: f64 = "the path tracer's noise (%)",
        without_noise: f64 = "RMS without that noise (%)",
        beside_rays: f64 = "RMS beside exact rays (%)",
        than: String = "compared with",
        over_other: Option<f64> = "RMS beside exact rays over its",
        time: f64 = "time (ms)",
        paths: f64 = "time of the path tracer, a sample a pixel (ms)",
    }
}

/// What is rendered, and in how many samples.
pub(super) struct Subject {
    pub name: &'static str,
    pub scene: Scene,
    pub camera: Camera,
    /// The light paths that all ways show.
    pub paths: &'static str,
    /// Pixels along a side, and samples along a side of a pixel.
    pub grid: [u32; 2],
    /// Samples of a pixel of the path tracer.
    pub spp: u32,
}

/// A picture by the path tracer and by exact rays, and what other ways make of it.
pub(super) struct Judge {
    name: &'static str,
    grid: [u32; 2],
    traced: Vec<DVec3>,
    exact: Vec<DVec3>,
    /// Pixels all of whose samples count.
    judged: Vec<bool>,
    /// Of the path tracer's mean: its deviation over the mean.
    noise: f64,
    /// Milliseconds of the path tracer.
    paths: f64,
    pub rows: Vec<Row>,
    tiles: Vec<Vec<DVec3>>,
}

impl Judge {
    /// Renders a subject by the path tracer; `exact` gives what its samples show, row by row, and none where they are not judged.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn new(gpu: &Gpu, subject: Subject, exact: impl FnOnce() -> Vec<Option<DVec3>>) -> Result<Self> {
        let Subject { grid, spp, .. } = subject;
        let mut scene = subject.scene;
        scene.cameras = vec![subject.camera];
        let image = Image::render(&Renderer::new(gpu, &scene)?, grid[0], spp, SEED, subject.paths)?;
        let clock = Instant::now();
        let samples = exact();
        let shown: Vec<DVec3> = samples.iter().map(|sample| sample.unwrap_or(DVec3::ZERO)).collect();
        let found = means(&shown, grid);
        let time = 1e3 * clock.elapsed().as_secs_f64();
        let counted: Vec<DVec3> = samples
            .iter()
            .map(|sample| DVec3::splat(f64::from(u8::from(sample.is_some()))))
            .collect();
        let judged: Vec<bool> = means(&counted, grid).iter().map(|share| share.x >= 1.0).collect();
        let traced = of_values(&image.radiance);
        let (of_variance, of_traced) = (mean(&of_values(&image.variance), &judged), mean(&traced, &judged));
        let mut judge = Self {
            name: subject.name,
            grid,
            noise: of_variance.sqrt() / of_traced,
            paths: 1e3 * image.report.gpu_seconds / f64::from(spp),
            tiles: vec![traced.clone()],
            traced,
            exact: found.clone(),
            judged,
            rows: Vec::new(),
        };
        judge.push(EXACT.into(), None, found, time);
        Ok(judge)
    }

    /// A picture by a way, from what it shows at samples, row by row; beside an earlier one where that is named.
    ///
    /// # Errors
    /// Those of the way.
    pub fn add(
        &mut self,
        way: impl Into<String>,
        than: Option<&str>,
        shown: impl FnOnce() -> Result<Vec<DVec3>>,
    ) -> Result<()> {
        let clock = Instant::now();
        let found = means(&shown()?, self.grid);
        let time = 1e3 * clock.elapsed().as_secs_f64();
        self.push(way.into(), than, found, time);
        Ok(())
    }

    fn push(&mut self, way: String, than: Option<&str>, found: Vec<DVec3>, time: f64) {
        let beside = |truth: &[DVec3]| {
            let squares: Vec<DVec3> = found.iter().zip(truth).map(|(a, b)| (*a - *b) * (*a - *b)).collect();
            mean(&squares, &self.judged).sqrt() / mean(truth, &self.judged)
        };
        let (beside_paths, beside_rays) = (beside(&self.traced), 100.0 * beside(&self.exact));
        let other = than.and_then(|than| self.rows.iter().find(|row| row.way == than));
        let row = Row {
            picture: self.name.into(),
            way,
            pixels: self.judged.iter().filter(|judged| **judged).count() as u64,
            beside_paths: 100.0 * beside_paths,
            noise: 100.0 * self.noise,
            without_noise: 100.0 * (beside_paths * beside_paths - self.noise * self.noise).max(0.0).sqrt(),
            beside_rays,
            than: than.unwrap_or(NONE).into(),
            over_other: other
                .filter(|other| other.beside_rays > 0.0)
                .map(|other| beside_rays / other.beside_rays),
            time,
            paths: self.paths,
        };
        self.rows.push(row);
        self.tiles.push(found);
    }

    /// The path tracer's picture, that of exact rays, and all others in their order, side by side.
    pub fn sheet(&self) -> Rgb8 {
        let brightest = self
            .exact
            .iter()
            .fold(0.0, |most: f64, value| most.max(value.max_element()));
        let white = brightest.min(WHITE * mean(&self.exact, &self.judged));
        let tile = |tile: &Vec<DVec3>| tile.iter().map(|value| *value / white).collect();
        let tiles: Vec<Vec<DVec3>> = self.tiles.iter().map(tile).collect();
        sheet(&tiles, self.grid[0], tiles.len() as u32)
    }
}

/// Pixels of values, three each.
fn of_values(values: &[f32]) -> Vec<DVec3> {
    let pixels = values.chunks_exact(3);
    pixels
        .map(|rgb| DVec3::from_array([rgb[0], rgb[1], rgb[2]].map(f64::from)))
        .collect()
}

/// The mean of all channels of judged pixels.
fn mean(picture: &[DVec3], judged: &[bool]) -> f64 {
    let pixels = picture.iter().zip(judged).filter(|(_, judged)| **judged);
    let (sum, count) = pixels.fold((0.0, 0.0), |(sum, count), (value, _)| {
        (sum + value.element_sum(), count + 3.0)
    });
    sum / f64::max(count, 1.0)
}

/// Means of pixels, of samples row by row.
fn means(samples: &[DVec3], [pixels, of_pixel]: [u32; 2]) -> Vec<DVec3> {
    let [side, of_pixel] = [pixels, of_pixel].map(|count| count as usize);
    let mut all = vec![DVec3::ZERO; side * side];
    for (row, line) in samples.chunks_exact(side * of_pixel).enumerate() {
        for (column, value) in line.iter().enumerate() {
            all[row / of_pixel * side + column / of_pixel] += *value;
        }
    }
    let count = (of_pixel * of_pixel) as f64;
    all.into_iter().map(|sum| sum / count).collect()
}

/// What a sphere's mirror sends from the middles of samples, row by row from above; none beside it and at its rim.
pub(super) fn mirrored_rays(sphere: &ShinySphere, [pixels, of_pixel]: [u32; 2]) -> Vec<Option<ImpostorRay>> {
    let side = pixels * of_pixel;
    let rays = sphere.pixels(side, None);
    let is_judged = |ray: &ImpostorRay| {
        let normal = (ray.origin - sphere.centre) / sphere.radius;
        (ray.origin - sphere.camera).normalize().cross(normal).length() < RIM
    };
    let rows = rays.chunks_exact(side as usize).rev().flatten();
    rows.map(|ray| ray.filter(is_judged)).collect()
}

/// The camera of a sphere, whose picture just holds it.
pub(super) fn camera_of(sphere: &ShinySphere) -> Camera {
    let half = (sphere.radius / sphere.centre.distance(sphere.camera)).asin();
    Camera::look_at("sphere", sphere.camera, sphere.centre, DVec3::Y, (2.0 * half) as f32)
}

/// Samples of a square picture in perspective.
pub(super) struct Samples {
    camera: Camera,
    /// Half of the picture at distance 1.
    half: f64,
    /// Samples along a side.
    side: u32,
}

impl Samples {
    /// Of a camera and the field that it sees, radians.
    pub fn new(camera: &Camera, field: f64, [pixels, of_pixel]: [u32; 2]) -> Self {
        Self {
            camera: camera.clone(),
            half: (0.5 * field).tan(),
            side: pixels * of_pixel,
        }
    }

    fn eye(&self) -> DVec3 {
        self.camera.transform.translation
    }

    fn direction(&self, x: u32, y: u32) -> DVec3 {
        let at = |i: u32| self.half * (2.0 * (f64::from(i) + 0.5) / f64::from(self.side) - 1.0);
        let ray = DVec3::new(at(x), -at(y), -1.0);
        self.camera.transform.transform_vector3(ray).normalize()
    }

    /// Unit directions row by row.
    pub fn directions(&self) -> Vec<DVec3> {
        let rows = (0..self.side).flat_map(|y| (0..self.side).map(move |x| (x, y)));
        rows.map(|(x, y)| self.direction(x, y)).collect()
    }

    /// What virtual triangles show, drawn as a rasterizer does: the nearest of those that a sample lies in; black of none.
    pub fn drawn(&self, triangles: &[VirtualTriangle], color: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
        let mut nearest = vec![(f64::INFINITY, DVec3::ZERO); (self.side * self.side) as usize];
        for triangle in triangles {
            let [columns, rows] = self.covered(&triangle.images);
            for y in rows {
                for x in columns.clone() {
                    let Some((distance, point)) = triangle.shown(self.eye(), self.direction(x, y)) else {
                        continue;
                    };
                    let known = &mut nearest[(y * self.side + x) as usize];
                    if distance < known.0 {
                        *known = (distance, point);
                    }
                }
            }
        }
        let shown = |(distance, point): (f64, DVec3)| {
            if distance.is_finite() {
                color(point)
            } else {
                DVec3::ZERO
            }
        };
        nearest.into_iter().map(shown).collect()
    }

    /// Columns and rows of samples that may lie in a triangle before the camera.
    fn covered(&self, corners: &[DVec3; 3]) -> [Range<u32>; 2] {
        let to_camera = self.camera.transform.inverse();
        let side = f64::from(self.side);
        let places = corners.map(|corner| {
            let seen = to_camera.transform_point3(corner);
            0.5 * side * (DVec2::new(seen.x, -seen.y) / (-seen.z * self.half) + 1.0)
        });
        let low = places.into_iter().fold(DVec2::INFINITY, DVec2::min);
        let high = places.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
        // Saturating: what lies outside of the picture leaves an empty range.
        let range = |low: f64, high: f64| low.floor() as u32..(high.ceil() as u32).min(self.side);
        [range(low.x, high.x), range(low.y, high.y)]
    }
}
