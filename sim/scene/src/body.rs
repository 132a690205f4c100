//! Bodies: shape, sampling, and what is asked of their model; surfels.

use std::path::PathBuf;

use glam::{DMat3, DVec3};
use phyxel_discretize::{Axis, Placement, Refinement, Shape, path_text};
use phyxel_elastic::MaterialSettings;
use phyxel_enrich::CutRule;
use phyxel_splat::{InsideTest, RadiusRule, WeightLaw};
use serde::{Deserialize, Serialize};

use super::material::Inclusion;
use super::method::Method;
use super::path::{one, turn};

/// A deformable body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name by which supports and cuts refer to the body; unique in the scene.
    #[serde(default = "Body::default_name")]
    pub name: String,
    /// What the body occupies at rest.
    pub shape: Shape,
    /// Translation (m) of the shape in the rest frame.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub position: DVec3,
    /// Rotation vector (degrees) of the shape about its own origin: direction is the axis, length the angle;
    /// applied before the translation.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub rotation: DVec3,
    /// Size of the body over that which its shape says; applied before rotation and translation.
    #[serde(default = "one")]
    pub scale: f64,
    /// Velocity (m/s) with which its nodes begin at scene time 0.
    #[serde(default)]
    #[cfg_attr(feature = "schemars", schemars(with = "[f64; 3]"))]
    pub velocity: DVec3,
    /// How finely the body is filled with nodes.
    #[serde(default)]
    pub sampling: Sampling,
    /// What the body is made of.
    #[serde(default)]
    pub material: MaterialSettings,
    /// Parts of another stiffness, such as a tumour; the last one that holds a node counts.
    #[serde(default)]
    pub inclusions: Vec<Inclusion>,
    /// How nodes are coupled: neighbours, gradients, volumes.
    #[serde(default)]
    pub method: Method,
    /// How a cut weakens the pairs it crosses.
    #[serde(default)]
    pub cut_rule: CutRule,
    /// Mass-proportional damping (1/s): a free motion loses its speed as `exp(-damping t)`.
    #[serde(default = "Body::default_damping")]
    pub damping: f64,
    /// Viscous (stiffness-proportional) damping of the body's stiffest mode, as a fraction of its
    /// critical damping; a mode of half its frequency has half of it. 0.1 quietens the few nodes at
    /// a wound's rim, which long steps would otherwise excite; 0 computes none.
    #[serde(default)]
    pub damping_ratio: f64,
    /// Surface points that are drawn; used only by a scene with pictures.
    #[serde(default)]
    pub surfels: SurfelSettings,
}

impl Body {
    /// A body of `shape` with everything else at its default.
    #[must_use]
    pub fn new(shape: Shape) -> Self {
        Self {
            name: Self::default_name(),
            shape,
            position: DVec3::ZERO,
            rotation: DVec3::ZERO,
            scale: 1.0,
            velocity: DVec3::ZERO,
            sampling: Sampling::default(),
            material: MaterialSettings::default(),
            inclusions: Vec::new(),
            method: Method::default(),
            cut_rule: CutRule::default(),
            damping: Self::default_damping(),
            damping_ratio: 0.0,
            surfels: SurfelSettings::default(),
        }
    }

    fn default_name() -> String {
        "body".to_owned()
    }

    /// Volume (m^3), roughly, of a shape that needs no file; only for estimates of node counts.
    #[must_use]
    pub fn rough_volume(&self) -> Option<f64> {
        let (primitive, own) = self.shape.primitive()?;
        Some(primitive.volume() * (self.scale * own.scale).powi(3))
    }

    /// Where its shape lies.
    #[must_use]
    pub fn placement(&self) -> Placement {
        Placement {
            scale: self.scale,
            turn: DMat3::from_quat(turn(self.rotation)),
            position: self.position,
        }
    }

    const fn default_damping() -> f64 {
        2.0
    }
}

/// How finely a body is filled with nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Sampling {
    /// What is asked for: a distance between nodes, a number of nodes, or a lattice of them.
    pub target: Target,
    /// Most nodes that the body may have; a sampling that would make more is refused.
    pub limit: u32,
    /// Largest distance between nodes inside over that at the surface, 1 to 32.
    pub coarsest: f64,
    /// Places with more nodes, such as where a tool touches or a blade passes.
    pub refine: Vec<Refinement>,
    /// Where nodes come from.
    pub form: Form,
}

/// Where the nodes of a body come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Form {
    /// Vertices of tetrahedra that fill the body; those that share an edge are neighbours.
    #[default]
    Tetrahedra,
    /// Points without tetrahedra: centres of the cells of a lattice (an octree where the distance
    /// varies) and points of the surface; the nearest are neighbours.
    Points,
}

