//! What can go wrong with data.

use std::error::Error;

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
    /// Points nearest to a point whose normal is asked for coincide or lie on a line.
    #[error(
        "the points nearest to point {point} coincide or lie on a line, so it has no normal; drop \
         duplicates, or sample the surface more evenly"
    )]
    NoPlane {
        /// Index of the first such point.
        point: usize,
    },
    /// A list that has not one entry per point.
    #[error("{found} {what} for {points} points; give one per point")]
    Counts {
        /// Which list.
        what: &'static str,
        /// Number of its entries.
        found: usize,
        /// Number of points.
        points: usize,
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

/// Refuses a list that has not one entry per point.
pub(crate) fn one_per_point(
    what: &'static str,
    found: usize,
    points: usize,
) -> Result<(), SurfelError> {
    if found == points {
        return Ok(());
    }
    Err(SurfelError::Counts {
        what,
        found,
        points,
    })
}

impl From<png::EncodingError> for ImageError {
    fn from(error: png::EncodingError) -> Self {
        Self::Encode {
            source: error.into(),
        }
    }
}

impl From<png::DecodingError> for ImageError {
    fn from(error: png::DecodingError) -> Self {
        Self::Decode {
            source: error.into(),
        }
    }
}

/// An image could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The encoder refused or the writer failed.
    #[error("cannot write the image: {source}")]
    Encode {
        /// The encoder's account.
        source: Box<dyn Error + Send + Sync>,
    },
    /// The file is no image, or is damaged.
    #[error("cannot read the image: {source}")]
    Decode {
        /// The decoder's account.
        source: Box<dyn Error + Send + Sync>,
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
}
