// Rays against the scene, as in src/cpu/trace.rs.
#import scene
#import rng
#import texture

const SEER_EYE: u32 = 0u;
const SEER_LIGHT: u32 = 1u;

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
    t_max: f32,
    alpha_seed: u32,
    seer: u32,
}

struct Hit {
    t: f32,
    // NONE: nothing was hit.
    primitive: u32,
    u: f32,
    v: f32,
}

// src/scene/bvh.rs allows no deeper tree.
const MAX_DEPTH: u32 = 64u;

// 1/d without infinities.
fn reciprocal(d: f32) -> f32 {
    return 1.0 / select(d, copysign(1e-20, d), abs(d) < 1e-20);
}

fn enter(box_min: vec3<f32>, box_max: vec3<f32>, origin: vec3<f32>, inverse: vec3<f32>, t_max: f32) -> f32 {
    let t0 = (box_min - origin) * inverse;
    let t1 = (box_max - origin) * inverse;
    let near = max(max_element(min(t0, t1)), 0.0);
    let last = max(t0, t1);
    // Two ulps more (Ize 2013), so that rounding never loses a box.
    let far = min(min(last.x, min(last.y, last.z)), t_max) * (1.0 + 2.4e-7);
    return select(FAR, near, near <= far);
}

// The nearest hit; with `any_hit` the first that is found.
fn trace_walk(ray: Ray, any_hit: bool) -> Hit {
    var best = Hit(ray.t_max, NONE, 0.0, 0.0);
    if tables.n_nodes == 0u {
        return best;
    }
    let inverse = vec3(reciprocal(ray.direction.x), reciprocal(ray.direction.y), reciprocal(ray.direction.z));
    var stack: array<vec2<u32>, MAX_DEPTH>;
    var height = 0u;
    var at = 0u;
    // No node is visited twice.
    for (var step = 0u; step < tables.n_nodes; step++) {
        let node = nodes[at];
        var near = enter(node.left_min, node.left_max, ray.origin, inverse, best.t);
        var far = enter(node.right_min, node.right_max, ray.origin, inverse, best.t);
        var near_child = vec2(node.left, node.n_left);
        var far_child = vec2(node.right, node.n_right);
        if far < near {
            let t = near;
            near = far;
            far = t;
            let child = near_child;
            near_child = far_child;
            far_child = child;
        }
        // Primitives of the near leaf, then of the far one, in one loop.
        let n_near = select(0u, near_child.y, near < FAR);
        let n_far = select(0u, far_child.y, far < FAR);
        for (var j = 0u; j < n_near + n_far; j++) {
            let index = select(far_child.x + j - n_near, near_child.x + j, j < n_near);
            trace_primitive(ray, index, &best);
        }
        if any_hit && best.primitive != NONE {
            break;
        }
        var next = NONE;
        if near < FAR && near_child.y == 0u {
            next = near_child.x;
        }
        if far < FAR && far_child.y == 0u {
            if next == NONE {
                next = far_child.x;
            } else {
                stack[min(height, MAX_DEPTH - 1u)] = vec2(far_child.x, bitcast<u32>(far));
                height += 1u;
            }
        }
        while next == NONE && height > 0u {
            height -= 1u;
            let top = stack[height];
            if bitcast<f32>(top.y) <= best.t {
                next = top.x;
            }
        }
        if next == NONE {
            break;
        }
        at = next;
    }
    return best;
}

fn trace_primitive(ray: Ray, index: u32, best: ptr<function, Hit>) {
    let p = primitives[index];
    var hit: Hit;
    if (p.flags & PRIMITIVE_SPHERE) == 0u {
        hit = trace_triangle(p, ray, (*best).t);
    } else {
        hit = trace_sphere(p, ray, (*best).t);
    }
    if hit.primitive == NONE {
        return;
    }
    hit.primitive = index;
    if (p.flags & (PRIMITIVE_ALPHA | PRIMITIVE_SINGLE_SIDED)) == 0u || trace_is_there(p, ray, hit) {
        *best = hit;
    }
}

const MISS: Hit = Hit(0.0, NONE, 0.0, 0.0);

fn trace_triangle(p: Primitive, ray: Ray, t_max: f32) -> Hit {
    let a = p.a - ray.origin;
    let b = p.b - ray.origin;
    let c = p.c - ray.origin;
    let d = ray.direction;
    let ca = c - a;
    let ab = a - b;
    let bc = b - c;
    let u = dot(cross(ca, c + a), d);
    let v = dot(cross(ab, a + b), d);
    let w = dot(cross(bc, b + c), d);
    if min(u, min(v, w)) < 0.0 && max(u, max(v, w)) > 0.0 {
        return MISS;
    }
    let normal = cross(ab, ca);
    let slope = dot(normal, d);
    let sum = u + v + w;
    if slope == 0.0 || sum == 0.0 {
        return MISS;
    }
    let t = dot(a, normal) / slope;
    if t > 0.0 && t < t_max {
        return Hit(t, 0u, u / sum, v / sum);
    }
    return MISS;
}

fn trace_sphere(p: Primitive, ray: Ray, t_max: f32) -> Hit {
    let radius = p.b.x;
    let f = ray.origin - p.a;
    let b = -dot(f, ray.direction);
    let apart = f + b * ray.direction;
    let discriminant = radius * radius - dot(apart, apart);
    if discriminant < 0.0 {
        return MISS;
    }
    let q = b + copysign(sqrt(discriminant), b);
    let c = dot(f, f) - radius * radius;
    var t0 = 0.0;
    if q != 0.0 {
        t0 = c / q;
    }
    let first = min(t0, q);
    let second = max(t0, q);
    if first > 0.0 && first < t_max {
        return Hit(first, 0u, 0.0, 0.0);
    }
    if second > 0.0 && second < t_max {
        return Hit(second, 0u, 0.0, 0.0);
    }
    return MISS;
}

fn trace_is_there(p: Primitive, ray: Ray, hit: Hit) -> bool {
    if (p.flags & PRIMITIVE_SINGLE_SIDED) != 0u && ray.seer == SEER_EYE
        && dot(geometric_normal(p, ray.origin + hit.t * ray.direction), ray.direction) > 0.0 {
        return false;
    }
    if (p.flags & PRIMITIVE_ALPHA) == 0u {
        return true;
    }
    let material = material_at(p.material);
    let opacity = texture_opacity(p, material, hit.u, hit.v);
    if material.alpha_cutoff <= 1.0 {
        return opacity >= material.alpha_cutoff;
    }
    return rng_unit(pcg4d(vec4(ray.alpha_seed, hit.primitive, 0u, 0u)).x) < opacity;
}

// Of the front; unit, world space.
fn geometric_normal(p: Primitive, position: vec3<f32>) -> vec3<f32> {
    if (p.flags & PRIMITIVE_SPHERE) != 0u {
        let outward = normalize(position - p.a);
        return select(outward, -outward, (p.flags & PRIMITIVE_INWARD) != 0u);
    }
    return normalize_or(cross(p.b - p.a, p.c - p.a), vec3(0.0, 1.0, 0.0));
}

// Where a ray may start so that it does not meet the surface it leaves.
fn trace_leave(position: vec3<f32>, normal: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    let scale = max(max_element(abs(position)), scene_info.radius * 0.05);
    let side = copysign(1.0, dot(normal, direction));
    return position + normal * (side * scene_info.epsilon * scale);
}
