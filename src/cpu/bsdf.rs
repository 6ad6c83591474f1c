//! How a surface scatters: a Lambertian base under a GGX coat, metal, and glass, mixed as glTF mixes them.
//!
//! One direction is known (the eye's for radiance, the light's for photons), the other is sampled; both point away from
//! the surface and the known one is above it. The functions are not symmetric where energy is made up for
//! ([`crate::scene::albedo`]) and across a refracting interface, so every evaluation says which side is the eye's.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::surface::Surface;
use crate::layout::{EyeVertex, MATERIAL_VOLUME};
use crate::math::{basis::Basis, ggx, oct, warp};
use crate::scene::{PackedScene, albedo};

/// Smoother coats are followed by the eye path; photons are gathered on the others.
pub const TRACED_ROUGHNESS: f32 = 0.3;

/// Which direction is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// The eye's: radiance is carried against the light.
    Radiance,
    /// The light's: photons carry power.
    Importance,
}

/// Some of a BSDF's lobes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lobes {
    /// The Lambertian base.
    pub diffuse: bool,
    /// Coat, metal and glass.
    pub specular: bool,
}

impl Lobes {
    /// All of them.
    pub const ALL: Self = Self { diffuse: true, specular: true };
}

/// A BSDF at a point, seen from the known direction's side.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<'a> {
    table: &'a [[f32; 2]],
    /// Around the shading normal on the known side.
    pub basis: Basis,
    /// Geometric normal on the known side.
    pub normal: Vec3,
    base_color: Vec3,
    f0: Vec3,
    f90: f32,
    roughness: f32,
    alpha: f32,
    metallic: f32,
    transmission: f32,
    /// Far side over known side.
    eta: f32,
    volume: bool,
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// Unit, world space.
    pub direction: Vec3,
    /// BSDF × cosine / density, and for photons the correction for shading normals (Veach 1997, §5.3.2).
    pub weight: Vec3,
    /// Per steradian; 0 where the direction was the only one possible.
    pub pdf: f32,
    /// Whether it went through.
    pub transmitted: bool,
    /// Whether coat, metal or glass chose it, and not the Lambertian base.
    pub specular: bool,
}

/// How probable the base, the coat or metal, and the glass are.
#[derive(Clone, Copy, Debug)]
struct Choice {
    diffuse: f32,
    coat: f32,
    glass: f32,
}

impl<'a> Bsdf<'a> {
    /// Of a surface that was just met.
    pub fn new(scene: &'a PackedScene, s: &Surface) -> Self {
        let m = &scene.materials[s.material as usize];
        let volume = m.flags & MATERIAL_VOLUME != 0;
        Self {
            table: &scene.albedo,
            basis: Basis::around(s.shading_normal),
            normal: s.normal,
            base_color: s.base_color,
            f0: m.f0.into(),
            f90: m.f90,
            roughness: s.roughness,
            alpha: s.roughness * s.roughness,
            metallic: s.metallic,
            transmission: s.transmission,
            eta: if volume && !s.front { 1.0 / m.ior } else { m.ior },
            volume,
        }
    }

    /// Of an eye vertex; the known side is the eye's.
    pub fn of_vertex(scene: &'a PackedScene, v: &EyeVertex) -> Self {
        Self {
            table: &scene.albedo,
            basis: Basis::around(oct::decode(v.shading_normal)),
            normal: oct::decode(v.normal),
            base_color: v.base_color.into(),
            f0: v.f0.into(),
            f90: v.f90,
            roughness: v.roughness,
            alpha: v.roughness * v.roughness,
            metallic: v.metallic,
            transmission: v.transmission,
            eta: v.eta,
            volume: v.material_flags & MATERIAL_VOLUME != 0,
        }
    }

    /// Far side over known side: what [`EyeVertex::eta`] keeps.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// Whether coat, metal and glass are mirrors.
    pub fn is_smooth(&self) -> bool {
        self.alpha < ggx::MIN_ALPHA
    }

    /// Whether there is nothing but the Lambertian base.
    pub fn is_diffuse(&self) -> bool {
        self.metallic == 0.0 && self.transmission == 0.0 && self.f90 == 0.0
    }

    /// Where photons are gathered.
    pub fn gathered(&self) -> Lobes {
        Lobes {
            diffuse: self.metallic < 1.0 && self.transmission < 1.0,
            specular: self.roughness >= TRACED_ROUGHNESS && !self.is_diffuse(),
        }
    }

