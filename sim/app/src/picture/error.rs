//! Why bodies cannot be drawn.

use std::path::PathBuf;

use phyxel_discretize::{ReadError, SampleError};
use phyxel_mls::CloudError;
use phyxel_splat::{ImageError, SurfelError};

use phyxel::MemoryShortage;
use phyxel::scene::SurfelSettings;

/// What is wrong with the surface of one body.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SkinProblem {
    /// A mesh file or one of points cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The surface cannot be sampled.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// No neighbours can be looked for among the points of a file.
    #[error(transparent)]
    Cloud(#[from] CloudError),
    /// The surface cannot be bound to the nodes.
    #[error(transparent)]
    Surfel(#[from] SurfelError),
    /// A file's points are not on the body's surface.
    #[error(
        "{}: its points lie {distance:.2e} m from the body's surface in the mean, more than its nodes \
         lie apart ({spacing:.2e} m); look at surfels.points.scale and .up",
        file.display()
    )]
    FarPoints {
        /// The point file.
        file: PathBuf,
        /// Mean distance (m) of its points from the surface.
        distance: f64,
        /// Distance (m) of the body's nodes.
        spacing: f64,
    },
    /// Surfels of a density are more than a body may have.
    #[error(
        "surfels.{key}: {density:?} /m^2 makes {count:.2e} surfels on the body's {area:.2e} m^2; the limit is {:.0e}: \
         take {:.1e} or less",
        f64::from(SurfelSettings::MOST),
        f64::from(SurfelSettings::MOST) / area
    )]
    TooManySurfels {
        /// The key of the density.
        key: &'static str,
        /// The density (1/m²).
        density: f64,
        /// Area (m²) of the body's surface.
        area: f64,
        /// Surfels that it makes.
        count: f64,
    },
    /// The surfels take more memory than there is.
    #[error("surfels: {0}; ask for fewer")]
    Memory(#[from] MemoryShortage),
    /// An image for the surface cannot be read.
    #[error("{}: {source}", file.display())]
    Image {
        /// The image file.
        file: PathBuf,
        /// What is wrong with it.
        source: ImageError,
    },
    /// The texture coordinates or materials of a mesh file cannot be read.
    #[error("{}: texture coordinates or materials: {source}", file.display())]
    Texture {
        /// The mesh file.
        file: PathBuf,
        /// What is wrong with it.
        source: tobj::LoadError,
    },
    /// No face of this mesh file has texture coordinates and an image.
    #[error(
        "{}: no face has texture coordinates and an image: take surfels.image, or an OBJ file with `vt` whose \
         materials have `map_Kd`",
        .0.display()
    )]
    NoTexture(PathBuf),
}

impl SkinProblem {
    /// The same with the body's name.
    pub(super) fn named(self, body: &str) -> PictureError {
        PictureError::Body {
            body: body.to_owned(),
            problem: self,
        }
    }
}

/// A world that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The surface of a body is at fault.
    #[error("body '{body}': {problem}")]
    Body {
        /// Name of the body.
        body: String,
        /// What went wrong.
        problem: SkinProblem,
    },
    /// A frame takes more memory than there is.
    #[error("pictures: {0}; take a smaller frame or fewer samples")]
    Memory(#[from] MemoryShortage),
    /// The file of a rigid surface cannot be read.
    #[error(transparent)]
    Mesh(#[from] ReadError),
}
