// Where light comes from, as in src/cpu/light.rs.
#import warp
#import surface

struct Incoming {
    direction: vec3<f32>,
    distance: f32,
    light: vec3<f32>,
    // 0: no light.
    pdf: f32,
    point_like: bool,
}

struct Emission {
    origin: vec3<f32>,
    direction: vec3<f32>,
    power: vec3<f32>,
    ok: bool,
}

const DARKNESS: Incoming = Incoming(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0, false);
const NO_EMISSION: Emission = Emission(vec3<f32>(0.0), vec3<f32>(0.0), vec3<f32>(0.0), false);

// The light that the number in [0, 1) falls on.
fn light_choose(u: f32) -> u32 {
    var low = 0u;
    var high = scene_info.n_lights - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if light_cumulative(middle) <= u {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

struct LightPoint {
    position: vec3<f32>,
    attributes: Attributes,
}

fn light_point_on(p: Primitive, u: vec2<f32>) -> LightPoint {
    if (p.flags & PRIMITIVE_SPHERE) != 0u {
        return LightPoint(p.a + warp_sphere(u) * p.b.x, attributes_at(p, 0.0, 0.0));
    }
    let w = warp_triangle(u);
    return LightPoint(p.a * (1.0 - w.x - w.y) + p.b * w.x + p.c * w.y, attributes_at(p, w.x, w.y));
}

fn light_double_sided(p: Primitive) -> bool {
    return (material_flags_at(p.material) & MATERIAL_DOUBLE_SIDED) != 0u;
}

// Light towards `position` from a light chosen by its power.
fn light_sample(position: vec3<f32>, u: vec3<f32>) -> Incoming {
    if scene_info.n_lights == 0u {
        return DARKNESS;
    }
    let light = light_at(light_choose(u.x));
    switch light.kind {
        case LIGHT_AREA: {
            let p = primitives[light.primitive];
            let at = light_point_on(p, u.yz);
            let to = at.position - position;
            let distance2 = dot(to, to);
            let distance = sqrt(distance2);
            if distance == 0.0 {
                return DARKNESS;
            }
            let direction = to / distance;
            let cosine = -dot(geometric_normal(p, at.position), direction);
            if cosine == 0.0 || (cosine < 0.0 && !light_double_sided(p)) {
                return DARKNESS;
            }
            let pdf = light.probability * distance2 / (light.area * abs(cosine));
            return Incoming(direction, distance, surface_emission(p, at.attributes), pdf, false);
        }
        case LIGHT_POINT, LIGHT_SPOT: {
            let to = light.position - position;
            let distance2 = dot(to, to);
            if distance2 == 0.0 {
                return DARKNESS;
            }
            let distance = sqrt(distance2);
            let direction = to / distance;
            let falloff = light_spot(light, -direction);
            if falloff <= 0.0 {
                return DARKNESS;
            }
            return Incoming(direction, distance, light.intensity * (falloff / distance2), light.probability, true);
        }
        case LIGHT_DIRECTIONAL: {
            return Incoming(-light.direction, FAR, light.intensity, light.probability, true);
        }
        default: {
            let found = light_sample_environment(u.yz);
            if found.w <= 0.0 {
                return DARKNESS;
            }
            return Incoming(found.xyz, FAR, light_environment(found.xyz), light.probability * found.w, false);
        }
    }
}

// Share of a spot light's intensity; 1 for a point light.
fn light_spot(light: Light, direction: vec3<f32>) -> f32 {
    if light.kind != LIGHT_SPOT {
        return 1.0;
    }
    let cosine = dot(light.direction, direction);
    let t = clamp((cosine - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1e-4), 0.0, 1.0);
    return t * t;
}

// Density per steradian with which light_sample finds a point of an emitting primitive.
fn light_area_pdf(light: u32, distance: f32, cosine: f32) -> f32 {
    if light == NONE || cosine == 0.0 {
        return 0.0;
    }
    let l = light_at(light);
    return l.probability * distance * distance / (l.area * abs(cosine));
}

// Density per steradian with which light_sample finds a direction of the environment.
fn light_environment_pdf(direction: vec3<f32>) -> f32 {
    if scene_info.environment_light == NONE {
        return 0.0;
    }
    let uv = environment_uv_of(map_from_world(direction));
    let texel = environment_texel_of(uv);
    return light_at(scene_info.environment_light).probability * environment_texel_density(texel.x, texel.y, uv.y);
}

fn map_from_world(d: vec3<f32>) -> vec3<f32> {
    let c = scene_info.environment_rotation.x;
    let s = scene_info.environment_rotation.y;
    return vec3(c * d.x - s * d.z, d.y, s * d.x + c * d.z);
}

fn world_from_map(d: vec3<f32>) -> vec3<f32> {
    let c = scene_info.environment_rotation.x;
    let s = scene_info.environment_rotation.y;
    return vec3(c * d.x + s * d.z, d.y, -s * d.x + c * d.z);
}

// The built-in inverse functions may be off by several texels of a large map.
fn arc_tangent(y: f32, x: f32) -> f32 {
    let a = max(abs(x), abs(y));
    if a == 0.0 {
        return 0.0;
    }
    var t = min(abs(x), abs(y)) / a;
    var angle = 0.0;
    if t > 0.41421356 {
        t = (t - 1.0) / (t + 1.0);
        angle = PI / 4.0;
    }
    let z = t * t;
    angle += (((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * t + t;
    if abs(y) > abs(x) {
        angle = PI / 2.0 - angle;
    }
    if x < 0.0 {
        angle = PI - angle;
    }
    return copysign(angle, y);
}

fn environment_uv_of(d: vec3<f32>) -> vec2<f32> {
    let y = clamp(d.y, -1.0, 1.0);
    let theta = arc_tangent(sqrt((1.0 - y) * (1.0 + y)), y);
    return vec2(0.5 + arc_tangent(d.z, d.x) / TAU, theta / PI);
}

fn environment_direction_of(uv: vec2<f32>) -> vec3<f32> {
    let phi = (uv.x - 0.5) * TAU;
    let theta = uv.y * PI;
    return vec3(sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi));
}

fn environment_texel_of(uv: vec2<f32>) -> vec2<u32> {
    let size = vec2(scene_info.environment_width, scene_info.environment_height);
    return min(vec2<u32>(max(uv * vec2<f32>(size), vec2(0.0))), size - 1u);
}

fn environment_cell(x: u32, y: u32) -> f32 {
    return environment_texels[y * scene_info.environment_width + x].w;
}

// Probability of a texel, and its solid angle over its share of the square.
fn environment_texel_density(x: u32, y: u32, v: f32) -> f32 {
    let n_texels = scene_info.environment_width * scene_info.environment_height;
    var in_rows = environment_row(y);
    if y > 0u {
        in_rows -= environment_row(y - 1u);
    }
    var in_row = environment_cell(x, y);
    if x > 0u {
        in_row -= environment_cell(x - 1u, y);
    }
    return in_rows * in_row * f32(n_texels) / (2.0 * PI * PI * max(sin(v * PI), 1e-6));
}

fn environment_cumulative(column: bool, i: u32, y: u32) -> f32 {
    if column {
        return environment_cell(i, y);
    }
    return environment_row(i);
}

// Where the number falls in a row of texels, or among the rows: index and place in it.
fn environment_place(column: bool, y: u32, n: u32, u: f32) -> vec2<f32> {
    var low = 0u;
    var high = n - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if environment_cumulative(column, middle, y) <= u {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var before = 0.0;
    if low > 0u {
        before = environment_cumulative(column, low - 1u, y);
    }
    let width = environment_cumulative(column, low, y) - before;
    var place = 0.5;
    if width > 0.0 {
        place = clamp((u - before) / width, 0.0, 0.999999);
    }
    return vec2(f32(low), place);
}

// A direction towards the environment and its density per steradian, the choice of the light not counted.
fn light_sample_environment(u: vec2<f32>) -> vec4<f32> {
    let w = scene_info.environment_width;
    let h = scene_info.environment_height;
    let row = environment_place(false, 0u, h, u.x);
    let y = u32(row.x);
    let column = environment_place(true, y, w, u.y);
    let uv = vec2((column.x + column.y) / f32(w), (row.x + row.y) / f32(h));
    return vec4(world_from_map(environment_direction_of(uv)), environment_texel_density(u32(column.x), y, uv.y));
}

// Radiance from the environment, bilinear; black without one.
fn light_environment(direction: vec3<f32>) -> vec3<f32> {
    if scene_info.environment_light == NONE {
        return vec3(0.0);
    }
    let w = i32(scene_info.environment_width);
    let h = i32(scene_info.environment_height);
    let uv = environment_uv_of(map_from_world(direction));
    let x = uv.x * f32(w) - 0.5;
    let y = uv.y * f32(h) - 0.5;
    let fx = x - floor(x);
    let fy = y - floor(y);
    // Never negative: the first column may be one to the left.
    let i = i32(floor(x)) + w;
    let j = i32(floor(y));
    let low = environment_fetch(i, j) * (1.0 - fx) + environment_fetch(i + 1, j) * fx;
    let high = environment_fetch(i, j + 1) * (1.0 - fx) + environment_fetch(i + 1, j + 1) * fx;
    return (low * (1.0 - fy) + high * fy) * scene_info.environment_scale;
}

fn environment_fetch(x: i32, y: i32) -> vec3<f32> {
    let w = i32(scene_info.environment_width);
    let h = i32(scene_info.environment_height);
    return environment_texels[clamp(y, 0, h - 1) * w + x % w].xyz;
}

// Sends out a photon: `u` chooses the light and where, `v` the direction and the side.
fn light_emit(u: vec3<f32>, v: vec3<f32>) -> Emission {
    if scene_info.n_lights == 0u {
        return NO_EMISSION;
    }
    let light = light_at(light_choose(u.x));
    let chosen = 1.0 / light.probability;
    switch light.kind {
        case LIGHT_AREA: {
            let p = primitives[light.primitive];
            let at = light_point_on(p, u.yz);
            var normal = geometric_normal(p, at.position);
            var sides = 1.0;
            if light_double_sided(p) {
                sides = 2.0;
                if v.z < 0.5 {
                    normal = -normal;
                }
            }
            let direction = basis_world(basis_around(normal), warp_cosine(v.xy));
            let power = surface_emission(p, at.attributes) * (PI * light.area * sides * chosen);
            return Emission(trace_leave(at.position, normal, direction), direction, power, true);
        }
        case LIGHT_POINT: {
            return Emission(light.position, warp_sphere(v.xy), light.intensity * (4.0 * PI * chosen), true);
        }
        case LIGHT_SPOT: {
            let direction = basis_world(basis_around(light.direction), warp_cone(v.xy, light.cos_outer));
            let power = light.intensity * (light_spot(light, direction) * TAU * (1.0 - light.cos_outer) * chosen);
            return Emission(light.position, direction, power, max_element(power) > 0.0);
        }
        case LIGHT_DIRECTIONAL: {
            let place = light_on_disc(light.direction, u.yz);
            return Emission(place.xyz, light.direction, light.intensity * (place.w * chosen), true);
        }
        default: {
            let found = light_sample_environment(v.xy);
            if found.w <= 0.0 {
                return NO_EMISSION;
            }
            let place = light_on_disc(-found.xyz, u.yz);
            let power = light_environment(found.xyz) * (place.w * chosen / found.w);
            return Emission(place.xyz, -found.xyz, power, true);
        }
    }
}

// On the disc that the scene's bounding sphere shows to light travelling along `direction`, before the scene; and one over
// the density of that place, m². Half of the photons lie about the subject, if it is a speck in the scene.
fn light_on_disc(direction: vec3<f32>, u: vec2<f32>) -> vec4<f32> {
    let radius = scene_info.radius;
    let subject_radius = scene_info.subject_radius;
    let basis = basis_around(direction);
    let before = scene_info.centre - direction * radius;
    if subject_radius == 0.0 {
        let p = warp_disc(u) * radius;
        return vec4(before + basis.x * p.x + basis.y * p.y, PI * radius * radius);
    }
    let to = scene_info.subject_centre - scene_info.centre;
    let middle = vec2(dot(to, basis.x), dot(to, basis.y));
    let octaves = log(radius / subject_radius);
    // Of those about it, the share within its radius: then their density does not leap there.
    let share = 1.0 / (1.0 + 2.0 * octaves);
    let is_about = u.x < 0.5;
    let unit = warp_disc(vec2(2.0 * u.x - select(1.0, 0.0, is_about), u.y));
    var p = unit * radius;
    if is_about {
        let t = dot(unit, unit);
        var distance = subject_radius * sqrt(t / share);
        if t >= share {
            distance = subject_radius * exp((t - share) / (1.0 - share) * octaves);
        }
        p = middle + unit * select(0.0, distance / sqrt(t), t > 0.0);
    }
    let from_middle = max(length(p - middle), subject_radius);
    // Rounding puts no sample outside of where it is from.
    let about = select(0.0, share / (from_middle * from_middle), is_about || from_middle <= radius);
    let evenly = select(0.0, 1.0 / (radius * radius), !is_about || length(p) <= radius);
    return vec4(before + basis.x * p.x + basis.y * p.y, TAU / (about + evenly));
}
