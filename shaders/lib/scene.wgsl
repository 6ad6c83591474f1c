// The packed scene.
#import frame
#import basis

struct Tables {
    n_nodes: u32,
    n_primitives: u32,
    // First word of four, in `table`, of each kind of thing.
    materials: u32,
    slots: u32,
    lights: u32,
    environment_rows: u32,
    albedo: u32,
    // Whether there is an emitting surface or an environment.
    has_extended: u32,
}

@group(2) @binding(2) var<uniform> scene_info: SceneInfo;
@group(2) @binding(3) var<uniform> tables: Tables;

@group(3) @binding(0) var<storage, read> nodes: array<SceneNode>;
@group(3) @binding(1) var<storage, read> primitives: array<Primitive>;
@group(3) @binding(2) var<storage, read> vertices: array<Vertex>;
@group(3) @binding(3) var<storage, read> texels: array<u32>;
// Radiance and the cumulative probability within the row.
@group(3) @binding(4) var<storage, read> environment_texels: array<vec4<f32>>;
// Materials, texture slots, lights, environment rows and albedo in one, for bindings are few.
@group(3) @binding(5) var<storage, read> table: array<vec4<u32>>;

fn material_at(index: u32) -> Material {
    let at = tables.materials + index * 7u;
    let a = table[at];
    let b = table[at + 1u];
    let c = table[at + 2u];
    let d = table[at + 3u];
    let e = table[at + 4u];
    let f = table[at + 5u];
    let g = table[at + 6u];
    return Material(
        bitcast<vec3<f32>>(a.xyz), bitcast<f32>(a.w),
        bitcast<vec3<f32>>(b.xyz), bitcast<f32>(b.w),
        bitcast<vec3<f32>>(c.xyz), bitcast<f32>(c.w),
        bitcast<vec3<f32>>(d.xyz), bitcast<f32>(d.w),
        bitcast<f32>(e.x), bitcast<f32>(e.y), bitcast<f32>(e.z), e.w,
        f.x, f.y, f.z, f.w,
        g.x, bitcast<f32>(g.y), g.zw,
    );
}

fn material_flags_at(index: u32) -> u32 {
    return table[tables.materials + index * 7u + 4u].w;
}

fn slot_at(index: u32) -> TextureSlot {
    let at = tables.slots + index * 3u;
    let a = table[at];
    let b = table[at + 1u];
    return TextureSlot(
        bitcast<vec4<f32>>(a), bitcast<vec2<f32>>(b.xy), b.z, b.w, table[at + 2u].x, array<u32, 3>(0u, 0u, 0u),
    );
}

fn light_at(index: u32) -> Light {
    let at = tables.lights + index * 4u;
    let a = table[at];
    let b = table[at + 1u];
    let c = table[at + 2u];
    let d = bitcast<vec4<f32>>(table[at + 3u]);
    return Light(
        bitcast<vec3<f32>>(a.xyz), a.w, bitcast<vec3<f32>>(b.xyz), b.w, bitcast<vec3<f32>>(c.xyz), bitcast<f32>(c.w),
        d.x, d.y, d.z, d.w,
    );
}

fn light_cumulative(index: u32) -> f32 {
    return bitcast<f32>(table[tables.lights + index * 4u + 3u].w);
}

fn environment_row(y: u32) -> f32 {
    return bitcast<f32>(table[tables.environment_rows + y / 4u][y & 3u]);
}