    /// Where the eye path goes on.
    pub fn traced(&self) -> Lobes {
        Lobes { diffuse: false, specular: self.roughness < TRACED_ROUGHNESS && !self.is_diffuse() }
    }

    fn plastic(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.transmission)
    }

    fn glass(&self) -> f32 {
        (1.0 - self.metallic) * self.transmission
    }

    /// Directional albedo of the single-scattering lobe, for reflectance 1 at normal incidence and at grazing alone.
    fn lobe_albedo(&self, cos: f32) -> [f32; 2] {
        if self.is_smooth() {
            let grazing = (1.0 - cos).max(0.0).powi(5);
            [1.0 - grazing, grazing]
        } else {
            albedo::look_up(self.table, cos, self.roughness)
        }
    }

    /// What a lobe of reflectance `f0` is multiplied by so that nothing is lost between the microfacets.
    fn compensation(f0: Vec3, [a, b]: [f32; 2]) -> Vec3 {
        Vec3::ONE + f0 * ((1.0 - a - b) / (a + b))
    }

    fn coat_albedo(&self, cos_eye: f32) -> Vec3 {
        let ab = self.lobe_albedo(cos_eye);
        ((self.f0 * ab[0] + self.f90 * ab[1]) * Self::compensation(self.f0, ab)).min(Vec3::ONE)
    }

    fn metal_albedo(&self, cos_eye: f32) -> Vec3 {
        let ab = self.lobe_albedo(cos_eye);
        (self.base_color * ab[0] + ab[1]) * Self::compensation(self.base_color, ab)
    }

    /// The Lambertian base under its coat, 1/sr, for this cosine of the eye's direction.
    pub fn diffuse(&self, cos_eye: f32) -> Vec3 {
        let base = self.base_color * (self.plastic() * FRAC_1_PI);
        if self.f90 == 0.0 { base } else { base * (Vec3::ONE - self.coat_albedo(cos_eye)) }
    }

    /// Coat, metal and glass, 1/sr; basis coordinates. Zero where they are mirrors.
    fn specular(&self, known: Vec3, other: Vec3, transport: Transport) -> Vec3 {
        if self.is_smooth() || self.is_diffuse() || known.z <= 0.0 || other.z == 0.0 {
            return Vec3::ZERO;
        }
        let reflected = other.z > 0.0;
        // A thin sheet transmits what its mirror image would reflect.
        let mirrored = Vec3::new(other.x, other.y, other.z.abs());
        if reflected || !self.volume {
            let half = (known + mirrored).normalize();
            let cos = known.dot(half).max(0.0);
            let lobe = ggx::distribution(half.z, self.alpha) * ggx::visibility(known.z, mirrored.z, self.alpha);
            let through = if self.transmission > 0.0 { dielectric(cos, self.eta) } else { 0.0 };
            if !reflected {
                return self.base_color * (self.glass() * (1.0 - through) * lobe);
            }
            let ab = self.lobe_albedo(if transport == Transport::Radiance { known.z } else { other.z });
            let grazing = (1.0 - cos).powi(5);
            let coat = (self.f0 + (Vec3::splat(self.f90) - self.f0) * grazing) * Self::compensation(self.f0, ab);
            let metal =
                (self.base_color + (Vec3::ONE - self.base_color) * grazing) * Self::compensation(self.base_color, ab);
            return (coat * self.plastic() + metal * self.metallic + self.glass() * through) * lobe;
        }
        // Walter et al. 2007, equation 21.
        let mut half = (known + other * self.eta).normalize_or(Vec3::Z);
        if half.z < 0.0 {
            half = -half;
        }
        let (k, o) = (known.dot(half), other.dot(half));
        if k <= 0.0 || o >= 0.0 {
            return Vec3::ZERO;
        }
        let spread = o + k / self.eta;
        let lobe = 4.0 * ggx::distribution(half.z, self.alpha) * ggx::visibility(known.z, -other.z, self.alpha);
        let through = (1.0 - dielectric(k, self.eta)) * lobe * k * -o / (spread * spread);
        let scale = if transport == Transport::Radiance { 1.0 / (self.eta * self.eta) } else { 1.0 };
        self.base_color * (self.glass() * through * scale)
    }

    /// 1/sr, without the mirrors' peaks; world space. The known direction is above the surface.
    pub fn evaluate(&self, known: Vec3, other: Vec3, lobes: Lobes, transport: Transport) -> Vec3 {
        let (k, o) = (self.basis.local(known), self.basis.local(other));
        if k.z <= 0.0 || o.z * other.dot(self.normal) <= 0.0 {
            return Vec3::ZERO;
        }
        let mut f = Vec3::ZERO;
        if lobes.diffuse && o.z > 0.0 {
            f += self.diffuse(if transport == Transport::Radiance { k.z } else { o.z });
        }
        if lobes.specular {
            f += self.specular(k, o, transport);
        }
        f
    }

    fn choice(&self, cos_known: f32, lobes: Lobes) -> Choice {
        if self.is_diffuse() {
            return Choice { diffuse: if lobes.diffuse { 1.0 } else { 0.0 }, coat: 0.0, glass: 0.0 };
        }
        let coat = self.coat_albedo(cos_known);
        let mut choice = Choice { diffuse: 0.0, coat: 0.0, glass: 0.0 };
        if lobes.diffuse {
            choice.diffuse = (self.base_color * (Vec3::ONE - coat)).max_element() * self.plastic();
        }
        if lobes.specular {
            choice.coat = coat.max_element() * self.plastic();
            if self.metallic > 0.0 {
                choice.coat += self.metal_albedo(cos_known).max_element() * self.metallic;
            }
            choice.glass = self.glass();
        }
        let sum = choice.diffuse + choice.coat + choice.glass;
        let scale = if sum > 0.0 { 1.0 / sum } else { 0.0 };
        Choice { diffuse: choice.diffuse * scale, coat: choice.coat * scale, glass: choice.glass * scale }
    }

    /// How much of what is reflected the eye path follows, rather than gathers: a probability.
    pub fn follow_probability(&self, known: Vec3) -> f32 {
        let (gathered, traced) = (self.gathered(), self.traced());
        if !traced.specular {
            return 0.0;
        }
        if !gathered.diffuse {
            return 1.0;
        }
        let choice = self.choice(self.basis.local(known).z.max(0.0), Lobes::ALL);
        (1.0 - choice.diffuse).clamp(0.1, 0.9)
    }

    /// Density with which [`Bsdf::sample`] chooses a direction, per steradian; mirrors do not count.
    pub fn pdf(&self, known: Vec3, other: Vec3, lobes: Lobes) -> f32 {
        let (k, o) = (self.basis.local(known), self.basis.local(other));
        if k.z <= 0.0 || o.z * other.dot(self.normal) <= 0.0 { 0.0 } else { self.local_pdf(k, o, lobes) }
    }

    fn local_pdf(&self, k: Vec3, o: Vec3, lobes: Lobes) -> f32 {
        let choice = self.choice(k.z, lobes);
        let mut pdf = choice.diffuse * warp::cosine_pdf(o.z);
        if self.is_smooth() || choice.coat + choice.glass == 0.0 || o.z == 0.0 {
            return pdf;
        }
        if o.z > 0.0 || !self.volume {
            let half = (k + Vec3::new(o.x, o.y, o.z.abs())).normalize();
            let cos = k.dot(half).max(1e-7);
            let normals = ggx::visible_normal_pdf(k.z, half.z, cos, self.alpha) / (4.0 * cos);
            let reflects = if choice.glass > 0.0 { dielectric(cos, self.eta) } else { 0.0 };
            pdf += normals
                * if o.z > 0.0 { choice.coat + choice.glass * reflects } else { choice.glass * (1.0 - reflects) };
            return pdf;
        }
        let mut half = (k + o * self.eta).normalize_or(Vec3::Z);
        if half.z < 0.0 {
            half = -half;
        }
        let (kh, oh) = (k.dot(half), o.dot(half));
        if kh <= 0.0 || oh >= 0.0 {
            return pdf;
        }
        let spread = oh + kh / self.eta;
        pdf + choice.glass
            * (1.0 - dielectric(kh, self.eta))
            * ggx::visible_normal_pdf(k.z, half.z, kh, self.alpha)
            * -oh
            / (spread * spread)
    }

    /// A direction for `known`, by three numbers in [0, 1); none if the light ends here.
    pub fn sample(&self, known: Vec3, lobes: Lobes, transport: Transport, u: [f32; 3]) -> Option<Scatter> {
        let k = self.basis.local(known);
        if k.z <= 0.0 {
            return None;
        }
        let choice = self.choice(k.z, lobes);
        let square = [u[1], u[2]];
        let specular = u[0] >= choice.diffuse;
        let (o, weight, pdf) = if !specular {
            let o = warp::cosine(square);
            if self.is_diffuse() {
                (o, self.base_color, warp::cosine_pdf(o.z))
            } else {
                self.weigh(k, o, lobes, transport)?
            }
        } else if choice.coat + choice.glass == 0.0 {
            return None;
        } else {
            // What is left of the first number decides between coat and glass, then between the glass' two ways.
            let v =
                (u[0] - choice.diffuse) / (1.0 - choice.diffuse).max(f32::MIN_POSITIVE) * (choice.coat + choice.glass);
            if self.is_smooth() {
                self.mirror(k, choice, v, transport)?
            } else {
                let half = ggx::sample_visible_normal(k, self.alpha, square);
                let o = self.bounce(k, half, choice, v)?;
                self.weigh(k, o, lobes, transport)?
            }
        };
        let direction = self.basis.world(o);
        if o.z * direction.dot(self.normal) <= 0.0 {
            return None; // The shading normal sends it to the wrong side of the real surface.
        }
        let weight = if transport == Transport::Importance && self.basis.z != self.normal {
            let swap = k.z * direction.dot(self.normal) / (known.dot(self.normal) * o.z);
            weight * swap.abs().min(MAX_SHADING_CORRECTION)
        } else {
            weight
        };
        Some(Scatter { direction, weight, pdf, transmitted: o.z < 0.0, specular })
    }

    /// Density and weight of a direction that any of the lobes may have chosen.
    fn weigh(&self, k: Vec3, o: Vec3, lobes: Lobes, transport: Transport) -> Option<(Vec3, Vec3, f32)> {
        if o.z == 0.0 {
            return None;
        }
        let pdf = self.local_pdf(k, o, lobes);
        let mut f = Vec3::ZERO;
        if lobes.diffuse && o.z > 0.0 {
            f += self.diffuse(if transport == Transport::Radiance { k.z } else { o.z });
        }
        if lobes.specular {
            f += self.specular(k, o, transport);
        }
        (pdf > 0.0).then(|| (o, f * (o.z.abs() / pdf), pdf))
    }

    /// Coat, metal and glass as mirrors.
    fn mirror(&self, k: Vec3, choice: Choice, v: f32, transport: Transport) -> Option<(Vec3, Vec3, f32)> {
        let reflects = if choice.glass > 0.0 { dielectric(k.z, self.eta) } else { 0.0 };
        let back = choice.coat + choice.glass * reflects;
        if v < back {
            let grazing = (1.0 - k.z).max(0.0).powi(5);
            let coat = self.f0 + (Vec3::splat(self.f90) - self.f0) * grazing;
            let metal = self.base_color + (Vec3::ONE - self.base_color) * grazing;
            let f = coat * self.plastic() + metal * self.metallic + self.glass() * reflects;
            return Some((Vec3::new(-k.x, -k.y, k.z), f / back, 0.0));
        }
        let through = choice.glass * (1.0 - reflects);
        if through <= 0.0 {
            return None;
        }
        let f = self.base_color * (self.glass() * (1.0 - reflects) / through);
        if !self.volume {
            return Some((-k, f, 0.0));
        }
        let scale = if transport == Transport::Radiance { 1.0 / (self.eta * self.eta) } else { 1.0 };
        Some((refract(k, Vec3::Z, self.eta)?, f * scale, 0.0))
    }

    /// Off or through the microfacet `half`.
    fn bounce(&self, k: Vec3, half: Vec3, choice: Choice, v: f32) -> Option<Vec3> {
        let cos = k.dot(half);
        let reflects = if choice.glass > 0.0 { dielectric(cos, self.eta) } else { 0.0 };
        let mirrored = 2.0 * cos * half - k;
        if v < choice.coat + choice.glass * reflects {
            return (mirrored.z > 0.0).then_some(mirrored);
        }
        if !self.volume {
            return (mirrored.z > 0.0).then_some(Vec3::new(mirrored.x, mirrored.y, -mirrored.z));
        }
        refract(k, half, self.eta).filter(|o| o.z < 0.0)
    }
}

/// Bounds the correction for shading normals, which grows without limit at grazing angles.
const MAX_SHADING_CORRECTION: f32 = 8.0;

/// Unpolarised Fresnel reflectance; `eta` is the far side over the near side, `cos` that of the angle of incidence.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2).sqrt();
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Snell's law around `normal`, on whose side `k` is; none if totally reflected.
#[inline]
fn refract(k: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    let cos = k.dot(normal);
    let sin2 = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2 >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2).sqrt();
    Some(((cos / eta - cos_t) * normal - k / eta).normalize())
}
