//! What goes in: stencils, nodes, materials, options.

use glam::{DMat3, DVec3};

use crate::error::ElasticError;
use crate::law::material::Material;

/// Gradient stencils of all nodes in factored form, compressed by rows:
///
/// `g_ij = w_ij [B_i X_ij + s_i (μ_j - μ_i)]`, `X_ij = X_j - X_i`, `g_ii = -sum_j g_ij`.
///
/// Plain moving least squares (Aras 2014, eqs (25)-(27)) has `B_i = A_i⁻¹`, `A_i = sum_j w_ij X_ij
/// X_ijᵀ`, and no `μ`; stencils that are conservative as well have `B_i = A_i⁻¹ - s_i H_i` with `s_i`
/// the volume and `H_i = (sum_j w_ij μ_ij X_ijᵀ) A_i⁻¹`. So a pair takes one number.
///
/// Row `i` of the graph is `indices[offsets[i]..offsets[i + 1]]`: its neighbours in ascending order,
/// without `i` itself.
#[derive(Debug, Clone, Copy)]
pub struct Stencils<'a> {
    /// Starts of the rows, shape `(n + 1)`.
    pub offsets: &'a [u32],
    /// Neighbours, shape `(pairs)`.
    pub indices: &'a [u32],
    /// `w_ij >= 0` (any unit), shape `(pairs)`; 0 for a severed pair. Kept as f32: a caller that solves for
    /// `B` and `μ` rounds the weights first, and what follows from them is exact. Hourglass stabilization
    /// needs `w_ij = w_ji`.
    pub weights: &'a [f64],
    /// `B_i` (1/m² over the unit of `w`), shape `(n)`.
    pub matrices: &'a [DMat3],
    /// `s_i`, shape `(n)`; empty without multipliers.
    pub scales: &'a [f64],
    /// `μ_i` (1/m over the units of `s` and `w`), shape `(n)`; empty for plain moving least squares,
    /// which takes less memory and time.
    pub multipliers: &'a [DVec3],
}

/// Rest state of the nodes.
#[derive(Debug, Clone, Copy)]
pub struct Nodes<'a> {
    /// Rest positions `X_i` (m), shape `(n)`.
    pub rest_positions: &'a [DVec3],
    /// Volumes `V_i` (m³), shape `(n)`, positive.
    pub volumes: &'a [f64],
}

impl<'a> Nodes<'a> {
    /// Rest positions (m) and volumes (m³), shape `(n)` each; checked by [`crate::Elastic::new`].
    #[must_use]
    pub fn new(rest_positions: &'a [DVec3], volumes: &'a [f64]) -> Self {
        Self {
            rest_positions,
            volumes,
        }
    }
}

/// What a model counts its stored coordinates and multipliers from. A model of some of a body's nodes has the bits of
/// the whole's only in the whole's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame {
    /// Of coordinates (m) and of multipliers.
    pub(crate) origin: [DVec3; 2],
}

/// Materials of the nodes.
#[derive(Debug, Clone, Copy)]
pub enum Materials<'a> {
    /// One for all.
    Uniform(Material),
    /// A list and, for each node, an index into it.
    PerNode {
        /// The materials.
        list: &'a [Material],
        /// Index per node, shape `(n)`.
        of_node: &'a [u32],
    },
}

/// Options of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// `alpha` of the hourglass stabilization, in units of the shear modulus; 0 turns it
    /// off. 0.1 serves beams, contact and cracks alike; 0.3 is visibly stiff, 0.05 soft.
    pub stabilization: f64,
    /// Where volume changes are resisted.
    pub dilatation: Dilatation,
    /// What stored coordinates are counted from; the middle of the nodes unless given, as that of nodes far away costs digits. In the frame of a body of which
    /// they are some nodes, rows of matrix and scale zero see nothing and give nothing. What the other rows, and the
    /// forces on nodes all of whose neighbours have such other rows, say is what the whole says, bit for bit, where the
    /// order of neighbours is the whole's. Sums over nodes are, where runs of [`crate::WATCHED_NODES`] nodes are.
    #[doc(hidden)]
    pub frame: Option<Frame>,
}

