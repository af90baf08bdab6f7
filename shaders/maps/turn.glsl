// Angles in whole turns, to single precision on every device: Vulkan lets sines be off by 2^-11. Polynomials and guarantees: maps/turn.rs.
#ifndef CLERESTORY_MAPS_TURN_GLSL
#define CLERESTORY_MAPS_TURN_GLSL

// The angle of a vector, in [-1/2, 1/2]; 0 for zero.
float vector_turn(vec2 v) {
    const float TAN_SIXTEENTH = 0.41421357;
    vec2 a = abs(v);
    float most = max(a.x, a.y);
    float least = min(a.x, a.y);
    // From the diagonal where that is nearer.
    bool steep = least > TAN_SIXTEENTH * most;
    float t = steep ? (least - most) / (least + most) : most > 0.0 ? least / most : 0.0;
    float z = t * t;
    float turn = t * (0.15915494 + z * (-0.053050794 + z * (0.0317902526 + z * (-0.0220453126 + z * 0.0127084632))));
    turn = steep ? turn + 0.125 : turn;
    turn = a.y > a.x ? 0.25 - turn : turn;
    turn = v.x < 0.0 ? 0.5 - turn : turn;
    return v.y < 0.0 ? -turn : turn;
}

// The unit vector (cosine, sine) of an angle.
vec2 turn_vector(float turn) {
    float quarter = floor(4.0 * turn + 0.5);
    float x = turn - 0.25 * quarter;  // exact, within an eighth
    float z = x * x;
    float s = x * (6.28318529 + z * (-41.3416626 + z * (81.5925482 - z * 75.4018403)));
    float c = 1.0 + z * (-19.7392088 + z * (64.9393691 + z * (-85.4488215 + z * 59.4241732)));
    int q = int(quarter);
    vec2 v = (q & 1) == 0 ? vec2(c, s) : vec2(-s, c);
    return (q & 2) == 0 ? v : -v;
}

#endif
