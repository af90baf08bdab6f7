//! Series: the statistics of a sweep. Per scene and variant the error at each budget with its spread, slopes against samples, rays and time, the
//! cost of an error that all variants reach, and the Pareto front of time and error.
//!
//! Errors are relative RMSE, the root of the mean of the repeats' relative MSEs without the reference's noise ([`super::unbiased`]).

use super::equal_error::{self, Cost};
use super::jackknife::mean_without;
use super::measurement::Measurement;
use super::pareto;
use super::results::{Point, Results, SceneResults, VariantResults};
use super::slope::{Fit, Slope};
use super::sweep::Budget;
use crate::timing::median;

/// What work is counted in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Work {
    /// Seconds of wall clock.
    Seconds,
    /// Rays of all kinds.
    Rays,
    /// Samples a pixel.
    Samples,
}

impl Work {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Seconds, Self::Rays, Self::Samples];

    /// With its unit, for axes and heads.
    pub fn label(self) -> &'static str {
        match self {
            Self::Seconds => "time (s)",
            Self::Rays => "rays",
            Self::Samples => "samples per pixel",
        }
    }

    /// As a part of file names.
    pub fn word(self) -> &'static str {
        match self {
            Self::Seconds => "time",
            Self::Rays => "rays",
            Self::Samples => "samples",
        }
    }

    /// How much a measurement took.
    pub fn of(self, measurement: &Measurement) -> f64 {
        match self {
            Self::Seconds => measurement.seconds,
            Self::Rays => measurement.count("rays"),
            Self::Samples => measurement.samples,
        }
    }
}

/// One budget of a variant: medians of work, means of errors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SeriesPoint {
    /// What was allowed.
    pub budget: Budget,
    /// Median samples per pixel.
    pub samples: f64,
    /// Median rays; `None` where the technique counts none.
    pub rays: Option<f64>,
    /// Median seconds.
    pub seconds: f64,
    /// Least and greatest seconds.
    pub seconds_range: [f64; 2],
    /// Root of the mean unbiased MSE; not a number where the reference's noise hides it.
    pub rmse: f64,
    /// Root of the mean unbiased relative MSE; not a number where the reference's noise hides it.
    pub relative_rmse: f64,
    /// Least and greatest relative RMSE of a repeat.
    pub relative_rmse_range: [f64; 2],
    /// Mean unbiased relative MSE.
    pub relative_mse: f64,
    /// The reference's own relative MSE, which has been subtracted.
    pub reference_relative_mse: f64,
    /// Mean relative bias of the repeats that have one.
    pub relative_bias: Option<f64>,
    /// Mean FLIP error.
    pub flip: f64,
    /// Whether no other point of the scene is both faster and less wrong.
    pub on_front: bool,
}

impl SeriesPoint {
    /// Median work, 0 where it is not counted.
    pub fn work(&self, work: Work) -> f64 {
        match work {
            Work::Seconds => self.seconds,
            Work::Rays => self.rays.unwrap_or(0.0),
            Work::Samples => self.samples,
        }
    }
}

/// A variant in a scene.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Series {
    /// The variant's name.
    pub name: String,
    /// Why it could not render the scene.
    pub refused: Option<String>,
    /// By budget, rising.
    pub points: Vec<SeriesPoint>,
    /// Of relative RMSE against samples.
    pub slope: Option<Slope>,
    /// Of RMSE against samples.
    pub absolute_slope: Option<Slope>,
    /// Of relative RMSE against seconds.
    pub time_slope: Option<Slope>,
    /// Seconds to the scene's common error.
    pub seconds_to_error: Option<Cost>,
    /// Rays to the scene's common error.
    pub rays_to_error: Option<Cost>,
}

/// Everything of one scene.
#[derive(Debug, Clone, serde::Serialize)]
pub struct SceneSeries {
    /// The scene's address.
    pub address: String,
    /// Triangles.
    pub triangles: u64,
    /// Name of the reference's file, in the folder of references.
    pub reference: String,
    /// Relative RMSE that every variant reaches, at which costs are compared.
    pub common_error: Option<f64>,
    /// By variant.
    pub series: Vec<Series>,
}

/// The statistics of all scenes.
pub fn of(results: &Results) -> Vec<SceneSeries> {
    results.scenes.iter().map(scene).collect()
}

