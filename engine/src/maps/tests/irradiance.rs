//! Irradiance gathered from maps: solid angles and directions together, against closed forms.

use super::super::*;
use super::directions;
use std::f64::consts::PI;

/// ∫ L(ω) max(0, n·ω) dω over the texels, by their centres.
fn irradiance(map: Parametrization, n: u32, normal: DVec3, radiance: impl Fn(DVec3) -> f64) -> f64 {
    let size = UVec2::new(n * map.aspect(), n);
    let part = |texel: Texel| {
        let d = map.texel_direction(size, texel)?;
        Some(radiance(d) * normal.dot(d).max(0.0) * map.texel_solid_angle(size, texel))
    };
    map.texels(size).filter_map(part).sum()
}

#[test]
fn constant_radiance_gives_pi_for_every_normal() {
    for map in [
        Parametrization::OctahedronQuadratic,
        Parametrization::OctahedronRectangular,
        Parametrization::EqualArea,
        Parametrization::Cube,
        Parametrization::LatLong,
    ] {
        let mut worst = 0.0f64;
        for normal in directions(12, 4).into_iter().skip(40).step_by(3) {
            worst = worst.max((irradiance(map, 320, normal, |_| 1.0) - PI).abs());
        }
        println!("{map}: {worst:.2e}");
        assert!(worst < 1e-4, "{map}: {worst}");
    }
}

#[test]
fn a_sky_that_fades_to_the_horizon_gives_two_thirds_of_pi() {
    for map in Parametrization::ALL.into_iter().filter(|map| !map.is_disc()) {
        let found = irradiance(map, 128, DVec3::Z, |d| d.z.max(0.0));
        // Midpoints of smooth functions: second order in the texel.
        assert!((found - 2.0 * PI / 3.0).abs() < 3e-4, "{map}: {found}");
    }
}

/// The integral over the sphere, of texels that are as different as can be.
#[test]
fn mips_keep_the_integral_and_plain_means_do_not() {
    let value = |texel: Texel| f64::from((texel.x * 7 + texel.y * 13 + texel.layer * 5) % 11);
    for map in Parametrization::ALL {
        let fine = UVec2::new(16 * map.aspect(), 16);
        let exact: f64 = map
            .texels(fine)
            .map(|t| value(t) * map.texel_solid_angle(fine, t))
            .sum();
        let (mut kept, mut plain) = (0.0, 0.0);
        for coarse in map.texels(fine / 2) {
            let solid_angle = map.texel_solid_angle(fine / 2, coarse);
            for tap in map.children(fine, coarse) {
                kept += solid_angle * tap.weight * value(tap.texel);
                plain += solid_angle * 0.25 * value(tap.texel);
            }
        }
        assert!((kept - exact).abs() < 1e-10, "{map}: {kept} {exact}");
        let even = map == Parametrization::EqualArea;
        assert!(even || (plain - exact).abs() > 1e-4, "{map}: {plain} {exact}");
    }
}
