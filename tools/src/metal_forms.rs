//! Errors of the forms of a metal's Fresnel factor beside the exact one, and spheres that show one form above another.

use clerestory::film::png::Rgb8;
use clerestory::scene::FresnelForm;
use clerestory::srgb::srgb_byte;
use clerestory::transport::fresnel::compensated::rule;
use clerestory::transport::fresnel::form::MetalFresnel;
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory::transport::fresnel::rescaled::fresnel_rescaled;
use clerestory::transport::ggx::{ggx_d, ggx_g2};
use glam::{DVec2, DVec3};

/// The cosines that errors are taken over: even steps from 0 to 1, both included.
pub const STEPS: u32 = 20_000;

/// Cosines from 0 to 1 in so many even steps, both included.
pub fn cosines(steps: u32) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |i| f64::from(i) / f64::from(steps))
}

/// A way to evaluate a band of a metal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// A form that scenes can name.
    Form(FresnelForm),
    /// The compensated curve by the published rule, as it was printed: without a guard.
    PrintedRule,
}

impl Way {
    /// All but the exact one.
    pub const ALL: [Self; 8] = [
        Self::Form(FresnelForm::Schlick),
        Self::Form(FresnelForm::Rescaled),
        Self::PrintedRule,
        Self::Form(FresnelForm::Compensated),
        Self::Form(FresnelForm::F82Tint),
        Self::Form(FresnelForm::Hoffman),
        Self::Form(FresnelForm::Simplified),
        Self::Form(FresnelForm::Table),
    ];

    /// What tables call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Form(form) => form.name(),
            Self::PrintedRule => "compensated, printed rule",
        }
    }

    /// Reflectance by the cosine of incidence, for n and k.
    pub fn curve(self, n: f64, k: f64) -> Box<dyn Fn(f64) -> f64> {
        let (eta, extinction) = (DVec3::splat(n), DVec3::splat(k));
        match self {
            Self::Form(form) => {
                let fresnel = MetalFresnel::new(form, eta, extinction);
                Box::new(move |c| fresnel.at(c).x)
            }
            Self::PrintedRule => {
                let term = rule(n, k);
                Box::new(move |c| fresnel_rescaled(c, eta, extinction).x - term.term(c))
            }
        }
    }
}

/// By how much a way is off for one n and k.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct FormError {
    /// Greatest relative error.
    pub worst: f64,
    /// The cosine of incidence where it is.
    pub at: f64,
    /// Mean relative error over even cosines.
    pub mean: f64,
    /// Greatest absolute error.
    pub absolute: f64,
}

impl FormError {
    /// Over so many even steps of the cosine.
    pub fn of(way: Way, n: f64, k: f64, steps: u32) -> Self {
        let curve = way.curve(n, k);
        let mut found = Self::default();
        for c in cosines(steps) {
            let exact = fresnel_conductor(c, DVec3::splat(n), DVec3::splat(k)).x;
            let error = (curve(c) - exact).abs();
            let relative = error / exact;
            if relative > found.worst {
                (found.worst, found.at) = (relative, c);
            }
            found.absolute = found.absolute.max(error);
            found.mean += relative / f64::from(steps + 1);
        }
        found
    }
}

/// GGX width of the spheres' highlights.
const SPHERE_ALPHA: f64 = 0.3;

/// A sphere of a metal seen from afar under one light from afar, whose direction is twice `degrees` from the viewer's, so that all microfacets that
/// reflect are met at this angle: above the middle by the exact factor, below it by another form. Radiance is scaled so that a perfect mirror's highlight
/// is white at its brightest.
pub fn split_sphere(exact: &MetalFresnel, below: &MetalFresnel, degrees: f64, side: u32) -> Vec<DVec3> {
    let c = degrees.to_radians().cos();
    split_part([exact, below].map(|fresnel| fresnel.at(c)), degrees, Part::WHOLE, side)
}

