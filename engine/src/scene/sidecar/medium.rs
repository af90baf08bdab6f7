//! Participating media in the sidecar.
//!
//! ```toml
//! [[medium]]                    # around everything; there is at most one such
//! sigma_a = 0.01                # absorption, 1/m: one number, or three for red, green and blue; 0 if not given
//! sigma_s = [0.10, 0.12, 0.15]  # scattering, likewise
//! phase = "rayleigh"            # isotropic (the default), hg, schlick or rayleigh
//!
//! [[medium]]
//! name = "smoke"
//! material = "bounds"           # inside the meshes with this material …
//! boundary = true               # … which are not seen themselves; without it they must be solids that transmit
//! sigma_t = 20.0                # instead of sigma_a and sigma_s: extinction, 1/m,
//! albedo = [0.9, 0.9, 0.9]      # and the share of it that is scattering
//! emission = [0.0, 0.0, 0.0]    # W·m⁻³·sr⁻¹
//! phase = "hg"
//! g = 0.5                       # mean cosine; with phase = "schlick", k = 0.5
//! density = { generate = "smoke", size = 96, low = [-1.0, 0.0, -1.0], high = [1.0, 2.0, 1.0] }
//! ```
//!
//! `g` without `phase` means Henyey and Greenstein's. All coefficients are those at density 1; what `density` may be says [`density`](super::density). A single table may be written `[medium]`.
//! The extension `KHR_materials_volume` of glTF makes no medium: its absorption stays that of the solid, and a solid with both is an error.

use std::fmt;

use glam::Vec3;
use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use super::density::DensityTable;
use super::{Budget, Named, Sidecar};
use crate::Result;
use crate::scene::medium::MAX_MEDIA;
use crate::scene::{Medium, Phase, Scene};

/// One table.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MediumTable {
    name: Option<String>,
    material: Option<String>,
    #[serde(default)]
    boundary: bool,
    sigma_a: Option<Bands>,
    sigma_s: Option<Bands>,
    sigma_t: Option<Bands>,
    albedo: Option<Bands>,
    emission: Option<Bands>,
    density: Option<DensityTable>,
    phase: Option<String>,
    g: Option<f32>,
    k: Option<f32>,
}

/// One number for all bands, or one for each.
#[derive(Debug, Clone, Copy)]
struct Bands(Vec3);

impl<'de> Deserialize<'de> for Bands {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Numbers;
        impl<'de> Visitor<'de> for Numbers {
            type Value = Bands;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or three of them")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Bands, E> {
                Ok(Bands(Vec3::splat(value as f32)))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Bands, E> {
                Ok(Bands(Vec3::splat(value as f32)))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, values: A) -> Result<Bands, A::Error> {
                <[f32; 3]>::deserialize(SeqAccessDeserializer::new(values)).map(|bands| Bands(bands.into()))
            }
        }
        deserializer.deserialize_any(Numbers)
    }
}

/// `[medium]` or any number of `[[medium]]`.
pub(super) fn one_or_many<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<MediumTable>, D::Error> {
    struct Tables;
    impl<'de> Visitor<'de> for Tables {
        type Value = Vec<MediumTable>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a table [medium] or tables [[medium]]")
        }

        fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Self::Value, A::Error> {
            MediumTable::deserialize(MapAccessDeserializer::new(table)).map(|table| vec![table])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, tables: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(tables))
        }
    }
    deserializer.deserialize_any(Tables)
}

