//! Bins of wavelengths: a spectrum at a few places, and what each of them adds to the red, green and blue of a picture.
//!
//! A bin's weight is what an observer (`observer.rs`: CIE 1931, D65, Rec. 709) makes of a hat that is 1 at its wavelength and falls to 0 at its neighbours':
//! spectra that are linear between the bins are summed without an error, and weights of a channel sum to 1. Light of one grey is daylight of that strength.
//! Three bins are rendered at a time, in the place of red, green and blue.

use std::collections::BTreeSet;

use glam::{DVec3, Vec3};

use super::observer;
use crate::scene::{ConductorIor, Image, LightKind, Material, Scene};
use crate::{Error, Result};

/// Fewest and most bins.
pub const COUNTS: [u32; 2] = [8, 41];
/// Wavelengths of the first and the last bin, nm: what spectra have to cover. What is seen beyond them counts for these two.
pub const ENDS: [f64; 2] = [400.0, 700.0];

/// Evenly spaced wavelengths with their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Bins {
    wavelengths: Vec<f64>,
    weights: Vec<DVec3>,
}

/// Three bins that are rendered together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BinPass {
    /// Nanometres, in the place of red, green and blue: the longest is red.
    pub wavelengths: [f64; 3],
    /// What one unit of each adds to red, green and blue; some are negative.
    pub weights: [DVec3; 3],
}

impl Bins {
    /// So many bins from 400 to 700 nm.
    ///
    /// # Errors
    /// [`Error::Setting`] for a count outside [`COUNTS`].
    pub fn new(count: u32) -> Result<Self> {
        let [fewest, most] = COUNTS;
        if !(fewest..=most).contains(&count) {
            return Err(Error::setting("bins", count, format!("is not in {fewest}..={most}")));
        }
        let [first, last] = ENDS;
        let steps = f64::from(count - 1);
        let place = |wavelength: f64| ((wavelength - first) / (last - first) * steps).clamp(0.0, steps);
        let hat = |bin: u32| observer::project(|at| (1.0 - (place(at) - f64::from(bin)).abs()).max(0.0));
        Ok(Self {
            wavelengths: (0..count)
                .map(|bin| first + (last - first) * f64::from(bin) / steps)
                .collect(),
            weights: (0..count).map(hat).collect(),
        })
    }

    /// Nanometres, rising.
    pub fn wavelengths(&self) -> &[f64] {
        &self.wavelengths
    }

    /// What one unit of each bin adds to red, green and blue.
    pub fn weights(&self) -> &[DVec3] {
        &self.weights
    }

    /// The colour of a spectrum, by its values at the bins. `spectrum` takes nanometres.
    pub fn color(&self, spectrum: impl Fn(f64) -> f64) -> DVec3 {
        let bins = self.wavelengths.iter().zip(&self.weights);
        bins.map(|(wavelength, weight)| *weight * spectrum(*wavelength)).sum()
    }

    /// All bins by threes, whose wavelengths lie far apart, as those of red, green and blue do. Where the count is no multiple of three, the last passes repeat a
    /// wavelength with the weight 0.
    pub fn passes(&self) -> Vec<BinPass> {
        let stride = self.wavelengths.len().div_ceil(3);
        let of = |pass: usize| {
            let bins = [2, 1, 0].map(|third| pass + third * stride);
            BinPass {
                wavelengths: bins.map(|bin| self.wavelengths.get(bin).copied().unwrap_or(ENDS[1])),
                weights: bins.map(|bin| self.weights.get(bin).copied().unwrap_or(DVec3::ZERO)),
            }
        };
        (0..stride).map(of).collect()
    }
}

impl BinPass {
    /// What a pixel of the pass, three bins, adds to red, green and blue.
    pub fn color(&self, bins: [f32; 3]) -> DVec3 {
        let [long, middle, short] = bins.map(f64::from);
        self.weights[0] * long + self.weights[1] * middle + self.weights[2] * short
    }
}

