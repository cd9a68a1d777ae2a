//! The observation encoder of HOP-PPO: strips as tokens through a pre-norm transformer (section IV.C).

use tch::{Kind, Tensor};

use super::layers::{LayerNorm, Linear, RELU_GAIN};
use crate::parameters::{Layout, Parameters};

/// Sizes of the encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TransformerSize {
    /// Tokens of a sequence.
    pub tokens: usize,
    /// Features of one token.
    pub features: usize,
    /// Embedding dimension.
    pub dim: usize,
    /// Attention heads; divides `dim`.
    pub heads: usize,
    /// Encoder layers.
    pub layers: usize,
    /// Units of each feed-forward network.
    pub feed_forward: usize,
}

/// Linear embedding, sinusoidal positions, `layers` encoder layers, a last layer norm.
#[derive(Debug, Clone)]
pub struct Transformer {
    embed: Linear,
    layers: Vec<EncoderLayer>,
    norm: LayerNorm,
    positions: Vec<f32>,
    dim: i64,
}

#[derive(Debug, Clone)]
struct EncoderLayer {
    norm_attention: LayerNorm,
    query_key_value: Linear,
    project: Linear,
    norm_feed_forward: LayerNorm,
    expand: Linear,
    contract: Linear,
    heads: i64,
}

impl Transformer {
    /// Declares the encoder's tensors.
    pub fn new(layout: &mut Layout, name: &str, size: TransformerSize) -> Self {
        let embed = Linear::new(layout, &format!("{name}.embed"), size.features, size.dim, 1.0);
        let layers =
            (0..size.layers).map(|index| EncoderLayer::new(layout, &format!("{name}.layer{index}"), size)).collect();
        Self {
            embed,
            layers,
            norm: LayerNorm::new(layout, &format!("{name}.norm"), size.dim),
            positions: positions(size.tokens, size.dim),
            dim: size.dim as i64,
        }
    }

    /// Encodes [batch, tokens, features] to [batch, tokens, dim]. `padding` is 0 for valid tokens
    /// and a large negative number for padding, [batch, 1, 1, tokens]; `None` when all are valid.
    pub fn forward(&self, parameters: &Parameters, x: &Tensor, padding: Option<&Tensor>) -> Tensor {
        let positions = Tensor::from_slice(&self.positions).view([-1, self.dim]);
        let positions = positions.to_device(x.device());
        let mut x = self.embed.forward(parameters, x) + positions;
        for layer in &self.layers {
            x = layer.forward(parameters, &x, padding);
        }
        self.norm.forward(parameters, &x)
    }
}

impl EncoderLayer {
    fn new(layout: &mut Layout, name: &str, size: TransformerSize) -> Self {
        let dim = size.dim;
        let part = |part: &str| format!("{name}.{part}");
        Self {
            norm_attention: LayerNorm::new(layout, &part("norm_attention"), dim),
            query_key_value: Linear::new(layout, &part("query_key_value"), dim, 3 * dim, 1.0),
            project: Linear::new(layout, &part("project"), dim, dim, 1.0),
            norm_feed_forward: LayerNorm::new(layout, &part("norm_feed_forward"), dim),
            expand: Linear::new(layout, &part("expand"), dim, size.feed_forward, RELU_GAIN),
            contract: Linear::new(layout, &part("contract"), size.feed_forward, dim, 1.0),
            heads: size.heads as i64,
        }
    }

    fn forward(&self, parameters: &Parameters, x: &Tensor, padding: Option<&Tensor>) -> Tensor {
        let normed = self.norm_attention.forward(parameters, x);
        let x = x + self.attend(parameters, &normed, padding);
        let normed = self.norm_feed_forward.forward(parameters, &x);
        let hidden = self.expand.forward(parameters, &normed).relu();
        self.contract.forward(parameters, &hidden) + x
    }

    /// Multi-head self-attention, written out: faster on a CPU than the fused operator.
    fn attend(&self, parameters: &Parameters, x: &Tensor, padding: Option<&Tensor>) -> Tensor {
        let (batch, tokens, dim) = (x.size()[0], x.size()[1], x.size()[2]);
        let width = dim / self.heads;
        let joined = self.query_key_value.forward(parameters, x);
        // [3, batch, heads, tokens, width]
        let split = joined.view([batch, tokens, 3, self.heads, width]).permute([2, 0, 3, 1, 4]);
        let (query, key, value) = (split.get(0), split.get(1), split.get(2));
        let scores = (query * (1.0 / (width as f64).sqrt())).matmul(&key.transpose(-2, -1));
        let scores = match padding {
            Some(padding) => scores + padding,
            None => scores,
        };
        let mixed = scores.softmax(-1, Kind::Float).matmul(&value);
        let mixed = mixed.transpose(1, 2).reshape([batch, tokens, dim]);
        self.project.forward(parameters, &mixed)
    }
}

/// Sinusoidal positions (eq. 21), tokens × dim in row order.
fn positions(tokens: usize, dim: usize) -> Vec<f32> {
    let value = |token: usize, index: usize| {
        let rate = 10000f64.powf(-((index / 2 * 2) as f64) / dim as f64);
        let angle = token as f64 * rate;
        let value = if index.is_multiple_of(2) { angle.sin() } else { angle.cos() };
        value as f32
    };
    let rows = 0..tokens;
    rows.flat_map(|token| (0..dim).map(move |index| value(token, index))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_equation_21() {
        let table = positions(40, 8);
        assert_eq!(table.len(), 320);
        let (n, i, dim) = (17.0f64, 2.0, 8.0);
        let angle = n / 10000f64.powf(2.0 * i / dim);
        assert!((f64::from(table[17 * 8 + 4]) - angle.sin()).abs() < 1e-6);
        assert!((f64::from(table[17 * 8 + 5]) - angle.cos()).abs() < 1e-6);
        assert_eq!(table[..2], [0.0, 1.0]);
    }
}
