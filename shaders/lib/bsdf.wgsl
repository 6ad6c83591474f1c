// How a surface scatters, as in src/cpu/bsdf.rs.
#import warp
#import ggx
#import albedo

const TRACED_ROUGHNESS: f32 = 0.3;
const MAX_SHADING_CORRECTION: f32 = 8.0;

// Transport: which direction is known.
const RADIANCE: u32 = 0u;
const IMPORTANCE: u32 = 1u;

// Lobes, as bits.
const LOBE_DIFFUSE: u32 = 1u;
const LOBE_SPECULAR: u32 = 2u;
const LOBES_ALL: u32 = 3u;

struct Bsdf {
    basis: Basis,
    normal: vec3<f32>,
    base_color: vec3<f32>,
    f0: vec3<f32>,
    f90: f32,
    roughness: f32,
    alpha: f32,
    metallic: f32,
    transmission: f32,
    // Far side over known side.
    eta: f32,
    volume: bool,
    // Directional albedo of the lobe for the known direction.
    known_albedo: vec2<f32>,
}

// A sampled direction; `ok` is false where the light ends.
struct Scatter {
    direction: vec3<f32>,
    weight: vec3<f32>,
    pdf: f32,
    transmitted: bool,
    // Coat, metal or glass chose it, and not the Lambertian base.
    specular: bool,
    ok: bool,
}

// Basis coordinates, BSDF × cosine / density, density.
struct Weighed {
    o: vec3<f32>,
    weight: vec3<f32>,
    pdf: f32,
    ok: bool,
}

struct Choice {
    diffuse: f32,
    coat: f32,
    glass: f32,
}

fn bsdf_of_vertex(v: EyeVertex) -> Bsdf {
    let b = Bsdf(
        basis_around(oct_decode(v.shading_normal)),
        oct_decode(v.normal),
        v.base_color,
        v.f0,
        v.f90,
        v.roughness,
        v.roughness * v.roughness,
        v.metallic,
        v.transmission,
        v.eta,
        (v.material_flags & MATERIAL_VOLUME) != 0u,
        vec2(0.0),
    );
    return bsdf_with_known(b, oct_decode(v.outgoing));
}

// With what depends on the known direction alone.
fn bsdf_with_known(b: Bsdf, known: vec3<f32>) -> Bsdf {
    var with_known = b;
    if !bsdf_is_diffuse(b) {
        with_known.known_albedo = bsdf_lobe_albedo(b, max(dot(b.basis.z, known), 0.0));
    }
    return with_known;
}

fn bsdf_is_smooth(b: Bsdf) -> bool {
    return b.alpha < MIN_ALPHA;
}

fn bsdf_is_diffuse(b: Bsdf) -> bool {
    return b.metallic == 0.0 && b.transmission == 0.0 && b.f90 == 0.0;
}

fn bsdf_gathered(b: Bsdf) -> u32 {
    return select(0u, LOBE_DIFFUSE, b.metallic < 1.0 && b.transmission < 1.0)
        | select(0u, LOBE_SPECULAR, b.roughness >= TRACED_ROUGHNESS && !bsdf_is_diffuse(b));
}

fn bsdf_traced(b: Bsdf) -> u32 {
    return select(0u, LOBE_SPECULAR, b.roughness < TRACED_ROUGHNESS && !bsdf_is_diffuse(b));
}

fn bsdf_plastic(b: Bsdf) -> f32 {
    return (1.0 - b.metallic) * (1.0 - b.transmission);
}

fn bsdf_glass(b: Bsdf) -> f32 {
    return (1.0 - b.metallic) * b.transmission;
}

fn bsdf_lobe_albedo(b: Bsdf, cosine: f32) -> vec2<f32> {
    if bsdf_is_smooth(b) {
        let grazing = pow5(max(1.0 - cosine, 0.0));
        return vec2(1.0 - grazing, grazing);
    }
    return albedo_look_up(cosine, b.roughness);
}

fn bsdf_compensation(f0: vec3<f32>, ab: vec2<f32>) -> vec3<f32> {
    return 1.0 + f0 * ((1.0 - ab.x - ab.y) / (ab.x + ab.y));
}

fn bsdf_coat_albedo(b: Bsdf, ab: vec2<f32>) -> vec3<f32> {
    return min((b.f0 * ab.x + b.f90 * ab.y) * bsdf_compensation(b.f0, ab), vec3(1.0));
}

