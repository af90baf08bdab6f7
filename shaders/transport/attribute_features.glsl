// What materials read of a mesh's vertices, as specialization constants; the kernels that look at alpha alone need no others. Their ids
// are two of those of transport/features.glsl.
#ifndef CLERESTORY_TRANSPORT_ATTRIBUTE_FEATURES_GLSL
#define CLERESTORY_TRANSPORT_ATTRIBUTE_FEATURES_GLSL

layout(constant_id = 6) const bool HAS_TEXTURES = true;
layout(constant_id = 9) const bool HAS_VERTEX_COLORS = true;

#endif
