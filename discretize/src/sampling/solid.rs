//! Bodies: shapes given by a function, and repaired meshes, behind one set of questions.

use std::fmt;
use std::sync::{Arc, OnceLock};

use glam::{DMat3, DVec3};

use crate::mesh::{Bounds, Hierarchy, Mesh};
use crate::sampling::{Measures, liver, measures_by_grid};

/// Shapes without a file, centred at the origin unless said otherwise (m).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Primitive {
    /// Axis-aligned box.
    Box {
        /// Half of each edge length.
        half_extents: DVec3,
    },
    /// Axis-aligned ellipsoid.
    Ellipsoid {
        /// Semi-axes.
        semi_axes: DVec3,
    },
    /// Cylinder with round ends along z.
    Capsule {
        /// Half the distance between the centres of the ends.
        half_length: f64,
        /// Radius.
        radius: f64,
    },
    /// Hollow cylinder along z with flat ends.
    Tube {
        /// Half the length.
        half_length: f64,
        /// Outer radius.
        outer_radius: f64,
        /// Inner radius.
        inner_radius: f64,
    },
    /// A liver of 1.2 litres, 17 cm wide: x to the patient's left, y to the head, z to the front.
    Liver,
}

impl Primitive {
    /// Level-set value: zero on the surface, negative inside. Exact signed distance for box,
    /// capsule and tube; for ellipsoid and liver only of the size of a distance near the surface.
    #[must_use]
    pub fn value(&self, p: DVec3) -> f64 {
        match *self {
            Self::Box { half_extents } => {
                let q = p.abs() - half_extents;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Ellipsoid { semi_axes } => {
                ((p / semi_axes).length() - 1.0) * semi_axes.min_element()
            }
            Self::Capsule {
                half_length,
                radius,
            } => {
                let z = p.z.clamp(-half_length, half_length);
                (p - DVec3::new(0.0, 0.0, z)).length() - radius
            }
            Self::Tube {
                half_length,
                outer_radius,
                inner_radius,
            } => {
                let middle = 0.5 * (outer_radius + inner_radius);
                let half_wall = 0.5 * (outer_radius - inner_radius);
                let radial = (p.truncate().length() - middle).abs() - half_wall;
                let axial = p.z.abs() - half_length;
                radial.max(0.0).hypot(axial.max(0.0)) + radial.max(axial).min(0.0)
            }
            Self::Liver => liver(p),
        }
    }

    /// Box around the shape.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let half = match *self {
            Self::Box { half_extents } => half_extents,
            Self::Ellipsoid { semi_axes } => semi_axes,
            Self::Capsule {
                half_length,
                radius,
            } => DVec3::new(radius, radius, half_length + radius),
            Self::Tube {
                half_length,
                outer_radius,
                ..
            } => DVec3::new(outer_radius, outer_radius, half_length),
            Self::Liver => DVec3::new(0.092, 0.078, 0.068),
        };
        Bounds::new(-half, half)
    }

    /// Extent of [`Primitive::Liver`] from right to left (m).
    pub const LIVER_WIDTH: f64 = 0.166;

    /// Volume (m³); of the liver to 1e-4 of it.
    #[must_use]
    pub fn volume(&self) -> f64 {
        use std::f64::consts::PI;
        match *self {
            Self::Box { half_extents } => 8.0 * half_extents.element_product(),
            Self::Ellipsoid { semi_axes } => 4.0 / 3.0 * PI * semi_axes.element_product(),
            Self::Capsule {
                half_length,
                radius,
            } => PI * radius * radius * (2.0 * half_length + 4.0 / 3.0 * radius),
            Self::Tube {
                half_length,
                outer_radius,
                inner_radius,
            } => {
                let section = outer_radius * outer_radius - inner_radius * inner_radius;
                PI * section * (2.0 * half_length)
            }
            // By quadrature over columns.
            Self::Liver => 1.2058e-3,
        }
    }
}

