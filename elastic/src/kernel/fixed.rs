//! What a node's stencil is made of, as the passes read it, and what they leave.

use glam::{DMat3, DVec3};

use crate::input::{Frame, Stencils};
use crate::kernel::gather::{ONE, Record};
use crate::kernel::pairs::{Pair, Pairs};
use crate::kernel::storage::{BLOCK, Plane, Planes, Sixteen, at, bytes_of, gradient};
use crate::law::tensor::outer;

/// Constants of all nodes, and what the last evaluation left. What a body does not use is empty.
#[derive(Debug, Clone)]
pub(crate) struct Tables {
    /// What coordinates and multipliers are counted from: sums of them lose the fewer digits.
    origin: [DVec3; 2],
    lanes: NodeReads,
    constants: Constants,
    /// `F_i` of the state last evaluated.
    pub(crate) deformation: Vec<Planes>,
}

/// What pairs read of nodes, with or without multipliers.
#[derive(Debug, Clone)]
enum NodeReads {
    Plain(Read<4>),
    Corrected(Read<8>),
}

#[derive(Debug, Clone)]
struct Read<const L: usize> {
    /// `X`, one, `μ`, zero.
    anchors: Vec<Sixteen<[f64; L]>>,
    /// What pass one writes and pass two reads.
    records: Vec<Sixteen<Record<L>>>,
}

impl<const L: usize> Read<L> {
    fn new(blocks: usize) -> Self {
        Self {
            anchors: vec![Sixteen::of([0.0; L]); blocks],
            records: vec![Sixteen::of([[0.0; L]; 3]); blocks],
        }
    }

    /// The three numbers of a node from a lane on.
    fn place(&self, node: usize, lane: usize) -> DVec3 {
        DVec3::from_slice(&at(&self.anchors, node)[lane..])
    }

    fn set_place(&mut self, node: usize, lane: usize, place: DVec3) {
        let anchor = &mut self.anchors[node / BLOCK].0[node % BLOCK];
        anchor[ONE] = 1.0;
        place.write_to_slice(&mut anchor[lane..]);
    }

    fn table<'a>(
        &'a mut self,
        constants: &'a Constants,
        deformation: &'a mut [Planes],
    ) -> Table<'a, L> {
        Table {
            fixed: Fixed {
                anchors: &self.anchors,
                constants,
            },
            deformation,
            records: &mut self.records,
        }
    }

    fn bytes(&self) -> usize {
        bytes_of(&self.anchors) + bytes_of(&self.records)
    }
}

/// Lane of the multipliers.
const MULTIPLIER: usize = ONE + 1;

/// What passes over nodes read of them.
#[derive(Debug, Clone)]
struct Constants {
    /// `B`, row by row.
    matrices: Vec<[Plane; 9]>,
    /// `A⁻¹`: xx, yy, zz, yz, zx, xy; with control and multipliers.
    inverses: Vec<[Plane; 6]>,
    /// `s`; with multipliers.
    scales: Vec<Plane>,
    /// `c`; with control.
    controls: Vec<Plane>,
    /// `sum_j w_ij c_j`; with control.
    drags: Vec<Plane>,
}

/// Constants of a block's nodes by component; matrices row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BlockConstants<'a> {
    /// `B`.
    pub(crate) matrix: &'a [Plane; 9],
    /// `A⁻¹`: xx, yy, zz, yz, zx, xy; only with control and multipliers.
    pub(crate) inverse: Option<&'a [Plane; 6]>,
    /// `s`; only with multipliers.
    pub(crate) scale: Option<&'a Plane>,
    /// `c`; only with control.
    pub(crate) control: Option<&'a Plane>,
}

/// What passes read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fixed<'a, const L: usize> {
    pub(crate) anchors: &'a [Sixteen<[f64; L]>],
    constants: &'a Constants,
}

/// What passes read and write.
pub(crate) struct Table<'a, const L: usize> {
    pub(crate) fixed: Fixed<'a, L>,
    pub(crate) deformation: &'a mut [Planes],
    pub(crate) records: &'a mut [Sixteen<Record<L>>],
}