impl Default for Sampling {
    fn default() -> Self {
        Self {
            target: Target::Nodes(6_000),
            limit: 200_000,
            coarsest: 1.0,
            refine: Vec::new(),
            form: Form::default(),
        }
    }
}

/// The fineness that a sampling aims at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum Target {
    /// Distance between neighbouring nodes (m).
    Spacing(f64),
    /// Number of nodes, met approximately.
    Nodes(u32),
    /// Nodes along x, y and z of a `Box`, its faces included, each cell six tetrahedra: as in Aras 2014,
    /// chapter 6.
    Lattice(u32, u32, u32),
}

/// Surface points of a body and their colours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct SurfelSettings {
    /// How many surfels cover the body's surface; ignored with `points`.
    pub target: SurfelTarget,
    /// Surfels from a file, such as a scan of the body, instead of those that are spread on its shape.
    pub points: Option<PointFile>,
    /// How far the surfels of the surface lie from each other; ignored with `points`.
    pub spacing: SurfelSpacing,
    /// Surfels per square metre (1/m^2) on each side of a cut; that of the surface where not given.
    pub cut_density: Option<f64>,
    /// Most nodes that carry a surfel.
    pub nodes: u32,
    /// How their weights fall with the distance.
    pub weights: WeightLaw,
    /// Distance (m) at rest by which the two sides of a cut are held apart.
    pub opening: f64,
    /// Radii of the surfels on the surface.
    pub radius: RadiusRule,
    /// Whether surfels are clipped where a cut passes and at sharp edges.
    pub clip: bool,
    /// How it is decided which samples of a cut lie in the body and become surfels.
    pub inside: InsideTest,
    /// Colour of the surface (sRGB, 0 to 1).
    pub color: [f64; 3],
    /// Colour of the inside that a cut lays open (sRGB, 0 to 1).
    pub cut_color: [f64; 3],
    /// Image that colours the surface instead of `color`.
    pub image: Option<ImageFile>,
    /// Whether the images that the body's mesh file names colour the surface, by the texture coordinates in it, in
    /// place of `color` and `image`: of an OBJ file, those of its `.mtl` beside it (`map_Kd`); PNG.
    pub textured: bool,
    /// Image that colours the inside instead of `cut_color`.
    pub cut_image: Option<ImageFile>,
}

/// Points with normals on a body's surface, without triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PointFile {
    /// PLY file, or text with `x y z nx ny nz` in each line; a relative path starts at the scene file's folder.
    #[serde(with = "path_text")]
    #[cfg_attr(feature = "schemars", schemars(with = "String"))]
    pub file: PathBuf,
    /// Metres per unit of the file.
    #[serde(default = "one")]
    pub scale: f64,
    /// Direction in the file that becomes up (+z) in the scene.
    #[serde(default)]
    pub up: Axis,
}

/// An image laid on a body from the six sides of a box, by the position at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, rename = "Image")]
pub struct ImageFile {
    /// PNG file; a relative path starts at the scene file's folder.
    #[serde(with = "path_text")]
    #[cfg_attr(feature = "schemars", schemars(with = "String"))]
    pub file: PathBuf,
    /// Width (m) of the image on the body; it repeats.
    pub size: f64,
}

impl SurfelSettings {
    /// Most surfels of a body's surface, and of its cuts.
    pub const MOST: u32 = 4_000_000;
}

impl Default for SurfelSettings {
    fn default() -> Self {
        Self {
            target: SurfelTarget::Shared(30_000),
            points: None,
            spacing: SurfelSpacing::default(),
            cut_density: None,
            nodes: 8,
            weights: WeightLaw::default(),
            opening: 0.0,
            radius: RadiusRule::default(),
            clip: true,
            inside: InsideTest::default(),
            color: [0.50, 0.16, 0.12],
            cut_color: [0.82, 0.36, 0.32],
            image: None,
            textured: false,
            cut_image: None,
        }
    }
}

/// How many surfels cover a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub enum SurfelTarget {
    /// This body's share of a number on all bodies that say so, by the square of its size: all of it if
    /// the body is the only one.
    Shared(u32),
    /// Number on the whole surface, met approximately.
    Count(u32),
    /// Number per square metre (1/m^2).
    Density(f64),
}

/// How far the surfels of a surface lie from each other.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub enum SurfelSpacing {
    /// Equally far everywhere.
    #[default]
    Even,
    /// Closer where the surface is more curved, as the cube root of the radius of curvature: depth and
    /// outline come out nearer to those of a surface whose curvature varies.
    Curvature {
        /// The widest spacing over the narrowest.
        #[serde(default = "SurfelSpacing::default_range")]
        range: f64,
    },
}

impl SurfelSpacing {
    const fn default_range() -> f64 {
        3.0
    }
}
