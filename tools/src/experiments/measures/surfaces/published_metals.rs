//! Greatest errors of the forms of metals' Fresnel factors, as they were computed independently of the engine.

/// A metal at a wavelength, and errors in percent.
pub struct Published {
    /// As [`clerestory::scene::metals`] calls it.
    pub metal: &'static str,
    /// Nanometres.
    pub wavelength: f64,
    /// Schlick's curve.
    pub schlick: f64,
    /// The rescaled curve.
    pub rescaled: f64,
    /// The compensated curve by the printed rule; infinite for one.
    pub printed_rule: f64,
    /// The better of that and of fitted coefficients.
    pub compensated: f64,
    /// The exponent 6, exact at 82 degrees.
    pub hoffman: f64,
    /// The simplified conductor.
    pub simplified: f64,
}

const fn of(metal: &'static str, wavelength: f64, errors: [f64; 6]) -> Published {
    let [schlick, rescaled, printed_rule, compensated, hoffman, simplified] = errors;
    Published {
        metal,
        wavelength,
        schlick,
        rescaled,
        printed_rule,
        compensated,
        hoffman,
        simplified,
    }
}

/// All of them.
pub const PUBLISHED: &[Published] = &[
    of("silver", 700.0, [14.6, 0.51, 0.27, 0.02, 0.07, 0.03]),
    of("silver", 550.0, [19.9, 0.67, 1.20, 0.04, 0.22, 0.08]),
    of("silver", 435.0, [12.9, 0.17, 0.19, 0.05, 0.14, 0.10]),
    of("gold", 700.0, [39.2, 1.57, 1.26, 0.07, 0.36, 0.14]),
    of("gold", 550.0, [79.3, 1.25, f64::INFINITY, 0.22, 0.79, 0.74]),
    of("gold", 435.0, [92.2, 3.33, 2.73, 2.50, 3.41, 1.01]),
    of("copper", 700.0, [55.6, 2.54, 1.64, 0.10, 0.52, 0.21]),
    of("copper", 550.0, [100.0, 5.35, 1.70, 0.17, 0.90, 1.10]),
    of("copper", 435.0, [97.7, 5.13, 1.03, 0.22, 0.46, 1.07]),
    of("aluminium", 700.0, [88.9, 18.50, 2.16, 1.42, 3.71, 0.25]),
    of("aluminium", 550.0, [100.0, 11.14, 0.87, 0.70, 0.90, 0.27]),
    of("aluminium", 435.0, [92.6, 6.99, 1.47, 0.35, 0.67, 0.30]),
    of("iron", 700.0, [57.1, 30.37, 4.96, 1.83, 2.28, 0.89]),
    of("iron", 550.0, [52.4, 30.80, 5.21, 1.83, 2.50, 0.92]),
    of("iron", 435.0, [62.6, 24.28, 3.34, 1.21, 1.43, 1.08]),
    of("chromium", 700.0, [54.3, 32.94, 5.66, 2.09, 2.84, 0.82]),
    of("chromium", 550.0, [50.9, 34.32, 6.13, 2.22, 3.20, 0.80]),
    of("chromium", 435.0, [74.0, 22.05, 2.60, 1.12, 1.52, 1.06]),
    of("nickel", 700.0, [83.5, 23.16, 2.34, 1.34, 1.83, 0.78]),
    of("nickel", 550.0, [84.6, 20.47, 1.89, 1.07, 1.96, 0.99]),
    of("nickel", 435.0, [87.6, 14.78, 0.95, 0.60, 1.23, 1.16]),
    of("titanium", 700.0, [63.0, 31.34, 4.89, 2.00, 2.46, 0.78]),
    of("titanium", 550.0, [67.5, 27.12, 3.85, 1.57, 1.81, 0.92]),
    of("titanium", 435.0, [73.5, 21.92, 2.58, 1.10, 1.46, 1.07]),
];
