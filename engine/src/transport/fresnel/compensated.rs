//! The rescaled Schlick curve less a term a c (1 − c)^α, which makes the dip of metals near grazing incidence.
//!
//! Source: Lazányi and Szirmay-Kalos, "Fresnel Term Approximations for Metals" (WSCG 2005): a from the slope of the error at grazing
//! incidence, α so that the curve is exact at a cosine of 0.15. The rule has no meaning where the error changes its sign between the two: then it
//! gives exponents below 1, or negative ones, whose term is infinite at normal incidence (gold at 550 nm). Own: the slope in closed form,
//! the guard ([`guarded_rule`]), and coefficients that minimise the greatest relative error ([`fitted`]). [`compensation`] takes the best of them,
//! so that the error is at most that of the rescaled curve. Runs once for a material, on the host: some milliseconds. Deterministic. The
//! evaluation's twin is `transport/fresnel_forms.glsl`.

use glam::DVec3;

use super::rescaled::{conductor_f0, fresnel_rescaled, fresnel_schlick_average};
use super::{fresnel_conductor, fresnel_schlick};
use crate::catalogue::{Bias, Role, Row, sources};

/// Where the rule's curve is exact.
const MATCHED_COSINE: f64 = 0.15;
/// Least and greatest exponent of a fit.
const EXPONENTS: [f64; 2] = [1.0, 12.0];
/// Even steps of the cosine that fits and comparisons look at.
const STEPS: u32 = 1000;
/// Even steps of the exponent before the search between them.
const EXPONENT_STEPS: u32 = 22;
/// Steps of the searches by the golden section, which leave 10⁻⁸ of an interval.
const SECTIONS: u32 = 40;
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Coefficient and exponent of the term a c (1 − c)^α.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compensation {
    /// Coefficient.
    pub a: f64,
    /// Exponent.
    pub alpha: f64,
}

impl Compensation {
    /// No term: the rescaled curve.
    pub const NONE: Self = Self { a: 0.0, alpha: 1.0 };

    /// The term at a cosine of incidence. An exponent below zero makes it infinite at 1.
    pub fn term(self, cos_i: f64) -> f64 {
        self.a * cos_i * (1.0 - cos_i).powf(self.alpha)
    }
}

/// Where a band's coefficients come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chosen {
    /// No term does better than none.
    Rescaled,
    /// The published rule, which the guard lets pass.
    Rule,
    /// The fit.
    Fitted,
}

/// Schlick's curve less a c (1 − c)^α per band, kept in [0, 1].
pub fn fresnel_compensated(cos_i: f64, f0: DVec3, a: DVec3, alpha: DVec3) -> DVec3 {
    let m = (1.0 - cos_i).clamp(0.0, 1.0);
    let power = alpha.map(|alpha| m.powf(alpha));
    (fresnel_schlick(cos_i, f0) - a * cos_i * power).clamp(DVec3::ZERO, DVec3::ONE)
}

/// Cosine-weighted hemispherical average 2∫F(μ)μ dμ of [`fresnel_compensated`] where nothing is cut off.
pub fn fresnel_compensated_average(f0: DVec3, a: DVec3, alpha: DVec3) -> DVec3 {
    // 2∫ a μ² (1 − μ)^α dμ, Euler's beta function.
    fresnel_schlick_average(f0) - 4.0 * a / ((alpha + 1.0) * (alpha + 2.0) * (alpha + 3.0))
}

fn exact(cos_i: f64, eta: f64, k: f64) -> f64 {
    fresnel_conductor(cos_i, DVec3::splat(eta), DVec3::splat(k)).x
}

fn rescaled(cos_i: f64, eta: f64, k: f64) -> f64 {
    fresnel_rescaled(cos_i, DVec3::splat(eta), DVec3::splat(k)).x
}

/// By how much steeper the exact factor falls from grazing incidence than the rescaled curve: −d(F − F*)/dc at c = 0.
///
/// With ε = (n − ik)²: 2 Re((1 + ε)/√(ε − 1)) − 20n/((n + 1)² + k²).
pub fn grazing_slope(eta: f64, k: f64) -> f64 {
    let t = eta * eta - k * k - 1.0;
    let q = t.hypot(2.0 * eta * k);
    // The root a − ib of ε − 1, the greater part first.
    let [a, b] = if t >= 0.0 {
        let a = (0.5 * (q + t)).sqrt();
        [a, if a > 0.0 { eta * k / a } else { 0.0 }]
    } else {
        let b = (0.5 * (q - t)).sqrt();
        [eta * k / b, b]
    };
    let real = ((1.0 + eta * eta - k * k) * a + 2.0 * eta * k * b) / (a * a + b * b);
    2.0 * real - 20.0 * eta / ((eta + 1.0).powi(2) + k * k)
}

