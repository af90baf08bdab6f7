// Walks through a density grid, cell by cell, on the way of one ray ("grid walks"; those of walk/wave.glsl go ray by ray): free flight by delta tracking and transmittance by ratio tracking, with a majorant for each block of cells.
//
// Sources: Woodcock et al., "Techniques Used in the GEM Code for Monte Carlo Neutronics Calculations" (1965); ratio tracking of Novak,
// Selle and Jarosz, "Residual Ratio Tracking for Estimating Attenuation in Participating Media" (2014); stepping through blocks of
// Amanatides and Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing" (1987); bands as in transport/medium.glsl.
// Guarantees: unbiased wherever majorants bound the density; at most GRID_WALK_QUOTA iterations per call, after which the walk can go on from where
// it stands, since free flight has no memory; where f32 does not tell one stop from the next, a rounding unit of the way is left out. Random
// numbers are hashes of a key and the number of the draw.
#ifndef CLERESTORY_TRANSPORT_MEDIA_TRACKING_GLSL
#define CLERESTORY_TRANSPORT_MEDIA_TRACKING_GLSL

#include "scene/media.glsl"
#include "transport/medium.glsl"
#include "transport/random.glsl"

// Iterations of a grid walk in one dispatch: blocks left and tentative collisions. Software drivers end loops silently after 65,535 of all lanes.
const uint GRID_WALK_QUOTA = 2048u;
// Iterations of all grid walks of the invocation so far.
uint grid_iterations = 0u;
// Tentative collisions on a segment with equi-angular samples in a grid, on average and at most.
const float AIRLIGHT_DEPTH = 96.0;
// Least component of a direction, as a share of the largest one.
const float GRID_COMPONENT_MIN = 1e-18;

// Whether walks keep GridWalk.bound: a bool constant.
#ifndef CLERESTORY_GRID_BOUNDS
#define CLERESTORY_GRID_BOUNDS false
#endif

const uint GRID_LEFT = 0u;      // at the end of the segment
const uint GRID_STOPPED = 1u;   // by the quota
const uint GRID_COLLIDED = 2u;

struct GridWalk {
    float entry;   // distance along the ray from which the others count, so that steps are not lost beside a long way to the grid
    vec3 origin;   // in cells, where the walk begins
    vec3 direction;
    vec3 inverse;
    ivec3 block;
    float t;
    float t_end;   // of the segment within the grid
    uint draw;     // random numbers so far
    uint nulls;    // tentative collisions that were none
    float bound;   // integral along the way of the greatest densities of its blocks, m
};

uvec4 grid_draw(uvec4 key, uint draw) { return pcg4d(pcg4d(key) + uvec4(draw, 0u, 0u, 0u)); }

// The block of a walk's place at t.
ivec3 grid_block(SceneMedium m, GridWalk w, float t) {
    return clamp(ivec3(floor((w.origin + t * w.direction) / m.block)), ivec3(0), ivec3(m.blocks) - 1);
}

GridWalk begin_grid_walk(SceneMedium m, vec3 origin, vec3 direction, float t, float t_end) {
    GridWalk w;
    w.origin = direction_to_cells(m, origin) + m.offset;
    w.direction = direction_to_cells(m, direction);
    vec3 a = abs(w.direction);
    float least = max(a.x, max(a.y, a.z)) * GRID_COMPONENT_MIN;
    w.inverse = mix(vec3(1.0), vec3(-1.0), lessThan(w.direction, vec3(0.0))) / max(a, vec3(least));
    vec3 t0 = -w.origin * w.inverse;
    vec3 t1 = (vec3(m.cells) - w.origin) * w.inverse;
    vec3 near = min(t0, t1);
    vec3 far = max(t0, t1);
    w.entry = max(t, max(near.x, max(near.y, near.z)));
    w.t = 0.0;
    w.t_end = min(t_end, min(far.x, min(far.y, far.z))) - w.entry;
    w.origin += w.entry * w.direction;
    w.block = grid_block(m, w, 0.0);
    w.draw = 0u;
    w.nulls = 0u;
    w.bound = 0.0;
    return w;
}

