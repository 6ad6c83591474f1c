//! A function of the user's own, in WGSL, for each neighbour.

use super::super::kernels::{ACCELERATION_STRUCTURE, Access, Kernel, Modules};
use super::super::shaders;
use super::{PointSearch, Queries, QueryRadii, SEARCH, TREE};
use crate::device::Error;

/// Bindings of the search itself; the user's come after them.
const OWN_BINDINGS: u32 = 4;

/// A compiled visitor, of the device and the method of search that it was compiled for.
pub struct Visitor {
    kernel: Kernel,
    accesses: Vec<Access>,
}

impl PointSearch {
    /// Compiles a visitor: WGSL that is run for each neighbour of each query, with nothing stored between. It defines
    ///
    /// ```wgsl
    /// struct Visitor {
    ///     radius2: f32,   // points beyond it are passed over: `begin` sets it, `visit` may shrink it;
    ///                     // with ray queries at most the square of the largest radius
    ///     // … and whatever is to be known of the query
    /// }
    /// // Before the first neighbour; `query` is the caller's index, `radius2` the square of its radius.
    /// fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor
    /// // Once for each point within the radius; `delta` leads from the centre to it, `distance2` is its square.
    /// fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32)
    /// // After the last.
    /// fn end(visitor: ptr<function, Visitor>, query: u32)
    /// ```
    ///
    /// and declares its buffers, as many as `buffers` has, at `@group(0)`, `@binding(4)` and on. `index_of(slot)` is the
    /// index of a point, `position_of(slot)` its position. Other names of this crate's shaders are taken
    /// ([`shaders::compose`] of `#import search` shows them); group 1 and the bindings 0 to 3 are the search's.
    ///
    /// What does not compile is an [`Error::Shader`] with the compiler's message; lines are counted in the text as given.
    pub fn compile(&self, wgsl: &str, buffers: &[Access]) -> Result<Visitor, Error> {
        let allowed = self.context.limits.max_storage_buffers_per_shader_stage - OWN_BINDINGS;
        if buffers.len() as u64 > u64::from(allowed) {
            let message = format!("{} buffers: {} allows {allowed}", buffers.len(), self.context.info());
            return Err(Error::Shader(message));
        }
        let mut bindings = vec![wgpu::BindingType::from(Access::Read); OWN_BINDINGS as usize];
        bindings.extend(buffers.iter().map(|&access| wgpu::BindingType::from(access)));
        // The user's text first, so that its lines keep their numbers: WGSL allows any order.
        let source = match self.hardware {
            None => format!("{wgsl}\n{}", shaders::compose("#import search\n")),
            Some(_) => {
                bindings[TREE] = ACCELERATION_STRUCTURE;
                let search = shaders::compose_for_hardware("#import search\n");
                format!("{}{wgsl}\n{search}", shaders::ENABLE_RAY_QUERIES)
            }
        };
        let kernel = Modules::new(&self.context, &self.shared).custom(source, "search", &bindings)?;
        Ok(Visitor { kernel, accesses: buffers.to_vec() })
    }

    /// Runs a visitor over the neighbours of all queries. `buffers` are its own, in the order of their bindings, with
    /// usage `STORAGE`.
    pub fn visit_all(
        &mut self,
        visitor: &Visitor,
        queries: Queries<'_>,
        radii: QueryRadii<'_>,
        buffers: &[&wgpu::Buffer],
    ) -> Result<(), Error> {
        if buffers.len() != visitor.accesses.len() {
            let message = format!("{} buffers for a visitor that has {}", buffers.len(), visitor.accesses.len());
            return Err(Error::Shader(message));
        }
        for buffer in buffers {
            self.context.check_bound("a visitor's buffer", buffer.size())?;
        }
        let set = self.prepare(queries, radii)?;
        let set = self.sort_if_asked(set)?;
        let own: Vec<_> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
        self.launch(SEARCH, &visitor.kernel, &set, &own, 0)
    }
}
