//! Surfaces: scattering functions and their energy, shading normals, tangents and alpha.
//!
//! [`energy`] has what the measures of energy share.

pub mod alpha;
pub mod coupled_reflection;
pub mod energy;
pub mod fresnel_cost;
pub mod fresnel_curves;
pub mod fresnel_dielectric;
pub mod fresnel_dips;
pub mod fresnel_forms;
pub mod fresnel_rescaling;
pub mod fresnel_seam;
pub mod fresnel_stripes;
pub mod metal_looks;
pub mod metal_spectra;
pub mod microfacet_parts;
pub mod multiple_scattering;
pub mod published_metals;
pub mod shading_normals;
pub mod spectral_ways;
pub mod tangents;
