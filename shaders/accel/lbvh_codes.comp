// Third stage of the linear hierarchy: Morton codes of the boxes' centres, and the identity for the sort to permute.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

#include "accel/lbvh.glsl"
#include "accel/morton.glsl"

layout(local_size_x = LBVH_GROUP_SIZE) in;

layout(constant_id = 0) const uint LBVH_AXIS_BITS = 10u;

layout(set = 0, binding = 0) uniform utextureBuffer lbvh_boxes;
layout(set = 0, binding = 1, scalar) restrict readonly buffer LbvhStateBlock { LbvhState lbvh_state; };
// One word per code of 30 bits, two of 63 with the low one first.
layout(set = 0, binding = 2, scalar) restrict writeonly buffer LbvhCodes { uint lbvh_codes[]; };
layout(set = 0, binding = 3, scalar) restrict writeonly buffer LbvhOrder { uint lbvh_order[]; };

layout(push_constant, scalar) uniform LbvhCodesPush { uint count; } lbvh_push;

void main() {
    uint place = gl_GlobalInvocationID.x;
    if (place >= lbvh_push.count) {
        return;
    }
    ivec4 low = ivec4(texelFetch(lbvh_boxes, int(LBVH_BOX_QUARTERS * place)));
    ivec2 high = ivec2(texelFetch(lbvh_boxes, int(LBVH_BOX_QUARTERS * place + 1u)).xy);
    precise vec3 doubled = ordered_floats(low.xyz) + ordered_floats(ivec3(low.w, high));
    uvec3 cell = morton_cell(doubled, lbvh_state.grid_lower, lbvh_state.grid_scale, LBVH_AXIS_BITS);
    if (LBVH_AXIS_BITS == MORTON_30_AXIS_BITS) {
        lbvh_codes[place] = morton_30(cell);
    } else {
        uvec2 code = morton_63(cell);
        lbvh_codes[2u * place] = code.x;
        lbvh_codes[2u * place + 1u] = code.y;
    }
    lbvh_order[place] = place;
}
