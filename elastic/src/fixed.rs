//! What a node's stencil is made of, as the passes read it: constant between cuts.

use glam::{DMat3, DVec3};

use crate::completion::Span;
use crate::gather::ONE;
use crate::input::{Frame, Stencils};
use crate::lanes::Constants;
use crate::law::outer;
use crate::pairs::{Pair, Pairs};
use crate::storage::{BLOCK, Number, Place, Plane, Sixteen, Storage, at};

/// Coordinates and constants of all nodes. What a body does not use is empty.
#[derive(Debug, Clone)]
pub(crate) struct Fixed<S: Storage, const L: usize> {
    /// What coordinates and multipliers are counted from: sums of them lose the fewer digits.
    origin: [DVec3; 2],
    /// Units of the lanes.
    pub(crate) unit: [f64; L],
    /// `X`, one, `μ`, one.
    pub(crate) anchors: Vec<Sixteen<[S::Place; L]>>,
    /// `B`, row by row.
    matrices: Vec<[Plane<S::Number>; 9]>,
    /// `A⁻¹`: xx, yy, zz, yz, zx, xy; with control and multipliers.
    inverses: Vec<[Plane<S::Number>; 6]>,
    /// `s`; with multipliers.
    scales: Vec<Plane<S::Number>>,
    /// `c`; with control.
    controls: Vec<Plane<S::Number>>,
    /// `sum_j w_ij c_j`; with control.
    drags: Vec<Plane<f64>>,
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

fn lane<const L: usize>(axis: usize) -> usize {
    (ONE + 1 + axis) % L
}

fn blocks<T: Copy>(of: usize, blank: T) -> Vec<T> {
    vec![blank; of]
}

impl<S: Storage, const L: usize> Fixed<S, L> {
    /// Whether there are multipliers.
    pub(crate) const CORRECTED: bool = L > ONE + 1;

    /// In a frame of its own unless one is given.
    pub(crate) fn new(
        rest: &[DVec3],
        multipliers: &[DVec3],
        controlled: bool,
        frame: Option<&Frame>,
    ) -> Self {
        let count = rest.len().div_ceil(BLOCK);
        let zero = S::Number::ZERO;
        let corrected = if Self::CORRECTED { count } else { 0 };
        let under_control = if controlled { count } else { 0 };
        let (low, high) = bounds(rest);
        let origin = frame.map_or((low + high) * 0.5, |frame| frame.origin[0]);
        let mut fixed = Self {
            origin: [origin, DVec3::ZERO],
            unit: [1.0; L],
            anchors: blocks(count, Sixteen([[S::Place::ZERO; L]; BLOCK])),
            matrices: blocks(count, [[zero; BLOCK]; 9]),
            inverses: blocks(corrected.min(under_control), [[zero; BLOCK]; 6]),
            scales: blocks(corrected, [zero; BLOCK]),
            controls: blocks(under_control, [zero; BLOCK]),
            drags: blocks(under_control, [0.0; BLOCK]),
        };
        let unit = S::Place::unit(rest.iter().fold(0.0, |most, x| farther(most, *x - origin)));
        for axis in 0..3 {
            fixed.unit[axis] = frame.map_or(unit, |frame| frame.unit[0]);
        }
        match frame {
            None => fixed.scale_multipliers(multipliers),
            Some(frame) if Self::CORRECTED => {
                fixed.origin[1] = frame.origin[1];
                for axis in 0..3 {
                    fixed.unit[lane::<L>(axis)] = frame.unit[1];
                }
            }
            Some(_) => {}
        }
        for (node, x) in rest.iter().enumerate() {
            let anchor = &mut fixed.anchors[node / BLOCK].0[node % BLOCK];
            // The last lane with multipliers is that of the low parts of what is recorded in the first one.
            anchor[ONE] = S::Place::ONE;
            anchor[L - 1] = S::Place::ONE;
            let x = (*x - origin).to_array();
            for axis in 0..3 {
                anchor[axis] = S::Place::of(x[axis], unit);
            }
        }
        for node in 0..rest.len() {
            fixed.set_multiplier(node, multipliers);
        }
        fixed
    }

    pub(crate) fn frame(&self) -> Frame {
        let of_multipliers = if Self::CORRECTED { lane::<L>(0) } else { 0 };
        Frame {
            origin: self.origin,
            unit: [self.unit[0], self.unit[of_multipliers]],
        }
    }

