//! What can go wrong with data.

/// A surfel or node array holds something that cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfelError {
    /// A surfel's position, normal or area is not finite, its normal is zero or its area is not
    /// positive.
    #[error(
        "surfel {surfel} is not drawable: position, normal and area must be finite, the normal not \
         zero and the area positive"
    )]
    BadSurfel {
        /// Index of the first such surfel.
        surfel: usize,
    },
    /// A node's rest position is not finite.
    #[error("node {node} has a rest position that is not finite")]
    BadNode {
        /// Index of the first such node.
        node: usize,
    },
    /// There is no node to carry the surfels.
    #[error("no nodes to carry {surfels} surfels; pass at least one node")]
    NoNodes {
        /// Number of surfels that wanted a node.
        surfels: usize,
    },
    /// A vertex of a cut triangle is not finite.
    #[error("triangle {triangle} of the cut has a vertex that is not finite")]
    BadTriangle {
        /// Index into the triangles passed.
        triangle: usize,
    },
}

/// An image could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The encoder refused or the writer failed.
    #[error("cannot write the image: {source}")]
    Encode {
        /// The encoder's account.
        #[from]
        source: png::EncodingError,
    },
    /// The file is no image, or is damaged.
    #[error("cannot read the image: {source}")]
    Decode {
        /// The decoder's account.
        #[from]
        source: png::DecodingError,
    },
    /// The file cannot be opened.
    #[error("cannot read the image: {source}")]
    Open {
        /// The system's account.
        #[from]
        source: std::io::Error,
    },
    /// The image has another form of pixels.
    #[error("the image has pixels of {color:?} with {depth:?} bits, not RGBA with eight")]
    Pixels {
        /// Channels.
        color: png::ColorType,
        /// Bits of a channel.
        depth: png::BitDepth,
    },
    /// A frame of an animation has another size than the first.
    #[error("frame {frame} is {width}x{height}, the animation is {first_width}x{first_height}")]
    FrameSize {
        /// Index of the frame.
        frame: u32,
        /// Its width (px).
        width: u32,
        /// Its height (px).
        height: u32,
        /// Width of the animation (px).
        first_width: u32,
        /// Height of the animation (px).
        first_height: u32,
    },
    /// More frames were added than announced, or fewer when finishing.
    #[error("{added} frames added, {announced} announced")]
    FrameCount {
        /// Frames added.
        added: u32,
        /// Frames announced.
        announced: u32,
    },
}