// On to the next tentative collision; what is left of `iterations` counts down. `scale` is the length of the direction in metres. `majorant`
// is that of the block the walk is in.
uint next_tentative_collision(SceneMedium m, float scale, float depth, inout GridWalk w, inout uint iterations, out float majorant) {
    majorant = 0.0;
    ivec3 step = ivec3(sign(w.inverse));
    vec3 ahead = max(vec3(step), vec3(0.0));
    while (w.t < w.t_end) {
        if (iterations == 0u) {
            return GRID_STOPPED;
        }
        --iterations;
        ++grid_iterations;
        float greatest = fetch_majorant(m, w.block);
        majorant = m.majorant * greatest;
        vec3 faces = ((vec3(w.block) + ahead) * m.block - w.origin) * w.inverse;
        float face = min(faces.x, min(faces.y, faces.z));
        float leave = max(min(face, w.t_end), w.t);
        float through = (leave - w.t) * majorant * scale;
        bool within = depth < through;
        float reached = within ? min(w.t + depth / (majorant * scale), leave) : leave;
        if (CLERESTORY_GRID_BOUNDS) {
            w.bound += (reached - w.t) * greatest * scale;
        }
        w.t = reached;
        if (within) {
            return GRID_COLLIDED;
        }
        depth -= through;
        bvec3 crossed = bvec3(faces.x <= face, faces.y <= face && faces.x > face, faces.z <= face && min(faces.x, faces.y) > face);
        w.block += ivec3(crossed) * step;
        if (any(lessThan(w.block, ivec3(0))) || any(greaterThanEqual(w.block, ivec3(m.blocks)))) {
            break;
        }
    }
    return GRID_LEFT;
}

// Density at the walk's place as a share of its block's majorant at density 1.
float grid_density(SceneMedium m, GridWalk w) { return density_in_cells(m, w.origin + w.t * w.direction); }

// Flies on until a real collision, the end or the quota; a flight that `passes` has no real ones, but is weighted by the transmittance
// (ratio tracking). Adds what the medium emits on the way, seen through `throughput`.
uint delta_tracking(SceneMedium m, uvec4 key, vec3 throughput, bool passes, inout GridWalk w, inout vec3 bands, inout vec3 weight, inout vec3 emitted) {
    uint iterations = GRID_WALK_QUOTA;
    while (true) {
        uvec4 bits = grid_draw(key, w.draw++);
        float majorant;
        uint state = next_tentative_collision(m, 1.0, -log(1.0 - unit_float(bits.x)), w, iterations, majorant);
        if (state != GRID_COLLIDED) {
            return state;
        }
        float share = grid_density(m, w) / majorant;
        emitted += throughput * weight * m.emission * share;
        vec3 real = min(m.sigma_t * share, vec3(1.0));
        if (passes) {
            weight *= 1.0 - real;
        } else if (sample_null_collision(real, m.sigma_s * share, unit_float(bits.y), bands, weight)) {
            return GRID_COLLIDED;
        }
        ++w.nulls;
    }
    return GRID_LEFT;
}

// Multiplies `weight` by an estimate of the transmittance to the end; GRID_STOPPED when `iterations` have been used up.
uint ratio_tracking(SceneMedium m, uvec4 key, float scale, inout GridWalk w, inout uint iterations, inout vec3 weight) {
    while (true) {
        uvec4 bits = grid_draw(key, w.draw++);
        float majorant;
        uint state = next_tentative_collision(m, scale, -log(1.0 - unit_float(bits.x)), w, iterations, majorant);
        if (state != GRID_COLLIDED) {
            return state;
        }
        ++w.nulls;
        weight *= 1.0 - min(m.sigma_t * (grid_density(m, w) / majorant), vec3(1.0));
        if (max(weight.x, max(weight.y, weight.z)) < RATIO_ROULETTE_BELOW) {
            if (unit_float(bits.y) >= RATIO_ROULETTE_SURVIVAL) {
                weight = vec3(0.0);
                return GRID_LEFT;
            }
            weight /= RATIO_ROULETTE_SURVIVAL;
        }
    }
    return GRID_LEFT;
}

#endif
