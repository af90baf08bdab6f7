// Luminance of linear RGB (ITU-R BT.709). Twin of luminance in transport/environment.rs.
#ifndef CLERESTORY_TRANSPORT_LUMINANCE_GLSL
#define CLERESTORY_TRANSPORT_LUMINANCE_GLSL

const vec4 LUMINANCE = vec4(0.2126, 0.7152, 0.0722, 0.0);

#endif
