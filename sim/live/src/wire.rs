//! Numbers to bytes and back: little endian, nothing padded but where said.

use glam::DVec3;

/// A message in the making: kind, length of the fixed part, epoch, then what is put.
#[derive(Debug)]
pub(crate) struct Writer {
    bytes: Vec<u8>,
}

/// Bytes of the header that every binary message begins with.
pub(crate) const HEADER: usize = 8;

impl Writer {
    /// Starts a message of `kind`, with room for `capacity` bytes after its header.
    pub(crate) fn new(kind: u16, epoch: u32, capacity: usize) -> Self {
        let mut bytes = Vec::with_capacity(HEADER + capacity);
        bytes.extend(kind.to_le_bytes());
        bytes.extend([0; 2]);
        bytes.extend(epoch.to_le_bytes());
        Self { bytes }
    }

    /// Ends the fixed part: arrays follow.
    pub(crate) fn end_head(&mut self) {
        let head = u16::try_from(self.bytes.len()).unwrap_or(u16::MAX);
        self.bytes[2..4].copy_from_slice(&head.to_le_bytes());
    }

    pub(crate) fn u32(&mut self, value: u32) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn count(&mut self, value: usize) {
        self.u32(u32::try_from(value).unwrap_or(u32::MAX));
    }

    pub(crate) fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn f64(&mut self, value: f64) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(crate) fn f32s(&mut self, values: impl IntoIterator<Item = f32>) {
        for value in values {
            self.bytes.extend(value.to_le_bytes());
        }
    }

    /// As [`Writer::f32s`], from numbers of double precision.
    pub(crate) fn singles(&mut self, values: impl IntoIterator<Item = f64>) {
        self.f32s(values.into_iter().map(single));
    }

    /// Three numbers of single precision each.
    pub(crate) fn points(&mut self, points: &[DVec3]) {
        self.singles(points.iter().flat_map(DVec3::to_array));
    }

    /// Half precision (IEEE 754 binary16).
    pub(crate) fn halves(&mut self, values: impl IntoIterator<Item = f64>) {
        for value in values {
            self.bytes.extend(half(single(value)).to_le_bytes());
        }
    }

    /// Zeros up to the next multiple of four bytes.
    pub(crate) fn align(&mut self) {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
    }

    pub(crate) fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// The nearest number of single precision.
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding is what is asked for"
)]
pub(crate) const fn single(value: f64) -> f32 {
    value as f32
}

/// Bits of the nearest half-precision number, ties to even; what is too large becomes infinite.
pub(crate) fn half(value: f32) -> u16 {
    let bits = value.to_bits();
    let sign = (bits >> 16) as u16 & 0x8000;
    let size = bits & 0x7fff_ffff;
    if size > 0x7f80_0000 {
        return sign | 0x7e00;
    }
    // 65520 and more round to infinity.
    if size >= 0x477f_f000 {
        return sign | 0x7c00;
    }
    // Below the smallest normal half, 2^-14, steps are 2^-24 wide.
    let rounded = if size < 0x3880_0000 {
        let steps = f32::from_bits(size) * 16_777_216.0;
        #[allow(clippy::cast_possible_truncation, reason = "between 0 and 1024")]
        let steps = steps.round_ties_even() as u32;
        steps
    } else {
        let even = size >> 13 & 1;
        (size - 0x3800_0000 + 0xfff + even) >> 13
    };
    #[allow(clippy::cast_possible_truncation, reason = "at most 0x7c00")]
    let rounded = rounded as u16;
    sign | rounded
}

/// Bytes of a message that someone sent: every read says whether there was enough.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(crate) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.bytes.split_first_chunk::<N>()?;
        self.bytes = rest;
        Some(*first)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// Finite numbers.
    pub(crate) fn finite<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f64::from_le_bytes(self.take()?);
        }
        values
            .iter()
            .all(|value| value.is_finite())
            .then_some(values)
    }

    pub(crate) fn rest(self) -> &'a [u8] {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::half;
    use proptest::prelude::*;

    /// The value of a half by its definition.
    fn value(bits: u16) -> f64 {
        let (exponent, part) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
        let size = match exponent {
            0 => part * 2_f64.powi(-24),
            31 => f64::INFINITY,
            _ => (1.0 + part / 1024.0) * 2_f64.powi(exponent - 15),
        };
        if bits & 0x8000 == 0 { size } else { -size }
    }

    #[test]
    fn every_half_is_its_own_nearest() {
        for bits in 0..=u16::MAX {
            let exact = value(bits);
            if bits & 0x7c00 != 0x7c00 {
                assert_eq!(half(super::single(exact)), bits, "{exact}");
            }
        }
        assert_eq!(half(f32::INFINITY), 0x7c00);
        assert_eq!(half(-1e30), 0xfc00);
        assert_eq!(half(f32::NAN) & 0x7fff, 0x7e00);
    }

    proptest! {
        #[test]
        fn halves_are_the_nearest(x in -70000.0_f32..70000.0, small in -1e-4_f32..1e-4) {
            for x in [x, small] {
                let bits = half(x);
                let found = value(bits);
                if found.is_finite() {
                    let error = (found - f64::from(x)).abs();
                    for other in [bits.wrapping_sub(1), bits.wrapping_add(1)] {
                        let aside = value(other);
                        prop_assert!(
                            !aside.is_finite() || error <= (aside - f64::from(x)).abs(),
                            "{x}: {found} but {aside} is nearer"
                        );
                    }
                } else {
                    prop_assert!(x.abs() >= 65520.0);
                }
            }
        }
    }
}
