// What the choice of a light for a point takes into account of the point.
#ifndef CLERESTORY_TRANSPORT_LIGHT_RECEIVER_GLSL
#define CLERESTORY_TRANSPORT_LIGHT_RECEIVER_GLSL

struct LightReceiver {
    vec3 position;
    vec3 normal;  // unit, to the side from which light is scattered; zero where that is all sides
};

#endif
