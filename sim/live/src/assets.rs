//! The page: a fixed table of files, all of them in the program.

/// A file of the page.
#[derive(Debug)]
pub(crate) struct Asset {
    pub(crate) path: &'static str,
    pub(crate) content_type: &'static str,
    pub(crate) content: &'static str,
}

macro_rules! script {
    ($name:literal) => {
        Asset {
            path: concat!("/", $name),
            content_type: "text/javascript; charset=utf-8",
            content: include_str!(concat!("../page/", $name)),
        }
    };
}

/// All that can be asked for.
pub(crate) const ASSETS: &[Asset] = &[
    Asset {
        path: "/",
        content_type: "text/html; charset=utf-8",
        content: include_str!("../page/index.html"),
    },
    Asset {
        path: "/style.css",
        content_type: "text/css; charset=utf-8",
        content: include_str!("../page/style.css"),
    },
    Asset {
        path: "/icon.svg",
        content_type: "image/svg+xml",
        content: include_str!("../page/icon.svg"),
    },
    script!("main.js"),
    script!("protocol.js"),
    script!("link.js"),
    script!("camera.js"),
    script!("body.js"),
    script!("renderer.js"),
    script!("shaders.js"),
    script!("tools.js"),
    script!("quality.js"),
    script!("hands.js"),
    script!("panel.js"),
    script!("plot.js"),
    script!("past.js"),
    script!("pad.js"),
];

/// The file at a path.
pub(crate) fn find(path: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|asset| asset.path == path)
}