fn bsdf_metal_albedo(b: Bsdf, ab: vec2<f32>) -> vec3<f32> {
    return (b.base_color * ab.x + ab.y) * bsdf_compensation(b.base_color, ab);
}

// `ab` is the albedo of the lobe for the eye's direction, here and below.
fn bsdf_diffuse(b: Bsdf, ab: vec2<f32>) -> vec3<f32> {
    let base = b.base_color * (bsdf_plastic(b) * FRAC_1_PI);
    if b.f90 == 0.0 {
        return base;
    }
    return base * (1.0 - bsdf_coat_albedo(b, ab));
}

fn bsdf_specular(b: Bsdf, known: vec3<f32>, other: vec3<f32>, transport: u32, ab: vec2<f32>) -> vec3<f32> {
    if bsdf_is_smooth(b) || bsdf_is_diffuse(b) || known.z <= 0.0 || other.z == 0.0 {
        return vec3(0.0);
    }
    let reflected = other.z > 0.0;
    // A thin sheet transmits what its mirror image would reflect.
    let mirrored = vec3(other.xy, abs(other.z));
    if reflected || !b.volume {
        let half_way = normalize(known + mirrored);
        let cosine = max(dot(known, half_way), 0.0);
        let lobe = ggx_distribution(half_way.z, b.alpha) * ggx_visibility(known.z, mirrored.z, b.alpha);
        var through = 0.0;
        if b.transmission > 0.0 {
            through = dielectric(cosine, b.eta);
        }
        if !reflected {
            return b.base_color * (bsdf_glass(b) * (1.0 - through) * lobe);
        }
        let grazing = pow5(1.0 - cosine);
        let coat = (b.f0 + (b.f90 - b.f0) * grazing) * bsdf_compensation(b.f0, ab);
        let metal = (b.base_color + (1.0 - b.base_color) * grazing) * bsdf_compensation(b.base_color, ab);
        return (coat * bsdf_plastic(b) + metal * b.metallic + bsdf_glass(b) * through) * lobe;
    }
    // Walter et al. 2007, equation 21.
    var half_way = normalize_or(known + other * b.eta, vec3(0.0, 0.0, 1.0));
    if half_way.z < 0.0 {
        half_way = -half_way;
    }
    let k = dot(known, half_way);
    let o = dot(other, half_way);
    if k <= 0.0 || o >= 0.0 {
        return vec3(0.0);
    }
    let spread = o + k / b.eta;
    let lobe = 4.0 * ggx_distribution(half_way.z, b.alpha) * ggx_visibility(known.z, -other.z, b.alpha);
    let through = (1.0 - dielectric(k, b.eta)) * lobe * k * -o / (spread * spread);
    let scale = select(1.0, 1.0 / (b.eta * b.eta), transport == RADIANCE);
    return b.base_color * (bsdf_glass(b) * through * scale);
}

fn bsdf_local(b: Bsdf, k: vec3<f32>, o: vec3<f32>, lobes: u32, transport: u32) -> vec3<f32> {
    var ab = b.known_albedo;
    if transport == IMPORTANCE && o.z > 0.0 && !bsdf_is_diffuse(b) {
        ab = bsdf_lobe_albedo(b, o.z);
    }
    var f = vec3(0.0);
    if (lobes & LOBE_DIFFUSE) != 0u && o.z > 0.0 {
        f += bsdf_diffuse(b, ab);
    }
    if (lobes & LOBE_SPECULAR) != 0u {
        f += bsdf_specular(b, k, o, transport, ab);
    }
    return f;
}

// 1/sr, without the mirrors' peaks; world space.
fn bsdf_evaluate(b: Bsdf, known: vec3<f32>, other: vec3<f32>, lobes: u32, transport: u32) -> vec3<f32> {
    let k = basis_local(b.basis, known);
    let o = basis_local(b.basis, other);
    if k.z <= 0.0 || o.z * dot(other, b.normal) <= 0.0 {
        return vec3(0.0);
    }
    return bsdf_local(b, k, o, lobes, transport);
}

