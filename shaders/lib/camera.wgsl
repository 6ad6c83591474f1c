// Rays from the lens, as in src/cpu/camera.rs.
#import scene
#import warp

struct CameraRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
}

fn camera_ray(pixel: vec2<u32>, u: vec4<f32>) -> CameraRay {
    let sx = (f32(frame.crop_x + pixel.x) + u.x) / f32(frame.full_width) * 2.0 - 1.0;
    let sy = 1.0 - (f32(frame.crop_y + pixel.y) + u.y) / f32(frame.full_height) * 2.0;
    let across = camera.right * (sx * camera.half_width) + camera.up * (sy * camera.half_height);
    var lens = vec3(0.0);
    if camera.aperture_radius > 0.0 {
        let p = warp_disc(u.zw) * camera.aperture_radius;
        lens = camera.right * p.x + camera.up * p.y;
    }
    if camera.orthographic != 0u {
        let focus = camera.position + across + camera.forward * camera.focus_distance;
        let origin = camera.position + across + lens;
        return CameraRay(origin, normalize(focus - origin));
    }
    let direction = across + camera.forward;
    if camera.aperture_radius > 0.0 {
        return CameraRay(camera.position + lens, normalize(direction * camera.focus_distance - lens));
    }
    return CameraRay(camera.position, normalize(direction));
}