/// The published rule as it stands, without a look at what it gives.
pub fn rule(eta: f64, k: f64) -> Compensation {
    let a = grazing_slope(eta, k);
    let left = term_left(eta, k, a);
    Compensation {
        a,
        alpha: left.abs().ln() / (1.0 - MATCHED_COSINE).ln(),
    }
}

/// What (1 − c)^α has to be where the rule's curve is exact.
fn term_left(eta: f64, k: f64, a: f64) -> f64 {
    (rescaled(MATCHED_COSINE, eta, k) - exact(MATCHED_COSINE, eta, k)) / (MATCHED_COSINE * a)
}

/// The published rule where it means something: the slope is positive, and what is left of it at a cosine of 0.15 lies between 0 and 1 with an exponent
/// of at least 1.
pub fn guarded_rule(eta: f64, k: f64) -> Option<Compensation> {
    let compensation = rule(eta, k);
    let left = term_left(eta, k, compensation.a);
    (compensation.a > 0.0 && left > 0.0 && left < 1.0 && compensation.alpha >= 1.0).then_some(compensation)
}

/// A metal's exact factor over even cosines, and the relative error of its rescaled curve there.
struct Curve {
    cosines: Vec<f64>,
    exact: Vec<f64>,
    error: Vec<f64>,
}

impl Curve {
    fn of(eta: f64, k: f64) -> Self {
        let cosines: Vec<f64> = (0..=STEPS).map(|i| f64::from(i) / f64::from(STEPS)).collect();
        // Without an interface nothing is reflected, and no error is relative to that.
        let exact: Vec<f64> = cosines
            .iter()
            .map(|&c| exact(c, eta, k).max(f64::MIN_POSITIVE))
            .collect();
        let error = (cosines.iter().zip(&exact))
            .map(|(&c, f)| (rescaled(c, eta, k) - f) / f)
            .collect();
        Self { cosines, exact, error }
    }

    /// Greatest relative error with a term; infinite where the term is.
    fn worst(&self, compensation: Compensation) -> f64 {
        let errors = (self.cosines.iter().zip(&self.exact))
            .zip(&self.error)
            .map(|((&c, f), error)| (error - compensation.term(c) / f).abs());
        errors.fold(
            0.0,
            |worst: f64, e| if e.is_nan() { f64::INFINITY } else { worst.max(e) },
        )
    }

    /// The best coefficient for an exponent: the greatest error is convex in it.
    fn coefficient(&self, alpha: f64) -> (f64, f64) {
        let shape: Vec<f64> = (self.cosines.iter().zip(&self.exact))
            .map(|(&c, f)| c * (1.0 - c).powf(alpha) / f)
            .collect();
        let greatest = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        // Beyond this the term alone is further from the error than no term is.
        let bound = 2.0 * greatest(&self.error) / greatest(&shape);
        golden_section([-bound, bound], |a| {
            let errors = self.error.iter().zip(&shape);
            errors.fold(0.0, |most: f64, (e, s)| most.max((e - a * s).abs()))
        })
    }
}

