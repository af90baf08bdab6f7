//! Reflections by distance impostors: what smooth surfaces mirror comes from a map of radiance and distance, everything else is direct light.
//!
//! Sources: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3) (Eurographics), 2005; those
//! of [`maps::impostor`](crate::maps::impostor), whose searches these are, of the map ([`CaptureBy`]), and of the path tracer.
//!
//! Eye paths are the path tracer's: emission seen, and direct light where they first arrive, `LE|L[DG]E`. Where that is at a smooth surface, the ray that it mirrors is
//! followed through the map, and the radiance that the map has there, times what the surface mirrors, is added. With light of so many scatterings in the map as
//! the setting says, one by default, pictures have the paths `LE|L.E|L.SE`: light that is seen in a mirror comes from the map alone.
//!
//! Where a setting [says so](ReflectionSettings::refracts), what smooth glass lets through is followed as well, through the same map and at one interface: panes, and surfaces of bodies whose other side is none. Both rays have the weights of the
//! exact dielectric factor, and beyond the critical angle all is mirrored. A body that the refracted ray enters absorbs of it as far as what is found, and one that the eye is in on the way to its surface. The refracted rays of each pixel's first sample are traced on: where one of them meets a second interface the picture is refused, since nothing is followed past the first.
//!
//! The map is captured once, before the first sample, and holds for all cameras. What reflects is left out of it, so that it may be seen from within; its shadow is in it.
//!
//! Bias, all of it:
//!
//! - What the map's place does not see is not there: reflections stick to the edges of what hides it. With further layers of surfaces, which a map by rays has, that is what lies behind more surfaces than these.
//!   A mirror sphere that touches a wall is 0.5 % RMS off, with a radius of 0.3 of the room's half width and a map at its middle. Behind a screen a fifth of the room's width across, a hundredth of its half width before the map's place,
//!   a sphere is 150 % RMS off; a second layer leaves 25 %, the sphere's own middle as the place 3 %.
//! - Radiance is that towards the map's place, not towards the surface; among diffuse surfaces they are the same. In a room whose walls reflect 70 % by Phong lobes of exponent 10, a mirror sphere half-way to a wall is 58 % RMS off with a radius of 0.3 of the room's half width, and 19 % with 0.1.
//! - Searches end beside surfaces: by how much, [`ImpostorReflections::counts`] and [`LookUp::residual`] say.
//! - Radiance at texels' middles is joined bilinearly, so that borders of shadows are up to half a texel off; with a capture by rays its noise stays, and is the same for all seeds.
//! - A second interface that no ray of the first samples meets is passed over.
//! - Light on its way to what lies within a body that absorbs is not absorbed: in the map it is lit as if nothing were around it.
//! - A surface that is smooth by a texture alone is not taken for one that reflects: it is in the map, and without others there is none.
//! - Bodies that reflect do not show in reflections, their own included.
//! - A rasterized map has the shadows, and their borders, of [`OmniShadowMaps`](crate::raster::OmniShadowMaps) and [`ViewShadowMaps`](crate::raster::ViewShadowMaps), and draws partial alpha opaque.
//!
//! In the limit of many texels and steps, what convex rooms of diffuse walls show in a convex mirror is exact.
//!
//! Deterministic in settings and seed, on any number of threads. Refused are participating media, surfaces that transmit where nothing is refracted, second interfaces where it is, bodies that absorb where no distances are looked up, and scenes that keep their instances.

pub(in crate::techniques) mod capture;
mod card;
mod draw;
mod interfaces;
mod peel;
mod reflections;
pub(in crate::techniques) mod renderer;
mod settings;
mod stage;

pub use capture::CaptureBy;
pub(super) use card::CARD;
pub(in crate::techniques) use card::map_refusals;
pub use reflections::ImpostorReflections;
pub use settings::{ReflectionMethod, ReflectionSettings};
pub(in crate::techniques) use settings::{check_place, check_place_about};
pub use stage::{LookUp, LookUpCounts};
