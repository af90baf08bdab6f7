// What is known of a photon's way, and what its record says of it, in bits that the words of kernel.glsl leave free.
#ifndef CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_HISTORY_GLSL
#define CLERESTORY_TECHNIQUES_PHOTON_MAPPING_PHOTON_HISTORY_GLSL

// State of a photon's path, beside its number of bounces: whether it has been scattered diffusely, or in a medium.
const uint PHOTON_UNDIFFUSED = 0u;
const uint PHOTON_DIFFUSED = 1u;

// Where the path set is an expression the state is the photon's class instead (techniques/photon_mapping/path_classes), and stands for the number of scatterings in its record, too.
const uint PHOTON_CLASSES = 15u;

// Flags of places in scenes with media, beside those of walk/wave.glsl: what waits there comes from a medium, or from a surface. Where ways are stored a place may have
// both.
const uint FLAG_VOLUME = 16u;
const uint FLAG_LANDED = 32u;
// A record waits there beside the way: a plane of two flights, or a collision, where these are stored as well.
const uint FLAG_BESIDE = 64u;

// Stand for the scale of radiance in a photon's walk, which eye paths alone keep, where planes are stored: whether its way begins at a collision with the medium that it goes through.
const float PHOTON_FROM_COLLISION = 0.0;
const float PHOTON_FROM_ELSEWHERE = 1.0;

// In the word of the normal: the photon has been scattered diffusely, or in a medium.
const uint PHOTON_DIFFUSED_BIT = 0x40000000u;
// In the word of the direction: how often it has been scattered before it landed, at most PHOTON_BOUNCE_MAX.
const uint PHOTON_BOUNCE_SHIFT = 26u;
const uint PHOTON_BOUNCE_MAX = 63u;

void add_history(uint bounce, bool diffused, inout uvec4 q0, inout uvec4 q1) {
    q0.w |= diffused ? PHOTON_DIFFUSED_BIT : 0u;
    q1.w |= min(bounce, PHOTON_BOUNCE_MAX) << PHOTON_BOUNCE_SHIFT;
}

bool photon_is_diffused(uvec4 q0) { return (q0.w & PHOTON_DIFFUSED_BIT) != 0u; }
uint photon_bounce(uvec4 q1) { return q1.w >> PHOTON_BOUNCE_SHIFT; }

#endif