/// A table of either kind.
pub(crate) enum Either<'a> {
    Plain(Table<'a, 4>),
    Corrected(Table<'a, 8>),
}

/// Sums over a row of the stencils.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moments {
    /// `A = sum_j w_ij X_ij X_ijᵀ`.
    pub(crate) moment: DMat3,
    /// `sum_j w_ij X_ij μ_ijᵀ`.
    cross: DMat3,
}

impl Moments {
    /// Of `(X_ij, μ_ij, w_ij)`.
    fn of(terms: impl Iterator<Item = (DVec3, DVec3, f64)>) -> Self {
        let (mut moment, mut cross) = (DMat3::ZERO, DMat3::ZERO);
        for (x, mu, w) in terms {
            moment += outer(x * w, x);
            cross += outer(x * w, mu);
        }
        Self { moment, cross }
    }

    /// As the caller gave coordinates and multipliers.
    pub(crate) fn given(node: usize, row: &[Pair], rest: &[DVec3], multipliers: &[DVec3]) -> Self {
        let mu = |node: usize| multipliers.get(node).copied().unwrap_or(DVec3::ZERO);
        Self::of(row.iter().map(|pair| {
            let j = pair.to as usize;
            let w = f64::from(pair.weight);
            (rest[j] - rest[node], mu(j) - mu(node), w)
        }))
    }

    /// `sum_j w_ij |X_ij|²`.
    pub(crate) fn spread(&self) -> f64 {
        let a = &self.moment;
        a.x_axis.x + a.y_axis.y + a.z_axis.z
    }

    /// `sum_j X_ij g_ijᵀ` of `g_ij = w_ij (B X_ij + s μ_ij)`.
    pub(crate) fn consistency(&self, matrix: DMat3, scale: f64) -> DMat3 {
        self.moment * matrix.transpose() + self.cross * scale
    }
}

impl Tables {
    /// In a frame of its own unless one is given.
    pub(crate) fn new(
        rest: &[DVec3],
        multipliers: &[DVec3],
        controlled: bool,
        frame: Option<Frame>,
    ) -> Self {
        let count = rest.len().div_ceil(BLOCK);
        let is_corrected = !multipliers.is_empty();
        let corrected = if is_corrected { count } else { 0 };
        let under_control = if controlled { count } else { 0 };
        let (one, zero) = (Plane::of(1.0), Plane::of(0.0));
        let mut tables = Self {
            origin: frame.map_or_else(|| [middle(rest), middle(multipliers)], |frame| frame.origin),
            lanes: if is_corrected {
                NodeReads::Corrected(Read::new(count))
            } else {
                NodeReads::Plain(Read::new(count))
            },
            constants: Constants {
                matrices: vec![[zero; 9]; count],
                inverses: vec![[zero; 6]; corrected.min(under_control)],
                scales: vec![zero; corrected],
                controls: vec![zero; under_control],
                drags: vec![zero; under_control],
            },
            deformation: vec![[one, zero, zero, zero, one, zero, zero, zero, one]; count],
        };
        for (node, x) in rest.iter().enumerate() {
            let place = *x - tables.origin[0];
            match &mut tables.lanes {
                NodeReads::Plain(read) => read.set_place(node, 0, place),
                NodeReads::Corrected(read) => read.set_place(node, 0, place),
            }
            tables.set_multiplier(node, multipliers);
        }
        tables
    }

    pub(crate) fn frame(&self) -> Frame {
        Frame {
            origin: self.origin,
        }
    }

    pub(crate) fn is_corrected(&self) -> bool {
        matches!(self.lanes, NodeReads::Corrected(_))
    }

    pub(crate) fn set_multiplier(&mut self, node: usize, multipliers: &[DVec3]) {
        if let (NodeReads::Corrected(read), Some(mu)) = (&mut self.lanes, multipliers.get(node)) {
            read.set_place(node, MULTIPLIER, *mu - self.origin[1]);
        }
    }