/// The seam of a split sphere from close by, where the light's edge of the sphere meets the middle. Below the middle the difference between the forms is so many times
/// what it is.
pub fn seam(exact: &MetalFresnel, below: &MetalFresnel, degrees: f64, times: f64, side: u32) -> Vec<DVec3> {
    let c = degrees.to_radians().cos();
    let [upper, lower] = [exact, below].map(|fresnel| fresnel.at(c));
    let magnified = (upper + times * (lower - upper)).max(DVec3::ZERO);
    split_part([upper, magnified], degrees, Part::SEAM, side)
}

/// A square part of the view of a sphere of radius 1.
#[derive(Debug, Clone, Copy)]
struct Part {
    middle: DVec2,
    half_width: f64,
}

impl Part {
    const WHOLE: Self = Self {
        middle: DVec2::ZERO,
        half_width: 1.0,
    };
    /// All that is lit at the middle of spheres from 70° of incidence on: what lies beyond the cosine of 40°.
    const SEAM: Self = Self {
        middle: DVec2::new(0.875, 0.0),
        half_width: 0.125,
    };
}

/// Of a part of the sphere, by the factors above and below the middle.
fn split_part([upper, lower]: [DVec3; 2], degrees: f64, part: Part, side: u32) -> Vec<DVec3> {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    // The viewer is at z; the light is to its right.
    let light = DVec3::new(2.0 * sine * cosine, 0.0, cosine * cosine - sine * sine);
    let half = DVec3::new(sine, 0.0, cosine);
    let shape = |n: DVec3| {
        let (cos_i, cos_o) = (n.dot(light), n.z);
        if cos_i <= 0.0 || cos_o <= 0.0 {
            return 0.0;
        }
        let across = half - n * n.dot(half);
        // The half vector in the frame of the normal.
        let local = DVec3::new(across.length(), 0.0, n.dot(half));
        ggx_d(local, SPHERE_ALPHA) * ggx_g2(cos_o, cos_i, SPHERE_ALPHA, false) / (4.0 * cos_o)
    };
    let size = f64::from(side);
    let at = |i: u32| {
        let across = 2.0 * (f64::from(i % side) + 0.5) / size - 1.0;
        let up = 1.0 - 2.0 * (f64::from(i / side) + 0.5) / size;
        let DVec2 { x, y } = part.middle + part.half_width * DVec2::new(across, up);
        let z2 = 1.0 - x * x - y * y;
        if z2 <= 0.0 {
            return (0.0, y);
        }
        (shape(DVec3::new(x, y, z2.sqrt())), y)
    };
    let points: Vec<(f64, f64)> = (0..side * side).map(at).collect();
    let brightest = points
        .iter()
        .fold(0.0, |most: f64, (s, _)| most.max(*s))
        .max(f64::MIN_POSITIVE);
    points
        .into_iter()
        .map(|(s, y)| if y > 0.0 { upper } else { lower } * (s / brightest))
        .collect()
}