/// The function of an implicit body, negative inside.
pub type LevelSet = Arc<dyn Fn(DVec3) -> f64 + Send + Sync>;

/// A body that can be asked what is inside: a shape or a repaired mesh.
///
/// # Examples
/// ```
/// use phyxel_discretize::{Primitive, Solid, glam::DVec3};
///
/// let ball = Solid::from(Primitive::Ellipsoid { semi_axes: DVec3::ONE });
/// assert!(ball.contains(DVec3::X * 0.9) && !ball.contains(DVec3::X * 1.1));
/// assert!((ball.signed_distance(DVec3::X * 2.0) - 1.0).abs() < 1e-9);
/// ```
#[derive(Clone)]
pub struct Solid {
    kind: SolidKind,
    bounds: Bounds,
    /// The surface is the box itself: a lattice that fits it exactly is worth having.
    pub(crate) is_box: bool,
    /// Volume (m³) of a shape that has one in closed form.
    shape_volume: Option<f64>,
    /// Volume and area of an implicit body, once someone asks.
    grid_measures: OnceLock<Measures>,
    /// See [`Solid::parts`].
    pub(super) parts: OnceLock<(Vec<u32>, usize)>,
    /// The body before it was turned.
    pub(crate) upright: Option<Arc<Upright>>,
}

/// A body in the frame that its nodes are made in: a turned one is `rotation X + translation` of its points X.
#[derive(Debug)]
pub(crate) struct Upright {
    pub solid: Solid,
    pub rotation: DMat3,
    pub translation: DVec3,
}

#[derive(Clone)]
enum SolidKind {
    Implicit(LevelSet),
    Mesh(Arc<MeshBody>),
}

struct MeshBody {
    mesh: Mesh,
    hierarchy: Hierarchy,
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match &self.kind {
            SolidKind::Implicit(_) => "implicit".to_owned(),
            SolidKind::Mesh(body) => format!("mesh of {} triangles", body.mesh.triangles.len()),
        };
        f.debug_struct("Solid")
            .field("kind", &kind)
            .field("bounds", &self.bounds)
            .finish()
    }
}

impl From<Bounds> for Solid {
    /// An axis-aligned box; its lattice is stretched by a few percent to fit it exactly.
    fn from(bounds: Bounds) -> Self {
        let half_extents = 0.5 * bounds.size();
        let (shape, middle) = (Primitive::Box { half_extents }, bounds.center());
        Self {
            is_box: true,
            shape_volume: Some(bounds.size().element_product()),
            ..Self::implicit(bounds, move |p| shape.value(p - middle))
        }
    }
}

impl From<Primitive> for Solid {
    fn from(shape: Primitive) -> Self {
        match shape {
            Primitive::Box { .. } => Self::from(shape.bounds()),
            _ => Self {
                shape_volume: Some(shape.volume()),
                ..Self::implicit(shape.bounds(), move |p| shape.value(p))
            },
        }
    }
}

impl Solid {
    /// A shape scaled, then turned, then moved: the body of the points `scale (rotation X) + translation` of
    /// its own X, sampled along the axes of the result.
    pub(crate) fn placed(
        shape: Primitive,
        rotation: DMat3,
        scale: f64,
        translation: DVec3,
    ) -> Self {
        let corners = shape.bounds().corners();
        let corners = corners.map(|corner| rotation * corner * scale + translation);
        let back = rotation.transpose();
        let function = move |p| scale * shape.value(back * (p - translation) / scale);
        Self {
            shape_volume: Some(shape.volume() * scale.powi(3)),
            ..Self::implicit(Bounds::of(corners), function)
        }
    }

