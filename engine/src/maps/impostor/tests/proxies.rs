//! Proxies and places of maps.

use glam::DVec3;

use super::super::places::{blended_maps, nearest_map};
use super::super::proxy::{box_proxy, hemisphere_proxy, mirrored, refracted, sphere_proxy};
use super::super::published::{BY_PROXIES, PROXY_RADII};
use super::*;

/// Mean error of directions to a proxy, and the largest.
fn by(sphere: &ShinySphere, distance: impl Fn(DVec3, DVec3) -> f64) -> [f64; 2] {
    let all = sphere.rays(SIDE, None).into_iter().map(|ray| {
        let d = distance(ray.origin, ray.direction);
        sphere.room.error(&ray, ray.origin + d * ray.direction)
    });
    let all = Errors(all.collect());
    [all.mean(), all.0.iter().copied().fold(0.0, f64::max)]
}

#[test]
fn a_box_is_exact_in_its_room() {
    for sphere in [ShinySphere::A, ShinySphere::B, ShinySphere::C] {
        let [_, most] = by(&sphere, |x, r| box_proxy(x, r, DVec3::NEG_ONE, DVec3::ONE));
        assert!(most < 1e-5, "{}: {most:e}°", sphere.name);
    }
}

#[test]
fn spheres_err_as_published() {
    for (sphere, published) in BY_PROXIES {
        for (radius, published) in PROXY_RADII.into_iter().zip(published) {
            let [mean, _] = by(&sphere, |x, r| sphere_proxy(x, r, radius));
            near(&format!("{}, radius {radius}", sphere.name), mean, published);
        }
    }
}

/// Rays that rise meet the hemisphere above them; all others are off, the more the flatter they are.
#[test]
fn a_hemisphere_is_exact_for_rays_that_rise() {
    let (x, up, radius) = (DVec3::new(0.4, 0.1, -0.3), DVec3::Y, 2.0);
    let d = hemisphere_proxy(x, up, radius);
    assert!(((x + d * up).length() - radius).abs() < 1e-12);
    let mut last = 0.0;
    for slant in [0.0, 0.2, 0.6, 1.5] {
        let r = DVec3::new(slant, 1.0, 0.0).normalize();
        let exact = sphere_proxy(x, r, radius);
        let error = (x + d * r).angle_between(x + exact * r);
        assert!(error >= last && (slant > 0.0) == (error > 1e-4), "{slant}: {error}");
        last = error;
    }
    // Far away it is the classical look-up.
    let r = DVec3::new(0.5, 0.7, 0.2).normalize();
    assert!((x + hemisphere_proxy(x, up, 1e9) * r).angle_between(r) < 1e-7);
}

#[test]
fn proxies_behind_a_ray_and_rays_along_walls_give_finite_distances() {
    let (low, high) = (DVec3::NEG_ONE, DVec3::ONE);
    assert_eq!(box_proxy(DVec3::new(0.0, 1.0, 0.0), DVec3::X, low, high), 1.0);
    assert_eq!(box_proxy(DVec3::new(3.0, 0.0, 0.0), DVec3::X, low, high), 0.0);
    assert_eq!(sphere_proxy(DVec3::new(3.0, 0.0, 0.0), DVec3::X, 1.0), 0.0);
    // A line that misses the sphere comes next to its middle.
    assert_eq!(sphere_proxy(DVec3::new(-2.0, 5.0, 0.0), DVec3::X, 1.0), 2.0);
    assert_eq!(hemisphere_proxy(DVec3::new(5.0, 0.0, 0.0), DVec3::Y, 1.0), 0.0);
    // On the sphere, inwards: a diameter.
    assert!((sphere_proxy(DVec3::new(1e5, 0.0, 0.0), DVec3::NEG_X, 1e5) - 2e5).abs() < 1e-6);
}

#[test]
fn all_light_is_reflected_where_none_is_refracted() {
    let n = DVec3::Y;
    let flat = DVec3::new(1.0, -0.3, 0.0).normalize();
    assert_eq!(refracted(flat, n, 1.5), mirrored(flat, n));
    // Into glass: Snell's law.
    let inside = refracted(flat, n, 1.0 / 1.5);
    assert!((inside.x * 1.5 - flat.x).abs() < 1e-12 && inside.y < 0.0 && (inside.length() - 1.0).abs() < 1e-12);
    assert!((refracted(flat, n, 1.0) - flat).length() < 1e-12);
}

const PLACES: [DVec3; 3] = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.2, 1.3, 0.0)];

/// Along a line over all borders: what a map shows is its number here.
#[test]
fn the_nearest_map_jumps_and_the_blend_does_not() {
    let steps = 4000;
    let (mut jump, mut most) = (0.0f64, 0.0f64);
    let mut last = None;
    for i in 0..=steps {
        let t = f64::from(i) / f64::from(steps);
        let point = DVec3::new(-0.4, -0.3, 0.2).lerp(DVec3::new(1.1, 1.5, 0.1), t);
        let blend = blended_maps(&PLACES, point).expect("places");
        assert!((0.0..=0.5 + 1e-12).contains(&blend.weight), "{blend:?}");
        let shown = f64::from(blend.maps[0]) * (1.0 - blend.weight) + f64::from(blend.maps[1]) * blend.weight;
        let nearest = f64::from(nearest_map(&PLACES, point).expect("places"));
        if let Some((before, of_nearest)) = last {
            most = most.max(f64::abs(shown - before));
            jump = jump.max(f64::abs(nearest - of_nearest));
        }
        last = Some((shown, nearest));
    }
    assert!(jump >= 1.0, "{jump}");
    // Four thousand steps over a change of two.
    assert!(most < 0.01, "{most}");
}

#[test]
fn places_that_are_none_are_refused() {
    assert!(blended_maps(&[], DVec3::ZERO).is_err());
    assert!(blended_maps(&[DVec3::ZERO; 17], DVec3::ZERO).is_err());
    assert!(blended_maps(&[DVec3::NAN], DVec3::ZERO).is_err());
    assert!(blended_maps(&PLACES, DVec3::INFINITY).is_err());
    // At a place there is its map alone; one place serves everything; two that coincide share nothing.
    let at = blended_maps(&PLACES, PLACES[1]).expect("places");
    assert_eq!((at.maps[0], at.weight), (1, 0.0));
    let one = blended_maps(&PLACES[..1], DVec3::ONE).expect("places");
    assert_eq!((one.maps, one.weight), ([0, 0], 0.0));
    let two = blended_maps(&PLACES[..2], DVec3::new(0.5, 3.0, 0.0)).expect("places");
    assert!((two.weight - 0.5).abs() < 1e-12);
    let same = blended_maps(&[DVec3::X, DVec3::X], DVec3::X).expect("places");
    assert_eq!(same.weight, 0.0);
}
