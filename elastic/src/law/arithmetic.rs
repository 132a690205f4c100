//! Products and sums as processors can round them.

/// Products and sums, rounded once or twice.
pub(crate) trait Arithmetic: Copy {
    /// Whether the registers hold the sums of pass one twice.
    const HOLDS_SUMS: bool;
    /// Whether they hold those of pass two twice.
    const HOLDS_RECORDS: bool;
    /// `a b + c`.
    fn add(a: f64, b: f64, c: f64) -> f64;
}

/// Rounds once, where processors can, with many wide registers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused;

/// Rounds once, with fewer registers: bitwise identical.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FusedInFew;

/// Rounds twice, as every processor can.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Separate;

impl Arithmetic for Fused {
    const HOLDS_SUMS: bool = true;
    const HOLDS_RECORDS: bool = true;

    #[inline(always)]
    fn add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

impl Arithmetic for FusedInFew {
    const HOLDS_SUMS: bool = false;
    const HOLDS_RECORDS: bool = true;

    #[inline(always)]
    fn add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

impl Arithmetic for Separate {
    const HOLDS_SUMS: bool = false;
    const HOLDS_RECORDS: bool = false;

    #[inline(always)]
    fn add(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}
