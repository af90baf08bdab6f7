//! What T. Engelhardt's thesis states of how evenly maps spread their texels (2013, chapters 5 and 7), beside what they do.

use clerestory::maps::Parametrization;
use clerestory::maps::statistics::DensityStatistics;
use glam::UVec2;

use crate::experiments::findings::{Bound, Criterion, rows};

/// What is stated of maps.
const FIGURES: [&str; 4] = [LEAST, GREATEST, "RMS of ratio − 1", "greatest shear"];
const LEAST: &str = "least ratio";
const GREATEST: &str = "greatest ratio";
/// Maps with what is stated of them, by figure.
pub const STATED: [(Parametrization, [&str; 4]); 8] = [
    (Parametrization::LatLong, ["0", "1.571", "0.483", "∞"]),
    (Parametrization::Sphere, ["1", "1", "0", "∞"]),
    (Parametrization::Cube, ["0.368", "1.910", "0.380", "1.732"]),
    (Parametrization::DualParaboloid, ["0.5", "2.0", "0.408", "1.0"]),
    (Parametrization::Nusselt, ["0.5", "∞", "∞", "∞"]),
    (
        Parametrization::OctahedronQuadratic,
        ["0.318", "1.654", "0.327", "2.618"],
    ),
    (
        Parametrization::OctahedronRectangular,
        ["0.318", "1.654", "0.327", "2.618"],
    ),
    (Parametrization::EqualArea, ["1", "1", "0", "none"]),
];

/// Decimals that a stated whole number is exact to.
const WHOLE: usize = 3;
/// The perspective family by its c, with what is stated of the first three figures.
pub const FAMILY: [(f64, [&str; 3]); 5] = [
    (0.5, ["0.080", "2.149", "0.571"]),
    (std::f64::consts::FRAC_1_SQRT_2, ["0.159", "1.779", "0.403"]),
    (1.0, ["0.318", "1.654", "0.327"]),
    (std::f64::consts::SQRT_2, ["0.225", "1.801", "0.411"]),
    (2.0, ["0.159", "2.339", "0.621"]),
];

rows! {
    /// A finite figure of the document.
    struct Figure = "Figures beside the document's" by [map, figure] {
        map: String = "map",
        figure: String = "figure",
        stated: f64 = "as stated",
        of_texels: f64 = "of texels",
        of_points: f64 = "as texels shrink",
        off: f64 = "off as texels shrink (steps of the last digit)",
        beyond: f64 = "texels finer or coarser than stated (steps of the last digit)",
    }
}

/// The document's tables to their digits, and no map finer or coarser than they say.
pub const OF_FIGURES: &[Criterion<Figure>] = &[
    Criterion::each(
        "the document's tables to their digits: steps of the last digit that finite figures are off",
        Bound::AtMost(1.0),
        |row: &Figure| row.off.into(),
    )
    .because("half a step is the document's rounding, half what is left of texels as they shrink"),
    Criterion::each(
        "no texel is finer or coarser than stated: steps of the last digit beyond it",
        Bound::AtMost(0.5),
        |row: &Figure| row.beyond.into(),
    )
    .among(|row| [LEAST, GREATEST].contains(&row.figure.as_str()))
    .because("half a step of the last digit is the document's rounding"),
];

/// What the document says of a map; none of one that it does not have.
pub fn of_document(map: &str, figure: usize) -> Option<&'static str> {
    let (_, stated) = STATED.iter().find(|(known, _)| known.to_string() == map)?;
    Some(stated[figure])
}

/// What the document says of a member of the family.
pub fn of_family(c: f64, figure: usize) -> Option<&'static str> {
    let (_, stated) = FAMILY
        .iter()
        .find(|(known, _)| (known - c).abs() < f64::from(f32::EPSILON))?;
    Some(stated[figure])
}

/// Statistics at a number of rows of a layer.
pub fn statistics(map: Parametrization, rows: u32) -> DensityStatistics {
    map.density_statistics(UVec2::new(rows * map.aspect(), rows))
}

impl Figure {
    /// Finite figures of a map at a number of rows, beside those that the document states. Figures of texels approach those of points as one over
    /// the rows: what is left of them with endless rows follows from half of them.
    pub fn all(name: &str, map: Parametrization, rows: u32, stated: &[&str]) -> Vec<Self> {
        let values = |found: &DensityStatistics| [found.min_ratio, found.max_ratio, found.rms, found.anisotropy];
        let [fine, coarse] = [rows, rows / 2].map(|rows| values(&statistics(map, rows)));
        let figure = |at: usize| {
            let text = stated.get(at)?;
            let stated: f64 = text.parse().ok()?;
            let decimals = text.split_once('.').map_or(WHOLE, |(_, decimals)| decimals.len());
            let steps = 10f64.powi(decimals as i32);
            let of_points = 2.0 * fine[at] - coarse[at];
            let beyond = if FIGURES[at] == LEAST {
                stated - fine[at]
            } else {
                fine[at] - stated
            };
            Some(Self {
                map: name.into(),
                figure: FIGURES[at].into(),
                stated,
                of_texels: fine[at],
                of_points,
                off: steps * (of_points - stated).abs(),
                beyond: steps * beyond,
            })
        };
        (0..FIGURES.len()).filter_map(figure).collect()
    }
}
