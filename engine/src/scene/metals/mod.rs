//! Complex indices of refraction of common metals, per RGB channel, from measured spectra.
//!
//! Four of them stand beside a second sample (`hagemann.rs`), under names of their own; a scene can name a file of its own, too ([`IndexSpectrum`]).
//! [`bins`] has spectra at more than three wavelengths.
//!
//! A channel's n and k are the means of the measured n and k (`spectra.rs`, interpolated linearly) over the channel's sensitivity
//! (`observer.rs`): CIE 1931 matching functions under D65, taken to linear Rec. 709. Guarantees, by the tests below: the normal
//! reflectance of three of the nine spectra (chromium, iron, copper) is within 0.0035 of what others published for the same measurements;
//! that of the three channels differs from that of its spectrum by at most 0.012, where the colour lies inside Rec. 709. Gold's red lies beyond it (1.04): no index of refraction reflects more than
//! comes in, and the channel has 0.98.

pub mod artistic;
pub mod bins;
mod form;
mod hagemann;
mod index_spectrum;
mod observer;
mod spectra;

use super::ConductorIor;
use crate::catalogue::{Role, Row, sources};
pub use artistic::by_colors;
pub use form::FresnelForm;
pub use index_spectrum::IndexSpectrum;
use spectra::Spectrum;

impl Spectrum {
    fn index(&self) -> IndexSpectrum {
        let number = |sample: &[u32; 3]| [0, 1, 2].map(|i| f64::from(sample[i]) * spectra::UNITS[i]);
        IndexSpectrum::new(self.samples.iter().map(number).collect())
    }
}

/// The metals, and other samples of some.
fn all() -> impl Iterator<Item = &'static Spectrum> {
    spectra::ALL.iter().chain(hagemann::ALL)
}

/// The names that [`by_name`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    all().map(|spectrum| spectrum.name)
}

/// The measured spectrum of a metal by its name (`aluminum` is understood too).
pub fn spectrum(name: &str) -> Option<IndexSpectrum> {
    let name = if name == "aluminum" { "aluminium" } else { name };
    all().find(|spectrum| spectrum.name == name).map(Spectrum::index)
}

