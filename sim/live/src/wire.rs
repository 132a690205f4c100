//! Numbers to bytes and back: little endian, nothing padded but where said.

use glam::DVec3;
use half::f16;

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
            self.bytes
                .extend(f16::from_f32(single(value)).to_le_bytes());
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
        let all = values.iter().all(|value| value.is_finite());
        all.then_some(values)
    }

    pub(crate) const fn rest(&self) -> &'a [u8] {
        self.bytes
    }
}
