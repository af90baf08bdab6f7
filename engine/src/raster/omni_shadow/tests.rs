//! What texels span, and that planes do not shade themselves.

use super::*;
use crate::test_random::Random;

/// Squares as large as texels, by the texels' exact solid angles.
#[test]
fn radii_are_those_of_texels() {
    for layout in ShadowLayout::ALL {
        let (map, side) = (layout.map(), 64);
        let size = UVec2::splat(side);
        for texel in map.texels(size) {
            let centre = map.texel_direction(size, texel).expect("direction");
            let exact = (0.5 * map.texel_solid_angle(size, texel)).sqrt();
            let share = shadow_texel_radius(layout, centre, side) / exact;
            // The density at the centre: second order but at the octahedron's vertices, where it has a kink.
            assert!((share - 1.0).abs() < 0.02, "{} {texel:?}: {share}", layout.name());
        }
    }
}

/// A plane never shades itself: in any direction it is no nearer than the threshold, and what it hides is.
#[test]
fn planes_do_not_shade_themselves() {
    let mut random = Random(7);
    for layout in ShadowLayout::ALL {
        for width in [0, 1, 3] {
            for _ in 0..4000 {
                let side = random.choose(&[8, 64, 1024]);
                let normal = random.direction().as_dvec3().normalize();
                let light = 10f64.powf(3.0 * f64::from(random.signed())) * random.direction().as_dvec3();
                // Down to grazing: the light is close above the plane now and then.
                let along = normal.any_orthonormal_vector() * 10f64.powf(2.0 * f64::from(random.signed()));
                let height = light.length() * random.choose(&[1e-3, 0.3, 1.0]);
                let position = light + along - height * normal;
                let r = shadow_receiver(layout, side, width, light, [position, normal], 0.0);
                let direction = random.direction().as_dvec3().normalize();
                let fall = -normal.dot(direction);
                let seen = if fall > 0.0 { height / fall } else { f64::INFINITY };
                let threshold = shadow_threshold(&r, direction);
                assert!(seen >= threshold, "{layout:?} {side} {width}: {seen} {r:?}");
                // Towards the place itself: no less than seven eighths of the way counts.
                let straight = shadow_threshold(&r, (position - light).normalize());
                assert!(
                    (0.874..1.0).contains(&(straight / r.distance)),
                    "{straight} of {}",
                    r.distance
                );
            }
        }
    }
}

/// Nor where rounding has taken the position off the plane: however close the light is above it, on whichever side of it the position lies.
#[test]
fn planes_do_not_shade_themselves_where_positions_are_rounded() {
    let mut random = Random(8);
    let mut shaded = 0;
    for layout in ShadowLayout::ALL {
        for width in [0, 1, 3] {
            for _ in 0..4000 {
                let side = random.choose(&[8, 64, 1024]);
                let normal = random.direction().as_dvec3().normalize();
                let light = random.direction().as_dvec3();
                let slack = 10f64.powf(-4.0 + 2.0 * f64::from(random.signed()));
                let height = slack * 10f64.powf(1.5 * f64::from(random.signed()));
                let along = normal.any_orthonormal_vector() * 10f64.powf(f64::from(random.signed()));
                let exact = light + along - height * normal;
                let position = (exact + slack * f64::from(random.signed()) * normal)
                    .as_vec3()
                    .as_dvec3();
                let slack = slack.max(normal.dot(position - exact).abs());
                let r = shadow_receiver(layout, side, width, light, [position, normal], slack);
                for _ in 0..8 {
                    let direction = random.direction().as_dvec3();
                    let fall = -normal.dot(direction);
                    let seen = if fall > 0.0 { height / fall } else { f64::INFINITY };
                    let threshold = shadow_threshold(&r, direction);
                    assert!(
                        seen >= threshold,
                        "{layout:?} {side} {width}: {seen} {threshold} {slack} {r:?}"
                    );
                    // A plane that is moved by no more than a share of the light's height, for rounding as well as for folds.
                    let least = (1.0 - f64::from(SHADOW_MOVE_MAX)) * -r.normal.dot(position - light);
                    let capped = ShadowReceiver { height: least, ..r };
                    shaded += usize::from(seen < shadow_threshold(&capped, direction));
                }
            }
        }
    }
    assert!(shaded > 0, "the cap on rounding, too, would do");
}

#[test]
fn filters_that_are_too_wide_are_refused() {
    for (width, side, is_fine) in [
        (0, 1, true),
        (1, 1, true),
        (2, 1, false),
        (SHADOW_WIDTH_MAX, 64, true),
        (SHADOW_WIDTH_MAX + 1, 64, false),
        (u32::MAX, u32::MAX, false),
    ] {
        assert_eq!(check_width(width, side).is_ok(), is_fine, "{width} of {side}");
    }
    let found: Vec<_> = (0..4).map(filter_iterations).collect();
    // Rows, and the texels of each.
    assert_eq!(found, [0, 2 + 4, 3 + 9, 4 + 16]);
}

#[test]
fn sides_have_the_texels_asked_for() {
    assert_eq!(ShadowLayout::Cube.side_for(6 * 128 * 128), 128);
    assert_eq!(ShadowLayout::Octahedron.side_for(256 * 256), 256);
    assert_eq!(ShadowLayout::Octahedron.side_for(6 * 128 * 128), 314);
    assert_eq!(ShadowLayout::Cube.side_for(1), 2);
}