/// The complex index of refraction of a metal by its name, per RGB channel.
pub fn by_name(name: &str) -> Option<ConductorIor> {
    spectrum(name).map(|spectrum| spectrum.channels())
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-F5",
        name: "indices of refraction of metals at 435, 550 and 700 nm",
        role: Role::PartOf("BG-3"),
        limits: "Three wavelengths stand for red, green and blue as they are, which is not what an observer sees: CL-METALS has means over the channels.",
        sources: &[
            sources::JOHNSON_CHRISTY_1972.whole(),
            sources::JOHNSON_CHRISTY_1974.whole(),
            sources::RAKIC_1995.whole(),
            sources::HAGEMANN_1975.whole(),
        ],
        tests: &[
            "engine/src/transport/fresnel/form.rs::constants_are_those_of_the_spectra",
            "engine/src/transport/fresnel/form.rs::hagemanns_metals_give_the_published_headline",
            "engine/src/scene/metals/index_spectrum.rs::texts_of_spectra_are_read_and_checked",
        ],
        experiment: "clerestory metal gold",
        api: &["clerestory::scene::metals::IndexSpectrum"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-METALS",
        name: "measured metals: gold, silver, copper, aluminium, iron, chromium, titanium, nickel, cobalt",
        role: Role::PartOf("BG-3"),
        limits: "One sample of each metal: reflectances that others measured differ by up to 0.01 (silver, aluminium), 0.07 (gold, nickel, iron, titanium), 0.11 (chromium) and, at the edge of copper near 590 nm, 0.18, and cobalt's were compared with none; three channels for a spectrum are off by up to 0.012, and gold's red, which is out of gamut, is 0.98.",
        sources: &[
            sources::JOHNSON_CHRISTY_1972.whole(),
            sources::JOHNSON_CHRISTY_1974.whole(),
            sources::RAKIC_1995.whole(),
        ],
        tests: &[
            "engine/src/scene/metals/mod.rs::spectra_reflect_what_others_computed_of_them",
            "engine/src/scene/metals/mod.rs::spectra_reflect_as_others_measured_within_the_spread_of_samples",
            "engine/src/scene/metals/mod.rs::channels_reflect_as_their_spectra_do",
            "engine/src/scene/metals/mod.rs::channels_reflect_like_other_samples_of_the_metals",
        ],
        experiment: "clerestory agreement --scene cornell-metals",
        api: &["clerestory::scene::metals"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    impl Spectrum {
        /// One of the quantities at a wavelength in nanometres: 1 is n, 2 is k.
        fn at(&self, wavelength: f64, quantity: usize) -> f64 {
            self.index().at(wavelength)[quantity - 1]
        }
    }

    /// Reflectance at normal incidence.
    fn reflectance(n: f64, k: f64) -> f64 {
        ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
    }

    fn of_channels(name: &str) -> DVec3 {
        let ior = by_name(name).expect("metal");
        let (n, k) = (ior.eta.as_dvec3(), ior.k.as_dvec3());
        DVec3::from_array([0, 1, 2].map(|i| reflectance(n[i], k[i])))
    }

    fn of_spectrum(spectrum: &Spectrum) -> DVec3 {
        observer::project(|wavelength| reflectance(spectrum.at(wavelength, 1), spectrum.at(wavelength, 2)))
    }

    fn deviation(a: DVec3, b: [f64; 3]) -> f64 {
        (a - DVec3::from_array(b)).abs().max_element()
    }

    #[test]
    fn spectra_cover_the_visible_wavelengths_in_order() {
        for spectrum in all() {
            let wavelengths: Vec<u32> = spectrum.samples.iter().map(|sample| sample[0]).collect();
            assert!(wavelengths.is_sorted_by(|a, b| a < b), "{}", spectrum.name);
            assert!(
                wavelengths[0] <= 38_000 && *wavelengths.last().expect("samples") >= 78_000,
                "{}",
                spectrum.name
            );
            // At a sample its own values, beyond the ends those of the ends.
            let [wavelength, n, k] = spectrum.samples[3].map(f64::from);
            let found = (spectrum.at(wavelength / 100.0, 1), spectrum.at(wavelength / 100.0, 2));
            assert!(
                (found.0 - n / 1e4).abs() < 1e-12 && (found.1 - k / 1e4).abs() < 1e-12,
                "{}",
                spectrum.name
            );
            let first = spectrum.samples[0].map(f64::from);
            assert_eq!(spectrum.at(0.0, 2), first[2] * 1e-4, "{}", spectrum.name);
        }
        assert!(by_name("aluminum").is_some() && by_name("mithril").is_none());
        assert_eq!(names().count(), 13);
    }

    #[test]
    fn a_constant_spectrum_is_grey() {
        assert!(deviation(observer::project(|_| 0.3), [0.3; 3]) < 1e-15);
        // Red light is seen by the red channel, blue light by the blue one; narrow bands have negative parts elsewhere.
        let red = observer::project(|wavelength| f64::from(u8::from(wavelength >= 620.0)));
        let blue = observer::project(|wavelength| f64::from(u8::from(wavelength <= 470.0)));
        assert!(
            red.max_element() == red.x && blue.max_element() == blue.z,
            "{red} {blue}"
        );
    }

    /// Colours that others computed from the same measurements, with other code: their last printed digit, and what a step of 10 nm
    /// leaves (0.003 for the steep edge of copper, found by a step of 5 nm), are all that may differ.
    #[test]
    fn spectra_reflect_what_others_computed_of_them() {
        for (name, published, bound) in [
            ("chromium", [0.549585, 0.556114, 0.554256], 0.001),
            ("iron", [0.530, 0.513, 0.494], 0.001),
            ("copper", [0.932, 0.623, 0.522], 0.0035),
        ] {
            let spectrum = spectra::ALL.iter().find(|s| s.name == name).expect("metal");
            let found = of_spectrum(spectrum);
            assert!(
                deviation(found, published) < bound,
                "{name}: {found} is not {published:?}"
            );
        }
    }

    /// Wavelength (nm), n and k of other samples of a metal, and by how much reflectances may differ.
    type Measured = (&'static str, &'static [[f64; 3]], f64);

    /// By S. Babar and J. H. Weaver, Appl. Opt. 54, 477 (2015): gold, silver, copper; K. M. McPeak et al., ACS Photonics 2, 326 (2015):
    /// aluminium; M. R. Querry, Contractor Report CRDC-CR-85034 (1985): iron; A. D. Rakić et al., Appl. Opt. 37, 5271 (1998), fits to what
    /// several measured: chromium, nickel, titanium. From the tables of refractiveindex.info. Bounds are the spread of the samples: 0.01 for
    /// the two metals whose films are clean, 0.07 for others, 0.11 for chromium. Copper's reflectance rises by a half between 560 and 600 nm,
    /// and a shift of its edge by 10 nm is the difference there: it stands by itself.
    const OTHERS: &[Measured] = &[
        (
            "gold",
            &[
                [442.8, 1.486, 1.797],
                [495.9, 0.8564, 1.629],
                [539.1, 0.329, 2.249],
                [590.4, 0.1823, 2.88],
                [652.5, 0.1091, 3.529],
            ],
            0.07,
        ),
        (
            "silver",
            &[
                [442.8, 0.052, 2.604],
                [495.9, 0.052, 3.105],
                [539.1, 0.05168, 3.483],
                [590.4, 0.04977, 3.918],
                [652.5, 0.04964, 4.432],
            ],
            0.01,
        ),
        (
            "copper",
            &[
                [442.8, 1.168, 2.299],
                [495.9, 1.121, 2.485],
                [539.1, 0.9717, 2.413],
                [652.5, 0.0878, 3.759],
            ],
            0.07,
        ),
        ("copper", &[[590.4, 0.1268, 2.918]], 0.18),
        (
            "aluminium",
            &[
                [450.0, 0.4892, 4.7783],
                [550.0, 0.7894, 5.8519],
                [650.0, 1.2464, 6.8523],
            ],
            0.01,
        ),
        (
            "iron",
            &[[450.0, 1.736, 2.906], [550.0, 2.189, 3.171], [650.0, 2.427, 3.361]],
            0.07,
        ),
        (
            "chromium",
            &[
                [456.56, 2.0753, 3.8913],
                [554.43, 2.8213, 4.2063],
                [654.85, 3.4522, 4.2727],
            ],
            0.11,
        ),
        (
            "nickel",
            &[
                [451.14, 1.6224, 2.7005],
                [547.79, 1.8127, 3.2625],
                [654.46, 2.07, 3.7773],
            ],
            0.07,
        ),
        (
            "titanium",
            &[
                [454.81, 1.4448, 3.0028],
                [552.24, 1.8802, 3.0214],
                [654.46, 2.0989, 3.1878],
            ],
            0.07,
        ),
    ];

    #[test]
    fn spectra_reflect_as_others_measured_within_the_spread_of_samples() {
        for (name, measured, bound) in OTHERS {
            let spectrum = spectra::ALL.iter().find(|s| s.name == *name).expect("metal");
            for [wavelength, n, k] in *measured {
                let found = reflectance(spectrum.at(*wavelength, 1), spectrum.at(*wavelength, 2));
                let other = reflectance(*n, *k);
                assert!(
                    (found - other).abs() < *bound,
                    "{name} at {wavelength} nm: {found}, measured by others {other}"
                );
            }
        }
        // Metals that a viewer tells apart are told apart: no other spectrum would pass for these.
        for (name, measured, bound) in OTHERS
            .iter()
            .filter(|(name, ..)| ["gold", "silver", "aluminium"].contains(name))
        {
            for spectrum in spectra::ALL.iter().filter(|s| s.name != *name) {
                let passes = |[wavelength, n, k]: &[f64; 3]| {
                    let found = reflectance(spectrum.at(*wavelength, 1), spectrum.at(*wavelength, 2));
                    (found - reflectance(*n, *k)).abs() < *bound
                };
                assert!(!measured.iter().all(passes), "{} passes for {name}", spectrum.name);
            }
        }
    }

    /// Tables of other samples of the same metals. Two published tables differ by 0.06 for gold and by 0.10 for titanium (polish, oxide,
    /// way of deposition): that is the spread of the matter itself, and what may differ here.
    #[test]
    fn channels_reflect_like_other_samples_of_the_metals() {
        for (name, published, bound) in [
            ("gold", [1.0, 0.765557, 0.336057], 0.06),
            ("silver", [0.971519, 0.959915, 0.915324], 0.065),
            ("copper", [0.955008, 0.637427, 0.538163], 0.06),
            ("aluminium", [0.913183, 0.921494, 0.924524], 0.01),
            ("iron", [0.56, 0.57, 0.58], 0.1),
            ("titanium", [0.541931, 0.496791, 0.449419], 0.1),
            ("nickel", [0.659777, 0.608679, 0.525649], 0.06),
            ("cobalt", [0.662124, 0.654864, 0.633732], 0.06),
        ] {
            let found = of_channels(name);
            assert!(
                deviation(found, published) < bound,
                "{name}: {found} is not {published:?}"
            );
        }
    }

    #[test]
    fn channels_reflect_as_their_spectra_do() {
        for spectrum in spectra::ALL {
            let ior = by_name(spectrum.name).expect("metal");
            assert!(
                ior.eta.min_element() > 0.0 && ior.k.min_element() > 0.0,
                "{}",
                spectrum.name
            );
            let (seen, found) = (of_spectrum(spectrum), of_channels(spectrum.name));
            let bound = if seen.max_element() > 1.0 { 0.02 } else { 0.012 };
            let clipped = seen.clamp(DVec3::ZERO, DVec3::ONE).to_array();
            assert!(deviation(found, clipped) < bound, "{}: {found}, {seen}", spectrum.name);
        }
    }
}