fn bsdf_choice(b: Bsdf, lobes: u32) -> Choice {
    if bsdf_is_diffuse(b) {
        return Choice(select(0.0, 1.0, (lobes & LOBE_DIFFUSE) != 0u), 0.0, 0.0);
    }
    let ab = b.known_albedo;
    let coat = bsdf_coat_albedo(b, ab);
    var choice = Choice(0.0, 0.0, 0.0);
    if (lobes & LOBE_DIFFUSE) != 0u {
        choice.diffuse = max_element(b.base_color * (1.0 - coat)) * bsdf_plastic(b);
    }
    if (lobes & LOBE_SPECULAR) != 0u {
        choice.coat = max_element(coat) * bsdf_plastic(b);
        if b.metallic > 0.0 {
            choice.coat += max_element(bsdf_metal_albedo(b, ab)) * b.metallic;
        }
        choice.glass = bsdf_glass(b);
    }
    let sum = choice.diffuse + choice.coat + choice.glass;
    var scale = 0.0;
    if sum > 0.0 {
        scale = 1.0 / sum;
    }
    return Choice(choice.diffuse * scale, choice.coat * scale, choice.glass * scale);
}

fn bsdf_follow_probability(b: Bsdf) -> f32 {
    if (bsdf_traced(b) & LOBE_SPECULAR) == 0u {
        return 0.0;
    }
    if (bsdf_gathered(b) & LOBE_DIFFUSE) == 0u {
        return 1.0;
    }
    let choice = bsdf_choice(b, LOBES_ALL);
    return clamp(1.0 - choice.diffuse, 0.1, 0.9);
}

// Density with which bsdf_sample chooses a direction, per steradian; mirrors do not count.
fn bsdf_pdf(b: Bsdf, known: vec3<f32>, other: vec3<f32>, lobes: u32) -> f32 {
    let k = basis_local(b.basis, known);
    let o = basis_local(b.basis, other);
    if k.z <= 0.0 || o.z * dot(other, b.normal) <= 0.0 {
        return 0.0;
    }
    return bsdf_local_pdf(b, k, o, bsdf_choice(b, lobes));
}

fn bsdf_local_pdf(b: Bsdf, k: vec3<f32>, o: vec3<f32>, choice: Choice) -> f32 {
    let pdf = choice.diffuse * warp_cosine_pdf(o.z);
    if bsdf_is_smooth(b) || choice.coat + choice.glass == 0.0 || o.z == 0.0 {
        return pdf;
    }
    if o.z > 0.0 || !b.volume {
        let half_way = normalize(k + vec3(o.xy, abs(o.z)));
        let cosine = max(dot(k, half_way), 1e-7);
        let normals = ggx_visible_normal_pdf(k.z, half_way.z, cosine, b.alpha) / (4.0 * cosine);
        var reflects = 0.0;
        if choice.glass > 0.0 {
            reflects = dielectric(cosine, b.eta);
        }
        return pdf + normals * select(choice.glass * (1.0 - reflects), choice.coat + choice.glass * reflects, o.z > 0.0);
    }
    var half_way = normalize_or(k + o * b.eta, vec3(0.0, 0.0, 1.0));
    if half_way.z < 0.0 {
        half_way = -half_way;
    }
    let kh = dot(k, half_way);
    let oh = dot(o, half_way);
    if kh <= 0.0 || oh >= 0.0 {
        return pdf;
    }
    let spread = oh + kh / b.eta;
    return pdf + choice.glass
        * (1.0 - dielectric(kh, b.eta))
        * ggx_visible_normal_pdf(k.z, half_way.z, kh, b.alpha)
        * -oh
        / (spread * spread);
}

const ENDED: Scatter = Scatter(vec3<f32>(0.0), vec3<f32>(0.0), 0.0, false, false, false);
const NOWHERE: Weighed = Weighed(vec3<f32>(0.0), vec3<f32>(0.0), 0.0, false);

