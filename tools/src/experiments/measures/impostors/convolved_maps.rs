//! Maps that are convolved once for all points: by the cosine for matte surfaces, by lobes for glossy ones.
//!
//! Oracles: the exact irradiance of the lit room at the map's place, for the widest lobe, which is the cosine; sums of many directions for powers of it; and the map itself, whose mean
//! a filter keeps, and whose radiance few numbers stand for.

use std::f64::consts::PI;

use clerestory::Result;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{GatherPoint, Lobe, SolidAngleForm, Terms};
use clerestory::maps::harmonics::HarmonicLight;
use clerestory::maps::irradiance::IrradianceSource;
use clerestory::maps::prefilter::prefilter_ggx;
use clerestory::maps::wavelets::WaveletLight;
use clerestory::maps::{MapImage, Parametrization};
use glam::{DVec3, UVec2};

use super::gather_glossy::at_the_maps_place;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

/// Texels along a side of a face of the map and of those that are made of it.
const SIDES: [u32; 2] = [32, 16];
/// Widths of lobes; at 1 the lobe is the cosine.
const ALPHAS: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];
/// Exponents of the lobes of Phong's model: those of a doctoral thesis on metals and reflections on graphics hardware, with a narrower one before and the cosine behind.
const EXPONENTS: [f64; 4] = [50.0, 10.0, 5.0, 1.0];
/// Lights along a side of a face that these lobes sum over.
const LIGHTS: u32 = 32;
/// Directions along the sides of the faces of a cube that their oracle sums over.
const DIRECTIONS: u32 = 192;
const PICTURE: &str = "convolved.png";
const LOBES: &str = "powers.png";

rows! {
    /// A convolved map.
    struct Row = "Maps of a lit room convolved by lobes" by [alpha] {
        alpha: f64 = "width of the lobe (GGX alpha)",
        exponent: f64 = "exponent of a cosine lobe about the half vector, as wide",
        contrast: f64 = "deviation over the mean",
        of_narrower: Option<f64> = "deviation over that of the next narrower lobe",
        mean: f64 = "mean over that of the map",
        brightest: f64 = "brightest texel over the mean",
        off: Option<f64> = "RMS against the exact irradiance (%)",
    }
}
rows! {
    /// A map convolved by a power of the cosine.
    struct Lobes = "Maps of a lit room convolved by powers of the cosine" by [exponent] {
        exponent: f64 = "exponent of the lobe about the mirrored direction",
        contrast: f64 = "deviation over the mean",
        of_narrower: Option<f64> = "deviation over that of the next greater exponent",
        mean: f64 = "mean over that of the map",
        brightest: f64 = "brightest texel over the mean",
        off: f64 = "RMS against exact lobes (%)",
    }
}
rows! {
    /// Light in harmonics.
    struct Harmonics = "Irradiance by spherical harmonics" by [order] {
        order: u64 = "order",
        numbers: u64 = "numbers a band of colour",
        off: f64 = "RMS against the exact irradiance (%)",
        worst: f64 = "greatest error over the mean (%)",
    }
}

