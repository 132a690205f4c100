//! How numbers are stored: as they are, or compact. Sums are made in f64 either way.

use std::fmt::Debug;

/// Nodes whose constants lie together, by component, and are evaluated together.
pub(crate) const BLOCK: usize = 16;

/// One number per node of a block.
pub(crate) type Plane<T> = [T; BLOCK];

/// What belongs to the nodes of a block, node after node, from a cache line's start on.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Sixteen<T>(pub(crate) [T; BLOCK]);

/// What is stored of `node` in blocks.
#[inline(always)]
pub(crate) fn at<T>(blocks: &[Sixteen<T>], node: usize) -> &T {
    &blocks[node / BLOCK].0[node % BLOCK]
}

/// A kind of storage.
pub(crate) trait Storage: Copy + Debug + Send + Sync + 'static {
    /// Constants and records of nodes.
    type Number: Number;
    /// Coordinates and multipliers.
    type Place: Place;
    /// Displacements (m) below this count as none: what follows from them would leave the range of
    /// the numbers stored.
    const LEAST_DISPLACEMENT: f64;
}

/// A stored number.
pub(crate) trait Number: Copy + Debug + Send + Sync + PartialEq + 'static {
    const ZERO: Self;
    /// Whether storing rounds.
    const ROUNDS: bool;
    fn of(value: f64) -> Self;
    /// A value that storing has rounded already.
    fn exactly(value: f64) -> Self;
    fn wide(self) -> f64;
}

/// A stored coordinate, in units of its axis.
pub(crate) trait Place: Copy + Debug + Send + Sync + 'static {
    const ZERO: Self;
    const ONE: Self;
    /// Whether the unit is one.
    const PLAIN: bool;
    /// The unit that keeps the most of numbers up to `most`.
    fn unit(most: f64) -> f64;
    fn of(value: f64, unit: f64) -> Self;
    fn wide(self) -> f64;
}

/// f64 throughout.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Double;

/// Constants, records and deformation gradients as f32, coordinates and multipliers as 32-bit whole
/// multiples of a unit: a coordinate is then off by 2⁻³² of the body's size, 128 times less than an f32.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compact;

impl Storage for Double {
    type Number = f64;
    type Place = f64;
    const LEAST_DISPLACEMENT: f64 = 0.0;
}

impl Storage for Compact {
    type Number = f32;
    type Place = i32;
    const LEAST_DISPLACEMENT: f64 = 1e-20;
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    const ROUNDS: bool = false;

    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn exactly(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

impl Number for f32 {
    const ZERO: Self = 0.0;
    const ROUNDS: bool = true;

    /// Subnormal numbers, as ahead of a wave, become zero: they cost a hundred times a normal one.
    #[inline(always)]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "rounding to f32 is this storage's purpose"
    )]
    fn of(value: f64) -> Self {
        let tiny = value.abs() < f64::from(Self::MIN_POSITIVE);
        (if tiny { 0.0 } else { value }) as Self
    }

    #[inline(always)]
    #[allow(clippy::cast_possible_truncation, reason = "nothing is left to round")]
    fn exactly(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self.into()
    }
}

impl Place for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const PLAIN: bool = true;

    fn unit(_: f64) -> f64 {
        1.0
    }

    fn of(value: f64, _: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
}

impl Place for i32 {
    const ZERO: Self = 0;
    const ONE: Self = 1;
    const PLAIN: bool = false;

    /// A power of two, so that it rounds nothing itself.
    fn unit(most: f64) -> f64 {
        if most > 0.0 {
            (most.log2().ceil() - 30.0).exp2()
        } else {
            1.0
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "the unit is chosen so that the values fit"
    )]
    fn of(value: f64, unit: f64) -> Self {
        (value / unit).round() as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self.into()
    }
}