    /// The body of the points `rotation X + translation` of this body's points X. Its nodes are this body's, so turned
    /// and moved: it is sampled here and then placed, and keeps volumes, tetrahedra and their order bitwise.
    ///
    /// # Arguments
    /// * `rotation` -- orthogonal, of determinant 1.
    /// * `translation` -- (m).
    ///
    /// # Examples
    /// ```
    /// use phyxel_discretize::glam::{DMat3, DVec3};
    /// use phyxel_discretize::{Primitive, SampleSettings, Solid, sample_tetrahedra};
    ///
    /// let half_extents = DVec3::new(0.05, 0.02, 0.01);
    /// let block = Solid::from(Primitive::Box { half_extents });
    /// let turned = block.turned(DMat3::from_rotation_z(0.6), DVec3::ZERO);
    /// let nodes = sample_tetrahedra(&turned, &SampleSettings::nodes(500))?;
    /// assert!((nodes.report.volume - 8e-5).abs() < 1e-15); // fitted to its faces
    /// # Ok::<(), phyxel_discretize::SampleError>(())
    /// ```
    #[must_use]
    pub fn turned(self, rotation: DMat3, translation: DVec3) -> Self {
        let place = move |p: DVec3| rotation * p + translation;
        let moved = match &self.kind {
            SolidKind::Mesh(body) => {
                let mut mesh = body.mesh.clone();
                mesh.vertices.iter_mut().for_each(|v| *v = place(*v));
                Self::from_mesh(mesh)
            }
            SolidKind::Implicit(function) => {
                let (function, back) = (function.clone(), rotation.transpose());
                let bounds = Bounds::of(self.bounds.corners().map(place));
                Self {
                    shape_volume: self.shape_volume,
                    ..Self::implicit(bounds, move |p| function(back * (p - translation)))
                }
            }
        };
        let upright = Upright {
            solid: self,
            rotation,
            translation,
        };
        Self {
            upright: Some(Arc::new(upright)),
            ..moved
        }
    }

    /// Volume (m³): of the surface, or of a [`Primitive`]; `None` where a function alone gives the body.
    #[must_use]
    pub fn volume(&self) -> Option<f64> {
        match &self.kind {
            SolidKind::Mesh(body) => Some(body.mesh.volume()),
            SolidKind::Implicit(_) => self.shape_volume,
        }
    }

    /// Body where `function` is negative; `bounds` must contain it.
    #[must_use]
    pub fn implicit(
        bounds: Bounds,
        function: impl Fn(DVec3) -> f64 + Send + Sync + 'static,
    ) -> Self {
        Self::new(SolidKind::Implicit(Arc::new(function)), bounds)
    }

    /// Body inside a surface: winding number above one half. Repair the mesh first
    /// ([`crate::repair()`]).
    ///
    /// # Panics
    /// If a triangle names a vertex out of range.
    #[must_use]
    pub fn from_mesh(mesh: Mesh) -> Self {
        let (bounds, hierarchy) = (mesh.bounds(), Hierarchy::new(&mesh));
        Self::new(
            SolidKind::Mesh(Arc::new(MeshBody { mesh, hierarchy })),
            bounds,
        )
    }

    fn new(kind: SolidKind, bounds: Bounds) -> Self {
        Self {
            kind,
            bounds,
            is_box: false,
            shape_volume: None,
            grid_measures: OnceLock::new(),
            parts: OnceLock::new(),
            upright: None,
        }
    }

    fn mesh_body(&self) -> Option<&MeshBody> {
        match &self.kind {
            SolidKind::Implicit(_) => None,
            SolidKind::Mesh(body) => Some(body),
        }
    }

    /// Box around the body.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The surface the body was made from; `None` for an implicit one
    /// (see [`crate::surface_mesh`]).
    #[must_use]
    pub fn mesh(&self) -> Option<&Mesh> {
        self.mesh_body().map(|body| &body.mesh)
    }

    /// The hierarchy over [`Solid::mesh`].
    #[must_use]
    pub fn hierarchy(&self) -> Option<&Hierarchy> {
        self.mesh_body().map(|body| &body.hierarchy)
    }

