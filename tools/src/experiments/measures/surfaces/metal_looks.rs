//! Rings of metals under a white sky: by Schlick's curve without k, by the rescaled curve, by the exact factor; and which metals look brighter and warmer than others.
//!
//! Oracle: the exact factor on the same light paths, by the same random numbers. All that is seen in the ring is the sky, reflected once or more often.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::film::picture::RADIANCE;
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, render};
use clerestory::scene::{Camera, Environment, FresnelForm, Material, Mesh, Scene, metals};
use clerestory::techniques::PathTracerSettings;
use glam::{DVec3, Vec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

/// Wavelengths of red, green and blue, nm.
const WAVELENGTHS: [f64; 3] = [700.0, 550.0, 435.0];
const METALS: [&str; 10] = [
    "copper",
    "gold",
    "silver",
    "silver-hagemann",
    "aluminium",
    "iron",
    "chromium",
    "nickel",
    "titanium",
    "cobalt",
];
const FORMS: [FresnelForm; 3] = [FresnelForm::Schlick, FresnelForm::Rescaled, FresnelForm::Exact];
/// Radius of the ring, and of the tube, metres.
const RADII: [f64; 2] = [1.0, 0.35];
/// Cells along the ring and around the tube.
const CELLS: [u32; 2] = [96, 48];
/// By how much a ring's pixel differs from the sky.
const OF_RING: f64 = 1e-3;
const PICTURE: &str = "rings.png";

rows! {
    /// A ring.
    struct Row = "Mean colours of rings under a white sky" by [metal, form] {
        metal: String = "metal",
        form: String = "form",
        red: f64 = "red",
        green: f64 = "green",
        blue: f64 = "blue",
        off: f64 = "greatest difference of a band from the exact factor's (%)",
        off_green_blue: f64 = "least difference of green and blue from it (%)",
        warmth: f64 = "red over blue",
        of_iron: f64 = "mean over that of iron by the exact factor",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the rescaled curve has the ring's colour: greatest difference of a band (%)",
        Bound::AtMost(3.0),
        |row: &Row| row.off.into(),
    )
    .among(|row| ["copper", "gold", "silver"].contains(&row.metal.as_str()) && row.form == FresnelForm::Rescaled.name())
    .because("its averages over the hemisphere are off by 1 % for these"),
    Criterion::each(
        "Schlick's curve has not: least difference of copper's green and blue (%)",
        Bound::AtLeast(50.0),
        |row: &Row| row.off_green_blue.into(),
    )
    .among(|row| row.metal == "copper" && row.form == FresnelForm::Schlick.name()),
    Criterion::each(
        "silver is brighter than iron: mean over its",
        Bound::AtLeast(1.5),
        |row: &Row| row.of_iron.into(),
    )
    .among(|row| row.metal == "silver" && row.form == FresnelForm::Exact.name())
    .because("0.98 and 0.51 at normal incidence"),
    Criterion::each(
        "silver by Hagemann's constants is warmer than chromium: red over blue",
        Bound::AtLeast(1.04),
        |row: &Row| row.warmth.into(),
    )
    .among(|row| row.metal == "silver-hagemann" && row.form == FresnelForm::Exact.name())
    .because("1.085 at normal incidence, beside 1.022"),
    Criterion::each("chromium is not: red over blue", Bound::AtMost(1.04), |row: &Row| {
        row.warmth.into()
    })
    .among(|row| row.metal == "chromium" && row.form == FresnelForm::Exact.name()),
];

/// A smooth ring that lies in the plane y = 0.
fn torus(material: u32) -> Mesh {
    let [along, around] = CELLS;
    let mut mesh = Mesh {
        name: "ring".into(),
        material: Some(material),
        ..Mesh::default()
    };
    for i in 0..along {
        for j in 0..around {
            let turn = TAU * f64::from(i) / f64::from(along);
            let (sine, cosine) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
            let out = DVec3::new(turn.cos(), 0.0, turn.sin());
            let normal = cosine * out + sine * DVec3::Y;
            mesh.positions.push((RADII[0] * out + RADII[1] * normal).as_vec3());
            mesh.normals.push(normal.as_vec3());
            let index = |i: u32, j: u32| i % along * around + j % around;
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    mesh
}

/// All pixels of a metal's ring by a form.
fn ring(gpu: &Gpu, metal: &str, form: FresnelForm, options: &RenderOptions) -> Result<Vec<DVec3>> {
    let mut scene = Scene::default();
    let material = scene.add_material(Material {
        conductor: metals::spectrum(metal).map(|spectrum| spectrum.at_wavelengths(WAVELENGTHS)),
        fresnel: form,
        ..Material::mirror(metal, Vec3::ONE)
    });
    scene.place(torus(material));
    scene.environment = Some(Environment::uniform(Vec3::ONE));
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 2.6, 3.1),
        DVec3::ZERO,
        DVec3::Y,
        40f32.to_radians(),
    ));
    let picture = render(gpu, &scene, options)?.picture;
    let pixels = picture.require(RADIANCE)?.pixels();
    Ok(pixels.map(|pixel| Vec3::from_array(pixel).as_dvec3()).collect())
}

