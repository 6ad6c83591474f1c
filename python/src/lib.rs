//! The native half of the Python package: contiguous arrays in, arrays out. Shapes, defaults and conversions are the
//! business of `package/sunfleck/__init__.py`.

use ::sunfleck::index::{self, MAX_K, PointBvh, PointOrder, Radii, RadiusSearch};
use glam::Vec3;
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

mod kd;
mod mesh;

type Array<'py, T> = Bound<'py, PyArray1<T>>;

/// A tree over points; it keeps its own copy of them.
#[pyclass(frozen, module = "sunfleck._sunfleck")]
struct Tree(PointBvh);

#[pymethods]
impl Tree {
    /// Over `points`, `[n, 3]`.
    #[new]
    fn new(py: Python<'_>, points: PyReadonlyArray2<'_, f32>) -> PyResult<Self> {
        let points = rows(&points)?;
        py.detach(|| PointBvh::with_order(points, PointOrder::Median)).map(Self).map_err(refused)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// Number of points within the radius of each query.
    fn count<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f32>,
        radii: PyReadonlyArray1<'py, f32>,
        each: bool,
    ) -> PyResult<Array<'py, u32>> {
        let (queries, radii) = (rows(&queries)?, checked(&radii, each)?);
        let counts = py.detach(|| self.0.count_all(queries, radii)).map_err(refused)?;
        Ok(counts.into_pyarray(py))
    }

    /// Compressed rows: offsets `[queries + 1]`, indices, distances.
    fn within<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f32>,
        radii: PyReadonlyArray1<'py, f32>,
        each: bool,
    ) -> PyResult<(Array<'py, usize>, Array<'py, u32>, Array<'py, f32>)> {
        let (queries, radii) = (rows(&queries)?, checked(&radii, each)?);
        let mut found = py.detach(|| self.0.neighbours_all(queries, radii)).map_err(refused)?;
        roots(&mut found.distances2);
        Ok((found.offsets.into_pyarray(py), found.indices.into_pyarray(py), found.distances2.into_pyarray(py)))
    }

    /// Distances and indices of the k nearest within the radius, row-major `[queries · k]`; infinite and n for none.
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f32>,
        radii: PyReadonlyArray1<'py, f32>,
        each: bool,
        k: i64,
    ) -> PyResult<(Array<'py, f32>, Array<'py, u32>)> {
        let (queries, radii) = (rows(&queries)?, checked(&radii, each)?);
        let k =
            usize::try_from(k).map_err(|_| PyValueError::new_err(format!("k is {k}: 1 to {MAX_K} are possible")))?;
        let mut found = py.detach(|| self.0.nearest_all(queries, radii, k)).map_err(refused)?;
        roots(&mut found.distances2);
        let n = self.0.len() as u32;
        // None is the largest of all.
        found.indices.iter_mut().for_each(|i| *i = n.min(*i));
        Ok((found.distances2.into_pyarray(py), found.indices.into_pyarray(py)))
    }
}

/// The rows of `[n, 3]` as they lie in memory.
fn rows<'a>(array: &'a PyReadonlyArray2<'_, f32>) -> PyResult<&'a [Vec3]> {
    Ok(bytemuck::cast_slice(triples(array)?))
}

/// The same of any type.
fn triples<'a, T: Element>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [[T; 3]]> {
    let [n, width] = [array.shape()[0], array.shape()[1]];
    if width != 3 {
        return Err(PyValueError::new_err(format!("shape ({n}, {width}): three numbers a row are needed")));
    }
    Ok(array.as_slice()?.as_chunks().0)
}

/// One radius of each query, or a single one of all.
fn checked<'a>(radii: &'a PyReadonlyArray1<'_, f32>, each: bool) -> PyResult<Radii<'a>> {
    match (each, radii.as_slice()?) {
        (true, radii) => Ok(Radii::Each(radii)),
        (false, [radius]) => Ok(Radii::One(*radius)),
        (false, radii) => Err(PyValueError::new_err(format!("{} radii where one is needed", radii.len()))),
    }
}

fn refused(error: index::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn roots(squares: &mut [f32]) {
    squares.iter_mut().for_each(|square| *square = square.sqrt());
}

#[pymodule]
mod _sunfleck {
    #[pymodule_export]
    use super::Tree;
    #[pymodule_export]
    use super::kd::{KdTree32, KdTree64};
    #[pymodule_export]
    use super::mesh::mesh_check;
    #[pymodule_export]
    const MAX_K: usize = super::MAX_K;
}
