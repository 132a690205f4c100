//! Colour by a scalar, and the bar that explains it.

use crate::cast::{byte, single, whole};
use crate::render::{Frame, linear};
use glam::Vec3;

/// Dark blue over green to yellow, even in lightness: readable in grey and by colour-blind eyes.
/// sRGB, five stops.
const STOPS: [Vec3; 5] = [
    Vec3::new(0.267, 0.005, 0.329),
    Vec3::new(0.230, 0.322, 0.545),
    Vec3::new(0.128, 0.567, 0.551),
    Vec3::new(0.369, 0.789, 0.383),
    Vec3::new(0.993, 0.906, 0.144),
];

/// A range of values and its colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColorScale {
    /// Value of the first colour.
    pub low: f64,
    /// Value of the last colour.
    pub high: f64,
}

impl ColorScale {
    /// The range of finite values; 0 to 1 if there are none.
    #[must_use]
    pub fn of(values: &[f64]) -> Self {
        let finite = values.iter().copied().filter(|v| v.is_finite());
        let low = finite.clone().fold(f64::INFINITY, f64::min);
        let high = finite.fold(f64::NEG_INFINITY, f64::max);
        if low <= high {
            Self { low, high }
        } else {
            Self {
                low: 0.0,
                high: 1.0,
            }
        }
    }

    /// sRGB colour of a value; values outside take the end colours, NaN a neutral grey.
    fn encoded(&self, value: f64) -> Vec3 {
        if value.is_nan() {
            return Vec3::splat(0.5);
        }
        let span = self.high - self.low;
        let at = if span > 0.0 {
            ((value - self.low) / span).clamp(0.0, 1.0)
        } else {
            0.5
        };
        let place = at * (STOPS.len() - 1) as f64;
        let k = whole(place).min(STOPS.len() - 2);
        STOPS[k].lerp(STOPS[k + 1], single(place - k as f64))
    }

    /// Linear colour of a value, for [`crate::SplatView::colors`].
    #[must_use]
    pub fn color(&self, value: f64) -> Vec3 {
        self.encoded(value).to_array().map(linear).into()
    }

    /// Linear colours of many values.
    #[must_use]
    pub fn colors(&self, values: &[f64]) -> Vec<Vec3> {
        values.iter().map(|&v| self.color(v)).collect()
    }
}

/// Glyphs of 3×5 dots, rows from the top, three bits each.
const GLYPHS: &str = "075557 126227 271747 371717 455711 574717 674757 771122 875757 975717 \
    A25755 B65656 C34443 D65556 E74647 F74644 G34553 H55755 I72227 J11152 K55655 L44447 M57755 \
    N65555 O25552 P65644 Q25563 R65655 S34216 T72222 U55557 V55522 W55775 X55255 Y55222 Z71247 \
    -00700 .00002 +02720 /11244 (12221 )42224 %51245 ^25000 ,00022 :02020 =07070";

/// Writing on finished frames.
#[derive(Debug)]
pub struct Overlay<'a> {
    frame: &'a mut Frame,
}

impl<'a> Overlay<'a> {
    /// Writes on `frame`.
    pub fn new(frame: &'a mut Frame) -> Self {
        Self { frame }
    }

    fn fill(&mut self, x: i64, y: i64, w: i64, h: i64, rgb: [u8; 3]) {
        for py in y.max(0)..(y + h).min(i64::from(self.frame.height)) {
            for px in x.max(0)..(x + w).min(i64::from(self.frame.width)) {
                let k = usize::try_from(py * i64::from(self.frame.width) + px).ok();
                if let Some(p) = k.and_then(|k| self.frame.pixels.get_mut(k)) {
                    *p = [rgb[0], rgb[1], rgb[2], 255];
                }
            }
        }
    }

    /// Writes text at (x, y), its upper left corner, in dots of `dot` pixels, light with a dark border so that it is
    /// read before anything; returns its width (px). Letters are upper case; characters without a glyph
    /// are blank.
    fn text(&mut self, x: i64, y: i64, dot: i64, text: &str) -> i64 {
        self.dots(x, y, dot, text, 1, [30, 34, 40]);
        self.dots(x, y, dot, text, 0, [235, 238, 240])
    }

    /// The dots of a text, each wider by a border (px) on every side.
    fn dots(&mut self, x: i64, y: i64, dot: i64, text: &str, border: i64, rgb: [u8; 3]) -> i64 {
        let mut at = x;
        let size = dot + 2 * border;
        for c in text.chars() {
            let c = c.to_ascii_uppercase();
            let rows = GLYPHS.split_whitespace().find_map(|g| g.strip_prefix(c));
            for (row, bits) in rows.unwrap_or("").chars().take(5).enumerate() {
                let bits = bits.to_digit(8).unwrap_or(0);
                for column in 0..3_i64 {
                    if bits >> (2 - column) & 1 == 1 {
                        let down = i64::try_from(row).unwrap_or(0) * dot;
                        let (left, top) = (at + column * dot - border, y + down - border);
                        self.fill(left, top, size, size, rgb);
                    }
                }
            }
            at += 4 * dot;
        }
        at - x
    }

    /// Draws a scale with its title and end values at the right border of the frame.
    pub fn legend(&mut self, scale: &ColorScale, title: &str) {
        let (w, h) = (i64::from(self.frame.width), i64::from(self.frame.height));
        let dot = ((h + 120) / 240).max(1);
        let length = i64::try_from(title.chars().count()).unwrap_or(0).max(9);
        let left = w - 4 * dot * (length + 2);
        let (top, bottom) = (h / 6, h - h / 6);
        for y in top..bottom {
            let at = single(f64::from(u32::try_from(bottom - y).unwrap_or(0)))
                / single(f64::from(u32::try_from(bottom - top).unwrap_or(1)));
            let value = scale.low + (scale.high - scale.low) * f64::from(at);
            let rgb = scale.encoded(value).to_array().map(byte);
            self.fill(left, y, 5 * dot, 1, rgb);
        }
        self.text(left, top - 16 * dot, dot, title);
        // What is nothing beside the other end is round-off.
        let size = scale.low.abs().max(scale.high.abs());
        let is_nothing = |value: f64| value.abs() < 1e-9 * size;
        let end = |value: f64| short(if is_nothing(value) { 0.0 } else { value });
        self.text(left, top - 8 * dot, dot, &end(scale.high));
        self.text(left, bottom + 3 * dot, dot, &end(scale.low));
    }
}

/// A number of three digits in at most nine characters.
fn short(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let decimals = [100.0, 10.0, 1.0, 0.1, 0.01]
        .iter()
        .position(|&least| size >= least);
    format!("{value:.*}", decimals.unwrap_or(5))
}

#[cfg(test)]
mod tests {
    #[test]
    fn ends_of_scales_have_three_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.002_345, "0.00234"),
            (-0.25, "-0.250"),
            (3.267_1, "3.27"),
            (47_123.4, "47123"),
            (-1.5e-12, "-1.50e-12"),
        ] {
            assert_eq!(super::short(value), text);
        }
    }
}
