//! Indirect light by a localised gather: the texels of a coarse map of what one place sees are area lights, whose solid angles are those seen from each point.
//!
//! Sources: L. Szirmay-Kalos, I. Lazányi, "Indirect Diffuse and Glossy Illumination on the GPU", SCCG 2006; those of [`maps::gather`](crate::maps::gather), whose lights
//! these are, of the map ([`CaptureBy`](crate::techniques::impostors::CaptureBy)), and of the path tracer.
//!
//! Eye paths are the path tracer's: what is seen, and direct light where they first arrive, `LE|L.E`. Where that is at a rough surface, light that was scattered once in the map, or
//! as often as the setting says, is gathered: `L.[DG]E`. Light that no surface has scattered is not in the map, whatever it comes from, so that emission comes by light sampling alone and never twice.
//! The sums go over all lights, for what is reflected evenly about the normal and, by a narrower lobe, about the mirrored direction; for the latter over the five greatest
//! terms alone where the setting [`terms`](LocalizedGatherSettings::terms) says so.
//!
//! The map is captured once, before the first sample, and holds for all cameras.
//!
//! Bias, all of it:
//!
//! - Nothing hides a light from the point: no contact shadows of indirect light.
//! - What the map's place does not see lights nothing, and radiance is that towards the map's place.
//! - Each texel is one disc of even radiance: with normals the error falls with more of them, without it stays.
//! - Microfacets reflect by a power of the cosine about the mirrored direction, of an exponent of 64 at most; their albedo is that of even surroundings.
//! - Five terms stand for all of the lobe about the mirrored direction, where they are asked for.
//! - The lobe about the mirrored direction ends at the surface's horizon, and is scaled to the whole there: at grazing views, where a half of it is below, its mean direction is higher.
//! - Rough conductors reflect by Schlick's factor.
//! - The map is the capture's, with its shadows and its noise, which is the same for all seeds.
//!
//! Deterministic in settings and seed, on any number of threads. Refused are participating media, surfaces that transmit, modified Phong and classical microfacets, and scenes that keep their instances.

mod card;
mod renderer;
mod settings;
mod stage;

pub(super) use card::CARD;
pub use renderer::LocalizedGather;
pub use settings::{GatherForm, GatherTerms, LocalizedGatherSettings};
