//! A network's weights: named tensors that share one flat buffer, so that the optimiser sees one.

use rand::{Rng, RngExt};
use tch::{Device, Kind, Tensor};

use crate::error::Result;

/// Index of a tensor in [`Parameters`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot(usize);

/// How a tensor is filled at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fill {
    Constant(f64),
    /// Orthogonal rows or columns, times a gain.
    Orthogonal(f64),
}

#[derive(Debug, Clone)]
struct Entry {
    name: String,
    shape: Vec<i64>,
    fill: Fill,
}

/// Names, shapes and initial values of a network's tensors, in the order they were declared.
#[derive(Debug, Clone, Default)]
pub struct Layout {
    entries: Vec<Entry>,
}

impl Layout {
    /// Declares a weight matrix [rows, columns] with orthogonal initial values times `gain`.
    pub fn matrix(&mut self, name: &str, rows: usize, columns: usize, gain: f64) -> Slot {
        let shape = vec![rows as i64, columns as i64];
        self.add(name, shape, Fill::Orthogonal(gain))
    }

    /// Declares a vector of equal initial values.
    pub fn vector(&mut self, name: &str, length: usize, value: f64) -> Slot {
        self.add(name, vec![length as i64], Fill::Constant(value))
    }

    fn add(&mut self, name: &str, shape: Vec<i64>, fill: Fill) -> Slot {
        self.entries.push(Entry { name: name.to_owned(), shape, fill });
        Slot(self.entries.len() - 1)
    }

    /// How many numbers there are in all.
    #[must_use]
    pub fn count(&self) -> usize {
        let sizes = self.entries.iter().map(|entry| numel(&entry.shape));
        sizes.sum::<i64>() as usize
    }

    /// Names and shapes in their order.
    pub fn entries(&self) -> impl Iterator<Item = (&str, &[i64])> {
        let entries = self.entries.iter();
        entries.map(|entry| (entry.name.as_str(), entry.shape.as_slice()))
    }
}

/// The values of a [`Layout`] on one device. Every tensor is a leaf that requires a gradient and a
/// window into [`Parameters::flat`].
#[derive(Debug)]
pub struct Parameters {
    /// All values in one vector; changing it changes every tensor.
    pub flat: Tensor,
    leaves: Vec<Tensor>,
}

impl Parameters {
    /// Fresh values drawn from `rng`.
    ///
    /// # Errors
    /// What libtorch refuses.
    pub fn initial(layout: &Layout, rng: &mut impl Rng, device: Device) -> Result<Self> {
        let mut parts = Vec::with_capacity(layout.entries.len());
        for entry in &layout.entries {
            parts.push(match entry.fill {
                Fill::Constant(value) => Tensor::f_full(entry.shape.as_slice(), value, (Kind::Float, Device::Cpu))?,
                Fill::Orthogonal(gain) => orthogonal(&entry.shape, gain, rng)?,
            });
        }
        let parts: Vec<Tensor> = parts.iter().map(|part| part.reshape(-1)).collect();
        Self::from_flat(layout, Tensor::f_cat(&parts, 0)?.to_device(device))
    }

    /// Windows into a flat vector of [`Layout::count`] values.
    ///
    /// # Errors
    /// A vector of another length.
    pub fn from_flat(layout: &Layout, flat: Tensor) -> Result<Self> {
        let mut leaves = Vec::with_capacity(layout.entries.len());
        let mut offset = 0;
        for entry in &layout.entries {
            let length = numel(&entry.shape);
            let window = flat.f_narrow(0, offset, length)?;
            let window = window.f_view(entry.shape.as_slice())?.detach();
            leaves.push(window.set_requires_grad(true));
            offset += length;
        }
        Ok(Self { flat, leaves })
    }

    /// The same values, for use on another thread.
    #[must_use]
    pub fn share(&self) -> Self {
        Self { flat: self.flat.shallow_clone(), leaves: self.leaves.iter().map(Tensor::shallow_clone).collect() }
    }

    /// The tensor in a slot.
    pub fn get(&self, slot: Slot) -> &Tensor {
        &self.leaves[slot.0]
    }