/// Pictures of linear RGB of one size beside and below each other, in sRGB.
pub fn sheet(pictures: &[Vec<DVec3>], side: u32, columns: u32) -> Rgb8 {
    let rows = (pictures.len() as u32).div_ceil(columns);
    let (width, height) = (columns * side, rows * side);
    let mut bytes = vec![0; (width * height * 3) as usize];
    for (place, picture) in (0..).zip(pictures) {
        let (left, top) = (place % columns * side, place / columns * side);
        for (i, texel) in (0..).zip(picture) {
            let at = ((top + i / side) * width + left + i % side) as usize * 3;
            for (byte, linear) in bytes[at..at + 3].iter_mut().zip(texel.to_array()) {
                *byte = srgb_byte(linear);
            }
        }
    }
    Rgb8 { width, height, bytes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_curve() {
        // Aluminium at 700 nm.
        let found = FormError::of(Way::Form(FresnelForm::Rescaled), 1.9214, 8.1420, STEPS);
        assert!(
            (found.worst - 0.185).abs() < 5e-4 && (found.at - 0.103).abs() < 1e-3,
            "{found:?}"
        );
        assert!(
            (found.mean - 0.0528).abs() < 5e-4 && (found.absolute - 0.1495).abs() < 1e-4,
            "{found:?}"
        );
        // Gold at 550 nm, whose printed term is infinite at normal incidence.
        let printed = FormError::of(Way::PrintedRule, 0.4241, 2.4721, STEPS);
        assert!(printed.worst.is_infinite() && printed.at == 1.0, "{printed:?}");
    }

    /// All that is lit of the whole sphere's middle rows, of the same brightness, with the step between the halves as large as it is said to be.
    #[test]
    fn a_seam_is_the_spheres_from_close_by() {
        let (eta, k) = (DVec3::new(1.92, 1.02, 0.59), DVec3::new(8.14, 6.63, 5.27));
        let [exact, rescaled] = [FresnelForm::Exact, FresnelForm::Rescaled].map(|form| MetalFresnel::new(form, eta, k));
        let side = 64;
        for degrees in [80.0, 75.0, 70.0] {
            let c = f64::to_radians(degrees).cos();
            let (upper, lower) = (exact.at(c), rescaled.at(c));
            let pictures = [1.0, 2.0].map(|times| seam(&exact, &rescaled, degrees, times, side));
            let lit = |picture: &[DVec3]| picture.iter().filter(|texel| texel.x > 0.0).count();
            assert!(lit(&pictures[0]) > 100, "{degrees}");
            for (times, picture) in [1.0, 2.0].into_iter().zip(&pictures) {
                let row = |row: u32| &picture[(row * side) as usize..((row + 1) * side) as usize];
                // On both sides of the middle, a row each.
                for (above, below) in row(side / 2 - 1).iter().zip(row(side / 2)) {
                    let expected = *above * (1.0 + times * (lower - upper) / upper);
                    assert!(
                        (*below - expected).abs().max_element() < 1e-9,
                        "{degrees}, {times}: {above} {below}"
                    );
                }
            }
            // The brightest place of the whole is among what is seen, and nothing of its middle row is left out.
            let most = pictures[0].iter().fold(DVec3::ZERO, |most, texel| most.max(*texel));
            let brightest = upper.max(lower);
            assert!(
                (most - brightest).abs().max_element() < 1e-9,
                "{degrees}: {most} {brightest}"
            );
            let whole = split_sphere(&exact, &rescaled, degrees, 1024);
            let middle = &whole[512 * 1024..513 * 1024];
            let first = middle.iter().position(|texel| texel.x > 0.0).expect("light");
            assert!(first as f64 >= 1024.0 * 0.875, "{degrees}: {first}");
        }
    }

    #[test]
    fn halves_of_a_sphere_have_the_ratio_of_their_factors() {
        let (eta, k) = (DVec3::new(1.92, 1.02, 0.59), DVec3::new(8.14, 6.63, 5.27));
        let [exact, rescaled] = [FresnelForm::Exact, FresnelForm::Rescaled].map(|form| MetalFresnel::new(form, eta, k));
        let side = 32;
        for degrees in [90.0, 85.0, 50.0] {
            let sphere = split_sphere(&exact, &rescaled, degrees, side);
            let c = f64::to_radians(degrees).cos();
            for (i, upper) in sphere.iter().take((side * side / 2) as usize).enumerate() {
                let (row, column) = (i as u32 / side, i as u32 % side);
                let lower = sphere[((side - 1 - row) * side + column) as usize];
                let expected = *upper * rescaled.at(c) / exact.at(c);
                assert!(
                    (lower - expected).abs().max_element() < 1e-9,
                    "{degrees}: {upper} {lower}"
                );
            }
        }
        let one = sheet(&[vec![DVec3::ONE; 4], vec![DVec3::ZERO; 4]], 2, 2);
        assert_eq!((one.width, one.height, one.bytes[0], one.bytes[6]), (4, 2, 255, 0));
    }
}
