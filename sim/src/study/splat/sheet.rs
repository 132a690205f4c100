//! Pictures side by side.

use phyxel_splat::{Frame, Overlay};

/// One picture of a sheet.
pub(super) struct Panel {
    pub(super) caption: String,
    pub(super) frame: Frame,
}

impl Panel {
    pub(super) fn new(caption: impl Into<String>, frame: Frame) -> Self {
        let caption = caption.into();
        Self { caption, frame }
    }
}

/// Places panels of one size in rows of `columns`, each under its caption.
pub(super) fn sheet(panels: Vec<Panel>, columns: u32) -> Frame {
    let (width, height) = panels
        .first()
        .map_or((1, 1), |panel| (panel.frame.width, panel.frame.height));
    let count = u32::try_from(panels.len()).unwrap_or(u32::MAX);
    let mut sheet = Frame::blank(width * columns, height * count.div_ceil(columns).max(1));
    for (k, mut panel) in (0..).zip(panels) {
        Overlay::new(&mut panel.frame).text(12, 12, 2, &panel.caption);
        let (x, y) = (k % columns * width, k / columns * height);
        Overlay::new(&mut sheet).place(x, y, &panel.frame);
    }
    sheet
}
