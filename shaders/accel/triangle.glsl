// Watertight ray/triangle test (Woop, Benthin and Wald, JCGT 2(1), 2013) with edge values of exact sign in f32 alone: both products'
// rounding errors are added back (Dekker's splitting). Edge value zero counts as inside. Twin of clerestory::accel::triangle, which
// states the guarantees; `precise` keeps compilers from contracting what they rest on.
#ifndef CLERESTORY_ACCEL_TRIANGLE_GLSL
#define CLERESTORY_ACCEL_TRIANGLE_GLSL

struct RayShear {
    vec3 origin;
    uint axis;
    vec3 shear;
};

struct TriangleHit {
    float t;
    vec2 barycentrics;
};

const float SPLITTER = 4097.0;

vec3 dominant_axis_last(vec3 v, uint axis) {
    return axis == 0u ? v.yzx : axis == 1u ? v.zxy : v;
}

RayShear ray_shear(vec3 origin, vec3 direction) {
    vec3 a = abs(direction);
    uint axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
    vec3 d = dominant_axis_last(direction, axis);
    return RayShear(origin, axis, vec3(d.xy / d.z, 1.0 / d.z));
}

vec3 project_vertex(RayShear ray, vec3 vertex) {
    precise vec3 a = vertex - ray.origin;
    a = dominant_axis_last(a, ray.axis);
    precise vec2 sheared = a.xy - ray.shear.xy * a.z;
    return vec3(sheared, ray.shear.z * a.z);
}

// Upper halves of the significands; the difference to the number is the lower half.
vec3 significand_high(vec3 v) {
    precise vec3 c = SPLITTER * v;
    precise vec3 high = c - (c - v);
    return high;
}

// The three edge values a·b − c·d at once, each with both products' errors added back.
vec3 difference_of_products(vec3 a, vec3 b, vec3 c, vec3 d, vec3 ah, vec3 bh, vec3 ch, vec3 dh) {
    precise vec3 p = a * b;
    precise vec3 q = c * d;
    precise vec3 al = a - ah;
    precise vec3 bl = b - bh;
    precise vec3 cl = c - ch;
    precise vec3 dl = d - dh;
    precise vec3 pe = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
    precise vec3 qe = ((ch * dh - q) + ch * dl + cl * dh) + cl * dl;
    precise vec3 result = (p - q) + (pe - qe);
    return result;
}

bool intersect_triangle(RayShear ray, vec3 v0, vec3 v1, vec3 v2, float t_min, float t_max, out TriangleHit hit) {
    vec3 a = project_vertex(ray, v0);
    vec3 b = project_vertex(ray, v1);
    vec3 c = project_vertex(ray, v2);
    vec3 x = vec3(a.x, b.x, c.x);
    vec3 y = vec3(a.y, b.y, c.y);
    vec3 xh = significand_high(x);
    vec3 yh = significand_high(y);
    vec3 edge = difference_of_products(x.zxy, y.yzx, y.zxy, x.yzx, xh.zxy, yh.yzx, yh.zxy, xh.yzx);
    precise float det = edge.x + edge.y + edge.z;
    precise float inverse = 1.0 / det;
    precise float t = (edge.x * a.z + edge.y * b.z + edge.z * c.z) * inverse;
    hit = TriangleHit(t, edge.yz * inverse);
    bool inside = all(greaterThanEqual(edge, vec3(0.0))) || all(lessThanEqual(edge, vec3(0.0)));
    return inside && det != 0.0 && t >= t_min && t <= t_max;
}

#endif
