//! Pictures of what deferred frames of many lights make on the way: the G-buffer, whole and split, the reflective shadow map of a spot, direct light, and indirect light split, merged and
//! filtered.
//!
//! Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, figures 3.1, 4.4 to 4.6 and 4.10 to 4.13.

use clerestory::Result;
use clerestory::film::picture;
use clerestory::film::png::{self, Rgb8};
use clerestory::film::tone::{ToneCurve, ToneMap};
use clerestory::gpu::shaders::constants::SHADING_NORMAL_BITS;
use clerestory::gpu::{Area, Gpu};
use clerestory::maps::packed_direction::unpack_octahedral;
use clerestory::raster::{GBuffer, GBufferDesc, Layering, Output, View};
use clerestory::scene::LightKind;
use clerestory::srgb::srgb_byte;
use clerestory::techniques::instant_radiosity::many_light::{Interleaving, ManyLightSettings, Placement};
use glam::{Vec3, Vec4};

use super::deferred_stages::{ALL, INDIRECT, Subject, TILES};
use crate::experiments::measures::Context;

/// The scene.
const SHOWN: &str = "builtin:cornell-box?source=spot";
const DIRECT: &str = "bounces=0..1,lobes=diffuse+glossy";
/// Pixels along a side; the same of a smoke run.
const SIDE: [u32; 2] = [256, 32];
const LIGHTS: u32 = 256;
/// Frames of what is shown without noise.
const FRAMES: u32 = 16;

/// Files of the pictures, with what they show.
const PICTURES: [(&str, &str); 12] = [
    ("normals.png", "Shading normals of the G-buffer."),
    ("places.png", "Places of the G-buffer, in the box around the scene."),
    (
        "rsm.png",
        "The reflective shadow map of the spot: places that it lights.",
    ),
    (
        "split.png",
        "Indirect light of one frame in the split picture: 4 × 4 tiles, each with a sixteenth of 256 walks' virtual lights, and tinted by its own color.",
    ),
    (
        "merged.png",
        "The same, merged: neighbours have other lights, which shows as a pattern.",
    ),
    (
        "filtered.png",
        "The same, filtered over neighbours on the same surface.",
    ),
    ("combined.png", "With direct light."),
    ("albedo.png", "Albedo of what the G-buffer's materials are."),
    (
        "split-normals.png",
        "Normals of the split G-buffer, its tiles tinted likewise.",
    ),
    ("rsm-normals.png", "The spot's map: normals."),
    ("rsm-flux.png", "The spot's map: power that comes to each texel."),
    ("direct.png", "Direct light alone."),
];
/// Those that were there before the others.
const FIRST: usize = 7;

/// The pictures of a page, all or the first ones.
pub fn shown(all: bool) -> Vec<(&'static str, &'static str)> {
    PICTURES[..if all { PICTURES.len() } else { FIRST }].to_vec()
}

/// What a view sees.
struct Seen {
    normals: Rgb8,
    /// In the box around the scene.
    places: Rgb8,
    albedo: Rgb8,
}

/// A square picture.
fn square(side: u32, bytes: Vec<u8>) -> Rgb8 {
    Rgb8 {
        width: side,
        height: side,
        bytes,
    }
}

impl Seen {
    fn of(gpu: &Gpu, subject: &Subject, view: View, side: u32) -> Result<Self> {
        let surfaces = subject.on_device.surfaces();
        let desc = GBufferDesc {
            size: [side; 2],
            layering: Layering::One,
            outputs: &[Output::Material, Output::Position, Output::Normals],
        };
        let gbuffer = GBuffer::new(gpu, &surfaces, &desc)?;
        let mut recorder = gpu.recorder("what is seen")?;
        gbuffer.record(&mut recorder, &surfaces, &[view])?;
        recorder.submit()?.wait()?;
        let positions: Vec<[f32; 4]> = gbuffer.read(gpu, Output::Position)?;
        let words: Vec<[u32; 2]> = gbuffer.read(gpu, Output::Normals)?;
        let materials: Vec<u32> = gbuffer.read(gpu, Output::Material)?;
        let [lower, upper] = subject.on_device.bounds();
        let shown = |color: Vec3| {
            color
                .to_array()
                .map(|value| (255.0 * value.clamp(0.0, 1.0)).round() as u8)
        };
        let is_there = |place: &[f32; 4]| place[3] != 0.0;
        let normals = words.iter().zip(&positions).flat_map(|(words, place)| {
            let normal = unpack_octahedral(words[1], SHADING_NORMAL_BITS).as_vec3();
            shown(if is_there(place) {
                0.5 + 0.5 * normal
            } else {
                Vec3::ZERO
            })
        });
        let places = positions.iter().flat_map(|place| {
            let within = (Vec4::from_array(*place).truncate() - lower) / (upper - lower);
            shown(if is_there(place) { within } else { Vec3::ZERO })
        });
        let albedo = materials.iter().flat_map(|number| {
            let material = subject.scene.materials.get(*number as usize);
            let color = material.map_or(Vec3::ZERO, |material| material.base_color.truncate());
            color.to_array().map(|value| srgb_byte(value.into()))
        });
        Ok(Self {
            normals: square(side, normals.collect()),
            places: square(side, places.collect()),
            albedo: square(side, albedo.collect()),
        })
    }
}