    /// What passes read and write.
    pub(crate) fn split(&mut self) -> Either<'_> {
        let (constants, deformation) = (&self.constants, &mut self.deformation[..]);
        match &mut self.lanes {
            NodeReads::Plain(read) => Either::Plain(read.table(constants, deformation)),
            NodeReads::Corrected(read) => Either::Corrected(read.table(constants, deformation)),
        }
    }

    /// `F_i` of a node.
    pub(crate) fn gradient(&self, node: usize) -> DMat3 {
        gradient(&self.deformation, node)
    }

    /// `X_i` and `μ_i` as stored.
    fn place(&self, node: usize) -> (DVec3, DVec3) {
        match &self.lanes {
            NodeReads::Plain(read) => (read.place(node, 0), DVec3::ZERO),
            NodeReads::Corrected(read) => (read.place(node, 0), read.place(node, MULTIPLIER)),
        }
    }

    /// Sums over a row with coordinates and multipliers as stored.
    pub(crate) fn moments(&self, node: usize, row: &[Pair]) -> Moments {
        let (x, mu) = self.place(node);
        Moments::of(row.iter().map(|pair| {
            let (there, other) = self.place(pair.to as usize);
            (there - x, other - mu, f64::from(pair.weight))
        }))
    }

    /// Stores what a row is made of. `inverse` is that of the moment as stored, for full rows.
    pub(crate) fn set_row(
        &mut self,
        node: usize,
        stencils: &Stencils<'_>,
        inverse: Option<[f64; 6]>,
    ) {
        let (block, at) = (node / BLOCK, node % BLOCK);
        let constants = &mut self.constants;
        if let Some(stored) = constants.scales.get_mut(block) {
            stored[at] = stencils.scales[node];
        }
        let rows = stencils.matrices[node].transpose().to_cols_array();
        for (plane, value) in constants.matrices[block].iter_mut().zip(rows) {
            plane[at] = value;
        }
        if let Some(planes) = constants.inverses.get_mut(block) {
            for (plane, value) in planes.iter_mut().zip(inverse.unwrap_or([0.0; 6])) {
                plane[at] = value;
            }
        }
    }

    pub(crate) fn set_control(&mut self, node: usize, control: f64) {
        if let Some(plane) = self.constants.controls.get_mut(node / BLOCK) {
            plane[node % BLOCK] = control;
        }
    }

    /// Sums the neighbours' `c` again.
    pub(crate) fn set_drag(&mut self, pairs: &Pairs, node: usize) {
        let mut sum = 0.0;
        for pair in pairs.row(node) {
            sum += f64::from(pair.weight) * self.control(pair.to as usize);
        }
        if let Some(plane) = self.constants.drags.get_mut(node / BLOCK) {
            plane[node % BLOCK] = sum;
        }
    }

    /// `c_i`.
    pub(crate) fn control(&self, node: usize) -> f64 {
        lane(&self.constants.controls, node)
    }

    /// `sum_j w_ij c_j`.
    pub(crate) fn drag(&self, node: usize) -> f64 {
        lane(&self.constants.drags, node)
    }

    /// `B` of a node.
    fn matrix(&self, node: usize) -> DMat3 {
        gradient(&self.constants.matrices, node)
    }

    /// `A⁻¹` of a node under control.
    pub(crate) fn moment_inverse(&self, node: usize) -> DMat3 {
        match self.constants.inverses.get(node / BLOCK) {
            Some(planes) => {
                let [xx, yy, zz, yz, zx, xy] = planes.map(|plane| plane[node % BLOCK]);
                DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
            }
            None => self.matrix(node),
        }
    }

    /// `X_ij` and `g_ij` of the pairs of a row, `g` without its weight.
    pub(crate) fn row<'a>(
        &'a self,
        node: usize,
        row: &'a [Pair],
    ) -> impl Iterator<Item = (u32, f64, DVec3, DVec3)> + 'a {
        let (x, mu) = self.place(node);
        let matrix = self.matrix(node);
        let scale = self.constants.scales.get(node / BLOCK);
        let scale = scale.map_or(0.0, |plane| plane[node % BLOCK]);
        row.iter().map(move |pair| {
            let (there, other) = self.place(pair.to as usize);
            let w = f64::from(pair.weight);
            let x = there - x;
            (pair.to, w, x, (matrix * x + (other - mu) * scale) * w)
        })
    }

    pub(crate) fn bytes(&self) -> usize {
        let constants = &self.constants;
        let read = match &self.lanes {
            NodeReads::Plain(read) => read.bytes(),
            NodeReads::Corrected(read) => read.bytes(),
        };
        read + bytes_of(&constants.matrices)
            + bytes_of(&constants.inverses)
            + bytes_of(&constants.scales)
            + bytes_of(&constants.controls)
            + bytes_of(&constants.drags)
            + bytes_of(&self.deformation)
    }
}

