//! On which devices to search.

use anyhow::Result;
use glam::Vec3;

use super::contest::Entrant;
use crate::devices::{self, Device};

/// What `--backend` takes: the CPU, the GPU's own tree, the GPU's ray queries.
pub const NAMES: [&str; 3] = ["cpu", "gpu", "gpu-hardware"];

/// Those that were asked for; by default the CPU, and the GPU where a real one is.
pub fn names(given: &[String]) -> Vec<String> {
    match given {
        [] if devices::has_real_gpu() => vec!["cpu".into(), "gpu".into()],
        [] => vec!["cpu".into()],
        some => {
            let mut names = some.to_vec();
            names.sort();
            names.dedup();
            names
        }
    }
}

/// Open devices.
pub struct Backends(Vec<Device>);

impl Backends {
    pub fn open(names: &[String]) -> Result<Self> {
        Ok(Self(names.iter().map(|name| devices::open_backend(name)).collect::<Result<_>>()?))
    }

    /// What the GPUs are called.
    pub fn devices(&self) -> Vec<String> {
        self.0.iter().filter_map(Device::gpu_name).collect()
    }

    /// The CPU's entrants, if it takes part, and those of the GPUs.
    pub fn entrants<'a>(
        &self,
        points: &'a [Vec3],
        cpu: fn(&'a [Vec3]) -> Vec<Box<dyn Entrant + 'a>>,
    ) -> Result<Vec<Box<dyn Entrant + 'a>>> {
        let mut all = Vec::new();
        for device in &self.0 {
            match device {
                Device::Cpu(_) => all.extend(cpu(points)),
                #[cfg(feature = "gpu")]
                Device::Gpu { context, method, .. } => all.push(gpu::entrant(context, *method, points)?),
            }
        }
        Ok(all)
    }
}

#[cfg(feature = "gpu")]
mod gpu {
    use std::sync::Arc;

    use anyhow::{Result, bail};
    use glam::Vec3;
    use sunfleck::gpu::{Context, Method, PointSearch};
    use sunfleck::index::Radii;

    use super::super::contest::{Answer, Entrant, Operation, Question};

    /// A search on a GPU. Its times are the device's own, between timestamps: transfers are not in them, and results stay
    /// on the device.
    struct Gpu<'a> {
        name: &'static str,
        points: &'a [Vec3],
        search: PointSearch,
        /// Of the last question, all calls together.
        searched: f64,
    }

    pub fn entrant<'a>(context: &Arc<Context>, method: Method, points: &'a [Vec3]) -> Result<Box<dyn Entrant + 'a>> {
        let (name, search) = match method {
            Method::Tree => ("gpu", PointSearch::new(Arc::clone(context))?),
            Method::Hardware => ("gpu-hardware", PointSearch::hardware(Arc::clone(context), 0.0)?),
        };
        Ok(Box::new(Gpu { name, points, search, searched: 0.0 }))
    }

    impl Entrant for Gpu<'_> {
        fn name(&self) -> &'static str {
            self.name
        }

        fn build(&mut self, radius: f32, _most: usize) -> Result<()> {
            self.search.set_max_radius(radius)?;
            Ok(self.search.build(self.points)?)
        }

        fn ask(&mut self, question: &Question<'_>) -> Result<Answer> {
            let mut answer = Answer::default();
            self.searched = 0.0;
            for queries in question.batches() {
                let radii = Radii::One(question.radius);
                match question.operation {
                    Operation::Sum => bail!("{}: there is no kernel sum for all indices on a GPU", self.name),
                    Operation::Store => {
                        let lists = self.search.neighbours_on_device(queries.into(), radii.into())?;
                        answer.neighbours += lists.indices.len() as u64;
                        let times = self.search.times()?;
                        self.searched += times.search + times.fill;
                    }
                    Operation::Nearest(k) => {
                        let lists = self.search.nearest_on_device(queries.into(), radii.into(), k)?;
                        self.searched += self.search.times()?.search;
                        let lists = lists.download()?;
                        answer.neighbours += lists.found.iter().map(|&n| u64::from(n)).sum::<u64>();
                        let found = lists.distances2.iter().filter(|d| d.is_finite());
                        answer.sum += found.map(|&d| f64::from(d)).sum::<f64>();
                    }
                }
            }
            Ok(answer)
        }

        fn device_seconds(&mut self) -> Result<Option<[f64; 2]>> {
            Ok(Some([self.search.times()?.build, self.searched]))
        }

        /// A device may round points on the sphere to the other side.
        fn is_exact(&self) -> bool {
            false
        }

        fn forget(&mut self) {}
    }
}
