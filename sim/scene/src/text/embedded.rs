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

/// Scenes of files, by name; then bodies of the dissertation's chapter 6, each of the text of a body in a model: one
/// template, its parts put together.
macro_rules! embedded {
    ($($name:literal $summary:literal)+; $($part:literal $about:literal $body:literal $model:literal)+) => {
        &[
            $(Embedded {
                name: $name,
                summary: $summary,
                text: include_str!(concat!("../../scenes/", $name, ".ron")),
            },)+
            $(Embedded {
                name: $part,
                summary: $about,
                text: concat!(
                    include_str!("../../scenes/chapter6/head.ron"),
                    "    name: \"",
                    $part,
                    "\",\n    description: \"",
                    $about,
                    "\",\n",
                    include_str!(concat!("../../scenes/chapter6/", $body, ".ron")),
                    include_str!(concat!("../../scenes/chapter6/", $model, ".ron")),
                    include_str!("../../scenes/chapter6/tail.ron"),
                ),
            },)+
        ]
    };
}

/// Every embedded scene; the first is the one that runs when nothing is named.
pub const EMBEDDED: &[Embedded] = embedded! {
    "liver" "a liver sags from its back, is cut in its right lobe and loses the tip of its left"
    "block" "a hanging block is cut half through from one side, then from the other"
    "press" "a probe presses a liver from the front, slides along it and lets go"
    "stack" "two soft pads fall onto a tray, one onto the other, and stay there"
    "wound" "a block is cut through; its wound is pressed shut, slides and is pulled open"
    "minimal" "the least that shows something: a beam bends by its weight; start your own from it";
    "block-1408" "the dissertation's block of 8 x 8 x 22 nodes hangs, is cut once and cut through"
        "block-1408" "ours"
    "block-436" "the dissertation's hierarchical block hangs, is cut once and cut through"
        "block-436" "ours"
    "liver-181" "a liver as coarse as the dissertation's hangs, is cut once and cut through"
        "liver-181" "ours"
    "block-1408-dissertation" "block-1408 in the dissertation's model"
        "block-1408" "dissertation"
    "block-436-dissertation" "block-436 in the dissertation's model"
        "block-436" "dissertation-unlimited"
    "liver-181-dissertation" "liver-181 in the dissertation's model"
        "liver-181" "dissertation-unlimited"
};