/// Where changes of volume are resisted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Dilatation {
    /// At each node by itself.
    #[default]
    Local,
    /// By means over neighbourhoods (mean dilatation): softer where a nearly incompressible body is
    /// confined. Worth its two further passes above a Poisson's ratio of about 0.48. Acts on the
    /// `(ln J)²` and eq. (30) parts; not with Saint Venant–Kirchhoff.
    Mean,
}

impl Default for Settings {
    /// Stabilization 0.1, dilatation at each node.
    fn default() -> Self {
        Self {
            stabilization: 0.1,
            dilatation: Dilatation::Local,
            frame: None,
        }
    }
}

/// Refuses a list that is not as long as it must be.
pub(crate) fn same_length(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ElasticError> {
    if found == expected {
        return Ok(());
    }
    Err(ElasticError::Length {
        what,
        found,
        expected,
    })
}

impl<'a> Stencils<'a> {
    /// Plain moving least squares: one weight a pair, one matrix a node, no multipliers. Lengths and values are
    /// checked by [`crate::Elastic::new`].
    ///
    /// # Examples
    /// ```
    /// use phyxel_elastic::{Stencils, glam::{DMat3, DVec3}};
    ///
    /// // Four nodes that see each other.
    /// let x = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    /// let (offsets, indices) = ([0, 3, 6, 9, 12], [1, 2, 3, 0, 2, 3, 0, 1, 3, 0, 1, 2]);
    /// let weights = [1.0; 12];
    /// // B_i, the inverse of A_i.
    /// let outer = |d: DVec3| DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    /// let moment = |a: DVec3| x.iter().fold(DMat3::ZERO, |sum, &b| sum + outer(b - a));
    /// let matrices = x.map(|a| moment(a).inverse());
    /// let stencils = Stencils::plain(&offsets, &indices, &weights, &matrices);
    /// assert!(stencils.multipliers.is_empty());
    /// ```
    #[must_use]
    pub fn plain(
        offsets: &'a [u32],
        indices: &'a [u32],
        weights: &'a [f64],
        matrices: &'a [DMat3],
    ) -> Self {
        Self {
            offsets,
            indices,
            weights,
            matrices,
            scales: &[],
            multipliers: &[],
        }
    }

    /// The same with the multipliers `μ_i` and scales `s_i` that make stencils conservative; both empty for plain ones.
    #[must_use]
    pub fn with_multipliers(self, scales: &'a [f64], multipliers: &'a [DVec3]) -> Self {
        Self {
            scales,
            multipliers,
            ..self
        }
    }

    pub(crate) fn check_lengths(&self, node_count: usize) -> Result<(), ElasticError> {
        let pairs = self.indices.len();
        same_length("offsets", self.offsets.len(), node_count + 1)?;
        same_length("weights", self.weights.len(), pairs)?;
        same_length("matrices", self.matrices.len(), node_count)?;
        let is_corrected = !self.multipliers.is_empty();
        let corrected = if is_corrected { node_count } else { 0 };
        same_length("multipliers", self.multipliers.len(), corrected)?;
        same_length("scales", self.scales.len(), corrected)?;
        let mut last = 0;
        for (position, &value) in self.offsets.iter().enumerate() {
            let end = position == node_count && value as usize != pairs;
            if value < last || (position == 0 && value != 0) || end {
                return Err(ElasticError::Offset { position, value });
            }
            last = value;
        }
        Ok(())
    }
}

pub(crate) fn checked_materials(
    materials: &Materials<'_>,
    node_count: usize,
) -> Result<(Vec<Material>, Vec<u32>), ElasticError> {
    let (list, of_node) = match materials {
        Materials::Uniform(material) => (vec![*material], Vec::new()),
        Materials::PerNode { list, of_node } => {
            same_length("material indices", of_node.len(), node_count)?;
            let count = list.len();
            for (node, &material) in of_node.iter().enumerate() {
                let material = material as usize;
                if material >= count {
                    return Err(ElasticError::UnknownMaterial {
                        node,
                        material,
                        count,
                    });
                }
            }
            (list.to_vec(), of_node.to_vec())
        }
    };
    for (index, material) in list.iter().enumerate() {
        material.validate(index)?;
    }
    Ok((list, of_node))
}