rows! {
    /// Light in wavelets beside harmonics.
    struct Wavelets = "Radiance by the greatest wavelets, and by harmonics" by [numbers] {
        numbers: u64 = "terms",
        lost: f64 = "lost by wavelets (%)",
        by_harmonics: f64 = "lost by as many harmonics (%)",
        share: f64 = "one over the other",
        off: f64 = "irradiance by wavelets: RMS against the exact one (%)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    maps: Vec<Row>,
    lobes: Vec<Lobes>,
    harmonics: Vec<Harmonics>,
    wavelets: Vec<Wavelets>,
}

const OF_WAVELETS: &[Criterion<Wavelets>] = &[Criterion::each(
    "wavelets hold edges that harmonics blur: what they lose over what harmonics do",
    Bound::AtMost(0.6),
    |row: &Wavelets| row.share.into(),
)
.in_every_form()];

const OF_HARMONICS: &[Criterion<Harmonics>] = &[
    Criterion::each(
        "nine numbers are near the irradiance: greatest error over the mean (%)",
        Bound::AtMost(9.0),
        |row: &Harmonics| row.worst.into(),
    )
    .among(|row| row.order == 2)
    .because("no light is off by more, as was published"),
    Criterion::each(
        "twenty-five are nearer: RMS (%)",
        Bound::AtMost(1.5),
        |row: &Harmonics| row.off.into(),
    )
    .among(|row| row.order == 4),
];

/// The greatest wavelets, as many as harmonics of orders 2 to 8, and the irradiance of what they keep.
fn wavelets(room: &LitRoom, map: &MapImage, points: u32) -> Result<Vec<Wavelets>> {
    let points = LitRoom::points(DVec3::ZERO, points);
    let exact: Vec<f64> = points
        .iter()
        .map(|point| {
            room.irradiance(&GatherPoint {
                position: DVec3::ZERO,
                ..*point
            })
        })
        .collect();
    let (kind, size) = (map.map(), map.size());
    let power = |value: &dyn Fn(usize, f64) -> f64| {
        let of = |(i, texel)| kind.texel_solid_angle(size, texel) * value(i, f64::from(map.at(texel).x)).powi(2);
        kind.texels(size).enumerate().map(of).sum::<f64>()
    };
    let whole = power(&|_, value| value);
    let row = |order: u32| {
        let harmonics = HarmonicLight::new(map, order)?;
        let light = WaveletLight::new(map, harmonics.numbers())?;
        let directions = kind.texels(size).map(|texel| kind.texel_direction(size, texel));
        let kept: Vec<f64> = directions
            .map(|direction| direction.map_or(0.0, |direction| harmonics.radiance(direction).x))
            .collect();
        let by_harmonics = power(&|i, value| value - kept[i]) / whole;
        let image = light.image()?;
        let source = IrradianceSource::new(&image);
        let found: Vec<f64> = points
            .iter()
            .map(|point| source.irradiance(point.axis).map_or(0.0, |irradiance| irradiance.x))
            .collect();
        Ok(Wavelets {
            numbers: light.numbers() as u64,
            lost: 100.0 * light.lost(),
            by_harmonics: 100.0 * by_harmonics,
            share: light.lost() / by_harmonics,
            off: relative_errors(&found, &exact)[0],
        })
    };
    [2, 4, 6, 8].into_iter().map(row).collect()
}

/// Harmonics of orders 0 to 6 at points of the unit sphere about the map's place.
fn harmonics(room: &LitRoom, map: &MapImage, count: u32) -> Result<Vec<Harmonics>> {
    let points = at_the_maps_place(&LitRoom::points(DVec3::ZERO, count));
    let exact: Vec<f64> = points.iter().map(|point| room.irradiance(point)).collect();
    let mean = exact.iter().sum::<f64>() / exact.len().max(1) as f64;
    let row = |order: u32| {
        let light = HarmonicLight::new(map, order)?;
        let found: Vec<f64> = points.iter().map(|point| light.irradiance(point.axis).x).collect();
        let worst = found
            .iter()
            .zip(&exact)
            .fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()));
        Ok(Harmonics {
            order: order.into(),
            numbers: light.numbers() as u64,
            off: relative_errors(&found, &exact)[0],
            worst: 100.0 * worst / mean,
        })
    };
    [0, 1, 2, 4, 6].into_iter().map(row).collect()
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "wider lobes blur more: deviation over that of the next narrower one",
        Bound::AtMost(0.95),
        |row: &Row| row.of_narrower.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.of_narrower.is_some())
    .in_every_form(),
    Criterion::each(
        "no light is lost: mean over that of the map",
        Bound::Between(0.98, 1.02),
        |row: &Row| row.mean.into(),
    )
    .because("a texel of the bright patch is a third as wide as it, and lobes are scaled to one"),
    Criterion::each(
        "the widest is the irradiance: RMS against the exact one (%)",
        Bound::AtMost(2.0),
        |row: &Row| row.off.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.off.is_some())
    .because("a texel has one direction"),
];