/// Where a function with one minimum in an interval is least, and its value there.
fn golden_section([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> (f64, f64) {
    let [mut left, mut right] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
    let [mut at_left, mut at_right] = [f(left), f(right)];
    for _ in 0..SECTIONS {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = f(right);
        }
    }
    if at_left < at_right {
        (left, at_left)
    } else {
        (right, at_right)
    }
}

/// Coefficient and exponent, from 1 to 12, that minimise the greatest relative error.
pub fn fitted(eta: f64, k: f64) -> Compensation {
    Curve::of(eta, k).fitted()
}

impl Curve {
    fn fitted(&self) -> Compensation {
        let [least, greatest] = EXPONENTS;
        let step = (greatest - least) / f64::from(EXPONENT_STEPS);
        let mut best = (least, f64::INFINITY);
        for i in 0..=EXPONENT_STEPS {
            let alpha = least + step * f64::from(i);
            let (_, error) = self.coefficient(alpha);
            if error < best.1 {
                best = (alpha, error);
            }
        }
        let around = [(best.0 - step).max(least), (best.0 + step).min(greatest)];
        let (between, error) = golden_section(around, |alpha| self.coefficient(alpha).1);
        let alpha = if error < best.1 { between } else { best.0 };
        Compensation {
            a: self.coefficient(alpha).0,
            alpha,
        }
    }
}

/// The best of no term, the guarded rule and the fit: the one whose greatest relative error is least.
pub fn compensation(eta: f64, k: f64) -> (Chosen, Compensation) {
    let curve = Curve::of(eta, k);
    let mut best = (Chosen::Rescaled, Compensation::NONE, curve.worst(Compensation::NONE));
    let others = [
        guarded_rule(eta, k).map(|rule| (Chosen::Rule, rule)),
        Some((Chosen::Fitted, curve.fitted())),
    ];
    for (chosen, compensation) in others.into_iter().flatten() {
        let error = curve.worst(compensation);
        if error < best.2 {
            best = (chosen, compensation, error);
        }
    }
    (best.0, best.1)
}

/// [`compensation`] of the bands of a metal: what [`fresnel_compensated`] takes, its normal reflectance first.
pub fn compensated_metal(eta: DVec3, k: DVec3) -> [DVec3; 3] {
    let bands = [0, 1, 2].map(|band| compensation(eta[band], k[band]).1);
    [
        conductor_f0(eta, k),
        DVec3::from_array(bands.map(|band| band.a)),
        DVec3::from_array(bands.map(|band| band.alpha)),
    ]
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-F4",
    name: "error-compensated Schlick approximation with guard and fitted coefficients",
    role: Role::PartOf("BG-3"),
    limits: "Two coefficients a band: up to 2.5 % off for the metals that are tabulated, most at gold's blue, whose error changes its sign.",
    sources: &[sources::LAZANYI_SZIRMAY_KALOS_2005.whole()],
    shaders: &["shaders/transport/fresnel_forms.glsl"],
    bias: Some(Bias::Biased("one term of two coefficients stands for the dip")),
    tests: &[
        "engine/src/transport/fresnel/compensated.rs::the_slope_is_the_derivative",
        "engine/src/transport/fresnel/compensated.rs::the_rule_gives_what_was_published_and_fails_where_it_was_found_to",
        "engine/src/transport/fresnel/compensated.rs::the_rule_fails_as_often_as_published",
        "engine/src/transport/fresnel/compensated.rs::guarded_curves_are_never_worse_than_the_rescaled_one",
        "engine/src/transport/fresnel/compensated.rs::fits_are_as_published",
        "engine/src/transport/fresnel/form.rs::forms_err_at_metals_as_published",
        "tests/tests/twins/fresnel_forms.rs::forms_agree_with_their_twins",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::compensated"],
    settings: &["clerestory::scene::FresnelForm"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::published::METALS;
    use super::*;

    const SAMPLES: u32 = 20_000;

    /// Greatest and mean relative error with a term, %, over 20,001 cosines.
    fn errors(eta: f64, k: f64, compensation: Compensation) -> [f64; 2] {
        let [mut worst, mut sum] = [0.0; 2];
        for i in 0..=SAMPLES {
            let c = f64::from(i) / f64::from(SAMPLES);
            let f = exact(c, eta, k);
            let error = (rescaled(c, eta, k) - compensation.term(c) - f).abs() / f;
            worst = f64::max(worst, error);
            sum += error;
        }
        [100.0 * worst, 100.0 * sum / f64::from(SAMPLES + 1)]
    }

    fn error(eta: f64, k: f64, compensation: Compensation) -> f64 {
        errors(eta, k, compensation)[0]
    }

    /// Percentage points by which an error may miss one that is printed to a hundredth: the farthest is 5.5 thousandths off.
    const HUNDREDTHS: f64 = 0.006;

    #[test]
    fn the_slope_is_the_derivative() {
        for metal in METALS {
            const STEP: f64 = 1e-6;
            let difference = |c| exact(c, metal.n, metal.k) - rescaled(c, metal.n, metal.k);
            // Both are 1 at grazing incidence; of second order.
            let slope = -(4.0 * difference(STEP) - difference(2.0 * STEP)) / (2.0 * STEP);
            let found = grazing_slope(metal.n, metal.k);
            assert!(
                (found - slope).abs() < 1e-4 * found.abs().max(0.1),
                "{}: {found} {slope}",
                metal.name
            );
        }
        // A dielectric, whose root is real.
        let slope = -(exact(1e-7, 1.5, 0.0) - rescaled(1e-7, 1.5, 0.0)) / 1e-7;
        assert!((grazing_slope(1.5, 0.0) - slope).abs() < 1e-4 * slope.abs());
    }

    #[test]
    fn the_rule_gives_what_was_published_and_fails_where_it_was_found_to() {
        for metal in METALS {
            let [n, k] = metal.index();
            let (found, what) = (rule(n, k), (metal.name, metal.wavelength));
            // Half of the last printed digit, and of an exponent of aluminium a little more.
            assert!((found.a - metal.rule[0]).abs() < 5e-5, "{what:?}: {found:?}");
            assert!((found.alpha - metal.rule[1]).abs() < 7e-5, "{what:?}: {found:?}");
            let guarded = guarded_rule(n, k);
            let fails = matches!(what, ("silver", 550.0 | 435.0) | ("gold", 550.0));
            assert_eq!(guarded.is_none(), fails, "{what:?}");
            if guarded.is_some() {
                let gap = rescaled(MATCHED_COSINE, n, k) - found.term(MATCHED_COSINE) - exact(MATCHED_COSINE, n, k);
                assert!(gap.abs() < 1e-12, "{what:?}: {gap}");
            }
            for (error, published) in errors(n, k, found).into_iter().zip(metal.compensated) {
                if published.is_finite() {
                    assert!((error - published).abs() < HUNDREDTHS, "{what:?}: {error} {published}");
                } else {
                    assert!(error.is_infinite(), "{what:?}: {error}");
                }
            }
        }
        // At n = 1.5, k = 5.
        let found = rule(1.5, 5.0);
        assert!(
            (found.a - 2.196).abs() < 1e-3 && (found.alpha - 5.647).abs() < 1e-3,
            "{found:?}"
        );
        assert!((error(1.5, 5.0, found) - 1.08).abs() < 0.01);
    }

    /// A grid of n from 0.05 to 4 and k from 1 to 9 with 1320 points, as published: 40 × 33.
    #[test]
    fn the_rule_fails_as_often_as_published() {
        let (mut refused, mut worse) = (0, 0);
        for i in 0..40 {
            for j in 0..33 {
                let (n, k) = (0.05 + 3.95 * f64::from(i) / 39.0, 1.0 + 0.25 * f64::from(j));
                refused += u32::from(guarded_rule(n, k).is_none());
                let curve = Curve::of(n, k);
                worse += u32::from(curve.worst(rule(n, k)) > curve.worst(Compensation::NONE));
            }
        }
        assert_eq!((refused, worse), (104, 62));
    }

    /// On every other point of about the same grid.
    #[test]
    fn guarded_curves_are_never_worse_than_the_rescaled_one() {
        let mut refused = 0;
        for i in 0..20 {
            for j in 0..17 {
                let (n, k) = (0.05 + 3.95 * f64::from(i) / 19.0, 1.0 + 0.5 * f64::from(j));
                let (chosen, compensation) = compensation(n, k);
                refused += u32::from(guarded_rule(n, k).is_none());
                let (found, without) = (error(n, k, compensation), error(n, k, Compensation::NONE));
                assert!(found <= without + 1e-3, "n {n}, k {k}: {chosen:?}, {found} {without}");
                assert!(compensation.alpha >= 1.0, "n {n}, k {k}: {compensation:?}");
            }
        }
        assert!((15..45).contains(&refused), "the guard refuses {refused} of 340");
        for metal in METALS {
            let [n, k] = metal.index();
            let (chosen, compensation) = compensation(n, k);
            let found = error(n, k, compensation);
            let bound = metal.rescaled[0].min(metal.compensated[0]).min(metal.fitted[2]);
            assert!(
                found <= bound + HUNDREDTHS,
                "{} {}: {chosen:?}, {found}",
                metal.name,
                metal.wavelength
            );
        }
        // No interface and a dielectric: finite, too.
        for (n, k) in [(1.0, 0.0), (1.5, 0.0), (1e-3, 0.0), (50.0, 100.0)] {
            let (_, compensation) = compensation(n, k);
            assert!(
                compensation.a.is_finite() && compensation.alpha.is_finite(),
                "{n} {k}: {compensation:?}"
            );
        }
    }

    #[test]
    fn fits_are_as_published() {
        for metal in METALS {
            let [n, k] = metal.index();
            let found = fitted(n, k);
            let (what, error) = ((metal.name, metal.wavelength), error(n, k, found));
            let [a, alpha, published] = metal.fitted;
            assert!(
                (error - published).abs() < HUNDREDTHS,
                "{what:?}: {error}, published {published}"
            );
            // The coefficient of gold at 435 nm, whose exponent is at its bound, is printed to a hundredth.
            let digit = if what == ("gold", 435.0) { 0.01 } else { 1e-4 };
            assert!((found.a - a).abs() < digit, "{what:?}: {found:?}");
            assert!((found.alpha - alpha).abs() < 1e-3, "{what:?}: {found:?}");
        }
    }

    #[test]
    fn the_average_is_the_integral() {
        let metal = [
            DVec3::new(0.9, 0.5, 0.7),
            DVec3::new(3.2, 0.06, 1.6),
            DVec3::new(7.0, 2.0, 5.5),
        ];
        let [f0, a, alpha] = metal;
        let mut sum = DVec3::ZERO;
        for i in 0..20_000 {
            let mu = (f64::from(i) + 0.5) / 20_000.0;
            sum += fresnel_compensated(mu, f0, a, alpha) * (2.0 * mu / 20_000.0);
        }
        let found = fresnel_compensated_average(f0, a, alpha);
        assert!((sum - found).abs().max_element() < 1e-7, "{sum} {found}");
    }
}
