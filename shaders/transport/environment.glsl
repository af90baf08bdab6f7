// Latitude-longitude environment maps: directions, radiance and density, in the environment's own frame.
//
// u = atan(x, -z) / 2 pi + 1/2, v = acos(y) / pi. Radiance is bilinear between the centres of texels, around in u; beyond the outer rows
// the last one reaches to the pole. Light sampling chooses a cell between four centres by its share of the light and a direction in it
// with a density bilinear in the luminances at its corners, over the azimuth and the height: even over solid angle where they are equal,
// and finite at the poles. Where scattered rays find light, too, luminance below `left_out` is left to them. Method and tables:
// transport/environment.rs.
// Expects, declared before the inclusion: `vec4 environment_texel(uint index)`, radiance and factor of the density by row, and what
// distribution.glsl expects.
#ifndef CLERESTORY_TRANSPORT_ENVIRONMENT_GLSL
#define CLERESTORY_TRANSPORT_ENVIRONMENT_GLSL

#include "transport/distribution.glsl"
#include "transport/luminance.glsl"
#include "transport/warp.glsl"

// What corners are taken to have at least, so that densities in a cell are quotients of normal numbers: 2^-80.
const float ENVIRONMENT_LUMINANCE_MIN = 8.271806e-25;

vec2 environment_uv(vec3 w) {
    // The arc tangent keeps its precision at the poles, where the arc cosine loses it.
    // At the poles themselves, where it is not defined, any azimuth does.
    float azimuth = w.x == 0.0 && w.z == 0.0 ? 0.0 : atan(w.x, -w.z);
    return vec2(azimuth * (0.5 * INV_PI) + 0.5, atan(length(w.xz), w.y) * INV_PI);
}

vec3 environment_direction(vec2 uv) {
    float phi = 2.0 * PI * (uv.x - 0.5);
    float theta = PI * uv.y;
    return vec3(sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi));
}

// The cell that holds texture coordinates, and the place in it by angles. Cell (x, y) lies between the centres of columns x and x + 1 and
// of rows y - 1 and y; there is one row of cells more than of texels.
uvec2 environment_cell(vec2 uv, uvec2 size, out vec2 within) {
    vec2 p = uv * vec2(size) + vec2(-0.5, 0.5);
    ivec2 cell = clamp(ivec2(floor(p)), ivec2(-1, 0), ivec2(size) - ivec2(1, 0));
    within = clamp(p - vec2(cell), 0.0, 1.0);
    return uvec2(cell.x < 0 ? int(size.x) - 1 : cell.x, cell.y);
}

// The texels at the upper corners of a cell, then those at the lower ones, of which the first has the factor of the cell's density.
mat4 environment_corners(uvec2 cell, uvec2 size) {
    uint next = cell.x + 1u == size.x ? 0u : cell.x + 1u;
    uint upper = (max(cell.y, 1u) - 1u) * size.x;
    uint lower = cell.y * size.x;
    return mat4(environment_texel(upper + cell.x), environment_texel(upper + next), environment_texel(lower + cell.x),
                environment_texel(lower + next));
}

vec3 environment_interpolated(mat4 corners, vec2 within) {
    return mix(mix(corners[0].rgb, corners[1].rgb, within.x), mix(corners[2].rgb, corners[3].rgb, within.x), within.y);
}

// Luminances at the corners, above what is left to scattered rays.
vec4 environment_luminances(mat4 corners, float left_out) { return max(LUMINANCE * corners - left_out, ENVIRONMENT_LUMINANCE_MIN); }

// Luminance at the left and the right side of a cell.
vec2 environment_sides(vec4 luminances, float down) { return mix(luminances.xy, luminances.zw, down); }

// The rims of a row of cells: halves of their distances 1 - cos from the nearer pole, which keeps its precision there.
vec2 environment_rims(uint row, uint height, out bool south) {
    south = 2u * row > height;
    float from_pole = float(south ? height - row : row);
    vec2 s = sin(vec2(max(from_pole - 0.5, 0.0), from_pole + 0.5) * (0.5 * PI / float(height)));
    return s * s;
}

