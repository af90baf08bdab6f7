//! Whether every way through a kd-tree finds the same hits: ten million rays by every scheme and every cache, on the device and on the host.
//!
//! Oracles: a bounding volume hierarchy's hits, to the bit; on a part of the rays all triangles in turn, in f32 to the bit and in f64 up to
//! the stated bounds ([`hit_errors`](super::hit_errors)).

use clerestory::Result;
use clerestory_hard_cases::RaySet;
use glam::Vec3;

use super::flights::{CASES, Case, on_hardware, told};
use super::kd_variants::{kept_kernels, variants};
use super::ray_checks::{Amount, Check, Place, Way};
use super::ray_kinds;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, total};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;

/// Scenes beside the source's: spheres of spheres, streets, soups of small and of large triangles, finely cut spheres.
static MORE: [Case; 5] = [
    Case::of_our_own("builtin:sphere-flake?depth=3&frequency=4", Vec3::Y),
    Case::of_our_own("builtin:box-city?n=25000", Vec3::Y),
    Case::of_our_own("builtin:triangle-soup?n=50000&size=0.02", Vec3::Y),
    Case::of_our_own("builtin:triangle-soup?n=5000&size=0.3", Vec3::Y),
    Case::of_our_own("builtin:materials", Vec3::Y),
];

/// Ten scenes of six kinds: ten million rays.
const FULL: Amount = Amount {
    of_each: 166_667,
    on_host: 50_000,
    tests: 100_000_000,
};
const SMOKE: Amount = Amount {
    of_each: 40,
    on_host: 100,
    tests: 100_000,
};

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    ways: Vec<Way>,
    places: Vec<Place>,
}

const EXACT: &str = "a device whose division is exact";

const OF_WAYS: &[Criterion<Way>] = &[
    Criterion::each(
        "no hit of a variant differs on the device",
        Bound::AtMost(0.0),
        |way: &Way| way.different.into(),
    )
    .in_every_form(),
    Criterion::each(
        "no answer differs from the closest hit's",
        Bound::AtMost(0.0),
        |way: &Way| way.other_answers.into(),
    )
    .in_every_form(),
    Criterion::each(
        "no hit of the host differs from the device's",
        Bound::AtMost(0.0),
        |way: &Way| way.different_on_host.into(),
    )
    .among(|way| !way.on_hardware)
    .needs(EXACT)
    .in_every_form(),
];

const OF_PLACES: &[Criterion<Place>] = &[
    Criterion::each(
        "no hit differs in any scene, of all variants and of the hierarchy on the host",
        Bound::AtMost(0.0),
        |place: &Place| place.different.into(),
    )
    .among(|place| !place.on_hardware)
    .needs(EXACT)
    .in_every_form(),
    Criterion::each(
        "no hit differs from trying all triangles in f32",
        Bound::AtMost(0.0),
        |place: &Place| place.different_from_all.into(),
    )
    .among(|place| !place.on_hardware)
    .needs(EXACT)
    .in_every_form(),
    Criterion::each(
        "no error is above its bound: the largest, of it",
        Bound::AtMost(1.0),
        |place: &Place| greatest([place.parameter, place.point]).into(),
    )
    .in_every_form(),
    Criterion::all("rays that are traced", Bound::AtLeast(1e7), |places: &[&Place]| {
        let rays: u64 = places.iter().map(|place| place.rays).sum();
        (!places.is_empty()).then(|| Measured::from(rays))
    }),
];

/// Where rays are from.
enum Origin {
    /// A scene, with a seed.
    Scene(Case, u32),
    /// A hard case, by name.
    HardCase(String, fn() -> Vec<RaySet>),
}

impl Origin {
    fn all(context: &Context<'_>) -> Vec<Self> {
        let ours = [&CASES[..], &MORE].concat();
        let scenes = told(context).unwrap_or_else(|| context.first(&ours, 1).to_vec());
        let scenes = scenes.into_iter().zip(0..).map(|(case, seed)| Self::Scene(case, seed));
        let hard = clerestory_hard_cases::all().iter();
        let hard = hard.filter_map(|case| Some(Self::HardCase(format!("hard case: {}", case.name), case.rays?)));
        scenes.chain(hard).collect()
    }

    fn name(&self) -> String {
        match self {
            Self::Scene(case, _) => case.name().to_owned(),
            Self::HardCase(name, _) => name.clone(),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let variants = variants(&gpu);
        let kept = kept_kernels(&gpu, &variants)?;
        let check = Check {
            gpu: &gpu,
            variants: &variants,
            amount: &context.pick(FULL, SMOKE),
        };
        let is_hardware = on_hardware(&gpu);
        let mut ways: Vec<Way> = variants.iter().map(|variant| Way::of(variant, is_hardware)).collect();
        let places = context.each(&Origin::all(context), Origin::name, |origin| {
            let place = match origin {
                Origin::Scene(case, seed) => check.scene(case, *seed, &mut ways)?,
                Origin::HardCase(name, sets) => check.hard_case(name, &sets(), &mut ways)?,
            };
            Ok(vec![place])
        })?;
        drop(kept);
        Ok(Self { ways, places })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.ways, OF_WAYS)
            .headline(
                "hits that differ between variants, of all rays by every variant",
                total(&self.ways, |_| true, |way| way.different + way.other_answers),
            )
            .note(format!(
                "Rays of {} in even shares, a fourth of those but the camera's and the diffuse ones with an end, and those of all hard cases; \
                 kd-trees with default settings. A hit is t, u, v and the triangle, and differs where one bit of these does: closest hits from \
                 those of the engine's bounding volume hierarchy on the device, any hits from those of the first variant; answers, whether \
                 there is a hit, from those of the closest. The host traces an even part of the rays by the twin of each kernel. Devices whose \
                 division is not exact, which Vulkan lets them have, may differ from the host in last bits; software devices must not.",
                ray_kinds::KINDS.join(", ")
            ))
            .and(Findings::of(&self.places, OF_PLACES))
            .note(
                "All triangles are tried, for an even part of the rays, by the kernels' test in f32 and by the same test in f64. With u = 2⁻²⁴, \
                 M the largest coordinate distance of a triangle's corner from the ray's origin, |d| the direction's largest component and s the \
                 slopes of t in the triangle's plane across the ray, t must lie within 18uM/|d| + 16uMs of the plane's in f64, no triangle that \
                 f64 meets clear of its edges may be nearer by more than that, and the point that u and v name must lie within 32uM of the ray \
                 along each axis (`clerestory::accel::triangle`). Errors are shares of these bounds, the largest of all.",
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::measures::kd::kd_traversal::SCHEMES;
    use crate::experiments::watch::Unwatched;
    use clerestory::accel::kd::KdCaches;
    use clerestory::gpu::{Gpu, GpuOptions};

    #[test]
    fn no_variant_finds_another_hit_and_none_is_above_its_bound() {
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| Gpu::headless(&GpuOptions::default()),
            folder: std::path::Path::new(""),
            watch: &Unwatched,
        };
        let found = Found::measure(&context).unwrap();
        assert_eq!(found.ways.len(), 2 * (SCHEMES.len() + KdCaches::COMPARED.len()));
        for way in &found.ways {
            assert!(way.hits > 1000, "{way:?}");
            assert_eq!((way.different, way.other_answers), (0, 0), "{way:?}");
            assert!(way.on_hardware || way.different_on_host == 0, "{way:?}");
        }
        for place in &found.places {
            assert!(
                place.on_hardware || (place.different, place.different_from_all) == (0, 0),
                "{place:?}"
            );
            assert_eq!(place.above, 0, "{place:?}");
        }
    }
}
