//! Ways to make pictures of metals of many wavelengths, and the scene that they are made of: a half pipe under a white sky, seen from above.

use std::f64::consts::PI;

use clerestory::Result;
use clerestory::film::picture::RADIANCE;
use clerestory::gpu::Gpu;
use clerestory::render::spectral::{SpectralMetal, render_spectral};
use clerestory::render::{RenderOptions, render};
use clerestory::scene::metals::artistic::{artistic_parameters, by_colors};
use clerestory::scene::metals::bins::Bins;
use clerestory::scene::metals::{self, IndexSpectrum};
use clerestory::scene::{Camera, ConductorIor, Environment, FresnelForm, Material, Mesh, Projection, Scene};
use clerestory::transport::fresnel::curve::CurveForm;
use glam::{DVec3, Vec3};

/// Wavelengths in the place of red, green and blue, nm.
const WAVELENGTHS: [f64; 3] = [700.0, 550.0, 435.0];
/// Facets of the half pipe.
const FACETS: u32 = 64;
/// How far from the middle the half pipe of radius 1 is seen: beyond, light is reflected very often.
const SEEN: f32 = 0.95;
/// A metal of one index at all wavelengths.
pub const GREY: &str = "grey";
/// Width over height of pictures.
pub const ASPECT: u32 = 16;

/// A way to make a picture.
#[derive(Debug, Clone, Copy)]
pub enum Way {
    /// A form in channels.
    Channels(FresnelForm),
    /// The simplified factor in channels, from reflectance at normal incidence and edge tint.
    Colors,
    /// The exact factor at three wavelengths.
    Wavelengths,
    /// The exact factor in so many bins.
    Bins(u32),
}

impl Way {
    /// What tables call it.
    pub fn name(self) -> String {
        match self {
            Self::Channels(form) => form.name().into(),
            Self::Colors => "reflectance and edge tint".into(),
            Self::Wavelengths => "three wavelengths".into(),
            Self::Bins(count) => bins_name(count),
        }
    }

    /// How many pictures it takes.
    pub const fn pictures(self) -> u32 {
        match self {
            Self::Channels(_) | Self::Colors | Self::Wavelengths => 1,
            Self::Bins(count) => count.div_ceil(3),
        }
    }

    /// What a device evaluates.
    pub const fn curve(self) -> CurveForm {
        match self {
            Self::Channels(form) => match form {
                FresnelForm::Exact => CurveForm::Exact,
                FresnelForm::Schlick | FresnelForm::Rescaled => CurveForm::RescaledF0,
                FresnelForm::Compensated => CurveForm::CompensatedF0,
                FresnelForm::F82Tint | FresnelForm::Hoffman => CurveForm::Tinted,
                FresnelForm::Simplified => CurveForm::Simplified,
                FresnelForm::Table => CurveForm::Table,
            },
            Self::Colors => CurveForm::Artistic,
            Self::Wavelengths | Self::Bins(_) => CurveForm::Exact,
        }
    }

    /// All pixels of the metal's half pipe.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn picture(self, gpu: &Gpu, spectrum: &IndexSpectrum, options: &RenderOptions) -> Result<Vec<DVec3>> {
        let channels = spectrum.channels();
        let (conductor, form) = match self {
            Self::Channels(form) => (channels, form),
            Self::Colors => (by_two_colors(&channels)?, FresnelForm::Simplified),
            Self::Wavelengths => (spectrum.at_wavelengths(WAVELENGTHS), FresnelForm::Exact),
            Self::Bins(_) => (channels, FresnelForm::Exact),
        };
        let mut scene = half_pipe();
        if let Some(material) = scene.materials.first_mut() {
            material.conductor = Some(conductor);
            material.fresnel = form;
        }
        let picture = match self {
            Self::Bins(count) => {
                let metal = SpectralMetal {
                    material: 0,
                    spectrum: spectrum.clone(),
                };
                render_spectral(gpu, &scene, &[metal], &Bins::new(count)?, options)?.picture
            }
            _ => render(gpu, &scene, options)?.picture,
        };
        let pixels = picture.require(RADIANCE)?.pixels();
        Ok(pixels.map(|pixel| Vec3::from_array(pixel).as_dvec3()).collect())
    }
}

/// What tables call bins of so many.
pub fn bins_name(count: u32) -> String {
    format!("{count} bins")
}

/// The spectrum of a metal, or of [`GREY`].
///
/// # Errors
/// [`clerestory::Error::Setting`] for an unknown metal.
pub fn spectrum_of(metal: &str) -> Result<IndexSpectrum> {
    let refused = |cause: String| clerestory::Error::setting("metal", metal, cause);
    if metal == GREY {
        return IndexSpectrum::parse("380 1.4 6.2\n780 1.4 6.2").map_err(|cause| refused(cause.to_string()));
    }
    metals::spectrum(metal).ok_or_else(|| refused("is none that is known".into()))
}

/// The index that an artist would have described by two colours, which hold no more than single precision.
///
/// # Errors
/// As [`by_colors`]; an index has both colours in range.
fn by_two_colors(ior: &ConductorIor) -> Result<ConductorIor> {
    let [reflectance, edge_tint] =
        artistic_parameters(ior.eta.as_dvec3(), ior.k.as_dvec3()).map(|color| color.as_vec3());
    by_colors(reflectance, edge_tint)
}

/// A half pipe of radius 1 under a white sky, whose one material is a mirror.
fn half_pipe() -> Scene {
    let mut scene = Scene::default();
    let metal = scene.add_material(Material::mirror("metal", Vec3::ONE));
    let edge = |z: f32| {
        (0..=FACETS).map(move |i| {
            let angle = PI * f64::from(i) / f64::from(FACETS);
            Vec3::new(-angle.cos() as f32, 1.0 - angle.sin() as f32, z)
        })
    };
    let other = FACETS + 1;
    let facet = |i: u32| [[i, i + other, i + 1], [i + 1, i + other, i + other + 1]];
    scene.place(Mesh {
        name: "half pipe".into(),
        positions: edge(-2.0).chain(edge(2.0)).collect(),
        triangles: (0..FACETS).flat_map(facet).collect(),
        material: Some(metal),
        ..Mesh::default()
    });
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene.cameras.push(Camera {
        // Square pixels: the picture is as many times wider than high as the half pipe's part that is seen.
        projection: Projection::Orthographic {
            half_height: SEEN / ASPECT as f32,
        },
        ..Camera::look_at("main", DVec3::new(0.0, 4.0, 0.0), DVec3::ZERO, DVec3::NEG_Z, 1.0)
    });
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_colours_in_single_precision_are_the_index() {
        let ior = metals::by_name("gold").expect("metal");
        let [before, after] = [ior, by_two_colors(&ior).expect("colours")].map(|ior| [ior.eta, ior.k]);
        for (a, b) in before.iter().zip(&after) {
            assert!((*a - *b).abs().max_element() < 1e-3, "{a} {b}");
        }
    }
}
