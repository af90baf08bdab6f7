//! Texture look-ups without mip levels: what a texture of a material shows at vertex coordinates.
//!
//! Conventions of glTF 2.0 (3.8.4): coordinate (0, 0) is the outer corner of the first texel, texel centres lie at half-integers, filters
//! and wrap modes are those of OpenGL. Guarantee: every coordinate finds a texel of the image; texel numbers are exact integers up to 2²⁴
//! texels from the origin, and coordinates beyond are taken as that far. Twin of `scene/texture.glsl`.

use glam::{DVec2, DVec3, DVec4};

use super::{Filter, Image, Texture, Wrap};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants::TEXTURE_COORDINATE_LIMIT;
use crate::srgb::linear_from_srgb;

/// Distance from the origin, in texels, beyond which f32 coordinates no longer tell neighbouring texels apart.
const COORDINATE_LIMIT: f64 = TEXTURE_COORDINATE_LIMIT as f64;

/// The texel in 0..`size` that stands at place `i` of an endless row; `size` is from 1 to 65535.
pub fn wrap_texel(i: i32, size: u32, mode: Wrap) -> u32 {
    let (i, n) = (i64::from(i), i64::from(size.max(1)));
    let texel = match mode {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::MirroredRepeat => {
            let r = i.rem_euclid(2 * n);
            if r < n { r } else { 2 * n - 1 - r }
        }
        Wrap::ClampToEdge => i.clamp(0, n - 1),
    };
    texel as u32
}

/// The linear RGBA value of the texel at a place of the endless plane; `srgb` says that the image's RGB is encoded.
pub fn fetch_texel(image: &Image, texture: &Texture, srgb: bool, place: [i32; 2]) -> DVec4 {
    let x = wrap_texel(place[0], image.width, texture.wrap[0]) as usize;
    let y = wrap_texel(place[1], image.height, texture.wrap[1]) as usize;
    let texel = image.texels.get(y * image.width as usize + x).copied();
    let c = DVec4::from_array(texel.unwrap_or_default().map(|byte| f64::from(byte) / 255.0));
    if srgb {
        c.truncate().map(linear_from_srgb).extend(c.w)
    } else {
        c
    }
}

/// Where a look-up at the vertex coordinates of sets 0 and 1 falls, in texels from the image's corner.
pub fn texel_coordinates(image: &Image, texture: &Texture, uvs: [DVec2; 2]) -> DVec2 {
    let uv = uvs[usize::from(texture.uv_set == 1)].extend(1.0);
    let [u, v] = texture
        .transform
        .map(|row| DVec3::from_array(row.map(f64::from)).dot(uv));
    let limit = DVec2::splat(COORDINATE_LIMIT);
    (DVec2::new(u, v) * DVec2::new(f64::from(image.width), f64::from(image.height))).clamp(-limit, limit)
}

/// The linear RGBA value of a texture at the vertex coordinates of sets 0 and 1.
///
/// A coordinate that is not a number gives, by [`Filter::Nearest`], some texel of the image (the device is free in which) and otherwise
/// a value that is not a number or lies within the range of the image's values.
pub fn sample_texture(image: &Image, texture: &Texture, srgb: bool, uvs: [DVec2; 2]) -> DVec4 {
    let p = texel_coordinates(image, texture, uvs);
    let fetch = |x: f64, y: f64| fetch_texel(image, texture, srgb, [x as i32, y as i32]);
    if texture.filter == Filter::Nearest {
        return fetch(p.x.floor(), p.y.floor());
    }
    let p = p - 0.5;
    let base = p.floor();
    let w = p - base;
    let row = |y: f64| fetch(base.x, y).lerp(fetch(base.x + 1.0, y), w.x);
    row(base.y).lerp(row(base.y + 1.0), w.y)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-TEXTURE",
    name: "texture look-ups: nearest, bilinear, three ways to wrap, sRGB",
    role: Role::PartOf("BG-3"),
    limits: "No levels of detail: fine textures alias until samples have averaged them.",
    sources: &[sources::KHRONOS_GLTF.at("3.8"), sources::IEC_61966_2_1.whole()],
    shaders: &["shaders/scene/texture.glsl"],
    tests: &[
        "engine/src/scene/texture.rs::half_texels_and_wrap_modes_meet_at_borders",
        "tests/tests/twins/twin_texture.rs::look_ups_agree_with_their_twins",
    ],
    experiment: "tools/models",
    api: &["clerestory::scene::texture"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(wrap: Wrap, filter: Filter) -> Texture {
        Texture {
            image: 0,
            uv_set: 0,
            wrap: [wrap; 2],
            filter,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }
    }

    #[test]
    fn rows_go_on_as_their_mode_says() {
        let row = |mode| (-5..7).map(|i| wrap_texel(i, 3, mode)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
        assert_eq!(row(Wrap::MirroredRepeat), [1, 2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(row(Wrap::ClampToEdge), [0, 0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2]);
        for mode in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            for i in [i32::MIN, i32::MAX] {
                assert_eq!(wrap_texel(i, 1, mode), 0);
                assert!(wrap_texel(i, 65_535, mode) < 65_535);
            }
        }
    }

    #[test]
    fn half_texels_and_wrap_modes_meet_at_borders() {
        let image = Image {
            name: "ramp".into(),
            width: 2,
            height: 1,
            texels: vec![[0; 4], [255; 4]],
        };
        let at = |wrap, filter, u: f64| {
            sample_texture(&image, &texture(wrap, filter), false, [DVec2::new(u, 0.5), DVec2::ZERO]).w
        };
        // Centres show the texels, the middle their mean; the border between copies depends on the mode.
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            assert_eq!([0.25, 0.5, 0.75].map(|u| at(wrap, Filter::Linear, u)), [0.0, 0.5, 1.0]);
            assert_eq!(
                [0.0, 0.49, 0.5, 0.99].map(|u| at(wrap, Filter::Nearest, u)),
                [0.0, 0.0, 1.0, 1.0]
            );
        }
        assert_eq!(at(Wrap::Repeat, Filter::Linear, 1.0), 0.5);
        assert_eq!(at(Wrap::MirroredRepeat, Filter::Linear, 1.0), 1.0);
        assert_eq!(at(Wrap::ClampToEdge, Filter::Linear, -0.25), 0.0);
        assert_eq!(at(Wrap::Repeat, Filter::Nearest, -0.25), 1.0);
    }
}
