//! Eye paths that go on along global ray-bundles: all parallel lines of one direction, met with all of the scene by rasterizing it once.
//!
//! SVO-G6. Sources: T. Hermes, N. Henrich, T. Grosch, S. Müller, "Global Illumination using Parallel Global Ray-Bundles", VMV 2010; Y. Tokuyoshi, S. Ogaki, "Real-Time
//! Bidirectional Path Tracing via Rasterization", I3D 2012; L. Szirmay-Kalos, W. Purgathofer, "Global Ray-Bundle Tracing with Hardware Acceleration", EGWR 1998.
//!
//! A frame is a sample of every pixel. Its eye paths begin by a camera ray, and all leave the surfaces of one depth of the path along one direction, by the sense of it that is above the surface, whose
//! density over the hemisphere is 1 / 2π. A [bundle](lists) of that direction tells where they arrive: each texel of a square across the scene has the list of all triangles that the line through
//! its middle meets, by their depths. Where a path is, direct light comes from one sample of the lights and one of the diffuse lobe, by a ray each, weighted against each other (E. Veach, PhD thesis, 1997, 9.2); what bundles meet
//! is only lit, and its emission left to these rays, so that each light path is there once.
//!
//! In place of linked lists by racing atomics, whose order is another in each run: surfaces are drawn twice, once to count the fragments of each texel, and once to write them where a scan of the counts says.
//! Sorted lists are then the same in each run, and a search in them takes as many steps as their lengths have digits. The count tells how many entries there will be before any is written, so that none is lost.
//!
//! # Consistent
//!
//! A texel's line stands for all ways through the texel: it is moved by up to a half of a texel from where the path is. The way begins where that line meets the plane of the surface that is left, so that
//! this surface is never met again. Squares are moved by a part of a texel from bundle to bundle, so that over many the lines of a point are even about it, and on plane surfaces
//! on which light changes evenly nothing is wrong. Within a texel of edges between surfaces lines begin beyond the edge, and light leaks. Concave surfaces are all edges: a line begins behind what is next to the
//! place that is left, so that within a texel's width what is met from behind is passed over, which takes a sheet there for nothing. A sphere that is some 18 texels wide loses a hundredth of the light of each bundle.
//! The error falls with the width of texels.
//!
//! Guarantees: deterministic in settings and seed, on any number of threads; all pixels of a frame have its directions, so that they share noise, and with one seed a sequence that is
//! even over frames. Refused are participating media, surfaces that let light through, unlit ones, and scenes that keep their instances.

mod card;
pub mod lists;
mod renderer;
mod settings;

pub(super) use card::CARD;
pub use renderer::{RayBundleCounts, RayBundles};
pub use settings::RayBundleSettings;
