//! Floor 3: rasterization. Surfaces of a scene seen from a camera or, in all directions, from a point, by what is asked for of each pixel.
//!
//! A [`GBuffer`] draws the triangles of [`Surfaces`], pulled from the buffers that rays use, in one [`View`] or in several at once
//! ([`Layering`]): six faces of a cube in six passes, by views or by layers, the eight octants of an octahedron side by side, in any of the
//! ways of [`OctantCut`], or both halves of a dual paraboloid map. Sources:
//! T. Saito and T. Takahashi, "Comprehensible Rendering of 3-D Shapes", SIGGRAPH 1990 (G-buffers); T. Engelhardt, "Efficient Visibility for
//! Realistic Rendering", 2013, §2.1 (both forms of visibility) and §7.2 (octahedra rendered live).
//!
//! [`OmniShadowMaps`] keep the distances that point lights see in all directions, [`ViewShadowMaps`] those that spots and parallel light see, and say which places their light reaches;
//! [`SplatAtlas`](splat_atlas::SplatAtlas) keeps those of many lights, drawn at once from points of the surfaces. [`Upsampler`](upsample::Upsampler) takes pictures of few pixels to those of
//! a larger G-buffer.
//!
//! Guarantee: what is seen at a pixel is what the ray through its centre meets, but where that centre lies within the rounding of vertices
//! from an edge of a triangle, or where triangles are equally far within the rounding of depths; distances and weights are the ray caster's
//! own. Deterministic, and equal bits in every way to several layers of linear views. Cuts that are not exact ([`OctantCut::is_exact`]) and
//! paraboloids guarantee nothing of this: they are here to be compared.

pub mod coverage;
pub mod curved_mirror;
pub mod facet;
mod gbuffer;
pub(crate) mod octahedron;
pub mod octants;
pub(crate) mod omni_shadow;
mod output;
pub(crate) mod pipelines;
pub mod reflective;
pub mod splat_atlas;
pub mod splats;
mod surfaces;
pub mod tessellation;
pub mod upsample;
mod view;
pub(crate) mod view_shadow;

pub(crate) use coverage::{Coverage, DrawPart};
pub use gbuffer::{GBuffer, GBufferDesc};
pub use octahedron::OCTANTS;
pub use octants::OctantCut;
pub use omni_shadow::{
    OmniShadowDesc, OmniShadowImage, OmniShadowMaps, SHADOW_MAPS_MAX, SHADOW_WIDTH_MAX, ShadowLayout, ShadowPlace,
    ShadowReceiver, shadow_receiver, shadow_texel_radius, shadow_threshold,
};
pub(crate) use omni_shadow::{check_width, filter_iterations};
pub use output::Output;
pub use pipelines::Layering;
pub use surfaces::{ObjectTriangles, SurfaceFeatures, Surfaces};
pub use view::View;
pub(crate) use view_shadow::shadow_view;
pub use view_shadow::{
    ViewReceiver, ViewShadowDesc, ViewShadowImage, ViewShadowMaps, shadow_view_place, shadow_view_ray,
    shadow_view_receiver, shadow_view_threshold,
};
