#version 460
// A sky and a chequered floor for a pinhole camera, averaged over frames with a sub-pixel offset each: a picture that shows that a camera,
// a window and a progressive film work together.
#extension GL_EXT_scalar_block_layout : require
layout(local_size_x = 8, local_size_y = 8) in;

const vec3 ZENITH = vec3(0.15, 0.35, 0.75);
const vec3 HORIZON = vec3(0.85, 0.90, 0.95);
const vec3 LIGHT_TILE = vec3(0.80, 0.75, 0.65);
const vec3 DARK_TILE = vec3(0.20, 0.22, 0.25);
// Lengths after which the floor has faded into the horizon.
const float FADE = 0.08;
// Additive recurrence of the plastic number (Roberts 2018): two dimensions of low discrepancy.
const vec2 R2 = vec2(0.75487766624669276, 0.56984029099805327);

layout(push_constant, scalar) uniform Push {
    vec3 eye;
    vec3 right;
    vec3 down;
    vec3 forward;
    uvec2 size;
    uint frame;
    // 1 when the picture's byte order is blue, green, red, alpha.
    uint bgra;
};

layout(set = 0, binding = 0, scalar) buffer Sums {
    vec3 sums[];
};
layout(set = 0, binding = 1, scalar) writeonly buffer Pixels {
    uint pixels[];
};

vec3 radiance(vec3 direction) {
    vec3 sky = mix(HORIZON, ZENITH, max(direction.y, 0.0));
    if (direction.y >= 0.0) {
        return sky;
    }
    float t = -eye.y / direction.y;
    ivec2 tile = ivec2(floor((eye + t * direction).xz));
    vec3 floor_color = ((tile.x + tile.y) & 1) == 0 ? LIGHT_TILE : DARK_TILE;
    return mix(HORIZON, floor_color, exp(-FADE * t));
}

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, size))) {
        return;
    }
    uint at = pixel.y * size.x + pixel.x;
    vec2 offset = fract(0.5 + R2 * float(frame));
    vec2 p = (2.0 * (vec2(pixel) + offset) - vec2(size)) / float(size.y);
    vec3 sum = radiance(normalize(forward + p.x * right + p.y * down));
    if (frame > 0) {
        sum += sums[at];
    }
    sums[at] = sum;
    vec3 mean = sum / float(frame + 1);
    // Powers of 1/2.2 stand in for the sRGB curve.
    vec3 encoded = pow(clamp(mean, 0.0, 1.0), vec3(1.0 / 2.2));
    pixels[at] = packUnorm4x8(vec4(bgra == 1 ? encoded.bgr : encoded, 1.0));
}