// What a direction meets: its cell, and the map there.
struct EnvironmentPlace {
    uvec2 cell;
    vec2 within;
    mat4 corners;
    vec4 luminances;  // at them, above what is left to scattered rays
    float luminance;  // between them
    vec2 rims;
};

EnvironmentPlace environment_place(uvec2 size, float left_out, vec3 w) {
    EnvironmentPlace p;
    p.cell = environment_cell(environment_uv(w), size, p.within);
    p.corners = environment_corners(p.cell, size);
    p.luminances = environment_luminances(p.corners, left_out);
    bool south;
    p.rims = environment_rims(p.cell.y, size.y, south);
    float rim = 0.5 * dot(w.xz, w.xz) / (1.0 + (south ? -w.y : w.y));
    float from_rim = clamp((rim - p.rims.x) / (p.rims.y - p.rims.x), 0.0, 1.0);
    vec2 sides = environment_sides(p.luminances, south ? 1.0 - from_rim : from_rim);
    p.luminance = mix(sides.x, sides.y, p.within.x);
    return p;
}

// What luminances in a cell are multiplied by for the density per solid angle, where the cell is chosen with a probability.
float environment_factor(float probability, vec4 luminances, vec2 rims, uint width) {
    float solid_angle = 4.0 * PI * (rims.y - rims.x) / float(width);
    return probability / (dot(luminances, vec4(0.25)) * solid_angle);
}

// Radiance from a direction, and in the last component the density of environment_sample there.
vec4 environment_look_up(uvec2 size, float left_out, vec3 w) {
    EnvironmentPlace p = environment_place(size, left_out, w);
    return vec4(environment_interpolated(p.corners, p.within), p.corners[2].a * p.luminance);
}

// Density of environment_sample in a direction, by the tables of emission that begin at `base`, sr^-1.
float environment_emission_pdf(uint base, uvec2 size, vec3 w) {
    EnvironmentPlace p = environment_place(size, 0.0, w);
    uint row = distribution_row_base(base, uvec2(size.x, size.y + 1u), p.cell.y);
    float probability = distribution_probability(base, p.cell.y) * distribution_probability(row, p.cell.x);
    return environment_factor(probability, p.luminances, p.rims, size.x) * p.luminance;
}

// A direction that two words choose; `found` is environment_look_up there. The tables of emission, which have all of the light, are not those
// that the densities of look-ups are of: with them the density follows from the cell's probability.
vec3 environment_sample(uint base, uvec2 size, float left_out, bool emission, uvec2 word, uvec2 fresh, out vec4 found) {
    float probability;
    uvec2 cell = distribution_sample_2d(base, uvec2(size.x, size.y + 1u), word, fresh, probability);
    mat4 corners = environment_corners(cell, size);
    vec4 luminances = environment_luminances(corners, emission ? 0.0 : left_out);
    float down = linear_sample(unit_float(word.y), dot(luminances.xy, vec2(0.5)), dot(luminances.zw, vec2(0.5)));
    vec2 sides = environment_sides(luminances, down);
    float around = linear_sample(unit_float(word.x), sides.x, sides.y);
    bool south;
    vec2 rims = environment_rims(cell.y, size.y, south);
    float d = 2.0 * mix(rims.x, rims.y, south ? 1.0 - down : down);
    float r = sqrt(max(0.0, d * (2.0 - d)));
    float y = south ? d - 1.0 : 1.0 - d;
    float phi = 2.0 * PI * ((float(cell.x) + 0.5 + around) / float(size.x) - 0.5);
    float row = atan(r, y) * INV_PI * float(size.y) + 0.5;
    vec2 within = vec2(around, clamp(row - float(cell.y), 0.0, 1.0));
    float factor = emission ? environment_factor(probability, luminances, rims, size.x) : corners[2].a;
    found = vec4(environment_interpolated(corners, within), factor * mix(sides.x, sides.y, around));
    return vec3(r * sin(phi), y, -r * cos(phi));
}

#endif