/// The mean over the pixels of the ring, which are those where the exact factor's picture is not the sky.
fn mean(pixels: &[DVec3], exact: &[DVec3]) -> DVec3 {
    let is_ring = |exact: &DVec3| (*exact - 1.0).abs().max_element() > OF_RING;
    let of_ring: Vec<DVec3> = (pixels.iter().zip(exact))
        .filter(|(_, exact)| is_ring(exact))
        .map(|(pixel, _)| *pixel)
        .collect();
    of_ring.iter().copied().sum::<DVec3>() / of_ring.len().max(1) as f64
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let side = context.pick(96, 8);
        let options = RenderOptions {
            size: [side; 2],
            spp: context.pick(64, 1),
            settings: PathTracerSettings {
                // Without roulette: paths end in the sky.
                roulette_start: 64,
                ..PathTracerSettings::default()
            }
            .into(),
            ..RenderOptions::default()
        };
        let metals = context.pick(METALS.to_vec(), vec!["copper"]);
        let iron = ring(&gpu, "iron", FresnelForm::Exact, &options)?;
        let iron = mean(&iron, &iron).element_sum();
        let mut shown = Vec::new();
        let rows = context.each(
            &metals,
            |metal| (*metal).into(),
            |metal| {
                let pictures: Vec<Vec<DVec3>> = FORMS
                    .iter()
                    .map(|form| ring(&gpu, metal, *form, &options))
                    .collect::<Result<_>>()?;
                let of_exact = pictures.last().map_or(&[][..], |picture| &picture[..]);
                let exact = mean(of_exact, of_exact);
                let row = |(form, picture): (&FresnelForm, &Vec<DVec3>)| {
                    let color = mean(picture, of_exact);
                    let off = 100.0 * ((color - exact) / exact).abs();
                    Row {
                        metal: (*metal).into(),
                        form: form.name().into(),
                        red: color.x,
                        green: color.y,
                        blue: color.z,
                        off: off.max_element(),
                        off_green_blue: off.y.min(off.z),
                        warmth: color.x / color.z,
                        of_iron: color.element_sum() / iron,
                    }
                };
                let rows = FORMS.iter().zip(&pictures).map(row).collect();
                shown.extend(pictures);
                Ok(rows)
            },
        )?;
        context.picture(PICTURE, &sheet(&shown, side, 3 * FORMS.len() as u32));
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let is = |row: &&Row| row.metal == "copper" && row.form == FresnelForm::Rescaled.name();
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "copper's ring by the rescaled curve: greatest difference of a band (%)",
                self.iter().find(is).map(|row| row.off.into()),
            )
            .note("Means are over the pixels of the ring. n and k at 700, 550 and 435 nm by Johnson and Christy (1972, 1974), Rakić (1995) and Hagemann, Gudat and Kunz (1975); iron stands for steel.");
        if self.is_empty() {
            return findings;
        }
        findings.picture(
            PICTURE,
            "Three metals a row, each by Schlick's curve, the rescaled one and the exact factor: copper, gold, silver; silver by Hagemann's constants, aluminium, iron; chromium, nickel, titanium; cobalt",
        )
    }
}
