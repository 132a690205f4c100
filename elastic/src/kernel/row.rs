//! What follows from a row of the stencils.

use glam::{DMat3, DVec3};

use crate::error::ElasticError;
use crate::input::Stencils;
use crate::kernel::completion::{RowKind, row_kind};
use crate::kernel::fixed::{Moments, Tables};
use crate::kernel::nodes::Model;

/// Reads a row of the stencils, but for its weights, and everything that follows from it but drags.
pub(crate) fn set_row(
    model: &mut Model,
    tables: &mut Tables,
    node: usize,
    stencils: &Stencils<'_>,
) -> Result<(), ElasticError> {
    let not_finite = |what| ElasticError::NotFinite { what, node };
    let matrix = stencils.matrices[node];
    if !matrix.is_finite() {
        return Err(not_finite("matrix"));
    }
    let scale = stencils.scales.get(node).copied().unwrap_or(0.0);
    if !scale.is_finite() {
        return Err(not_finite("scale"));
    }
    let row = model.pairs.row(node);
    let given = Moments::given(node, row, &model.rest, stencils.multipliers);
    let kind = row_kind(given.consistency(matrix, scale));
    let span = match &kind {
        RowKind::Inconsistent(residual) => {
            let residual = *residual;
            return Err(ElasticError::InconsistentRow { node, residual });
        }
        RowKind::Deficient(span) => Some(span),
        RowKind::Full => None,
    };
    let moments = tables.moments(node, row);
    let inverse = inverse_moment(moments.moment).filter(|_| span.is_none());
    tables.set_row(node, stencils, inverse);
    model.set_span(node, span);
    // Without a full row the leftover e_ij is not blind to rotations; the node is then held by the
    // control of its neighbours.
    let spread = if inverse.is_some() {
        moments.spread()
    } else {
        f64::INFINITY
    };
    set_control(model, tables, node, spread);
    Ok(())
}

/// `A⁻¹` (xx, yy, zz, yz, zx, xy); `None` unless `A` is safely positive definite.
pub(crate) fn inverse_moment(a: DMat3) -> Option<[f64; 6]> {
    let floor = 1e-12 * (a.x_axis.x + a.y_axis.y + a.z_axis.z);
    let root = |pivot: f64| (pivot > floor && pivot > 0.0).then(|| pivot.sqrt());
    let l00 = root(a.x_axis.x)?;
    let (l10, l20) = (a.x_axis.y / l00, a.x_axis.z / l00);
    let l11 = root(a.y_axis.y - l10 * l10)?;
    let l21 = (a.y_axis.z - l20 * l10) / l11;
    let l22 = root(a.z_axis.z - l20 * l20 - l21 * l21)?;
    let l = DMat3::from_cols(
        DVec3::new(l00, l10, l20),
        DVec3::new(0.0, l11, l21),
        DVec3::new(0.0, 0.0, l22),
    );
    // The columns of L⁻¹ are the directions in which A is one.
    let [x, y, z] = l.inverse().to_cols_array_2d().map(DVec3::from_array);
    Some([x.dot(x), y.dot(y), z.dot(z), y.dot(z), z.dot(x), x.dot(y)])
}

/// Recomputes `c_i` after volumes or scales of some nodes changed, and what their neighbours sum of it.
pub(crate) fn refresh_control(model: &Model, tables: &mut Tables, nodes: &[usize]) {
    if model.controlled() {
        for &node in nodes {
            let spread = tables.moments(node, model.pairs.row(node)).spread();
            set_control(model, tables, node, spread);
        }
        set_drags(model, tables, nodes.iter().copied());
    }
}

/// `c_i = s_i alpha mu V_i / sum_j w_ij |X_ij|²`; none for a node whose row is not full.
pub(crate) fn set_control(model: &Model, tables: &mut Tables, node: usize, spread: f64) {
    if model.controlled() {
        let factor = model.control_scales.get(node).copied().unwrap_or(1.0);
        let alpha = model.settings.stabilization * factor;
        let stiffness = alpha * model.material(node).lame_mu() * model.elastic_volumes[node];
        let full = model.ranks[node] == 3 && spread > 0.0;
        tables.set_control(node, if full { stiffness / spread } else { 0.0 });
    }
}

/// Sums the control of neighbours again, where it changed.
pub(crate) fn set_drags(model: &Model, tables: &mut Tables, touched: impl Iterator<Item = usize>) {
    if !model.controlled() {
        return;
    }
    for node in touched {
        tables.set_drag(&model.pairs, node);
        for pair in model.pairs.row(node) {
            tables.set_drag(&model.pairs, pair.to as usize);
        }
    }
}
