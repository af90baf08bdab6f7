// The number that directions are measured by.
#ifndef CLERESTORY_PI_GLSL
#define CLERESTORY_PI_GLSL

const float PI = 3.14159265358979323846;
const float INV_PI = 0.31830988618379067154;

#endif
