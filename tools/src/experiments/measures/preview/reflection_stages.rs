//! Reflection maps of a place in a scene: forms of one size, milliseconds of their parts, nanoseconds of look-ups, and errors of these.

use clerestory::Result;
use clerestory::gpu::shaders::constants::SAT_TWO_FLOAT;
use clerestory::gpu::shaders::maps::{directional_look_up, sat_look_up};
use clerestory::gpu::{BufferDesc, Category, Gpu, Pass};
use clerestory::maps::box_lobe::{WeightedBox, sat_border};
use clerestory::maps::prefilter::weighted_texels;
use clerestory::maps::spherical_sat::sat_half_width;
use clerestory::maps::{MapImage, Parametrization};
use clerestory::techniques::preview::{LightProbeDesc, ProbeMap, ReflectionMap, ReflectionMapDesc};
use glam::{DVec3, DVec4, UVec2, Vec3, Vec4};
use rayon::prelude::*;

use super::live_stages::{Stage, error};
use crate::random::Random;

/// Solid angles of boxes, sr.
pub const BOXES: [f64; 2] = [0.01, 0.05];
/// Names of look-ups: that of the map itself, and those of boxes.
pub const LOOK_UPS: [&str; 3] = ["mirror", "box of 0.01 sr", "box of 0.05 sr"];
/// Directions of look-ups, everywhere and near the poles.
const DIRECTIONS: usize = 2000;
/// How near, degrees.
pub const NEAR_POLES: f64 = 15.0;
/// Drawn, and the other two: made of an octahedron of as many texels, and of four times as many.
pub const FORMS: [&str; 3] = ["octahedron", "lat-long", "lat-long of four times the texels"];
/// The parts of a frame, by the names of their passes; the first two are the drawing.
const PASSES: [&str; 5] = [
    "raster: surfaces",
    "preview: shade live map",
    "reflection: latitude and longitude",
    "reflection: border",
    "reflection: table",
];

/// A form of about `side`² texels, with the border that its boxes reach into.
///
/// # Errors
/// None; such maps have borders.
pub fn form(number: usize, side: u32) -> Result<ReflectionMapDesc> {
    let (map, size) = match number {
        0 => (Parametrization::OctahedronQuadratic, UVec2::splat(side)),
        _ => {
            let map = Parametrization::LatLong;
            (map, map.size_for(f64::from(side).powi(2)))
        }
    };
    let boxes = BOXES.map(|solid_angle| WeightedBox {
        direction: DVec3::Z,
        solid_angle,
        weight: 1.0,
    });
    Ok(ReflectionMapDesc {
        side: if number == 2 { 2 * side } else { side },
        lat_long: (number > 0).then_some(size.y),
        border: sat_border(map, size, &boxes)?,
    })
}

/// Draws a map: milliseconds of drawing and shading, of the latitude–longitude map, of the border, of the table, and of all together.
///
/// # Errors
/// Those of the device.
pub fn milliseconds(stage: &Stage<'_>, reflection: &ReflectionMap) -> Result<[f64; 5]> {
    let timings = stage.draw_reflection(reflection)?;
    let [draw, shade, convert, border, table] = PASSES.map(|pass| 1e3 * timings.seconds_of(pass));
    let made = draw + shade;
    Ok([made, convert, border, table, made + convert + border + table])
}

/// Nanoseconds of a look-up, by its number in [`LOOK_UPS`], of so many in random directions.
///
/// # Errors
/// Those of the device.
pub fn nanoseconds(gpu: &Gpu, reflection: &ReflectionMap, look_up: usize, count: u32) -> Result<f64> {
    let mut random = Random::new(51);
    let directions: Vec<DVec3> = (0..count).map(|_| random.direction()).collect();
    let asked: Vec<[f32; 4]> = queries(reflection, look_up, &directions)
        .iter()
        .map(Vec4::to_array)
        .collect();
    let asked = gpu.buffer_with("queries", Category::Work, &asked)?;
    let bytes = u64::from(count) * size_of::<[f32; 3]>() as u64;
    let values = gpu.buffer(&BufferDesc::storage("values", bytes, Category::Work))?;
    let (map, table) = (reflection.map(), reflection.table());
    let constants = map.constants();
    let mirror = gpu.compute_pipeline::<directional_look_up::Kernel>(&directional_look_up::Spec {
        directional_kind: constants.kind,
        directional_border: constants.border,
    })?;
    let boxes = gpu.compute_pipeline::<sat_look_up::Kernel>(&sat_look_up::Spec {
        directional_kind: constants.kind,
        directional_border: constants.border,
        sat_numbers: SAT_TWO_FLOAT,
    })?;
    let mut recorder = gpu.recorder("look-ups")?;
    recorder.pass("look-ups", |pass: &mut Pass<'_>| {
        if look_up == 0 {
            let set = directional_look_up::Set0 {
                queries: asked.view(),
                values: values.view(),
            };
            let groups = mirror.groups_over(count);
            return pass.dispatch(
                &mirror,
                &[&set, &map.set()],
                &directional_look_up::Push { count },
                groups,
            );
        }
        let set = sat_look_up::Set0 {
            queries: asked.view(),
            values: values.view(),
        };
        let groups = [boxes.groups_for(count), 1, 1];
        pass.dispatch(&boxes, &[&set, &table.set()], &sat_look_up::Push { count }, groups)
    })?;
    Ok(1e9 * recorder.submit()?.wait()?.seconds() / f64::from(count))
}

