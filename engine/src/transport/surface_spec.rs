//! Specialization of kernels that know surfaces.

/// Specialization of a kernel that knows surfaces (`transport/arrival.glsl` with the constants of `transport/features.glsl`) to those of a
/// [`GpuScene`](crate::transport::GpuScene): the `Spec` of a generated module, with further fields.
///
/// ```ignore
/// let spec = surface_spec!(my_kernel, scene, { has_alpha: false, ..Default::default() });
/// ```
#[macro_export]
macro_rules! surface_spec {
    ($shader:ident, $scene:expr, { $($further:tt)* }) => {{
        let (profile, bsdf) = ($scene.profile(), $scene.bsdf_features());
        $shader::Spec {
            has_metal: bsdf.metal,
            has_conductor: bsdf.conductor,
            has_specular_layer: bsdf.specular_layer,
            has_transmission: bsdf.transmission,
            has_textures: profile.has_textures,
            has_shading_normals: profile.has_shading_normals,
            has_normal_maps: profile.has_normal_maps,
            has_vertex_colors: profile.has_vertex_colors,
            has_absorption: profile.has_absorption,
            has_unlit: profile.has_unlit,
            $($further)*
        }
    }};
}
pub use surface_spec;