/// The pixels of a picture by tiles, each tinted by its own color.
fn split(picture: &Rgb8) -> Rgb8 {
    let [width, height] = [picture.width, picture.height];
    let [across, down] = Interleaving::new([width, height], TILES).tile();
    let mut bytes = vec![0; picture.bytes.len()];
    for y in 0..height {
        for x in 0..width {
            let tile = [x % TILES, y % TILES];
            let to = [tile[0] * across + x / TILES, tile[1] * down + y / TILES];
            if to[0] >= width || to[1] >= height {
                continue;
            }
            let tint = [255 - 40 * tile[0], 255, 255 - 40 * tile[1]];
            for (channel, tint) in tint.into_iter().enumerate() {
                let from = u32::from(picture.bytes[3 * (y * width + x) as usize + channel]);
                bytes[3 * (to[1] * width + to[0]) as usize + channel] = (from * tint / 255) as u8;
            }
        }
    }
    Rgb8 { width, height, bytes }
}

/// What the spot sees, if there is one.
fn seen_by_spot(gpu: &Gpu, subject: &Subject, side: u32) -> Result<Option<Seen>> {
    let spot = subject.scene.lights.iter().find_map(|light| match light.kind {
        LightKind::Spot {
            position,
            direction,
            outer,
            ..
        } => Some((position, direction, outer)),
        _ => None,
    });
    let Some((position, direction, outer)) = spot else {
        return Ok(None);
    };
    let near = View::near_plane(position, &subject.on_device.surfaces());
    let view = View::of_square(position, direction, outer, near, Area::whole([side; 2]))?;
    Seen::of(gpu, subject, view, side).map(Some)
}

/// Power that comes to texels of the first view of a light, of the most that comes to one.
fn flux(gpu: &Gpu, subject: &Subject, side: u32) -> Result<Option<Rgb8>> {
    let settings = ManyLightSettings {
        placement: Placement::Rsm,
        rsm_side: side,
        path_set: INDIRECT.parse()?,
        ..ManyLightSettings::default()
    };
    let mut renderer = subject.renderer(gpu, side, settings)?;
    while renderer.step(1)?.is_some() {}
    let maps = renderer.reflective_maps()?;
    Ok(maps.first().map(|map| {
        let powers: Vec<Vec3> = map
            .texels
            .iter()
            .map(|texel| texel.as_ref().map_or(Vec3::ZERO, |light| light.power))
            .collect();
        let most = powers
            .iter()
            .map(|power| power.max_element())
            .fold(f32::MIN_POSITIVE, f32::max);
        let bytes = powers
            .iter()
            .flat_map(|power| power.to_array().map(|value| srgb_byte((value / most).into())));
        square(map.side, bytes.collect())
    }))
}

/// Writes all of them.
///
/// # Errors
/// Those of rendering.
pub fn write_pictures(context: &Context<'_>, gpu: &Gpu) -> Result<()> {
    let subject = Subject::new(gpu, SHOWN)?;
    let side = context.pick(SIDE[0], SIDE[1]);
    let surfaces = subject.on_device.surfaces();
    let view = View::of_camera(&subject.scene.cameras[0], &surfaces, Area::whole([side; 2]))?;
    let seen = Seen::of(gpu, &subject, view, side)?;
    let (rsm_places, rsm_normals) = match seen_by_spot(gpu, &subject, side)? {
        Some(seen) => (Some(seen.places), Some(seen.normals)),
        None => (None, None),
    };
    let tone = ToneMap {
        exposure: 0.0,
        curve: ToneCurve::Photographic,
    };
    let shown = |filter, path_set: &str, frames| -> Result<Rgb8> {
        let settings = ManyLightSettings {
            lights: LIGHTS,
            interleave: TILES,
            filter,
            path_set: path_set.parse()?,
            ..ManyLightSettings::default()
        };
        let picture = subject.picture(gpu, side, frames, settings)?;
        Ok(png::tone_mapped(picture.require(picture::RADIANCE)?, side, &tone))
    };
    let merged = shown(false, INDIRECT, 1)?;
    let pictures = [
        Some(seen.normals.clone()),
        Some(seen.places),
        rsm_places,
        Some(split(&merged)),
        Some(merged),
        Some(shown(true, INDIRECT, 1)?),
        Some(shown(true, ALL, FRAMES)?),
        Some(seen.albedo),
        Some(split(&seen.normals)),
        rsm_normals,
        flux(gpu, &subject, side)?,
        Some(shown(true, DIRECT, FRAMES)?),
    ];
    for ((file, _), picture) in PICTURES.iter().zip(pictures) {
        if let Some(picture) = picture {
            context.picture(file, &picture);
        }
    }
    Ok(())
}
