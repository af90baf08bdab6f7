//! Irradiance under maps: solid angles, directions and the horizon together, against closed forms.

use super::super::irradiance::*;
use super::super::*;
use super::{angle, directions};
use glam::Vec3;
use std::f64::consts::PI;

/// Maps of the whole sphere.
fn whole() -> impl Iterator<Item = Parametrization> {
    Parametrization::ALL
        .into_iter()
        .filter(|map| *map != Parametrization::Nusselt)
}

fn image(map: Parametrization, rows: u32, radiance: impl Fn(DVec3) -> f64 + Sync) -> MapImage {
    let size = UVec2::new(rows * map.aspect(), rows);
    MapImage::from_fn(map, size, |texel| {
        // Of a texel whose centre is outside its disc, the point next to the disc's middle.
        let [lower, upper] = texel.bounds(size);
        let uv = DVec2::splat(0.5).clamp(lower, upper);
        let layer = texel.layer;
        let d = map
            .texel_direction(size, texel)
            .or_else(|| map.decode(MapPoint { layer, uv }));
        DVec3::splat(d.map_or(0.0, &radiance))
    })
    .unwrap()
}

#[test]
fn constant_radiance_gives_pi_for_every_normal() {
    for map in whole() {
        let source = IrradianceSource::new(&image(map, 32, |_| 1.0));
        let mut worst = 0.0f64;
        for normal in directions(12, 200) {
            worst = worst.max((source.irradiance(3.0 * normal).unwrap().x - PI).abs());
        }
        println!("{map}: {worst:.2e}");
        // At the rim of the sphere map texels are ever longer, and their parts with them.
        let bound = if map == Parametrization::Sphere { 1e-3 } else { 1e-4 };
        assert!(worst < bound, "{map}: {worst}");
    }
    // Of a hemisphere, where the normal is its axis.
    let nusselt = image(Parametrization::Nusselt, 32, |_| 1.0);
    let found = irradiance(&nusselt, DVec3::Z).unwrap().x;
    // At the rim, a part of 1/512 wide, heights are off by as much as they are.
    assert!((found - PI).abs() < 4.0 * PI / 512.0, "{found}");
    assert!(irradiance(&nusselt, DVec3::ZERO).is_err());
}

#[test]
fn a_sky_that_fades_to_the_horizon_gives_two_thirds_of_pi() {
    for map in whole() {
        // ∫ over both half spaces at an angle γ: ⅔ ((π − γ) cos γ + sin γ), which is 2π/3 for an upward normal.
        let source = IrradianceSource::new(&image(map, 96, |d| d.z.max(0.0)));
        for degrees in [0.0f64, 30.0, 60.0, 90.0, 135.0, 180.0] {
            let gamma = degrees.to_radians();
            let expected = 2.0 / 3.0 * ((PI - gamma) * gamma.cos() + gamma.sin());
            let normal = DVec3::new(0.6 * gamma.sin(), 0.8 * gamma.sin(), gamma.cos());
            let found = source.irradiance(normal).unwrap().x;
            // Texels hold the sky at their centres: second order in their size, π/96 and more.
            assert!((found - expected).abs() < 1e-3, "{map}, {degrees}°: {found} {expected}");
        }
        assert!((source.irradiance(DVec3::Z).unwrap().x - 2.0944).abs() < 1e-3, "{map}");
    }
}

/// ½ Σ of the angles of a polygon's sides times the normals of their planes: ∫ ω dω (Lambert).
fn moment(corners: &[DVec3]) -> DVec3 {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let all: DVec3 = sides
        .map(|(a, b)| a.cross(*b).normalize() * angle(a.normalize(), b.normalize()))
        .sum();
    0.5 * all
}

/// A sun of one texel, whose sides are arcs of great circles.
#[test]
fn a_sun_of_one_texel_is_lamberts_polygon() {
    for (map, rows) in [
        (Parametrization::Cube, 5),
        (Parametrization::Cube, 32),
        (Parametrization::OctahedronQuadratic, 32),
        (Parametrization::OctahedronRectangular, 32),
        (Parametrization::OctahedronPerspective { c: 0.5 }, 32),
    ] {
        let size = UVec2::new(rows * map.aspect(), rows);
        for (x, y) in [(1, 1), (0, 3), (3, 2)] {
            let texel = Texel { layer: 0, x, y };
            let mut texels = vec![Vec3::ZERO; (size.element_product() * map.layers()) as usize];
            texels[(y * size.x + x) as usize] = Vec3::new(1e3, 2e3, 5e3);
            let sun = IrradianceSource::new(&MapImage::new(map, size, texels).unwrap());
            let [lower, upper] = texel.bounds(size);
            let at = |uv: DVec2| map.decode(MapPoint { layer: 0, uv }).unwrap();
            let corners = [lower, DVec2::new(upper.x, lower.y), upper, DVec2::new(lower.x, upper.y)].map(at);
            let exact = moment(&corners);
            let exact = exact * exact.dot(at(0.5 * (lower + upper))).signum();
            // A fold goes through some texels of the octahedra: those are two triangles.
            let p = (2.0 * texel.centre(size).uv - 1.0).abs();
            if matches!(map, Parametrization::OctahedronQuadratic) && (p.x + p.y - 1.0).abs() < 1e-9 {
                continue;
            }
            let n = at(0.5 * (lower + upper));
            for normal in [n, (n + 0.7 * n.any_orthonormal_vector()).normalize()] {
                let found = sun.irradiance(normal).unwrap();
                let expected = normal.dot(exact);
                // A twelfth of the solid angle of a 256th of the texel, or of 1.2·10⁻⁴ sr, times half of the shear and its inverse; and some
                // times as much for normals at a slant, since where the density changes middles are not centroids.
                let bound = 8.0 * (map.texel_solid_angle(size, texel) / 256.0).max(1.2e-4) / 12.0;
                assert!(
                    (found.x / (1e3 * expected) - 1.0).abs() < bound,
                    "{map} {texel:?} {normal}: {found} {expected}"
                );
                assert!((found.y / found.x - 2.0).abs() < 1e-12 && (found.z / found.x - 5.0).abs() < 1e-12);
            }
            assert_eq!(sun.irradiance(-n).unwrap(), DVec3::ZERO, "{map} {texel:?}");
        }
    }
}

/// The map over normals is what single ones say, and lights from below do not reach surfaces that face up.
#[test]
fn maps_of_irradiance_hold_it_for_every_normal() {
    let light = image(Parametrization::LatLong, 16, |d| if d.z < -0.5 { 4.0 } else { 0.0 });
    let map = Parametrization::OctahedronQuadratic;
    let size = UVec2::splat(8);
    let all = irradiance_map(&light, map, size).unwrap();
    for texel in map.texels(size) {
        let normal = map.texel_direction(size, texel).unwrap();
        let one = irradiance(&light, normal).unwrap().as_vec3();
        assert_eq!(all.at(texel), one, "{texel:?}");
    }
    assert_eq!(irradiance(&light, DVec3::Z).unwrap(), DVec3::ZERO);
    // A cap of half angle 60°: π sin².
    let found = irradiance(&light, DVec3::NEG_Z).unwrap().x;
    // Rows of 11° have their edge a third of a row away from that of the cap.
    assert!((found / (4.0 * PI * 0.75) - 1.0).abs() < 0.1, "{found}");
    assert!(irradiance_map(&light, map, UVec2::ZERO).is_err());
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
