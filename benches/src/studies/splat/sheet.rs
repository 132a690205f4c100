//! Pictures side by side.

use phyxel_splat::{Frame, Overlay};

/// Distance of captions from the border, and advance of a letter of dots of one pixel (pixels).
const MARGIN: i64 = 12;
const GLYPH: i64 = 4;

/// One picture of a sheet.
pub(crate) struct Panel {
    pub(crate) caption: String,
    pub(crate) frame: Frame,
}

impl Panel {
    pub(crate) fn new(caption: impl Into<String>, frame: Frame) -> Self {
        let caption = caption.into();
        Self { caption, frame }
    }
}

/// Places panels of one size in rows of `columns`, each under its caption.
pub(crate) fn sheet(panels: Vec<Panel>, columns: u32) -> Frame {
    let (width, height) = panels
        .first()
        .map_or((1, 1), |panel| (panel.frame.width, panel.frame.height));
    let count = u32::try_from(panels.len()).unwrap_or(u32::MAX);
    let mut sheet = Frame::blank(width * columns, height * count.div_ceil(columns).max(1));
    let longest = panels.iter().map(|panel| panel.caption.chars().count());
    let longest = longest
        .max()
        .and_then(|longest| i64::try_from(longest).ok());
    let needed = 2 * MARGIN + 2 * GLYPH * longest.unwrap_or(0);
    let dot = if needed <= i64::from(width) { 2 } else { 1 };
    for (k, mut panel) in (0..).zip(panels) {
        Overlay::new(&mut panel.frame).text(MARGIN, MARGIN, dot, &panel.caption);
        let (x, y) = (k % columns * width, k / columns * height);
        Overlay::new(&mut sheet).place(x, y, &panel.frame);
    }
    sheet
}