// A direction for `known`, by three numbers in [0, 1).
fn bsdf_sample(b: Bsdf, known: vec3<f32>, lobes: u32, transport: u32, u: vec3<f32>) -> Scatter {
    let k = basis_local(b.basis, known);
    if k.z <= 0.0 {
        return ENDED;
    }
    let choice = bsdf_choice(b, lobes);
    var found: Weighed;
    // Where the direction comes first and its weight follows.
    var weigh = false;
    if u.x < choice.diffuse {
        found.o = warp_cosine(u.yz);
        if bsdf_is_diffuse(b) {
            found = Weighed(found.o, b.base_color, warp_cosine_pdf(found.o.z), true);
        } else {
            weigh = true;
        }
    } else if choice.coat + choice.glass == 0.0 {
        return ENDED;
    } else {
        // What is left of the first number decides between coat and glass, then between the glass' two ways.
        let v = (u.x - choice.diffuse) / max(1.0 - choice.diffuse, 1.1754944e-38) * (choice.coat + choice.glass);
        if bsdf_is_smooth(b) {
            found = bsdf_mirror(b, k, choice, v, transport);
        } else {
            found.o = bsdf_bounce(b, k, ggx_sample_visible_normal(k, b.alpha, u.yz), choice, v);
            if found.o.z == 0.0 {
                return ENDED;
            }
            weigh = true;
        }
    }
    if weigh {
        found.pdf = bsdf_local_pdf(b, k, found.o, choice);
        found.weight = bsdf_local(b, k, found.o, lobes, transport) * (abs(found.o.z) / found.pdf);
        found.ok = found.o.z != 0.0 && found.pdf > 0.0;
    }
    if !found.ok {
        return ENDED;
    }
    let direction = basis_world(b.basis, found.o);
    let across = dot(direction, b.normal);
    if found.o.z * across <= 0.0 {
        return ENDED; // The shading normal sends it to the wrong side of the real surface.
    }
    var weight = found.weight;
    if transport == IMPORTANCE && any(b.basis.z != b.normal) {
        let swap = k.z * across / (dot(known, b.normal) * found.o.z);
        weight *= min(abs(swap), MAX_SHADING_CORRECTION);
    }
    let specular = u.x >= choice.diffuse;
    return Scatter(direction, weight, found.pdf, found.o.z < 0.0, specular, true);
}

// Coat, metal and glass as mirrors.
fn bsdf_mirror(b: Bsdf, k: vec3<f32>, choice: Choice, v: f32, transport: u32) -> Weighed {
    var reflects = 0.0;
    if choice.glass > 0.0 {
        reflects = dielectric(k.z, b.eta);
    }
    let back = choice.coat + choice.glass * reflects;
    if v < back {
        let grazing = pow5(max(1.0 - k.z, 0.0));
        let coat = b.f0 + (b.f90 - b.f0) * grazing;
        let metal = b.base_color + (1.0 - b.base_color) * grazing;
        let f = coat * bsdf_plastic(b) + metal * b.metallic + bsdf_glass(b) * reflects;
        return Weighed(vec3(-k.xy, k.z), f / back, 0.0, true);
    }
    let through = choice.glass * (1.0 - reflects);
    if through <= 0.0 {
        return NOWHERE;
    }
    let f = b.base_color * (bsdf_glass(b) * (1.0 - reflects) / through);
    if !b.volume {
        return Weighed(-k, f, 0.0, true);
    }
    let scale = select(1.0, 1.0 / (b.eta * b.eta), transport == RADIANCE);
    let o = refracted(k, vec3(0.0, 0.0, 1.0), b.eta);
    return Weighed(o, f * scale, 0.0, any(o != vec3(0.0)));
}

// Off or through the microfacet; zero if that leads nowhere.
fn bsdf_bounce(b: Bsdf, k: vec3<f32>, half_way: vec3<f32>, choice: Choice, v: f32) -> vec3<f32> {
    let cosine = dot(k, half_way);
    var reflects = 0.0;
    if choice.glass > 0.0 {
        reflects = dielectric(cosine, b.eta);
    }
    let mirrored = 2.0 * cosine * half_way - k;
    let reflect_it = v < choice.coat + choice.glass * reflects;
    if reflect_it || !b.volume {
        if mirrored.z <= 0.0 {
            return vec3(0.0);
        }
        return vec3(mirrored.xy, select(-mirrored.z, mirrored.z, reflect_it));
    }
    let o = refracted(k, half_way, b.eta);
    return select(vec3(0.0), o, o.z < 0.0);
}

// Unpolarised Fresnel reflectance; `eta` is the far side over the near side, `cosine` that of the angle of incidence.
fn dielectric(cosine: f32, eta: f32) -> f32 {
    let c = clamp(cosine, 0.0, 1.0);
    let sin2 = (1.0 - c * c) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = sqrt(1.0 - sin2);
    let parallel = (eta * c - cos_t) / (eta * c + cos_t);
    let perpendicular = (c - eta * cos_t) / (c + eta * cos_t);
    return 0.5 * (parallel * parallel + perpendicular * perpendicular);
}

// Snell's law around `normal`, on whose side `k` is; zero if totally reflected.
fn refracted(k: vec3<f32>, normal: vec3<f32>, eta: f32) -> vec3<f32> {
    let cosine = dot(k, normal);
    let sin2 = max(1.0 - cosine * cosine, 0.0) / (eta * eta);
    if sin2 >= 1.0 {
        return vec3(0.0);
    }
    let cos_t = sqrt(1.0 - sin2);
    return normalize((cosine / eta - cos_t) * normal - k / eta);
}