impl Sidecar {
    /// Adds the medium of a table and puts it in its place.
    pub(super) fn medium(
        &self,
        scene: &mut Scene,
        named: &Named,
        index: usize,
        table: &MediumTable,
        budget: &mut Budget<'_>,
    ) -> Result<()> {
        let key = match (&table.name, self.content.medium.len()) {
            (Some(name), _) => format!("medium.{name}"),
            (None, 1) => "medium".into(),
            (None, _) => format!("medium[{index}]"),
        };
        self.require(
            scene.media.len() < MAX_MEDIA,
            &key,
            &format!("is one more than the {MAX_MEDIA} media that a scene may have"),
        )?;
        let (sigma_a, sigma_s) = self.coefficients(&key, table)?;
        let emission = self.bands(&key, "emission", table.emission)?;
        let density = match &table.density {
            Some(density) => Some(self.density(&format!("{key}.density"), density, budget)?),
            None => None,
        };
        let medium = Medium {
            name: table
                .name
                .clone()
                .or(table.material.clone())
                .unwrap_or("surrounding".into()),
            sigma_a,
            sigma_s,
            emission: emission.unwrap_or_default(),
            phase: self.phase(&key, table)?,
            density,
        };
        let number = scene.media.len() as u32;
        let Some(name) = &table.material else {
            self.require(
                !table.boundary,
                &format!("{key}.boundary"),
                "needs a material, whose meshes are the boundary",
            )?;
            self.require(
                scene.surrounding.is_none(),
                &key,
                "is the second one around everything; give it a material",
            )?;
            scene.surrounding = Some(number);
            scene.media.push(medium);
            return Ok(());
        };
        let at = format!("{key}.material");
        let Some(places) = named.get(name) else {
            return Err(self.unknown_material(scene, &at));
        };
        for &place in places {
            let material = &mut scene.materials[place];
            self.require(material.interior.is_none(), &at, "has another medium inside already")?;
            material.interior = Some(number);
            material.boundary = table.boundary;
        }
        scene.media.push(medium);
        Ok(())
    }

    fn bands(&self, key: &str, name: &str, value: Option<Bands>) -> Result<Option<Vec3>> {
        let sound = value.is_none_or(|Bands(v)| v.is_finite() && v.min_element() >= 0.0);
        self.require(sound, &format!("{key}.{name}"), "must be finite and at least 0")?;
        Ok(value.map(|Bands(v)| v))
    }

    /// Absorption and scattering from either pair of keys.
    fn coefficients(&self, key: &str, table: &MediumTable) -> Result<(Vec3, Vec3)> {
        let sigma_a = self.bands(key, "sigma_a", table.sigma_a)?;
        let sigma_s = self.bands(key, "sigma_s", table.sigma_s)?;
        let sigma_t = self.bands(key, "sigma_t", table.sigma_t)?;
        let albedo = self.bands(key, "albedo", table.albedo)?;
        match (sigma_a, sigma_s, sigma_t, albedo) {
            (sigma_a, sigma_s, None, None) => Ok((sigma_a.unwrap_or_default(), sigma_s.unwrap_or_default())),
            (None, None, Some(sigma_t), Some(albedo)) => {
                self.require(
                    albedo.max_element() <= 1.0,
                    &format!("{key}.albedo"),
                    "must not be above 1",
                )?;
                // 1 − albedo is exact or rounded once, so that albedo 1 absorbs nothing at all.
                Ok((sigma_t * (Vec3::ONE - albedo), sigma_t * albedo))
            }
            _ => Err(self.fault(
                key,
                "needs sigma_a and sigma_s, or sigma_t with albedo, not a mixture of them",
            )),
        }
    }

    fn phase(&self, key: &str, table: &MediumTable) -> Result<Phase> {
        let name = match (&table.phase, table.g) {
            (Some(name), _) => name.as_str(),
            (None, Some(_)) => "hg",
            (None, None) => "isotropic",
        };
        let eccentricity = |name: &str, value: Option<f32>| {
            let value = value.unwrap_or(0.0);
            let sound = value.abs() < 1.0;
            self.require(sound, &format!("{key}.{name}"), "must lie between -1 and 1")
                .map(|()| value)
        };
        let (phase, has) = match name {
            "isotropic" => (Phase::Isotropic, ""),
            "hg" => (
                Phase::HenyeyGreenstein {
                    g: eccentricity("g", table.g)?,
                },
                "g",
            ),
            "schlick" => (
                Phase::Schlick {
                    k: eccentricity("k", table.k)?,
                },
                "k",
            ),
            "rayleigh" => (Phase::Rayleigh, ""),
            other => {
                let cause = format!("{other:?} is not known; known: isotropic, hg, schlick, rayleigh");
                return Err(self.fault(&format!("{key}.phase"), cause));
            }
        };
        for (parameter, given) in [("g", table.g.is_some()), ("k", table.k.is_some())] {
            let cause = format!("has no meaning for phase {name:?}");
            self.require(!given || parameter == has, &format!("{key}.{parameter}"), &cause)?;
        }
        Ok(phase)
    }
}