    /// Gradient of a scalar with respect to all values, as one vector like [`Parameters::flat`].
    /// What the scalar does not depend on gets 0.
    ///
    /// # Errors
    /// A tensor that is no scalar, or has no gradient.
    pub fn gradient(&self, scalar: &Tensor) -> Result<Tensor> {
        let gradients = Tensor::f_run_backward(&[scalar], &self.leaves, false, false)?;
        let pieces: Vec<Tensor> = gradients
            .iter()
            .zip(&self.leaves)
            .map(
                |(gradient, leaf)| {
                    if gradient.defined() { gradient.reshape(-1) } else { leaf.detach().zeros_like().reshape(-1) }
                },
            )
            .collect();
        Ok(Tensor::f_cat(&pieces, 0)?)
    }
}

fn numel(shape: &[i64]) -> i64 {
    shape.iter().product()
}

fn orthogonal(shape: &[i64], gain: f64, rng: &mut impl Rng) -> Result<Tensor> {
    let (rows, columns) = (shape[0], shape[1]);
    let (tall, wide) = (rows.max(columns), rows.min(columns));
    let normal: Vec<f64> = (0..tall * wide).map(|_| standard_normal(rng)).collect();
    let normal = Tensor::from_slice(&normal).f_view([tall, wide])?;
    let (q, r) = Tensor::f_linalg_qr(&normal, "reduced")?;
    // The signs of R's diagonal make the distribution uniform over orthogonal matrices.
    let q = q * r.diagonal(0, 0, 1).sign();
    let matrix = if rows >= columns { q } else { q.tr() };
    Ok((matrix * gain).to_kind(Kind::Float).contiguous())
}

/// A draw from the normal distribution with mean 0 and deviation 1 (Box and Muller).
pub fn standard_normal(rng: &mut impl Rng) -> f64 {
    let radius: f64 = 1.0 - rng.random::<f64>();
    let angle = std::f64::consts::TAU * rng.random::<f64>();
    (-2.0 * radius.ln()).sqrt() * angle.cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn sample() -> (Layout, Slot, Slot) {
        let mut layout = Layout::default();
        let matrix = layout.matrix("matrix", 3, 5, 2.0);
        let vector = layout.vector("vector", 4, 0.5);
        (layout, matrix, vector)
    }

    #[test]
    fn initial_matrices_are_orthogonal_times_the_gain() {
        let (layout, matrix, vector) = sample();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let parameters = Parameters::initial(&layout, &mut rng, Device::Cpu).unwrap();
        let weight = parameters.get(matrix).detach();
        let product = weight.matmul(&weight.tr());
        let wanted = Tensor::eye(3, (Kind::Float, Device::Cpu)) * 4.0;
        assert!(product.allclose(&wanted, 1e-5, 1e-5, false));
        assert_eq!(layout.count(), 19);
        assert_abs_diff_eq!(parameters.get(vector).double_value(&[3]), 0.5);
    }

    #[test]
    fn changing_the_flat_vector_changes_every_tensor_and_its_share() {
        let (layout, matrix, vector) = sample();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut parameters = Parameters::initial(&layout, &mut rng, Device::Cpu).unwrap();
        let share = parameters.share();
        let _ = parameters.flat.fill_(7.0);
        assert_eq!(parameters.get(matrix).double_value(&[2, 4]), 7.0);
        assert_eq!(share.get(vector).double_value(&[0]), 7.0);
    }

    #[test]
    fn the_gradient_is_flat_and_zero_for_what_is_not_used() {
        let (layout, _, vector) = sample();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let parameters = Parameters::initial(&layout, &mut rng, Device::Cpu).unwrap();
        let scalar = (parameters.get(vector) * 3.0).sum(Kind::Float);
        let gradient = Vec::<f32>::try_from(parameters.gradient(&scalar).unwrap()).unwrap();
        assert_eq!(gradient[..15], [0.0; 15]);
        assert_eq!(gradient[15..], [3.0; 4]);
    }
}
