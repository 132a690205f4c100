//! Scenes that the program brings along.

/// A scene inside the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Embedded {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for people.
    pub summary: &'static str,
    /// The scene file, comments included.
    pub text: &'static str,
}

/// Every embedded scene; the first is the one that runs when nothing is named.
pub const EMBEDDED: &[Embedded] = &[
    Embedded {
        name: "liver",
        summary: "a liver sags from its back, is cut in its right lobe and loses the tip of its left",
        text: include_str!("../../scenes/liver.ron"),
    },
    Embedded {
        name: "block",
        summary: "a hanging block is cut half through from one side, then from the other",
        text: include_str!("../../scenes/block.ron"),
    },
    Embedded {
        name: "press",
        summary: "a probe presses a liver from the front, slides along it and lets go",
        text: include_str!("../../scenes/press.ron"),
    },
    Embedded {
        name: "minimal",
        summary: "the least that shows something: a beam bends by its weight; start your own from it",
        text: include_str!("../../scenes/minimal.ron"),
    },
];

/// The embedded scene `name`.
pub(super) fn find(name: &str) -> Option<&'static Embedded> {
    EMBEDDED.iter().find(|scene| scene.name == name)
}
