//! Checked conversions between counts, indices and image scalars.

/// A `u32` index as `usize`.
#[inline]
pub(crate) fn index(value: u32) -> usize {
    value as usize
}

/// A count as `u32`; the arrays of this crate hold fewer than 2³² entries.
///
/// # Panics
/// If `value` does not fit.
#[inline]
pub(crate) fn count(value: usize) -> u32 {
    u32::try_from(value).expect("fewer than 2^32 entries")
}

/// A physical value rounded to image precision.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to f32 is the purpose"
)]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

/// The whole part of a non-negative finite number as a count, 0 for anything else.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "float casts saturate; negative and NaN give 0"
)]
pub(crate) fn whole(value: f64) -> usize {
    value as usize
}

/// Rounds down to a pixel index, saturating.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "saturates; bounds are clamped to the image afterwards"
)]
pub(crate) fn pixel(value: f64) -> i32 {
    value.floor() as i32
}

/// A linear channel in `[0, 1]` as an 8-bit value, rounded.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    reason = "clamped to 0..=255 first; NaN gives 0"
)]
pub(crate) fn byte(value: f32) -> u8 {
    (value * 255.0 + 0.5).clamp(0.0, 255.0) as u8
}