const OF_LOBES: &[Criterion<Lobes>] = &[
    Criterion::each(
        "less shininess blurs more: deviation over that of the next greater exponent",
        Bound::AtMost(0.95),
        |row: &Lobes| row.of_narrower.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.of_narrower.is_some())
    .in_every_form(),
    Criterion::each(
        "powers of the cosine lose no light: mean over that of the map",
        Bound::Between(0.98, 1.02),
        |row: &Lobes| row.mean.into(),
    )
    .because("as for other lobes"),
    Criterion::each(
        "powers of the cosine are those of the room: RMS against exact lobes (%)",
        Bound::AtMost(3.0),
        |row: &Lobes| row.off.into(),
    )
    .because("a light is 3° wide and has one direction, the narrowest lobe is 13° to half of its height"),
];

/// The map convolved by powers of the cosine: what its lights give at its own place.
fn lobes(context: &Context<'_>, room: &LitRoom, of_map: f64) -> Result<Vec<Lobes>> {
    let (side, count, to, directions) = context.pick((LIGHTS, 400, SIDES[1], DIRECTIONS), (8, 20, 4, 16));
    let lights = room.lights(side, SolidAngleForm::Disc)?;
    let gathered = |axis: DVec3, exponent: f64| {
        let position = DVec3::ZERO;
        lights
            .gather(&GatherPoint { position, axis }, Lobe::Middles(exponent), Terms::All)
            .x
    };
    let points = at_the_maps_place(&LitRoom::points(DVec3::ZERO, count));
    let (kind, size) = (Parametrization::Cube, UVec2::splat(to));
    let mut shown = Vec::new();
    let mut last = None;
    let rows = context.each(
        &EXPONENTS,
        |exponent| format!("exponent {exponent}"),
        |exponent| {
            let map = MapImage::from_fn(kind, size, |texel| {
                let axis = kind.texel_direction(size, texel);
                DVec3::splat(axis.map_or(0.0, |axis| gathered(axis, *exponent)))
            })?;
            let [mean, deviation] = statistics(&map);
            let of_narrower = last.replace(deviation).map(|narrower: f64| deviation / narrower);
            let brightest = map.texels().iter().fold(0.0f32, |most, texel| most.max(texel.x));
            let found: Vec<f64> = points.iter().map(|point| gathered(point.axis, *exponent)).collect();
            let exact = room.glossy(&points, *exponent, directions);
            shown.push(unfolded(&map, 2.0 * of_map));
            Ok(vec![Lobes {
                exponent: *exponent,
                contrast: deviation / mean,
                of_narrower,
                mean: mean / of_map,
                brightest: f64::from(brightest) / mean,
                off: relative_errors(&found, &exact)[0],
            }])
        },
    )?;
    context.picture(LOBES, &sheet(&shown, 3 * to, EXPONENTS.len() as u32));
    Ok(rows)
}

/// Mean and deviation over all directions.
fn statistics(map: &MapImage) -> [f64; 2] {
    let (kind, size) = (map.map(), map.size());
    let moments = |f: &dyn Fn(f64) -> f64| {
        let of = |texel| kind.texel_solid_angle(size, texel) * f(f64::from(map.at(texel).x));
        kind.texels(size).map(of).sum::<f64>() / (4.0 * PI)
    };
    let mean = moments(&|value| value);
    [mean, moments(&|value| (value - mean) * (value - mean)).sqrt()]
}