fn scene(results: &SceneResults) -> SceneSeries {
    let mut series: Vec<Series> = results.variants.iter().map(variant).collect();
    let all: Vec<(f64, f64)> = series
        .iter()
        .flat_map(|series| &series.points)
        // An MSE that noise has brought below 0 has no root and is the least there is.
        .map(|point| (point.seconds, point.relative_mse))
        .collect();
    let points = series.iter_mut().flat_map(|series| &mut series.points);
    for (point, on_front) in points.zip(pareto::front(&all)) {
        point.on_front = on_front;
    }
    let curve = |series: &Series, work: Work| -> Vec<(f64, f64)> {
        let pairs = series
            .points
            .iter()
            .map(|point| (point.work(work), point.relative_rmse));
        pairs.filter(|(_, error)| error.is_finite()).collect()
    };
    let curves: Vec<Vec<(f64, f64)>> = series.iter().map(|series| curve(series, Work::Seconds)).collect();
    let measured = curves.iter().filter(|curve| !curve.is_empty());
    let common_error = equal_error::common_error(measured.map(Vec::as_slice));
    if let Some(error) = common_error {
        for series in &mut series {
            series.seconds_to_error = equal_error::cost_of(&curve(series, Work::Seconds), error);
            series.rays_to_error = equal_error::cost_of(&curve(series, Work::Rays), error);
        }
    }
    SceneSeries {
        address: results.address.clone(),
        triangles: results.triangles,
        reference: results.reference.clone(),
        common_error,
        series,
    }
}

/// An MSE of a measurement and the standard error that the reference gives it.
type Errors = [fn(&Measurement) -> f64; 2];
const RELATIVE: Errors = [|one| one.error.relative_mse, |one| one.error.reference_relative_error];
const ABSOLUTE: Errors = [|one| one.error.mse, |one| one.error.reference_error];

fn fit(results: &VariantResults, work: Work, [mse, reference_error]: Errors, least: f64) -> Option<Fit> {
    // A budget that an interruption has left with fewer repeats waits for them.
    let most = results.points.iter().map(|point| point.measurements.len()).max()?;
    let whole = || {
        let points = results.points.iter();
        points.filter(move |point| point.measurements.len() == most && point.budget.amount() >= least)
    };
    let works: Vec<f64> = whole().map(|point| median_work(point, work)).collect();
    let errors = whole().map(|point| point.measurements.iter().map(mse).collect());
    let by_reference = whole().flat_map(|point| &point.measurements).map(reference_error);
    Fit::of(
        &works,
        &errors.collect::<Vec<Vec<f64>>>(),
        by_reference.fold(0.0, f64::max),
    )
}

/// The slope of relative RMSE against samples, from budgets of `least` on.
pub(super) fn fall(results: &VariantResults, least: f64) -> Option<Fit> {
    fit(results, Work::Samples, RELATIVE, least)
}

fn median_work(results: &Point, work: Work) -> f64 {
    median(results.measurements.iter().map(|one| work.of(one)).collect())
}

/// A root of what is not above 0 is not a number, or 0, neither of which has a place on a logarithmic axis.
fn root(mse: f64) -> f64 {
    if mse > 0.0 { mse.sqrt() } else { f64::NAN }
}

fn variant(results: &VariantResults) -> Series {
    let slope = |work: Work, errors: Errors| fit(results, work, errors, 0.0).map(|fit| fit.slope());
    Series {
        name: results.name.clone(),
        refused: results.refused.clone(),
        slope: slope(Work::Samples, RELATIVE),
        absolute_slope: slope(Work::Samples, ABSOLUTE),
        time_slope: slope(Work::Seconds, RELATIVE),
        seconds_to_error: None,
        rays_to_error: None,
        points: results.points.iter().map(point).collect(),
    }
}

