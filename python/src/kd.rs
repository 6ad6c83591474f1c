//! kd-trees over triangles: a class for each precision.

use std::ops::ControlFlow;

use ::sunfleck::index::kd::{self, Builder, Hit, KdOptions, KdTree, LazyKd, Ray, RaySearch, Scalar, Triangles};
use numpy::{Element, IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use super::{Array, triples};

/// Built at once, or where rays come.
enum Tree<T> {
    Whole(KdTree<T>),
    Lazy(LazyKd<T>),
}

impl<T: Scalar> Tree<T> {
    fn new(vertices: &[[T; 3]], faces: &[[u32; 3]], builder: &str, lazy: bool, parallel: bool) -> Result<Self, String> {
        let builder = match builder {
            "none" => Builder::None,
            "quadratic" => Builder::Quadratic,
            "sort-each-node" => Builder::SortEachNode,
            "sort-once" => Builder::SortOnce,
            other => {
                return Err(format!(
                    "builder is {other:?}: \"sort-once\", \"sort-each-node\", \"quadratic\" or \"none\""
                ));
            }
        };
        let options = KdOptions { builder, parallel, ..KdOptions::default() };
        let triangles = Triangles::new(vertices.to_vec(), faces.to_vec());
        let tree = triangles.and_then(|triangles| match lazy {
            true => LazyKd::new(triangles, &options).map(Self::Lazy),
            false => KdTree::new(triangles, &options).map(Self::Whole),
        });
        tree.map_err(|e| e.to_string())
    }
}

impl<T: Scalar> RaySearch<T> for Tree<T> {
    fn triangles(&self) -> &Triangles<T> {
        match self {
            Self::Whole(tree) => tree.triangles(),
            Self::Lazy(tree) => tree.triangles(),
        }
    }

    fn try_hits<B>(&self, ray: &Ray<T>, visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B> {
        match self {
            Self::Whole(tree) => tree.try_hits(ray, visit),
            Self::Lazy(tree) => tree.try_hits(ray, visit),
        }
    }
}

/// Many rays: as many origins as directions and ranges of t.
struct Rays<'a, T> {
    origins: &'a [[T; 3]],
    directions: &'a [[T; 3]],
    ranges: [&'a [T]; 2],
}

impl<T: Scalar> Rays<'_, T> {
    /// `answer` of each, in order. Fails with the first that is no ray.
    fn ask<R: Send>(&self, answer: impl Fn(&Ray<T>) -> R + Sync) -> Result<Vec<R>, String> {
        let [min, max] = self.ranges;
        let n = self.origins.len();
        if [self.directions.len(), min.len(), max.len()] != [n; 3] {
            return Err("as many directions and ranges as origins are needed".to_owned());
        }
        let rays = (0..n).into_par_iter().with_min_len(64);
        let ask = |i: usize| match Ray::new(self.origins[i], self.directions[i]) {
            Ok(ray) => Ok(answer(&ray.within(min[i], max[i]))),
            Err(error) => Err((i, error)),
        };
        rays.map(ask).collect::<Result<_, (usize, kd::Error)>>().map_err(|(i, error)| format!("ray {i}: {error}"))
    }
}

fn refused(error: String) -> PyErr {
    PyValueError::new_err(error)
}

/// Origins and directions, `[n, 3]`, and first and last t, `[n]`.
type Arrays<'py, T> = (PyReadonlyArray2<'py, T>, PyReadonlyArray2<'py, T>, PyReadonlyArray1<'py, T>, PyReadonlyArray1<'py, T>);

fn rays<'a, T: Element>((origins, directions, min, max): &'a Arrays<'_, T>) -> PyResult<Rays<'a, T>> {
    let ranges = [min.as_slice()?, max.as_slice()?];
    Ok(Rays { origins: triples(origins)?, directions: triples(directions)?, ranges })
}

macro_rules! class {
    ($name:ident, $scalar:ty) => {
        /// A tree over triangles; it keeps its own copy of them.
        #[pyclass(frozen, module = "sunfleck._sunfleck")]
        pub struct $name(Tree<$scalar>);

        #[pymethods]
        impl $name {
            /// Over `vertices`, `[n, 3]`, and `faces`, `[m, 3]`.
            #[new]
            fn new(
                py: Python<'_>,
                vertices: PyReadonlyArray2<'_, $scalar>,
                faces: PyReadonlyArray2<'_, u32>,
                builder: &str,
                lazy: bool,
                parallel: bool,
            ) -> PyResult<Self> {
                let (vertices, faces) = (triples(&vertices)?, triples(&faces)?);
                py.detach(|| Tree::new(vertices, faces, builder, lazy, parallel)).map(Self).map_err(refused)
            }

            /// Number of triangles.
            fn __len__(&self) -> usize {
                self.0.triangles().len()
            }

            /// Of the tree, without the mesh; none of one that grows.
            #[getter]
            fn nbytes(&self) -> Option<usize> {
                match &self.0 {
                    Tree::Whole(tree) => Some(tree.bytes()),
                    Tree::Lazy(_) => None,
                }
            }

            /// Whether there is a hit.
            fn any<'py>(
                &self,
                py: Python<'py>,
                of: Arrays<'py, $scalar>,
            ) -> PyResult<Array<'py, bool>> {
                let rays = rays(&of)?;
                let found = py.detach(|| rays.ask(|ray| self.0.any(ray))).map_err(refused)?;
                Ok(found.into_pyarray(py))
            }

            /// Number of hits.
            fn count<'py>(
                &self,
                py: Python<'py>,
                of: Arrays<'py, $scalar>,
            ) -> PyResult<Array<'py, u32>> {
                let rays = rays(&of)?;
                let found = py.detach(|| rays.ask(|ray| self.0.count(ray) as u32)).map_err(refused)?;
                Ok(found.into_pyarray(py))
            }

            /// t, face, and the weights of the second and third corner, `[n · 2]`; infinite, m and 0 for none.
            fn nearest<'py>(
                &self,
                py: Python<'py>,
                of: Arrays<'py, $scalar>,
            ) -> PyResult<(Array<'py, $scalar>, Array<'py, u32>, Array<'py, $scalar>)> {
                let rays = rays(&of)?;
                let none = self.0.triangles().len() as u32;
                let (t, face, weights) = py
                    .detach(|| {
                        let hits = rays.ask(|ray| self.0.nearest(ray))?;
                        let t = hits.iter().map(|hit| hit.map_or(<$scalar>::INFINITY, |hit| hit.t)).collect::<Vec<_>>();
                        let face = hits.iter().map(|hit| hit.map_or(none, |hit| hit.face)).collect::<Vec<_>>();
                        let weights = hits.iter().flat_map(|hit| hit.map_or([0.0; 2], |hit| [hit.u, hit.v]));
                        Ok((t, face, weights.collect::<Vec<_>>()))
                    })
                    .map_err(refused)?;
                Ok((t.into_pyarray(py), face.into_pyarray(py), weights.into_pyarray(py)))
            }

            /// Compressed rows: offsets `[n + 1]`, t, faces, weights `[hits · 2]`.
            fn all<'py>(
                &self,
                py: Python<'py>,
                of: Arrays<'py, $scalar>,
            ) -> PyResult<(Array<'py, usize>, Array<'py, $scalar>, Array<'py, u32>, Array<'py, $scalar>)> {
                let rays = rays(&of)?;
                let (offsets, t, faces, weights) = py
                    .detach(|| {
                        let rows = rays.ask(|ray| {
                            let mut hits = Vec::new();
                            self.0.all(ray, &mut hits);
                            hits
                        })?;
                        let mut offsets = vec![0];
                        offsets.extend(rows.iter().scan(0, |end, row| {
                            *end += row.len();
                            Some(*end)
                        }));
                        let t = rows.iter().flatten().map(|hit| hit.t).collect::<Vec<_>>();
                        let faces = rows.iter().flatten().map(|hit| hit.face).collect::<Vec<_>>();
                        let weights = rows.iter().flatten().flat_map(|hit| [hit.u, hit.v]).collect::<Vec<_>>();
                        Ok((offsets, t, faces, weights))
                    })
                    .map_err(refused)?;
                Ok((offsets.into_pyarray(py), t.into_pyarray(py), faces.into_pyarray(py), weights.into_pyarray(py)))
            }
        }
    };
}

class!(KdTree32, f32);
class!(KdTree64, f64);