/// All faces beside each other in one square of rows and columns: +x, −x, +y above, −y, +z, −z in the middle.
pub(super) fn unfolded(map: &MapImage, brightest: f64) -> Vec<DVec3> {
    let side = map.size().x;
    let whole = 3 * side;
    let at = |i: u32| {
        let (x, y) = (i % whole, i / whole);
        let layer = 3 * (y / side) + x / side;
        if y >= 2 * side {
            return DVec3::ZERO;
        }
        let texel = (layer * side + y % side) * side + x % side;
        map.texels()[texel as usize].as_dvec3() / brightest
    };
    (0..whole * whole).map(at).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let [from, to] = context.pick(SIDES, [8, 4]);
        let room = LitRoom::PUBLISHED;
        let (radiance, _) = room.maps(Parametrization::Cube, from)?;
        let [of_map, _] = statistics(&radiance);
        let mut shown = Vec::new();
        let mut last = None;
        let rows = context.each(
            &ALPHAS,
            |alpha| format!("alpha {alpha}"),
            |alpha| {
                let map = prefilter_ggx(&radiance, UVec2::splat(to), *alpha)?;
                let [mean, deviation] = statistics(&map);
                let of_narrower = last.replace(deviation).map(|narrower: f64| deviation / narrower);
                let brightest = map.texels().iter().fold(0.0f32, |most, texel| most.max(texel.x));
                let off = (*alpha == 1.0).then(|| {
                    let directions = map.map().texels(map.size()).filter_map(|texel| {
                        let axis = map.map().texel_direction(map.size(), texel)?;
                        let position = DVec3::ZERO;
                        Some((
                            PI * f64::from(map.at(texel).x),
                            room.irradiance(&GatherPoint { position, axis }),
                        ))
                    });
                    let (found, exact): (Vec<f64>, Vec<f64>) = directions.unzip();
                    relative_errors(&found, &exact)[0]
                });
                shown.push(unfolded(&map, 2.0 * of_map));
                Ok(vec![Row {
                    alpha: *alpha,
                    exponent: 2.0 / (alpha * alpha) - 2.0,
                    contrast: deviation / mean,
                    of_narrower,
                    mean: mean / of_map,
                    brightest: f64::from(brightest) / mean,
                    off,
                }])
            },
        )?;
        context.picture(PICTURE, &sheet(&shown, 3 * to, ALPHAS.len() as u32));
        Ok(Self {
            maps: rows,
            lobes: lobes(context, &room, of_map)?,
            harmonics: harmonics(&room, &radiance, context.pick(400, 20))?,
            wavelets: wavelets(&room, &radiance, context.pick(400, 20))?,
        })
    }

    fn findings(&self) -> Findings {
        let widest = self.maps.iter().find(|row| row.alpha == 1.0);
        let findings = Findings::of(&self.maps, CRITERIA)
            .headline(
                "RMS of the widest lobe against the exact irradiance (%)",
                widest.and_then(|row| row.off).map(Into::into),
            )
            .note("A cube of 32² texels a face of a room with walls of different radiance and a bright patch, seen from its middle, convolved into 16² texels a face.")
            .and(Findings::of(&self.lobes, OF_LOBES).note(
                "A look-up in such a map by the mirrored direction is the model by Phong, as a doctoral thesis on metals and reflections on graphics hardware has it for glossy surfaces; its exponents are 5 and 10. Here the map is of 16² \
                 texels a face, each the sum of 32² lights a face of the same room.",
            ))
            .and(Findings::of(&self.harmonics, OF_HARMONICS).note("Of the same map, in place of a convolved one; the third and the fifth order add nothing to irradiance."))
            .and(Findings::of(&self.wavelets, OF_WAVELETS).note("Of the same map; what is lost is the squared error over the square of the radiance, in the mean over all directions. A wavelet takes its place beside its value."))
            .curves(
                "contrast",
                "What is left of the room's contrast",
                Axes::rates("width of the lobe (GGX alpha)", "deviation over the mean"),
                curves(&self.maps, |_| "lit room".into(), |row| (row.alpha, row.contrast.into())),
            );
        if self.maps.is_empty() {
            return findings;
        }
        findings
            .picture(
                PICTURE,
                "Faces +x, −x, +y and −y, +z, −z of the convolved maps, from narrow lobes to the cosine",
            )
            .picture(LOBES, "The same by powers of the cosine: exponents 50, 10, 5 and 1")
    }
}
