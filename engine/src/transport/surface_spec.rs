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
            has_exact_conductor: bsdf.exact_conductor,
            has_schlick_conductor: bsdf.schlick_conductor,
            has_compensated_conductor: bsdf.compensated_conductor,
            has_tinted_conductor: bsdf.tinted_conductor,
            has_simplified_conductor: bsdf.simplified_conductor,
            has_table_conductor: bsdf.table_conductor,
            has_classic_microfacets: bsdf.classic_microfacets,
            has_phong: bsdf.phong,
            has_specular_layer: bsdf.specular_layer,
            has_transmission: bsdf.transmission,
            has_textures: profile.has_textures,
            has_shading_normals: profile.has_shading_normals,
            has_normal_maps: profile.has_normal_maps,
            has_vertex_colors: profile.has_vertex_colors,
            has_absorption: profile.has_absorption,
            has_unlit: profile.has_unlit,
            has_instances: profile.keeps_instances,
            $($further)*
        }
    }};
}
pub use surface_spec;

/// Specialization of a kernel in which light leaves the lights (`transport/emission.glsl`) to those of a [`GpuScene`](crate::transport::GpuScene), as
/// [`surface_spec!`].
macro_rules! emission_spec {
    ($shader:ident, $scene:expr, { $($further:tt)* }) => {{
        let profile = $scene.profile();
        $shader::Spec {
            has_textures: profile.has_textures,
            has_vertex_colors: profile.has_vertex_colors,
            has_shading_normals: false,
            has_normal_maps: false,
            has_absorption: profile.has_absorption,
            has_media: profile.media.any(),
            has_unlit: false,
            has_instances: profile.keeps_instances,
            has_alpha: profile.has_alpha(),
            has_environment: profile.has_environment(),
            has_area_lights: $scene.has_area_lights(),
            has_punctual_lights: $scene.has_punctual_lights(),
            $($further)*
        }
    }};
}
pub(crate) use emission_spec;

/// The specialization constants of kernels that know surfaces (`transport/features.glsl`) that are off for some scenes: by name, what each stands for, and why it
/// is off where nothing else is known.
pub(crate) const SURFACE_FEATURES: [(&str, &str, &str); 28] = [
    ("has_metal", METAL_LOBES, "no material is metal"),
    (
        "has_exact_conductor",
        "exact conductors",
        "no metal has a complex index of refraction and the exact form",
    ),
    (
        "has_schlick_conductor",
        "Schlick's curve of conductors",
        "no metal names it",
    ),
    (
        "has_compensated_conductor",
        "compensated curve of conductors",
        "no metal names it",
    ),
    (
        "has_tinted_conductor",
        "tinted curve of conductors",
        "no metal names it",
    ),
    (
        "has_simplified_conductor",
        "simplified factor of conductors",
        "no metal names it",
    ),
    ("has_table_conductor", "tables of conductors", "no metal names them"),
    (
        "has_specular_layer",
        "dielectric reflection",
        "no material reflects specularly",
    ),
    ("has_classic_microfacets", "classical microfacets", "no metal has them"),
    ("has_phong", "modified Phong lobes", "no material has one"),
    ("has_transmission", "transmission", "no material transmits"),
    ("has_multiple_scattering", COMPENSATION, "no material is metal"),
    ("has_textures", "texture look-ups", "no material has a texture"),
    ("has_shading_normals", "shading normals", "no mesh interpolates normals"),
    ("has_normal_maps", "normal maps", "no material has one"),
    ("has_vertex_colors", "vertex colours", "no mesh has them"),
    ("has_absorption", "absorption in solids", "no solid absorbs"),
    ("has_environment", "environment light", "the scene has none"),
    ("has_area_lights", "area lights", "no material emits"),
    ("has_unlit", "unlit surfaces", "no material is unlit"),
    ("has_alpha", "alpha tests", "no material has alpha"),
    ("write_aovs", "albedo, normal and depth", "they were not asked for"),
    (
        "has_punctual_lights",
        "point, spot and directional lights",
        "the scene has none",
    ),
    (
        "has_light_tree",
        "choice of lights for the point that they are to light",
        "the scene has few lights",
    ),
    ("has_media", "participating media", "the scene has none"),
    ("has_instances", "instances", "all are flattened"),
    (
        "has_path_automaton",
        "path expressions",
        "the path set is a range of bounces and lobes",
    ),
    (
        "has_lobe_labels",
        "telling overlapping lobes apart",
        "the path set goes on alike after each, or the scene has but one",
    ),
];
/// What reports call the lobes of metals.
pub(crate) const METAL_LOBES: &str = "metal lobes";
/// What they call the compensation of rough metals.
pub(crate) const COMPENSATION: &str = "multiple-scattering compensation";