/// Checks that bins can stand for the colours of a scene: the metals of these materials have spectra, and all else is grey, so that no spectrum of it is missing.
///
/// # Errors
/// [`Error::Scene`], with the place: an index that no material has or that is there twice, a material without a measured conductor, and whatever has a colour: base colours,
/// emission, specular and attenuation colours, their textures, other conductors, vertices, lights, media, the environment.
pub fn check_bins(scene: &Scene, materials: &[u32]) -> Result<()> {
    let fault = |at: String, cause: &str| Err(Error::scene(&scene.source, at, cause));
    let name = |index: usize, name: &str| format!("materials[{index}] ({name})");
    let mut spectral = BTreeSet::new();
    for index in materials {
        let Some(material) = scene.materials.get(*index as usize) else {
            return fault(format!("materials[{index}]"), "is not there, and has a spectrum");
        };
        let at = name(*index as usize, &material.name);
        if material.conductor.is_none() || material.metallic <= 0.0 {
            return fault(at, "has a spectrum, and no conductor that it could be of");
        }
        if !spectral.insert(*index as usize) {
            return fault(at, "has two spectra");
        }
    }
    for (index, material) in scene.materials.iter().enumerate() {
        let colored = colored_part(scene, material, spectral.contains(&index));
        if let Some(part) = colored {
            return fault(name(index, &material.name), &format!("{part} {COLORED}"));
        }
    }
    for (index, mesh) in scene.meshes.iter().enumerate() {
        if !mesh.colors.iter().all(|color| is_grey(color.truncate())) {
            return fault(
                format!("meshes[{index}] ({})", mesh.name),
                &format!("a vertex {COLORED}"),
            );
        }
    }
    for (index, light) in scene.lights.iter().enumerate() {
        let (LightKind::Point { intensity: color, .. }
        | LightKind::Spot { intensity: color, .. }
        | LightKind::Directional { irradiance: color, .. }) = light.kind;
        if !is_grey(color) {
            return fault(format!("lights[{index}] ({})", light.name), COLORED);
        }
    }
    for (index, medium) in scene.media.iter().enumerate() {
        if ![medium.sigma_a, medium.sigma_s, medium.emission]
            .into_iter()
            .all(is_grey)
        {
            return fault(format!("media[{index}] ({})", medium.name), COLORED);
        }
    }
    match &scene.environment {
        Some(environment) if !environment.radiance.iter().copied().all(is_grey) => {
            fault(format!("environment ({})", environment.name), COLORED)
        }
        _ => Ok(()),
    }
}

/// Gives metals the index at three wavelengths, in the place of red, green and blue; [`check_bins`] has passed.
pub fn set_wavelengths<'a>(
    scene: &mut Scene,
    metals: impl IntoIterator<Item = (u32, &'a super::IndexSpectrum)>,
    wavelengths: [f64; 3],
) {
    for (index, spectrum) in metals {
        if let Some(material) = scene.materials.get_mut(index as usize) {
            material.conductor = Some(spectrum.at_wavelengths(wavelengths));
        }
    }
}

/// What is wrong with what is not grey.
const COLORED: &str = "has a colour, whose spectrum is not known: bins of wavelengths take grey";

fn is_grey(color: Vec3) -> bool {
    color == Vec3::splat(color.x)
}

/// The first part of a material that has a colour.
fn colored_part(scene: &Scene, material: &Material, is_spectral: bool) -> Option<&'static str> {
    let grey_ior = |ior: &ConductorIor| is_grey(ior.eta) && is_grey(ior.k);
    let grey_image = |image: &Image| image.texels.iter().all(|[r, g, b, _]| r == g && g == b);
    let grey_texture = |texture: &Option<crate::scene::Texture>| {
        let image = texture.and_then(|texture| scene.images.get(texture.image as usize));
        image.is_none_or(grey_image)
    };
    let parts = [
        ("the base colour", is_grey(material.base_color.truncate())),
        (
            "the texture of the base colour",
            grey_texture(&material.base_color_texture),
        ),
        ("the emission", is_grey(material.emission)),
        ("the texture of the emission", grey_texture(&material.emission_texture)),
        ("the specular colour", is_grey(material.specular_color)),
        (
            "the texture of the specular colour",
            grey_texture(&material.specular_color_texture),
        ),
        ("the attenuation", is_grey(material.attenuation_color)),
        (
            "the conductor, which has no spectrum,",
            is_spectral || material.conductor.as_ref().is_none_or(grey_ior),
        ),
    ];
    parts.into_iter().find_map(|(part, grey)| (!grey).then_some(part))
}

