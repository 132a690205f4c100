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
    /// Not one normal per point.
    #[error("{normals} normals for {positions} points; give one per point")]
    Counts {
        /// Number of points.
        positions: usize,
        /// Number of normals.
        normals: usize,
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

/// What the reader or writer of image files says; it shows as its text.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct CodecError(Codec);

#[derive(Debug, thiserror::Error)]
enum Codec {
    #[error(transparent)]
    Encoding(#[from] png::EncodingError),
    #[error(transparent)]
    Decoding(#[from] png::DecodingError),
}

impl From<png::EncodingError> for ImageError {
    fn from(error: png::EncodingError) -> Self {
        let source = CodecError(error.into());
        Self::Encode { source }
    }
}

impl From<png::DecodingError> for ImageError {
    fn from(error: png::DecodingError) -> Self {
        let source = CodecError(error.into());
        Self::Decode { source }
    }
}

/// An image could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The encoder refused or the writer failed.
    #[error("cannot write the image: {source}")]
    Encode {
        /// The encoder's account.
        source: CodecError,
    },
    /// The file is no image, or is damaged.
    #[error("cannot read the image: {source}")]
    Decode {
        /// The decoder's account.
        source: CodecError,
    },
    /// The file is a JPEG.
    #[error("it is a JPEG, and only PNG is read: convert it")]
    Jpeg,
    /// The file cannot be opened.
    #[error("cannot read the image: {source}")]
    Open {
        /// The system's account.
        #[from]
        source: std::io::Error,
    },
    /// The image has another form of pixels.
    #[error("the image has {channels} channels of {bits} bits, not four (RGBA) of eight")]
    Pixels {
        /// Channels of a pixel.
        channels: usize,
        /// Bits of a channel.
        bits: u8,
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
