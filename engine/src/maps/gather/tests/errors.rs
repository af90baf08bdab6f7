//! Errors as published.

use super::*;
use crate::maps::Parametrization;
use crate::maps::irradiance::IrradianceSource;
use SolidAngleForm::{Disc, DiscWithNormals, Ratio};

/// RMS within a fifth, bias within six points.
#[track_caller]
fn near(what: &str, found: [f64; 2], published: [f64; 2]) {
    println!(
        "{what}: {:.2} % RMS, {:+.2} % bias, published {published:?}",
        found[0], found[1]
    );
    assert!(
        (found[0] - published[0]).abs() <= 0.2 * published[0],
        "{what}: {found:?}, published {published:?}"
    );
    assert!(
        (found[1] - published[1]).abs() <= 6.0,
        "{what}: {found:?}, published {published:?}"
    );
}

#[test]
fn the_map_at_its_place_errs_as_published() {
    let published = [[6.1, 0.5], [22.3, -17.2], [92.3, -46.4], [55.1, -22.2]];
    let (radiance, _) = LitRoom::PUBLISHED.maps(Parametrization::Cube, 64).expect("maps");
    let source = IrradianceSource::new(&radiance);
    for (place, published) in LitRoom::PLACES.into_iter().zip(published) {
        let points = sphere(place);
        let exact: Vec<f64> = points
            .iter()
            .map(|point| LitRoom::PUBLISHED.irradiance(point))
            .collect();
        let found: Vec<f64> = points
            .iter()
            .filter_map(|point| Some(source.irradiance(point.axis)?.x))
            .collect();
        near(
            &format!("map at its place, {place}"),
            relative_errors(&found, &exact),
            published,
        );
    }
}

/// The irradiance that all is judged by, against a fine sum over the walls.
#[test]
fn the_oracle_is_lamberts_cosine_summed_over_the_walls() {
    let room = LitRoom::PUBLISHED;
    let side = 400;
    for point in [sphere(LitRoom::PLACES[1])[37], sphere(LitRoom::PLACES[2])[222]] {
        let mut sum = 0.0;
        for i in 0..6 * side * side {
            let (wall, cell) = (i / (side * side), i % (side * side));
            let at = |k: i32| 2.0 * (f64::from(k) + 0.5) / f64::from(side) - 1.0;
            let axis = (wall / 2) as usize;
            let sign = if wall % 2 == 0 { 1.0 } else { -1.0 };
            let mut y = sign * DVec3::AXES[axis];
            y += at(cell % side) * DVec3::AXES[(axis + 1) % 3] + at(cell / side) * DVec3::AXES[(axis + 2) % 3];
            let v = y - point.position;
            let r = v.length();
            let cos_y = (v[axis] * sign / r).max(0.0);
            let cos_x = (point.axis.dot(v) / r).max(0.0);
            sum += room.radiance(y) * cos_x * cos_y / (r * r) * 4.0 / f64::from(side * side);
        }
        let exact = room.irradiance(&point);
        assert!((sum / exact - 1.0).abs() < 3e-3, "{sum} {exact}");
    }
}

#[test]
fn gathers_err_as_published() {
    let published: [(u32, SolidAngleForm, [[f64; 2]; 4]); 6] = [
        (2, Ratio, [[7.2, -2.6], [13.5, 1.2], [56.6, -5.0], [206.0, 107.0]]),
        (4, Ratio, [[3.1, 0.5], [14.5, 10.1], [42.0, -4.1], [202.0, 91.0]]),
        (8, Ratio, [[1.6, 0.4], [16.7, 11.5], [22.2, 1.9], [94.5, 70.0]]),
        (16, Ratio, [[1.4, 0.4], [17.0, 11.8], [14.8, 4.3], [94.5, 71.0]]),
        (4, Disc, [[3.2, -0.2], [8.2, 5.0], [51.9, -13.8], [58.5, 17.0]]),
        (16, Disc, [[1.4, 0.3], [16.3, 11.4], [15.8, 3.3], [90.4, 63.0]]),
    ];
    for (side, form, published) in published {
        let lights = LitRoom::PUBLISHED.printed_lights(side, form).expect("lights");
        for (place, published) in LitRoom::PLACES.into_iter().zip(published) {
            let found = irradiance_errors(&lights, &sphere(place));
            near(&format!("{form:?}, {side}² texels a face, {place}"), found, published);
        }
    }
}

