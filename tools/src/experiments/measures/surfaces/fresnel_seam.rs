//! A sphere of aluminium, exact above and approximate below: the step between the halves, and how much of the sphere is lit.
//!
//! In double precision, and by the device in the forms that scenes have, from numbers that the host prepares. Oracle: the exact factor, and the steps that were published. Far light and viewer have one half vector, so that all that reflects is met at one angle.

use std::f64::consts::PI;

use clerestory::Result;
use clerestory::scene::{ConductorIor, FresnelForm, metals};
use clerestory::transport::fresnel::curve::{CurveForm, FresnelCurve};
use clerestory::transport::fresnel::form::MetalFresnel;
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{seam, sheet, split_sphere};

/// Wavelengths of red, green and blue, nm.
const WAVELENGTHS: [f64; 3] = [700.0, 550.0, 435.0];
/// Pixels along a side of a sphere's picture.
const SIDE: u32 = 160;
const PICTURES: [&str; 2] = ["rescaled.png", "compensated.png"];
/// Close-ups of the seam: the file, angles of incidence in degrees, and how many times the difference between the halves is shown.
const CLOSE_UPS: &str = "close-ups.png";
const CLOSE_ANGLES: [f64; 3] = [80.0, 75.0, 70.0];
const MAGNIFIED: [f64; 2] = [1.0, 2.0];

/// Degrees of incidence, and by how much the rescaled curve was published to be above the exact one.
const PUBLISHED: [(f64, [f64; 3]); 9] = [
    (90.0, [0.0, 0.0, 0.0]),
    (85.0, [0.1482, 0.0910, 0.0543]),
    (80.0, [0.1250, 0.0882, 0.0612]),
    (75.0, [0.0849, 0.0639, 0.0483]),
    (70.0, [0.0550, 0.0427, 0.0339]),
    (65.0, [0.0350, 0.0277, 0.0227]),
    (60.0, [0.0221, 0.0177, 0.0148]),
    (55.0, [0.0138, 0.0111, 0.0094]),
    (50.0, [0.0085, 0.0069, 0.0059]),
];

rows! {
    /// A band at an angle.
    struct Row = "Steps between the halves of an aluminium sphere" by [angle, band] {
        angle: f64 = "angle of incidence (°)",
        band: String = "band",
        exact: f64 = "exact",
        step: f64 = "step of the rescaled curve",
        published: f64 = "published step",
        share: f64 = "step of the rescaled curve (%)",
        left: f64 = "step of the compensated curve",
        on_device: f64 = "step of the rescaled curve on the device",
        left_on_device: f64 = "step of the compensated curve on the device",
        lit: f64 = "lit pixels of a sphere 256 pixels wide",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "steps of the rescaled curve are the published ones: their difference",
        Bound::AtMost(1e-3),
        |row: &Row| (row.step - row.published).abs().into(),
    )
    .in_every_form(),
    Criterion::each(
        "the compensated curve leaves no seam: its step",
        Bound::AtMost(0.02),
        |row: &Row| row.left.abs().into(),
    )
    .because("a fiftieth of white, which the eye finds at an edge in good light alone")
    .in_every_form(),
    Criterion::each(
        "on the device steps of the rescaled curve are the published ones: their difference",
        Bound::AtMost(1e-3),
        |row: &Row| (row.on_device - row.published).abs().into(),
    )
    .in_every_form(),
    Criterion::each(
        "on the device the compensated curve leaves no seam: its step",
        Bound::AtMost(0.02),
        |row: &Row| row.left_on_device.abs().into(),
    )
    .in_every_form(),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let Some(spectrum) = metals::spectrum("aluminium") else {
            return Ok(Vec::new());
        };
        let indices = WAVELENGTHS.map(|wavelength| spectrum.at(wavelength));
        let part = |quantity: usize| DVec3::from_array(indices.map(|index| index[quantity]));
        let [exact, rescaled, compensated] = [FresnelForm::Exact, FresnelForm::Rescaled, FresnelForm::Compensated]
            .map(|form| MetalFresnel::new(form, part(0), part(1)));
        let gpu = (context.gpu)()?;
        let ior = ConductorIor {
            eta: part(0).as_vec3(),
            k: part(1).as_vec3(),
        };
        let at_angles = PUBLISHED.map(|(angle, _)| angle.to_radians().cos());
        let on_device = |form: CurveForm| -> Result<Vec<DVec3>> {
            let values = FresnelCurve::new(&gpu, form, &ior, 1)?.run_at(&gpu, &at_angles)?;
            Ok(values
                .into_iter()
                .map(|value| DVec3::from_array(value.map(f64::from)))
                .collect())
        };
        let [device_exact, device_rescaled, device_compensated] = [
            on_device(CurveForm::Exact)?,
            on_device(CurveForm::RescaledF0)?,
            on_device(CurveForm::CompensatedF0)?,
        ];
        let mut rows = Vec::new();
        for (i, (angle, published)) in PUBLISHED.into_iter().enumerate() {
            let c = at_angles[i];
            let device_step = device_rescaled[i] - device_exact[i];
            let device_left = device_compensated[i] - device_exact[i];
            let [at, step, left] = [
                exact.at(c),
                rescaled.at(c) - exact.at(c),
                compensated.at(c) - exact.at(c),
            ];
            for (band, name) in ["red", "green", "blue"].into_iter().enumerate() {
                rows.push(Row {
                    angle,
                    band: name.into(),
                    exact: at[band],
                    step: step[band],
                    published: published[band],
                    share: 100.0 * step[band] / at[band],
                    left: left[band],
                    on_device: device_step[band],
                    left_on_device: device_left[band],
                    // The part of the disc that light from twice the angle reaches.
                    lit: 128.0 * 128.0 * PI * 0.5 * (1.0 + (2.0 * angle).to_radians().cos()),
                });
            }
        }
        let side = context.pick(SIDE, 16);
        for (file, below) in PICTURES.into_iter().zip([&rescaled, &compensated]) {
            let spheres = PUBLISHED.map(|(angle, _)| split_sphere(&exact, below, angle, side));
            context.picture(file, &sheet(&spheres, side, 3));
        }
        let mut close = Vec::new();
        for below in [&rescaled, &compensated] {
            for times in MAGNIFIED {
                close.extend(CLOSE_ANGLES.map(|angle| seam(&exact, below, angle, times, side)));
            }
        }
        context.picture(CLOSE_UPS, &sheet(&close, side, CLOSE_ANGLES.len() as u32));
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "the largest step that the compensated curve leaves",
                largest(self, |_| true, |row| row.left.abs()),
            )
            .note(
                "n and k by Rakić (1995). A step is that of radiance over what a perfect mirror would send from there. Where steps are largest, light and \
                 viewer are nearly opposite each other, and a sliver of the sphere is lit.",
            );
        if self.is_empty() {
            return findings;
        }
        findings
            .picture(
                PICTURES[0],
                "From 90° (top left) to 50° of incidence, exact above, rescaled below",
            )
            .picture(PICTURES[1], "The same, compensated below")
            .picture(
                CLOSE_UPS,
                "The seam from close by at 80°, 75° and 70°: rescaled below, then with the difference between the halves doubled; compensated below, and again doubled",
            )
    }
}
