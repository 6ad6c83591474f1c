// Adds an iteration's image to the film, as ppm::film::add does.
#import frame

@group(0) @binding(0) var<storage, read> radiance: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> film: array<vec4<f32>>;

fn luminance(rgb: vec3<f32>) -> f32 {
    return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
}

// Reads radiance, reads and writes film; one thread per pixel of the chunk. values.x: pixels in the chunk.
@compute @workgroup_size(64)
fn accumulate(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let pixel = thread_index(workgroup, workgroups, local, 64u);
    if pixel >= arguments.values.x {
        return;
    }
    let before = film[pixel];
    let now = radiance[pixel].xyz;
    let mean = before.xyz + (now - before.xyz) * (1.0 / f32(frame.iteration));
    let spread = (luminance(now) - luminance(before.xyz)) * (luminance(now) - luminance(mean));
    film[pixel] = vec4(mean, before.w + spread);
}
