//! Ray queries over inflated boxes, the method of the paper (Evangelou et al. 2021, section 3): a point is within the
//! radius only if the query lies in the box around it, and the adapter's own tree finds those boxes. The exact test
//! stays in the shader, `shaders/lib/hardware.wgsl`.

use std::sync::Arc;

use super::buffers::Array;
use super::context::Context;
use super::kernels::{Access, Batch, Kernel, Modules};
use crate::device::Error;
use crate::index;

/// Threads a workgroup.
const THREADS: u32 = 64;
/// Bytes of a box: two corners.
const STRIDE: u64 = wgpu::AABB_GEOMETRY_MIN_STRIDE;
/// Half of the boxes' width over the radius: more than distance, squares and sum together can be rounded off.
const SLACK: f64 = 1.0 + 1.0 / (1 << 20) as f64;
/// Below this, metres, the square of a distance may be rounded to zero, which is within any radius.
const LEAST_REACH: f64 = 1.2e-19;

/// Boxes over sorted points, and the adapter's trees over them.
pub(super) struct Hardware {
    inflate: Arc<Kernel>,
    boxes: Array,
    trees: Option<Trees>,
    radius: f32,
}

struct Trees {
    boxes: wgpu::Blas,
    /// What shaders see: one instance of `boxes`.
    scene: wgpu::Tlas,
    /// As made; builds may have fewer boxes.
    size: wgpu::BlasAABBGeometrySizeDescriptor,
    /// Others may not be bound.
    built: bool,
}

impl Hardware {
    /// On a device with ray queries; another is refused.
    pub(super) fn new(context: &Context, modules: &Modules<'_>) -> Result<Self, Error> {
        if !context.ray_queries() {
            return Err(Error::NoDevice(format!("{} was opened without ray queries", context.info())));
        }
        Ok(Self {
            inflate: modules.kernel("inflate", "inflate", &[Access::Read, Access::Write])?,
            boxes: Array::of_boxes("boxes of the points"),
            trees: None,
            radius: 0.0,
        })
    }

    /// Most points that a device takes.
    pub(super) fn max_points(context: &Context) -> u32 {
        let bound = (context.most_bytes_bound() / STRIDE).min(u64::from(u32::MAX - 1)) as u32;
        context.limits.max_blas_primitive_count.min(bound)
    }

    /// Makes room for `n` points.
    pub(super) fn reserve(&mut self, context: &Context, n: u32) -> Result<(), Error> {
        let n = n.max(1);
        if self.trees.as_ref().is_some_and(|trees| trees.size.primitive_count >= n) {
            return Ok(());
        }
        self.trees = None;
        // A little more than asked, for the number changes from one build to the next.
        let most = Self::max_points(context);
        let roomy = n.saturating_add(n / 16).min(most).max(n);
        if n > most {
            return Err(Error::TooLarge {
                what: "a tree for ray queries".into(),
                needed: u64::from(n) * STRIDE,
                allowed: u64::from(most) * STRIDE,
                device: context.info().to_string(),
            });
        }
        self.boxes.reserve(context, u64::from(roomy))?;
        let make = || Trees::new(&context.device, roomy);
        self.trees = Some(context.scoped(make).map_err(|error| context.error(error.to_string()))?);
        Ok(())
    }

    /// Records the boxes around `n` sorted records of `words` words, a position first in each, and the trees over them,
    /// for queries of up to `radius`. Call [`Hardware::reserve`] first.
    pub(super) fn build(&mut self, batch: &mut Batch<'_>, n: u32, sorted: &Array, words: u32, radius: f32) {
        self.radius = radius;
        let trees = self.trees.as_mut().expect("reserved before use");
        trees.built = true;
        // An empty tree may not be bound.
        let n_boxes = n.max(1);
        let reach = (f64::from(radius) * SLACK).max(LEAST_REACH).min(f64::from(f32::MAX)) as f32;
        let buffers = [sorted.all(), self.boxes.all()];
        batch.dispatch(&self.inflate, &buffers, [n, n_boxes, words, reach.to_bits()], n_boxes.div_ceil(THREADS));
        let size = wgpu::BlasAABBGeometrySizeDescriptor { primitive_count: n_boxes, ..trees.size.clone() };
        let geometry =
            wgpu::BlasAabbGeometry { size: &size, stride: STRIDE, aabb_buffer: self.boxes.raw(), primitive_offset: 0 };
        let entry =
            wgpu::BlasBuildEntry { blas: &trees.boxes, geometry: wgpu::BlasGeometries::AabbGeometries(vec![geometry]) };
        // The upper tree with the lower: one that is older is refused.
        batch.encoder().build_acceleration_structures([&entry], [&trees.scene]);
    }

    /// What queries search whose largest radius is `radius`, that of query `query`.
    pub(super) fn tree(
        &self,
        context: &Context,
        query: usize,
        radius: f32,
    ) -> Result<wgpu::BindingResource<'_>, Error> {
        if radius > self.radius {
            return Err(index::Error::RadiusAboveBuilt { query, radius, built: self.radius }.into());
        }
        let built = self
            .trees
            .as_ref()
            .filter(|trees| trees.built)
            .ok_or_else(|| context.error("the boxes of the points are not built".into()))?;
        Ok(built.scene.as_binding())
    }
}

impl Trees {
    fn new(device: &wgpu::Device, n_boxes: u32) -> Self {
        let size = wgpu::BlasAABBGeometrySizeDescriptor {
            primitive_count: n_boxes,
            flags: wgpu::AccelerationStructureGeometryFlags::NO_DUPLICATE_ANY_HIT_INVOCATION,
        };
        let boxes = device.create_blas(
            &wgpu::CreateBlasDescriptor {
                label: Some("boxes of the points"),
                flags: wgpu::AccelerationStructureFlags::PREFER_FAST_BUILD,
                update_mode: wgpu::AccelerationStructureUpdateMode::Build,
            },
            wgpu::BlasGeometrySizeDescriptors::AABBs { descriptors: vec![size.clone()] },
        );
        let mut scene = device.create_tlas(&wgpu::CreateTlasDescriptor {
            label: Some("the boxes' only instance"),
            max_instances: 1,
            flags: wgpu::AccelerationStructureFlags::PREFER_FAST_BUILD,
            update_mode: wgpu::AccelerationStructureUpdateMode::Build,
        });
        let where_they_are = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        scene[0] = Some(wgpu::TlasInstance::new(&boxes, where_they_are, 0, 0xff));
        Self { boxes, scene, size, built: false }
    }
}