fn point(results: &Point) -> SeriesPoint {
    let all = |of: &dyn Fn(&Measurement) -> f64| results.measurements.iter().map(of).collect::<Vec<f64>>();
    let mean = |values: &[f64]| mean_without(values, None);
    let range = |values: &[f64]| {
        let least = values.iter().copied().fold(f64::INFINITY, f64::min);
        [least, values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    let relative = all(&|one| one.error.relative_mse);
    let biases: Vec<f64> = results
        .measurements
        .iter()
        .filter_map(|one| one.relative_bias)
        .collect();
    let counts_rays = results.measurements.iter().all(|one| one.counters.contains_key("rays"));
    SeriesPoint {
        budget: results.budget,
        samples: median_work(results, Work::Samples),
        rays: counts_rays.then(|| median_work(results, Work::Rays)),
        seconds: median_work(results, Work::Seconds),
        seconds_range: range(&all(&|one| Work::Seconds.of(one))),
        rmse: root(mean(&all(&|one| one.error.mse))),
        relative_rmse: root(mean(&relative)),
        relative_rmse_range: range(&relative).map(|mse| mse.max(0.0).sqrt()),
        relative_mse: mean(&relative),
        reference_relative_mse: mean(&all(&|one| one.error.reference_relative_mse)),
        relative_bias: (!biases.is_empty()).then(|| mean(&biases)),
        flip: mean(&all(&|one| one.flip)),
        on_front: false,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::measurement::tests::made_up;
    use super::*;
    use clerestory::film::{Picture, ToneMap};

    /// Two variants of slope −½, the second twice as fast, three repeats that agree.
    pub(in super::super) fn made_up_scene() -> SceneResults {
        let variant = |name: &str, speed: f64| VariantResults {
            name: name.into(),
            technique: "path".into(),
            settings: serde_json::Value::Null,
            refused: None,
            points: [4, 16, 64]
                .map(|spp| Point {
                    budget: Budget::Spp(spp),
                    measurements: (0..3)
                        .map(|seed| made_up("", Budget::Spp(spp), seed, f64::from(spp) / speed, 1.0 / f64::from(spp)))
                        .collect(),
                })
                .to_vec(),
            picture: Picture::from_radiance(2, 1, vec![0.5; 6]).ok(),
        };
        let mut reference_picture = Picture::from_radiance(2, 1, vec![0.25; 6]).unwrap();
        reference_picture.add_layer("variance", 3, vec![0.0; 6]).unwrap();
        SceneResults {
            address: "builtin:ring".into(),
            triangles: 138,
            reference: "r.exr".into(),
            tone: ToneMap::default(),
            reference_error_of_mean: 1e-4,
            reference_picture: Some(reference_picture),
            variants: vec![variant("slow", 10.0), variant("<fast> & \"good\"", 20.0)],
        }
    }

    #[test]
    fn slopes_costs_and_fronts_of_power_laws_are_exact() {
        let scene = scene(&made_up_scene());
        for series in &scene.series {
            for slope in [series.slope, series.absolute_slope, series.time_slope] {
                let slope = slope.unwrap();
                // Repeats agree; the reference's noise is below 1e-7 of the MSEs.
                assert!((slope.value + 0.5).abs() < 1e-12 && slope.standard_error.unwrap() < 1e-7);
            }
        }
        let seconds: Vec<f64> = scene
            .series
            .iter()
            .filter_map(|series| series.seconds_to_error.and_then(Cost::measured))
            .collect();
        assert!(
            (seconds[0] - 6.4).abs() < 1e-9 && (seconds[1] - 3.2).abs() < 1e-9,
            "{seconds:?}"
        );
        let front: Vec<bool> = scene
            .series
            .iter()
            .flat_map(|s| &s.points)
            .map(|p| p.on_front)
            .collect();
        assert_eq!(front, [false, false, false, true, true, true]);
        let point = scene.series[0].points[1];
        assert!((point.relative_mse - 2.0 / 16.0).abs() < 1e-15 && (point.rmse - 0.25).abs() < 1e-15);
        assert_eq!(point.seconds_range, [1.6, 1.6]);
    }

    #[test]
    fn rays_that_are_not_counted_are_none() {
        let mut results = made_up_scene();
        for point in &mut results.variants[0].points {
            for one in &mut point.measurements {
                one.counters.clear();
            }
        }
        let scene = scene(&results);
        let rays = |series: &Series| {
            series
                .points
                .iter()
                .map(|point| point.rays.is_some())
                .collect::<Vec<_>>()
        };
        assert_eq!(rays(&scene.series[0]), [false; 3]);
        assert_eq!(rays(&scene.series[1]), [true; 3]);
        let to_error = [0, 1].map(|i: usize| scene.series[i].rays_to_error.is_some());
        assert_eq!(to_error, [false, true]);
    }

    #[test]
    fn what_an_interruption_left_undone_is_not_fitted() {
        let mut results = made_up_scene();
        results.variants[0].points[2].measurements.truncate(1);
        results.variants[0].points[2].measurements[0].error.relative_mse *= 100.0;
        let series = variant(&results.variants[0]);
        assert_eq!(series.slope.map(|slope| slope.budgets), Some(2));
        assert!((series.slope.unwrap().value + 0.5).abs() < 1e-12);
    }
}