/// A node's number of planes that may not be there.
#[inline(always)]
fn lane(planes: &[Plane], node: usize) -> f64 {
    let plane = planes.get(node / BLOCK);
    plane.map_or(0.0, |plane| plane[node % BLOCK])
}

impl<'a, const L: usize> Fixed<'a, L> {
    /// `sum_j w_ij c_j`.
    #[inline(always)]
    pub(crate) fn drag(&self, node: usize) -> f64 {
        lane(&self.constants.drags, node)
    }

    /// Constants of a block of nodes.
    #[inline(always)]
    pub(crate) fn constants(&self, block: usize) -> BlockConstants<'a> {
        let constants = self.constants;
        BlockConstants {
            matrix: &constants.matrices[block],
            inverse: constants.inverses.get(block),
            scale: constants.scales.get(block),
            control: constants.controls.get(block),
        }
    }

    /// Copies a node's constants into a lane of other planes.
    pub(crate) fn copy_lane(&self, node: usize, lane: usize, to: &mut Lane) {
        let (block, at) = (node / BLOCK, node % BLOCK);
        let copy = |to: &mut [Plane], from: &[Plane]| {
            for (to, from) in to.iter_mut().zip(from) {
                to[lane] = from[at];
            }
        };
        let constants = self.constants;
        copy(&mut to.matrix, &constants.matrices[block]);
        if let Some(planes) = constants.inverses.get(block) {
            copy(&mut to.inverse, planes);
        }
        if let Some(plane) = constants.scales.get(block) {
            to.scale[lane] = plane[at];
        }
        if let Some(plane) = constants.controls.get(block) {
            to.control[lane] = plane[at];
        }
    }

    /// Constants copied by [`Fixed::copy_lane`].
    pub(crate) fn copied<'b>(&self, from: &'b Lane) -> BlockConstants<'b> {
        let constants = self.constants;
        BlockConstants {
            matrix: &from.matrix,
            inverse: (!constants.inverses.is_empty()).then_some(&from.inverse),
            scale: (!constants.scales.is_empty()).then_some(&from.scale),
            control: (!constants.controls.is_empty()).then_some(&from.control),
        }
    }
}

/// Constants of nodes that do not lie together.
#[derive(Debug, Clone)]
pub(crate) struct Lane {
    matrix: [Plane; 9],
    inverse: [Plane; 6],
    scale: Plane,
    control: Plane,
}

impl Lane {
    pub(crate) fn new() -> Self {
        Self {
            matrix: [Plane::of(0.0); 9],
            inverse: [Plane::of(0.0); 6],
            scale: Plane::of(0.0),
            control: Plane::of(0.0),
        }
    }
}

/// Middle of the box around some points.
fn middle(points: &[DVec3]) -> DVec3 {
    let first = points.first().copied().unwrap_or(DVec3::ZERO);
    let grow = |(low, high): (DVec3, DVec3), x: &DVec3| (low.min(*x), high.max(*x));
    let (low, high) = points.iter().fold((first, first), grow);
    (low + high) * 0.5
}
