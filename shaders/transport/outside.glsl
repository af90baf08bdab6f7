// Stands for the material of a body where there is none around.
#ifndef CLERESTORY_TRANSPORT_OUTSIDE_GLSL
#define CLERESTORY_TRANSPORT_OUTSIDE_GLSL

const uint OUTSIDE = 0xFFFFFFFFu;

#endif
