// What a scene needs of a kernel that knows surfaces, as specialization constants: what is off compiles to nothing.
#ifndef CLERESTORY_TRANSPORT_FEATURES_GLSL
#define CLERESTORY_TRANSPORT_FEATURES_GLSL

#include "transport/attribute_features.glsl"

layout(constant_id = 0) const bool HAS_METAL = true;
layout(constant_id = 1) const bool HAS_EXACT_CONDUCTOR = true;         // exact complex index of refraction
layout(constant_id = 2) const bool HAS_SPECULAR_LAYER = true;          // dielectric reflection
layout(constant_id = 3) const bool HAS_TRANSMISSION = true;
layout(constant_id = 4) const bool HAS_MULTIPLE_SCATTERING = true;     // compensation of rough metals
layout(constant_id = 5) const bool SEPARABLE_MASKING = false;          // uncorrelated Smith masking, for comparisons
layout(constant_id = 7) const bool HAS_SHADING_NORMALS = true;
layout(constant_id = 8) const bool HAS_NORMAL_MAPS = true;
layout(constant_id = 10) const bool HAS_ABSORPTION = true;            // absorbing solids
layout(constant_id = 11) const bool HAS_UNLIT = true;
layout(constant_id = 12) const bool HAS_ENVIRONMENT = true;
layout(constant_id = 13) const bool HAS_AREA_LIGHTS = true;
layout(constant_id = 14) const bool HAS_PUNCTUAL_LIGHTS = true;
layout(constant_id = 15) const uint SAMPLER_KIND = 0;                  // SAMPLER_SOBOL, SAMPLER_PCG or SAMPLER_JOINT_SOBOL
layout(constant_id = 16) const bool WRITE_AOVS = true;
layout(constant_id = 17) const bool HAS_ALPHA = true;                  // surfaces that are there in part
layout(constant_id = 24) const bool HAS_PATH_AUTOMATON = false;        // the path set is more than a range of bounces and lobes
layout(constant_id = 25) const bool HAS_LOBE_LABELS = false;           // and tells lobes apart that share directions

layout(constant_id = 26) const bool HAS_PHONG = true;                  // modified Phong lobes
// Conductors whose Fresnel factor is in another form than the exact one.
layout(constant_id = 30) const bool HAS_SCHLICK_CONDUCTOR = true;      // Schlick's, and rescaled
layout(constant_id = 31) const bool HAS_COMPENSATED_CONDUCTOR = true;  // with a term of two coefficients
layout(constant_id = 32) const bool HAS_TINTED_CONDUCTOR = true;       // with a term of one
layout(constant_id = 33) const bool HAS_SIMPLIFIED_CONDUCTOR = true;   // without the sine
layout(constant_id = 37) const bool HAS_TABLE_CONDUCTOR = true;        // by tables behind the materials
layout(constant_id = 34) const bool HAS_CLASSIC_MICROFACETS = true;    // metals with others than GGX under Smith's masking

layout(constant_id = 23) const bool HAS_LIGHT_TREE = false;            // lights are chosen by a tree, for the point that they are to light

layout(constant_id = 19) const bool HAS_MEDIA = true;                  // paths know which medium they are in

#define CLERESTORY_SAMPLER SAMPLER_KIND

#endif
