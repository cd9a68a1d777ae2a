//! What is refused, as Python's exceptions.

use std::error::Error;

use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

/// A `ValueError` with the text of an error and of what caused it.
pub fn refused(error: &dyn Error) -> PyErr {
    PyValueError::new_err(text(error))
}

/// A `RuntimeError` of something that was asked for too early or that failed by itself.
pub fn failed(error: &dyn Error) -> PyErr {
    PyRuntimeError::new_err(text(error))
}

fn text(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text += &format!(": {error}");
        cause = error.source();
    }
    text
}