#[cfg(test)]
mod tests {
    use super::super::{IndexSpectrum, spectra, spectrum};
    use super::*;

    /// Reflectance at normal incidence, met so many times.
    fn reflectance(spectrum: &IndexSpectrum, wavelength: f64, times: i32) -> f64 {
        let [n, k] = spectrum.at(wavelength);
        (((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)).powi(times)
    }

    /// The greatest error of any channel of any metal, against all 41 samples of the observer's tables.
    fn worst(count: u32, times: i32) -> f64 {
        let bins = Bins::new(count).expect("bins");
        let of = |metal: &spectra::Spectrum| {
            let index = spectrum(metal.name).expect("spectrum");
            let of = |wavelength: f64| reflectance(&index, wavelength, times);
            (bins.color(of) - observer::project(of)).abs().max_element()
        };
        spectra::ALL.iter().map(of).fold(0.0, f64::max)
    }

    #[test]
    fn bins_converge_to_the_observers_tables() {
        for (count, once, four_times) in [
            (8, 0.011, 0.022),
            (16, 0.0025, 0.004),
            (24, 0.0016, 0.002),
            (41, 6e-4, 8e-4),
        ] {
            let found = [worst(count, 1), worst(count, 4)];
            assert!(found[0] < once && found[1] < four_times, "{count}: {found:?}");
        }
        assert!(worst(8, 4) > 4.0 * worst(16, 4) && worst(16, 4) > 4.0 * worst(41, 4));
    }

    #[test]
    fn weights_keep_grey_and_lines() {
        for count in COUNTS[0]..=COUNTS[1] {
            let bins = Bins::new(count).expect("bins");
            assert!((bins.color(|_| 0.4) - 0.4).abs().max_element() < 1e-12, "{count}");
            let line = |wavelength: f64| wavelength.clamp(400.0, 700.0) / 300.0;
            let gap = (bins.color(line) - observer::project(line)).abs().max_element();
            assert!(gap < 1e-12, "{count}: {gap}");
            // Each bin is in one pass, the longest wavelength as red.
            let mut seen = DVec3::ZERO;
            for pass in bins.passes() {
                assert!(pass.wavelengths[0] > pass.wavelengths[1] && pass.wavelengths[1] > pass.wavelengths[2]);
                seen += pass.color(pass.wavelengths.map(|wavelength| wavelength as f32));
            }
            assert_eq!(bins.passes().len() as u32, count.div_ceil(3));
            let all = bins.color(|wavelength| f64::from(wavelength as f32));
            assert!((seen - all).abs().max_element() < 1e-9, "{count}: {seen} {all}");
        }
        for count in [0, 7, 42, u32::MAX] {
            assert!(
                Bins::new(count).expect_err("count").to_string().contains("8..=41"),
                "{count}"
            );
        }
    }

    /// Channels of means of n and k are near at one reflection, and lose the colour of copper's edge where there are more.
    #[test]
    fn channels_lose_what_bins_keep() {
        let red = |name: &str, times: i32| {
            let index = spectrum(name).expect("spectrum");
            let ior = index.channels();
            let channels = IndexSpectrum::new(vec![[400.0, ior.eta.x.into(), ior.k.x.into()]]);
            let bins = Bins::new(41).expect("bins");
            reflectance(&channels, 400.0, times) - bins.color(|at| reflectance(&index, at, times)).x
        };
        assert!((red("copper", 1) - 0.0112).abs() < 1e-3 && (red("copper", 4) - 0.1164).abs() < 1e-3);
        assert!(red("silver", 4).abs() < 0.002 && red("iron", 4).abs() < 0.001);
    }
}
