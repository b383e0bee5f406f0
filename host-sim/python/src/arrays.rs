//! NumPy's arrays: in as views, out without a copy.

use crate::errors::refused;
use nalgebra::Vector3;
use numpy::ndarray::IxDyn;
use numpy::{
    Element, PyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray,
    PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// An argument that is an array, with its name for errors. While it lives nobody else of this
/// package can write to it.
pub struct ArrayArgument<'py, T: Element> {
    view: PyReadonlyArray<'py, T, IxDyn>,
    name: &'static str,
}

/// Takes an argument as a view. No element is copied or converted.
///
/// # Errors
/// It is no array, of another type of element, or not in C order: with shape and remedy.
pub fn given<'py, T: Element>(
    name: &'static str,
    value: &Bound<'py, PyAny>,
) -> PyResult<ArrayArgument<'py, T>> {
    let wanted = T::get_dtype(value.py()).to_string();
    let remedy = format!("numpy.ascontiguousarray({name}, dtype=\"{wanted}\")");
    let Ok(untyped) = value.cast::<PyUntypedArray>() else {
        let kind = value.get_type().name()?.to_string();
        let problem = format!("is a {kind} where a NumPy array of {wanted} is needed");
        return Err(refused(name, problem, remedy));
    };
    let shape = || {
        format!(
            "has shape {} and type {}",
            tuple(untyped.shape()),
            untyped.dtype()
        )
    };
    let typed = value.cast::<PyArrayDyn<T>>();
    let Ok(array) = typed else {
        return Err(refused(name, format!("{}, not {wanted}", shape()), remedy));
    };
    if !array.is_c_contiguous() {
        let problem = format!("{}, and is not contiguous in C order", shape());
        return Err(refused(name, problem, remedy));
    }
    let view = array.try_readonly().map_err(|e| {
        let remedy = "do not change it meanwhile in another thread";
        refused(name, e.to_string(), remedy)
    })?;
    Ok(ArrayArgument { view, name })
}

impl<T: Element> ArrayArgument<'_, T> {
    /// All elements.
    ///
    /// # Errors
    /// Its shape is not (n,).
    pub fn flat(&self) -> PyResult<&[T]> {
        if self.view.ndim() != 1 {
            return Err(self.misshapen("(n,)"));
        }
        self.all()
    }

    /// Rows of N elements.
    ///
    /// # Errors
    /// Its shape is not (n, N).
    pub fn rows<const N: usize>(&self) -> PyResult<&[[T; N]]> {
        if self.view.ndim() != 2 || self.view.shape()[1] != N {
            return Err(self.misshapen(&format!("(n, {N})")));
        }
        Ok(self.all()?.as_chunks().0)
    }

    /// As many rows as another array has.
    ///
    /// # Errors
    /// Their numbers differ.
    pub fn rows_like<const N: usize, U: Element>(
        &self,
        other: &ArrayArgument<'_, U>,
    ) -> PyResult<&[[T; N]]> {
        let rows = self.rows()?;
        let (own, others) = (rows.len(), other.view.shape().first().copied().unwrap_or(0));
        if own != others {
            let problem = format!("has {own} rows, and {} has {others}", other.name);
            return Err(refused(self.name, problem, "give the same number of rows"));
        }
        Ok(rows)
    }

    fn all(&self) -> PyResult<&[T]> {
        let all = self.view.as_slice();
        all.map_err(|e| refused(self.name, e.to_string(), "numpy.ascontiguousarray"))
    }

    fn misshapen(&self, wanted: &str) -> PyErr {
        let problem = format!("has shape {}, not {wanted}", tuple(self.view.shape()));
        refused(
            self.name,
            problem,
            format!("give an array of shape {wanted}"),
        )
    }
}

/// A shape as Python writes it.
fn tuple(shape: &[usize]) -> String {
    let inside: Vec<String> = shape.iter().map(ToString::to_string).collect();
    match &inside[..] {
        [one] => format!("({one},)"),
        _ => format!("({})", inside.join(", ")),
    }
}

/// The error of a table that has no row of a scheme after a time.
pub fn no_row(asked: &str, schemes: &[String], times: &[u32], unit: &str) -> PyErr {
    let problem = format!("there is no row of {asked}");
    let times: Vec<String> = times.iter().map(u32::to_string).collect();
    let (schemes, times) = (schemes.join(", "), times.join(", "));
    refused(
        "rows",
        problem,
        format!("a scheme of {schemes}, after {times} {unit}"),
    )
}

/// A few numbers: an array, a list or a tuple.
///
/// # Errors
/// Their number is not N, or they are no numbers.
pub fn few<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f64; N]> {
    value.extract().map_err(|_| {
        // an array by its shape: its numbers are many, and not what is wrong
        let shape = value
            .getattr("shape")
            .and_then(|shape| shape.extract::<Vec<usize>>());
        let problem = match shape {
            Ok(shape) => format!("has shape {}, not ({N},)", tuple(&shape)),
            Err(_) => format!("is {}, not {N} numbers", text_of(value)),
        };
        refused(name, problem, format!("give a sequence of {N} numbers"))
    })
}

/// The same in single precision; an array of `float32` is read as it is.
///
/// # Errors
/// As [`few`].
pub fn few_f32<const N: usize>(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f32; N]> {
    if let Ok(array) = value.cast::<PyArray1<f32>>()
        && let Ok(view) = array.try_readonly()
        && let Some(all) = view.as_slice().ok().and_then(|all| all.try_into().ok())
    {
        return Ok(all);
    }
    Ok(few::<N>(name, value)?.map(|x| x as f32))
}

fn text_of(value: &Bound<'_, PyAny>) -> String {
    host_core::error::excerpt(&value.repr().map_or_else(|_| "?".into(), |r| r.to_string()))
}

/// A vector as an array, which takes its memory over.
pub fn array<T: Element>(py: Python<'_>, all: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, all)
}

/// Rows as an array of shape (n, N), which takes their memory over.
///
/// # Errors
/// None that can be provoked.
pub fn table<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [rows.len(), N];
    PyArray::from_vec(py, rows.into_flattened()).reshape(shape)
}

/// A name of something as its value.
///
/// # Errors
/// It is not among those known.
pub fn named<V: Copy>(what: &str, name: &str, known: &[(&str, V)]) -> PyResult<V> {
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        refused(
            what,
            format!("is '{name}'"),
            format!("one of {}", names.join(", ")),
        )
    })
}

/// Rows of three from vectors.
pub fn triples<'a>(all: impl Iterator<Item = &'a Vector3<f64>>) -> Vec<[f64; 3]> {
    all.map(|v| [v.x, v.y, v.z]).collect()
}

/// A Python object from JSON text.
///
/// # Errors
/// None that can be provoked.
pub fn from_json<'py>(py: Python<'py>, text: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (text,))
}

/// JSON text of a Python object.
///
/// # Errors
/// It holds what JSON cannot.
pub fn to_json(value: &Bound<'_, PyAny>) -> PyResult<String> {
    value
        .py()
        .import("json")?
        .call_method1("dumps", (value,))?
        .extract()
}