    /// Chooses the origin and unit of the multipliers.
    fn scale_multipliers(&mut self, multipliers: &[DVec3]) {
        if !Self::CORRECTED {
            return;
        }
        let (low, high) = bounds(multipliers);
        self.origin[1] = (low + high) * 0.5;
        let off = |most, mu: &DVec3| farther(most, *mu - self.origin[1]);
        let unit = S::Place::unit(multipliers.iter().fold(0.0, off));
        for axis in 0..3 {
            self.unit[lane::<L>(axis)] = unit;
        }
    }

    /// Makes room for multipliers that have grown; true if all rows must be set again.
    pub(crate) fn outgrown(&mut self, touched: &[u32], multipliers: &[DVec3]) -> bool {
        if !Self::CORRECTED || S::Place::PLAIN {
            return false;
        }
        // Whole numbers are chosen up to 2³⁰ and end at 2³¹.
        let most = self.unit[lane::<L>(0)] * 2.0_f64.powi(31);
        let grown = touched
            .iter()
            .any(|&node| farther(0.0, multipliers[node as usize] - self.origin[1]) >= most);
        if grown {
            self.scale_multipliers(multipliers);
            for node in 0..multipliers.len() {
                self.set_multiplier(node, multipliers);
            }
        }
        grown
    }

    pub(crate) fn set_multiplier(&mut self, node: usize, multipliers: &[DVec3]) {
        if let (true, Some(mu)) = (Self::CORRECTED, multipliers.get(node)) {
            let mu = (*mu - self.origin[1]).to_array();
            let anchor = &mut self.anchors[node / BLOCK].0[node % BLOCK];
            for (axis, mu) in mu.into_iter().enumerate() {
                let at = lane::<L>(axis);
                anchor[at] = S::Place::of(mu, self.unit[at]);
            }
        }
    }

    /// Units of the lanes, with their signs turned but for those of ones.
    #[inline(always)]
    pub(crate) fn signed_unit(&self) -> [f64; L] {
        let mut signed = self.unit;
        for (k, unit) in signed.iter_mut().enumerate() {
            if k % 4 != ONE {
                *unit = -*unit;
            }
        }
        signed
    }

    /// `X_i` and `μ_i` as stored.
    fn place(&self, node: usize) -> (DVec3, DVec3) {
        let anchor = at(&self.anchors, node);
        let axis = |at: usize| anchor[at].wide() * self.unit[at];
        let x = DVec3::new(axis(0), axis(1), axis(2));
        let mu = if Self::CORRECTED {
            DVec3::from_array([0, 1, 2].map(|k| axis(lane::<L>(k))))
        } else {
            DVec3::ZERO
        };
        (x, mu)
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
        moments: &Moments,
        inverse: Option<[f64; 6]>,
        span: Option<&Span>,
    ) {
        let (block, at) = (node / BLOCK, node % BLOCK);
        let mut matrix = stencils.matrices[node];
        let mut scale = 0.0;
        if let Some(stored) = self.scales.get_mut(block) {
            let rounded = S::Number::of(stencils.scales[node]);
            stored[at] = rounded;
            scale = rounded.wide();
        }
        if S::Number::ROUNDS {
            // What follows from rounded numbers must, or consistency is lost to cancellation.
            let inverse = match (span, inverse) {
                (Some(span), _) => Some(span.inverse(moments.moment)),
                (None, inverse) => inverse.map(symmetric),
            };
            if let Some(inverse) = inverse {
                matrix = inverse - moments.cross.transpose() * inverse * scale;
            }
        }
        let rows = matrix.transpose().to_cols_array();
        for (plane, value) in self.matrices[block].iter_mut().zip(rows) {
            plane[at] = S::Number::of(value);
        }
        if let Some(planes) = self.inverses.get_mut(block) {
            for (plane, value) in planes.iter_mut().zip(inverse.unwrap_or([0.0; 6])) {
                plane[at] = S::Number::of(value);
            }
        }
    }

    pub(crate) fn set_control(&mut self, node: usize, control: f64) {
        if let Some(plane) = self.controls.get_mut(node / BLOCK) {
            plane[node % BLOCK] = S::Number::of(control);
        }
    }

    /// Sums the neighbours' `c` again.
    pub(crate) fn set_drag(&mut self, pairs: &Pairs, node: usize) {
        let mut sum = 0.0;
        for pair in pairs.row(node) {
            sum += f64::from(pair.weight) * self.control(pair.to as usize);
        }
        if let Some(plane) = self.drags.get_mut(node / BLOCK) {
            plane[node % BLOCK] = sum;
        }
    }