/// What look-ups ask of directions: nothing more of mirrors, of boxes half their side.
fn queries(reflection: &ReflectionMap, look_up: usize, directions: &[DVec3]) -> Vec<Vec4> {
    let (map, size) = (reflection.map().map(), reflection.map().size(0).unwrap_or_default());
    let half = |d: DVec3| match look_up.checked_sub(1) {
        Some(number) => sat_half_width(map, size, d, BOXES[number]).unwrap_or_default(),
        None => 0.0,
    };
    let query = |d: &DVec3| d.as_vec3().extend(half(*d) as f32);
    directions.iter().map(query).collect()
}

/// Look-ups in a far finer map of a place: the map itself, and its means over caps.
pub struct FineMap {
    /// Everywhere, and near the poles.
    directions: [Vec<DVec3>; 2],
    /// By directions and look-ups.
    truth: [[Vec<DVec3>; LOOK_UPS.len()]; 2],
}

impl FineMap {
    /// That of a place, by a map of so many texels along a side, and means of so many that caps are summed over.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(stage: &Stage<'_>, (side, summed): (u32, u32)) -> Result<Self> {
        let mut random = Random::new(52);
        let mut draw = |near: bool| -> Vec<DVec3> {
            let is_meant = |d: &DVec3| !near || d.z.abs() > NEAR_POLES.to_radians().cos();
            let all = std::iter::repeat_with(|| random.direction());
            all.filter(is_meant).take(DIRECTIONS).collect()
        };
        let directions = [draw(false), draw(true)];
        let fine = stage
            .live(LightProbeDesc {
                map: ProbeMap::Octahedron,
                side,
                finest: 32,
            })?
            .probe()
            .map()
            .read(0)?;
        let mut means = fine.clone();
        while means.size().x > summed {
            means = means.coarser()?;
        }
        let texels = weighted_texels(&means);
        let truth = [0, 1].map(|at: usize| truth(&fine, &texels, &directions[at]));
        Ok(Self { directions, truth })
    }

    /// RMS errors of a map's look-ups over the mean: everywhere and near the poles, by look-up.
    ///
    /// # Errors
    /// Those of the device.
    pub fn errors(&self, reflection: &ReflectionMap) -> Result<Vec<[f64; 2]>> {
        let of = |look_up: usize, at: usize| -> Result<f64> {
            let queries = queries(reflection, look_up, &self.directions[at]);
            let values: Vec<Vec3> = match look_up {
                0 => reflection.map().look_up(&queries)?,
                _ => reflection.table().look_up(&queries)?,
            };
            Ok(error(&values, &self.truth[at][look_up]))
        };
        (0..LOOK_UPS.len())
            .map(|look_up| Ok([of(look_up, 0)?, of(look_up, 1)?]))
            .collect()
    }
}

/// The fine map's own look-ups, and its means over caps.
fn truth(fine: &MapImage, texels: &[(DVec3, DVec4)], directions: &[DVec3]) -> [Vec<DVec3>; LOOK_UPS.len()] {
    let cap = |d: &DVec3, solid_angle: f64| -> DVec3 {
        let least = 1.0 - solid_angle / std::f64::consts::TAU;
        let inside = texels.iter().filter(|(centre, _)| centre.dot(*d) >= least);
        let sum: DVec4 = inside.map(|(_, value)| *value).sum();
        sum.truncate() / sum.w
    };
    let mirrors = directions.iter().map(|d| fine.look_up(*d).unwrap_or(DVec3::NAN));
    let [small, large] = BOXES.map(|angle| directions.par_iter().map(|d| cap(d, angle)).collect::<Vec<DVec3>>());
    [mirrors.collect(), small, large]
}
