// Morton codes of 63 bits, 21 an axis, in a box.

const CELLS: f32 = 2097152.0;

// Spreads the low 11 bits to every third bit.
fn spread(value: u32) -> u32 {
    var v = value & 0x7ffu;
    v = (v | (v << 16u)) & 0x070000ffu;
    v = (v | (v << 8u)) & 0x0700f00fu;
    v = (v | (v << 4u)) & 0x430c30c3u;
    v = (v | (v << 2u)) & 0x49249249u;
    return v;
}

// Bits of x, y and z at 3k + 2, 3k + 1 and 3k, as in src/math/morton.rs: the lower 10 bits of each axis fill bits 0 to 29, the upper 11 bits 30 to 62.
fn morton(cell: vec3<u32>) -> vec2<u32> {
    let low = (spread(cell.x & 0x3ffu) << 2u) | (spread(cell.y & 0x3ffu) << 1u) | spread(cell.z & 0x3ffu);
    let x = spread(cell.x >> 10u);
    let y = spread(cell.y >> 10u);
    let z = spread(cell.z >> 10u);
    // x << 2 | y << 1 | z has 33 bits; two of them go into the low word.
    let upper = (x << 2u) | (y << 1u) | z;
    return vec2(low | (upper << 30u), (upper >> 2u) | ((x >> 30u) << 30u));
}

// Code of a position in the box, beside it that of the nearest cell.
fn morton_code(position: vec3<f32>, low: vec3<f32>, high: vec3<f32>) -> vec2<u32> {
    let extent = high - low;
    // Below this the quotient would overflow; everything is then in one cell.
    let flat = extent < vec3(1e-30);
    let scale = select(vec3(CELLS) / extent, vec3(0.0), flat);
    return morton(vec3<u32>(clamp((position - low) * scale, vec3(0.0), vec3(CELLS - 1.0))));
}