/// With the walls' normals the error vanishes with more texels, without it stays; mean positions do no worse than mean distances. Of what was published of
/// more than 16² texels, 0.13 and 0.12 %, most is the error of the reference.
#[test]
fn normals_make_it_converge() {
    let points = sphere(LitRoom::PLACES[1]);
    let rms = |lights: crate::Result<GatherLights>| irradiance_errors(&lights.expect("lights"), &points)[0];
    let mut last = f64::INFINITY;
    for side in [16, 32, 64] {
        let plain = rms(LitRoom::PUBLISHED.lights(side, Disc));
        let printed = rms(LitRoom::PUBLISHED.printed_lights(side, DiscWithNormals));
        let with_normals = rms(LitRoom::PUBLISHED.lights(side, DiscWithNormals));
        println!(
            "{side}² texels a face: {plain:.2} % without normals, with them {with_normals:.4} % by positions, {printed:.4} % by distances"
        );
        assert!((plain - 16.0).abs() < 0.2 * 16.0, "{side}: {plain}");
        assert!(side > 16 || (printed - 0.6).abs() <= 0.2 * 0.6, "{side}: {printed}");
        assert!(
            with_normals < printed && with_normals < last / 3.0,
            "{side}: {with_normals}"
        );
        last = with_normals;
    }
}

/// Close to a wall and facing it: the middles of lights show as bright spots, means over cones do not.
#[test]
fn cones_leave_no_spots_at_a_wall() {
    let lights = LitRoom::EVEN.lights(4, Disc).expect("lights");
    let table = Reflectivity::new(1.0).expect("table");
    // Light is even, so that all that differs is where the lights' middles are.
    let points: Vec<GatherPoint> = (0..200)
        .map(|i| GatherPoint {
            position: DVec3::new(0.98, f64::from(i) / 125.0 - 0.8, 0.25),
            axis: DVec3::X,
        })
        .collect();
    let [middles, cones] = [Lobe::Middles(1.0), Lobe::Cones(&table)].map(|lobe| {
        let all = points.iter().map(|point| lights.gather(point, lobe, Terms::All).x);
        all.fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(x), high.max(x)))
    });
    println!("along a wall, exactly 1: {middles:?} by middles, {cones:?} over cones");
    assert!(middles.1 > 1.5 && cones.1 < 1.1, "{middles:?} {cones:?}");
    assert!(
        cones.1 - cones.0 < 0.5 * (middles.1 - middles.0),
        "{middles:?} {cones:?}"
    );
}

/// Five terms of a lobe of exponent 10, 4² texels a face, in the middle and near the patch: much of the energy is lost as printed, little of it scaled; of 8² texels
/// more is lost, and five say less of the rest.
#[test]
fn five_terms_keep_the_energy() {
    let [coarse, finer] = [4, 8].map(|side| LitRoom::PUBLISHED.printed_lights(side, Disc).expect("lights"));
    for place in [DVec3::ZERO, DVec3::new(0.5, -0.3, 0.3)] {
        let points = LitRoom::points(place, 100);
        let exact = LitRoom::PUBLISHED.glossy(&points, 10.0, 48);
        let errors = |lights: &GatherLights, terms: Terms| {
            let values: Vec<f64> = points
                .iter()
                .map(|point| lights.gather(point, Lobe::Middles(10.0), terms).x)
                .collect();
            relative_errors(&values, &exact)
        };
        let [all, scaled, printed] = [Terms::All, Terms::Five, Terms::FiveUnscaled].map(|terms| errors(&coarse, terms));
        println!("{place}: all {all:?}, five {scaled:?}, as printed {printed:?}");
        assert!(scaled[1].abs() < 10.0, "{scaled:?}");
        assert!(printed[1] < -10.0, "{printed:?}");
        let [more_scaled, more] = [Terms::Five, Terms::FiveUnscaled].map(|terms| errors(&finer, terms));
        println!("{place}, 8²: five {more_scaled:?}, as printed {more:?}");
        assert!(more[1] < printed[1] - 20.0, "{printed:?} {more:?}");
        // Near the patch, which is within five texels, it is the coarse texels that err.
        assert!(
            more_scaled[0] > scaled[0] || place != DVec3::ZERO,
            "{scaled:?} {more_scaled:?}"
        );
    }
}
