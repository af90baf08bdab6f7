//! A scene of metals in bins of wavelengths: three at a time in the place of red, green and blue, summed as an observer does.
//!
//! The metals' indices are those of their spectra at each bin, and all else is grey, so that a pass is an ordinary picture of the same light paths and the sum is what channels
//! only stand for. Its error falls with the number of bins ([`Bins`]: at most 0.011 of white by 8 bins, 6·10⁻⁴ by 41, for one reflection of the engine's metals).
//! All passes take the same random numbers: their noise is common to them, and a metal without a colour has none in the picture. Deterministic as the technique is.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{FrameReport, RenderOptions, render};
use crate::Result;
use crate::catalogue::{Role, Row, sources};
use crate::film::picture::{Metadata, Picture, RADIANCE};
use crate::gpu::Gpu;
use crate::scene::Scene;
use crate::scene::metals::IndexSpectrum;
use crate::scene::metals::bins::{Bins, check_bins, set_wavelengths};

/// A material whose index has a spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralMetal {
    /// Index into [`Scene::materials`], of one with a conductor, whose bands the spectrum replaces.
    pub material: u32,
    /// Its index over wavelengths.
    pub spectrum: IndexSpectrum,
}

/// A finished picture of bins.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SpectralPicture {
    /// The layer `radiance`, linear Rec. 709 under D65: colours outside of it have negative parts.
    pub picture: Picture,
    /// How each pass came about, three bins each.
    pub reports: Vec<FrameReport>,
}

/// Renders a scene in bins of wavelengths; the options are those of each pass, but for a time budget, of which each has an equal share. Each pass uploads the scene and builds its
/// ray index anew. AOVs are not gathered.
///
/// # Errors
/// As [`check_bins`] and [`render`].
pub fn render_spectral(
    gpu: &Gpu,
    scene: &Scene,
    metals: &[SpectralMetal],
    bins: &Bins,
    options: &RenderOptions,
) -> Result<SpectralPicture> {
    let materials: Vec<u32> = metals.iter().map(|metal| metal.material).collect();
    check_bins(scene, &materials)?;
    let passes = bins.passes();
    let options = RenderOptions {
        aovs: false,
        time_budget: options.time_budget.map(|budget| budget / passes.len() as u32),
        ..options.clone()
    };
    let mut scene = scene.clone();
    let [width, height] = options.size;
    let mut sums = vec![DVec3::ZERO; width as usize * height as usize];
    let mut reports = Vec::with_capacity(passes.len());
    let mut metadata = None;
    for pass in &passes {
        let indices = metals.iter().map(|metal| (metal.material, &metal.spectrum));
        set_wavelengths(&mut scene, indices, pass.wavelengths);
        let rendered = render(gpu, &scene, &options)?;
        for (sum, bins) in sums.iter_mut().zip(rendered.picture.require(RADIANCE)?.pixels()) {
            *sum += pass.color(bins);
        }
        metadata.get_or_insert(rendered.picture.metadata);
        reports.push(rendered.report);
    }
    let values = sums.into_iter().flat_map(|sum| sum.as_vec3().to_array()).collect();
    let mut picture = Picture::from_radiance(width, height, values)?;
    let first = metadata.unwrap_or_default();
    picture.metadata = Metadata {
        seconds: Some(reports.iter().map(|report| report.render_seconds).sum()),
        other: BTreeMap::from([("bins".to_owned(), bins.wavelengths().len().to_string())])
            .into_iter()
            .chain(first.other.clone())
            .collect(),
        ..first
    };
    Ok(SpectralPicture { picture, reports })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-SPECTRAL-METALS",
    name: "metals in 8 to 41 bins of wavelengths, three a pass, summed by the observer",
    role: Role::Service,
    limits: "Light and all other surfaces are grey, without fluorescence and interference; each pass uploads the scene again, and eight bins are off by up to 0.01 of white at a reflection.",
    sources: &[
        sources::JOHNSON_CHRISTY_1972.whole(),
        sources::JOHNSON_CHRISTY_1974.whole(),
        sources::RAKIC_1995.whole(),
    ],
    tests: &[
        "engine/src/scene/metals/bins.rs::bins_converge_to_the_observers_tables",
        "engine/src/scene/metals/bins.rs::weights_keep_grey_and_lines",
        "engine/src/scene/metals/bins.rs::channels_lose_what_bins_keep",
        "tests/tests/paths/spectral_metals.rs::bins_are_summed_to_the_colour_of_two_reflections",
        "tests/tests/paths/spectral_metals.rs::grey_metals_have_no_colour_in_bins",
        "tests/tests/paths/determinism.rs::threads_of_the_driver_never_show_on_metals",
        "tests/tests/paths/spectral_metals.rs::colours_without_a_spectrum_are_refused",
    ],
    api: &[
        "clerestory::render::spectral::render_spectral",
        "clerestory::scene::metals::bins::Bins",
    ],
    ..Row::of(file!())
}];
