//! Numbers that look random and are the same on every machine.

use glam::DVec3;

/// A number from -1 to 1 (the splitting generator of Steele 2014); any `state` will do.
pub(crate) fn noise(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut bits = *state;
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    #[allow(clippy::cast_precision_loss, reason = "53 bits fit")]
    let unit = (bits >> 11) as f64 / (1_u64 << 53) as f64;
    2.0 * unit - 1.0
}

/// A vector with each coordinate from `-size` to `size`.
pub(crate) fn noisy(state: &mut u64, size: f64) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| size * noise(state)))
}
