//! What the complex index of refraction n − ik means: the wave inside a material, its decay, and the index of bound charges that swing.
//!
//! Sources: Born and Wolf, Principles of Optics, §14.1 (waves in a conductor); Feynman, Leighton and Sands, The Feynman Lectures on Physics I,
//! chapter 31 (the index of oscillators). Time goes by e^{+iωt}, so that a wave that decays has n − ik with k ≥ 0. Lengths are in the unit of the
//! wavelength in vacuum.

use std::f64::consts::{PI, TAU};

use crate::catalogue::{Role, Row, sources};

/// What is left of a wave's amplitude after a way inside: e^{−2πkx/λ}, λ the wavelength in vacuum.
pub fn wave_envelope(k: f64, wavelength: f64, depth: f64) -> f64 {
    (-TAU * k * depth / wavelength).exp()
}

/// The field of a wave of unit amplitude at time zero: its envelope times cos(2πnx/λ).
pub fn wave_field(eta: f64, k: f64, wavelength: f64, depth: f64) -> f64 {
    wave_envelope(k, wavelength, depth) * (TAU * eta * depth / wavelength).cos()
}

/// Wavelength inside: λ/n, shorter than in vacuum for n above 1.
pub fn wavelength_inside(eta: f64, wavelength: f64) -> f64 {
    wavelength / eta
}

/// Absorption coefficient 4πk/λ, by which intensity decays.
pub fn absorption_coefficient(k: f64, wavelength: f64) -> f64 {
    4.0 * PI * k / wavelength
}

/// Bound charges that swing alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// q² N f/(2 ε₀ m): charge, number in a volume, strength, mass; in the unit of a squared frequency.
    pub strength: f64,
    /// Angular frequency of resonance; 0 for free charges.
    pub resonance: f64,
    /// Damping rate.
    pub damping: f64,
}

/// n and k at an angular frequency: n − ik = 1 + Σ strength/(ω₀² − ω² + iδω), for indices near 1.
pub fn oscillator_index(oscillators: &[Oscillator], frequency: f64) -> [f64; 2] {
    let mut index = [1.0, 0.0];
    for &Oscillator {
        strength,
        resonance,
        damping,
    } in oscillators
    {
        let (real, imaginary) = (resonance * resonance - frequency * frequency, damping * frequency);
        let size = real * real + imaginary * imaginary;
        index[0] += strength * real / size;
        index[1] += strength * imaginary / size;
    }
    index
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "MET-F0",
    name: "complex index of refraction: waves that decay, oscillators",
    role: Role::PartOf("BG-3"),
    limits: "One plane wave in a uniform material; indices of oscillators hold near 1, and scenes take measured ones.",
    sources: &[
        sources::BORN_WOLF_1999.at("14.1"),
        sources::FEYNMAN_1964.at("volume I, 31"),
    ],
    tests: &[
        "engine/src/transport/fresnel/extinction.rs::waves_decay_as_published",
        "engine/src/transport/fresnel/extinction.rs::oscillators_make_dielectrics_and_metals",
    ],
    experiment: "clerestory metal gold",
    api: &["clerestory::transport::fresnel::extinction"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_decay_as_published() {
        for (k, depth, left) in [
            (0.1, 100.0, 0.855),
            (0.1, 1000.0, 0.208),
            (0.5, 100.0, 0.456),
            (0.5, 400.0, 0.0432),
            (0.0, 1000.0, 1.0),
        ] {
            let found = wave_envelope(k, 400.0, depth);
            assert!((found - left).abs() < 5e-4, "{k} {depth}: {found}");
            let intensity = (-absorption_coefficient(k, 400.0) * depth).exp();
            assert!((intensity - found * found).abs() < 1e-12);
        }
        let inside = wavelength_inside(1.2, 400.0);
        assert!((inside - 1000.0 / 3.0).abs() < 1e-9, "shorter than in vacuum");
        // A wavelength further the wave is what it was, but for its decay.
        for depth in [0.0, 37.0, 250.0] {
            let [here, there] = [depth, depth + inside].map(|depth| wave_field(1.2, 0.1, 400.0, depth));
            assert!((there - here * wave_envelope(0.1, 400.0, inside)).abs() < 1e-12);
        }
    }

    #[test]
    fn oscillators_make_dielectrics_and_metals() {
        let bound = Oscillator {
            strength: 0.2,
            resonance: 10.0,
            damping: 0.01,
        };
        // Far below the resonance: nothing is absorbed, and n is above 1.
        let [n, k] = oscillator_index(&[bound], 1.0);
        assert!((n - 1.002).abs() < 1e-4 && k < 1e-6, "{n} {k}");
        // At it: absorbed.
        let [n, k] = oscillator_index(&[bound], 10.0);
        assert!((n - 1.0).abs() < 1e-12 && (k - 0.2 / 0.1).abs() < 1e-9, "{n} {k}");
        // Free charges: phases faster than light.
        let free = Oscillator {
            resonance: 0.0,
            ..bound
        };
        let [n, k] = oscillator_index(&[free], 1.0);
        assert!(n < 1.0 && k > 0.0, "{n} {k}");
    }
}
