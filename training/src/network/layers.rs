//! The pieces networks are made of: linear layers, multi-layer perceptrons, layer norms.

use tch::Tensor;

use crate::parameters::{Layout, Parameters, Slot};

/// Gain that keeps the size of activations through a ReLU.
pub const RELU_GAIN: f64 = std::f64::consts::SQRT_2;

/// y = x·Wᵀ + b.
#[derive(Debug, Clone)]
pub struct Linear {
    weight: Slot,
    bias: Slot,
}

impl Linear {
    /// Declares the layer's two tensors.
    pub fn new(layout: &mut Layout, name: &str, inputs: usize, outputs: usize, gain: f64) -> Self {
        Self {
            weight: layout.matrix(&format!("{name}.weight"), outputs, inputs, gain),
            bias: layout.vector(&format!("{name}.bias"), outputs, 0.0),
        }
    }

    /// [..., inputs] to [..., outputs].
    pub fn forward(&self, parameters: &Parameters, x: &Tensor) -> Tensor {
        x.linear(parameters.get(self.weight), Some(parameters.get(self.bias)))
    }
}

/// Normalises the last dimension, then scales and shifts it.
#[derive(Debug, Clone)]
pub struct LayerNorm {
    scale: Slot,
    shift: Slot,
    width: i64,
}

impl LayerNorm {
    /// Declares scale 1 and shift 0.
    pub fn new(layout: &mut Layout, name: &str, width: usize) -> Self {
        Self {
            scale: layout.vector(&format!("{name}.weight"), width, 1.0),
            shift: layout.vector(&format!("{name}.bias"), width, 0.0),
            width: width as i64,
        }
    }

    /// [..., width] to the same shape.
    pub fn forward(&self, parameters: &Parameters, x: &Tensor) -> Tensor {
        let scale = Some(parameters.get(self.scale));
        let shift = Some(parameters.get(self.shift));
        x.layer_norm([self.width], scale, shift, 1e-5, false)
    }
}

/// Hidden layers with ReLU and a linear output.
#[derive(Debug, Clone)]
pub struct Mlp {
    hidden: Vec<Linear>,
    output: Linear,
}

impl Mlp {
    /// Declares the layers; `output_gain` scales the initial weights of the last one.
    pub fn new(
        layout: &mut Layout,
        name: &str,
        inputs: usize,
        hidden: &[usize],
        outputs: usize,
        output_gain: f64,
    ) -> Self {
        let (hidden, width) = stack(layout, name, inputs, hidden);
        let output = Linear::new(layout, &format!("{name}.output"), width, outputs, output_gain);
        Self { hidden, output }
    }

    /// [..., inputs] to [..., outputs].
    pub fn forward(&self, parameters: &Parameters, x: &Tensor) -> Tensor {
        let x = through(&self.hidden, parameters, x);
        self.output.forward(parameters, &x)
    }
}

/// Hidden layers only, each followed by ReLU: an encoder.
#[derive(Debug, Clone)]
pub struct Trunk {
    hidden: Vec<Linear>,
    /// Size of its output.
    pub width: usize,
}

impl Trunk {
    /// Declares the layers.
    pub fn new(layout: &mut Layout, name: &str, inputs: usize, hidden: &[usize]) -> Self {
        let (hidden, width) = stack(layout, name, inputs, hidden);
        Self { hidden, width }
    }

    /// [..., inputs] to [..., width].
    pub fn forward(&self, parameters: &Parameters, x: &Tensor) -> Tensor {
        through(&self.hidden, parameters, x)
    }
}

fn stack(layout: &mut Layout, name: &str, inputs: usize, hidden: &[usize]) -> (Vec<Linear>, usize) {
    let mut width = inputs;
    let mut layers = Vec::with_capacity(hidden.len());
    for (index, &units) in hidden.iter().enumerate() {
        let layer = format!("{name}.{index}");
        layers.push(Linear::new(layout, &layer, width, units, RELU_GAIN));
        width = units;
    }
    (layers, width)
}

fn through(layers: &[Linear], parameters: &Parameters, x: &Tensor) -> Tensor {
    let mut x = x.shallow_clone();
    for layer in layers {
        x = layer.forward(parameters, &x).relu();
    }
    x
}