    /// `c_i`.
    pub(crate) fn control(&self, node: usize) -> f64 {
        let plane = self.controls.get(node / BLOCK);
        plane.map_or(0.0, |plane| plane[node % BLOCK].wide())
    }

    /// `sum_j w_ij c_j`.
    #[inline(always)]
    pub(crate) fn drag(&self, node: usize) -> f64 {
        let plane = self.drags.get(node / BLOCK);
        plane.map_or(0.0, |plane| plane[node % BLOCK])
    }

    /// Constants of a block of nodes.
    #[inline(always)]
    pub(crate) fn constants(&self, block: usize) -> Constants<'_, S::Number> {
        Constants {
            matrix: &self.matrices[block],
            inverse: self.inverses.get(block),
            scale: self.scales.get(block),
            control: self.controls.get(block),
        }
    }

    /// `B` of a node.
    fn matrix(&self, node: usize) -> DMat3 {
        let planes = &self.matrices[node / BLOCK];
        DMat3::from_cols_array(&[0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| planes[i][node % BLOCK].wide()))
            .transpose()
    }

    /// `A⁻¹` of a node under control.
    pub(crate) fn moment_inverse(&self, node: usize) -> DMat3 {
        match self.inverses.get(node / BLOCK) {
            Some(planes) => symmetric([0, 1, 2, 3, 4, 5].map(|i| planes[i][node % BLOCK].wide())),
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
        let scale = self.scales.get(node / BLOCK);
        let scale = scale.map_or(0.0, |plane| plane[node % BLOCK].wide());
        row.iter().map(move |pair| {
            let (there, other) = self.place(pair.to as usize);
            let w = f64::from(pair.weight);
            let x = there - x;
            (pair.to, w, x, (matrix * x + (other - mu) * scale) * w)
        })
    }

    /// Copies a node's constants into a lane of other planes.
    pub(crate) fn copy_lane(&self, node: usize, lane: usize, to: &mut Lane<S::Number>) {
        let (block, at) = (node / BLOCK, node % BLOCK);
        let copy = |to: &mut [Plane<S::Number>], from: &[Plane<S::Number>]| {
            for (to, from) in to.iter_mut().zip(from) {
                to[lane] = from[at];
            }
        };
        copy(&mut to.matrix, &self.matrices[block]);
        if let Some(planes) = self.inverses.get(block) {
            copy(&mut to.inverse, planes);
        }
        if let Some(plane) = self.scales.get(block) {
            to.scale[lane] = plane[at];
        }
        if let Some(plane) = self.controls.get(block) {
            to.control[lane] = plane[at];
        }
    }

    /// Constants copied by [`Fixed::copy_lane`].
    pub(crate) fn copied<'a>(&self, from: &'a Lane<S::Number>) -> Constants<'a, S::Number> {
        Constants {
            matrix: &from.matrix,
            inverse: (!self.inverses.is_empty()).then_some(&from.inverse),
            scale: (!self.scales.is_empty()).then_some(&from.scale),
            control: (!self.controls.is_empty()).then_some(&from.control),
        }
    }

    /// Heap bytes held.
    pub(crate) fn bytes(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        of(&self.anchors)
            + of(&self.matrices)
            + of(&self.inverses)
            + of(&self.scales)
            + of(&self.controls)
            + of(&self.drags)
    }
}

/// Constants of nodes that do not lie together.
#[derive(Debug, Clone)]
pub(crate) struct Lane<T> {
    matrix: [Plane<T>; 9],
    inverse: [Plane<T>; 6],
    scale: Plane<T>,
    control: Plane<T>,
}

impl<T: Number> Lane<T> {
    pub(crate) fn new() -> Self {
        Self {
            matrix: [[T::ZERO; BLOCK]; 9],
            inverse: [[T::ZERO; BLOCK]; 6],
            scale: [T::ZERO; BLOCK],
            control: [T::ZERO; BLOCK],
        }
    }
}

/// Matrix of xx, yy, zz, yz, zx, xy.
fn symmetric([xx, yy, zz, yz, zx, xy]: [f64; 6]) -> DMat3 {
    DMat3::from_cols_array(&[xx, xy, zx, xy, yy, yz, zx, yz, zz])
}

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let first = points.first().copied().unwrap_or(DVec3::ZERO);
    let grow = |(low, high): (DVec3, DVec3), x: &DVec3| (low.min(*x), high.max(*x));
    points.iter().fold((first, first), grow)
}

fn farther(most: f64, off: DVec3) -> f64 {
    most.max(off.abs().max_element())
}
