//! What texels span, and that planes do not shade themselves.

use super::*;
use crate::test_random::Random;

/// The longest way from a texel's centre to a corner, radians.
fn farthest_corner(layout: ShadowLayout, side: u32, texel: Texel) -> f64 {
    let (map, size) = (layout.map(), UVec2::splat(side));
    let [low, high] = texel.bounds(size);
    let centre = map.texel_direction(size, texel).expect("direction");
    let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)];
    corners
        .iter()
        .filter_map(|uv| {
            map.decode(MapPoint {
                layer: texel.layer,
                uv: *uv,
            })
        })
        .map(|corner| corner.angle_between(centre))
        .fold(0.0, f64::max)
}

/// Texels on a fold of the octahedron span two octants; the others differ by curvature alone.
#[test]
fn radii_are_those_of_texels() {
    for layout in ShadowLayout::ALL {
        let side = 64;
        let size = UVec2::splat(side);
        let mut worst = [f64::INFINITY, 0.0f64];
        for texel in layout.map().texels(size) {
            let at = [texel.x, texel.y].map(|x| (2 * x + 1) as i32 - side as i32);
            let on_fold = at[0].abs() + at[1].abs() == side as i32;
            if layout == ShadowLayout::Octahedron && on_fold {
                continue;
            }
            let centre = layout.map().texel_direction(size, texel).expect("direction");
            let share = shadow_texel_radius(layout, centre, side) / farthest_corner(layout, side, texel);
            worst = [worst[0].min(share), worst[1].max(share)];
        }
        // Second order in 1/side over a first-order bound: 2/side.
        assert!(worst[0] > 0.96 && worst[1] < 1.04, "{}: {worst:?}", layout.name());
    }
}

/// A plane never shades itself: along any texel within the span it is no nearer than the threshold.
#[test]
fn planes_do_not_shade_themselves() {
    let mut random = Random(7);
    for layout in ShadowLayout::ALL {
        for width in [0, 1, 3] {
            for _ in 0..4000 {
                let side = random.choose(&[8, 64, 1024]);
                let any = f64::from(random.signed());
                let normal = random.direction().as_dvec3();
                let light = 10f64.powf(3.0 * f64::from(random.signed())) * random.direction().as_dvec3();
                // Down to grazing: the place lies in a plane, the light close above it now and then.
                let along = normal.any_orthonormal_vector() * 10f64.powf(2.0 * f64::from(random.signed()));
                let height = light.length() * random.choose(&[1e-3, 0.3, 1.0]);
                let position = light + along - height * normal;
                let r = shadow_receiver(layout, side, width, light, [position, normal], 0.0);
                let ahead = r.to.normalize();
                let span = shadow_span(layout, position - light, side, width);
                let aside = ahead.cross(random.direction().as_dvec3()).normalize_or_zero();
                let direction = (ahead + (span * random.choose(&[any, 1.0, -1.0])).tan() * aside).normalize();
                let fall = -normal.dot(direction);
                let seen = if fall > 0.0 { height / fall } else { f64::INFINITY };
                assert!(
                    seen >= shadow_threshold(&r, direction),
                    "{layout:?} {side} {width}: {seen} {r:?}"
                );
            }
        }
    }
}

#[test]
fn sides_have_the_texels_asked_for() {
    assert_eq!(ShadowLayout::Cube.side_for(6 * 128 * 128), 128);
    assert_eq!(ShadowLayout::Octahedron.side_for(256 * 256), 256);
    assert_eq!(ShadowLayout::Octahedron.side_for(6 * 128 * 128), 314);
    assert_eq!(ShadowLayout::Cube.side_for(1), 2);
}