    /// Volume and area: those of the surface, or of a grid's points in an implicit body's box.
    pub(crate) fn measures(&self) -> Measures {
        match &self.kind {
            SolidKind::Mesh(body) => Measures {
                volume: body.mesh.volume(),
                area: body.mesh.area(),
            },
            SolidKind::Implicit(_) if self.is_box => {
                let size = self.bounds.size();
                Measures {
                    volume: size.element_product(),
                    area: 2.0 * size.dot(DVec3::new(size.y, size.z, size.x)),
                }
            }
            SolidKind::Implicit(_) => self.grid_measures(),
        }
    }

    /// Volume and area by a grid's points in the box, computed once.
    pub(crate) fn grid_measures(&self) -> Measures {
        // A look at a mesh of parts that overlap sums them all: 1e5 looks at 8,000 triangles take 15 s, these take 2.
        let grid = if self.mesh().is_some() { 24 } else { 48 };
        let measure = || measures_by_grid(self.bounds, grid, |p| self.contains(p));
        *self.grid_measures.get_or_init(measure)
    }

    /// Whether `p` is inside.
    #[must_use]
    pub fn contains(&self, p: DVec3) -> bool {
        match &self.kind {
            SolidKind::Implicit(function) => function(p) < 0.0,
            SolidKind::Mesh(body) => body.hierarchy.winding_number(p) > 0.5,
        }
    }

    /// Whether a point is inside or not farther than `tolerance` (m) outside of the surface, by
    /// [`Solid::signed_distance`].
    #[must_use]
    pub fn contains_within(&self, p: DVec3, tolerance: f64) -> bool {
        self.contains(p) || self.signed_distance(p) <= tolerance
    }

    /// Distance to the surface, negative inside. For implicit bodies the function's value, which
    /// is a distance only if the function is one.
    #[must_use]
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        match &self.kind {
            SolidKind::Implicit(function) => function(p),
            SolidKind::Mesh(body) => {
                let closest = body.hierarchy.closest(p);
                let distance = closest.map_or(f64::INFINITY, |c| c.distance_squared.sqrt());
                if self.contains(p) {
                    -distance
                } else {
                    distance
                }
            }
        }
    }

    /// Outward unit normal at a surface point: the function's gradient by central differences
    /// (step 1e-5 of the box's diagonal, error of its square), or the normal of the closest
    /// triangle. Zero where the gradient vanishes.
    #[must_use]
    pub fn normal(&self, p: DVec3) -> DVec3 {
        match &self.kind {
            SolidKind::Implicit(_) => self.gradient(p).normalize_or_zero(),
            SolidKind::Mesh(body) => body.hierarchy.closest(p).map_or(DVec3::ZERO, |c| {
                let vector = body.mesh.area_vector(c.triangle as usize);
                vector.normalize_or_zero()
            }),
        }
    }

    /// Moves a point near the surface onto it: Newton along the gradient for implicit bodies, the
    /// closest point for meshes.
    #[must_use]
    pub fn project(&self, p: DVec3) -> DVec3 {
        match &self.kind {
            SolidKind::Implicit(function) => {
                let mut at = p;
                for _ in 0..6 {
                    let value = function(at);
                    let gradient = self.gradient(at);
                    let slope_squared = gradient.length_squared();
                    if value == 0.0 || slope_squared == 0.0 {
                        break;
                    }
                    let step = gradient * (value / slope_squared);
                    at -= step;
                    if step.length() < 1e-14 * self.bounds.diagonal() {
                        break;
                    }
                }
                at
            }
            SolidKind::Mesh(body) => body.hierarchy.closest(p).map_or(p, |c| c.point),
        }
    }

    /// Gradient of the implicit function by central differences; zero for meshes.
    fn gradient(&self, p: DVec3) -> DVec3 {
        let SolidKind::Implicit(function) = &self.kind else {
            return DVec3::ZERO;
        };
        let step = 1e-5 * self.bounds.diagonal();
        let along = |axis: DVec3| function(p + step * axis) - function(p - step * axis);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * step)
    }
}
