//! Points of a body's surface that can touch a tool, bound to its nodes.

use glam::DVec3;

/// Why a surface cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A node index is too large.
    #[error("point or triangle {item} names node {node}, but there are {node_count}")]
    NoSuchNode {
        /// Index of the triangle, node entry or surfel.
        item: usize,
        /// The node it names.
        node: u32,
        /// How many nodes there are.
        node_count: usize,
    },
    /// A triangle has no area, or an area given is not positive and finite.
    #[error("point or triangle {item} has area {area} m², which must be positive and finite")]
    BadArea {
        /// Index of the triangle, node entry or surfel.
        item: usize,
        /// Its area (m²).
        area: f64,
    },
    /// Triangles are divided by 0.
    #[error("triangles divided by 0 have no points; divide by 1 at least")]
    NoDivisions,
    /// There is not one area per node.
    #[error("{areas} areas for {nodes} nodes; give one per node")]
    Areas {
        /// Number of areas.
        areas: usize,
        /// Number of nodes.
        nodes: usize,
    },
}

/// Quadrature points on the surface of a body. Points of one group hang on the same nodes.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactSurface {
    /// The body's nodes that points hang on, ascending; all else counts within this list.
    pub(crate) members: Vec<u32>,
    pub(crate) groups: Vec<Group>,
    pub(crate) nodes: Vec<u32>,
    pub(crate) areas: Vec<f64>,
    /// How far (m) the surface stands in front of each point.
    pub(crate) heights: Vec<f64>,
    /// The largest of them, at least 0.
    pub(crate) highest: f64,
    pub(crate) weights: Vec<f64>,
}

/// Ranges of one group in the surface's arrays; groups of alike points share their weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Group {
    pub(crate) nodes: [u32; 2],
    pub(crate) points: [u32; 2],
    pub(crate) weights: u32,
}

impl ContactSurface {
    /// Triangles with linear interpolation, each cut into `divisions²` equal ones with a point at the
    /// centre of each. 4 (16 points) is enough for contact radii of two spacings; 6 was used for the
    /// reference values.
    ///
    /// # Errors
    /// [`SurfaceError`] if a node is missing, a triangle has no area, or `divisions` is 0.
    pub fn from_triangles(
        triangles: &[[u32; 3]],
        rest_positions: &[DVec3],
        divisions: u32,
    ) -> Result<Self, SurfaceError> {
        if divisions == 0 {
            return Err(SurfaceError::NoDivisions);
        }
        let mut points = Vec::new();
        let n = f64::from(divisions);
        for i in 0..divisions {
            for j in 0..divisions - i {
                let (a, b) = (f64::from(i) / n, f64::from(j) / n);
                points.push((a + 1.0 / (3.0 * n), b + 1.0 / (3.0 * n)));
                if i + j + 1 < divisions {
                    points.push((a + 2.0 / (3.0 * n), b + 2.0 / (3.0 * n)));
                }
            }
        }
        let weights = points.iter().flat_map(|(s, t)| [1.0 - s - t, *s, *t]);
        let mut surface = Self {
            weights: weights.collect(),
            groups: Vec::with_capacity(triangles.len()),
            nodes: Vec::with_capacity(3 * triangles.len()),
            areas: Vec::with_capacity(points.len() * triangles.len()),
            ..Self::default()
        };
        for (item, triangle) in triangles.iter().enumerate() {
            check_nodes(item, triangle, rest_positions.len())?;
            let [a, b, c] = triangle.map(|node| rest_positions[node as usize]);
            let area = 0.5 * (b - a).cross(c - a).length();
            check_area(item, area)?;
            surface.push(triangle, 0, area / (n * n), points.len());
        }
        Ok(surface.numbered())
    }

    /// Lets the surface stand in front of its triangles: it touches where a tool is nearer than that.
    ///
    /// A tool that presses a curved surface touches it before it touches the triangles between nodes. Without heights a sphere of
    /// 6,000 nodes that a plane pushes in by a twentieth of its radius resists by 11 % too little.
    ///
    /// # Arguments
    /// * `bulges` -- how far (m) it stands in front of the middles of the edges ab, bc and ca of each triangle. A point with the
    ///   barycentric coordinates `w` has `4 (w_a w_b ab + w_b w_c bc + w_c w_a ca)`. Triangles beyond have none.
    #[must_use]
    pub fn raised(mut self, bulges: &[[f64; 3]]) -> Self {
        for (group, [ab, bc, ca]) in (0..self.group_count()).zip(bulges) {
            for point in self.points(group) {
                let mut weights = self.weights_of(group, point).map(|(_, weight)| weight);
                let [a, b, c] = std::array::from_fn(|_| weights.next().unwrap_or(0.0));
                let height = 4.0 * (a * b * ab + b * c * bc + c * a * ca);
                drop(weights);
                self.heights[point as usize] = height;
                self.highest = self.highest.max(height);
            }
        }
        self
    }

    /// The surface of a body that a cut may have torn. Triangles whose corners hang together are those of
    /// [`ContactSurface::from_triangles`], with their `bulges` ([`ContactSurface::raised`]). Each torn one has a third of its area
    /// at every corner, so that nothing spans a gap.
    ///
    /// # Arguments
    /// * `holds` -- whether two corners of a triangle hang together.
    ///
    /// # Errors
    /// As [`ContactSurface::from_triangles`].
    pub fn from_torn_triangles(
        (triangles, bulges): (&[[u32; 3]], &[[f64; 3]]),
        rest_positions: &[DVec3],
        divisions: u32,
        holds: impl Fn(u32, u32) -> bool,
    ) -> Result<Self, SurfaceError> {
        let bulges = bulges.iter().copied().chain(std::iter::repeat([0.0; 3]));
        let all = triangles.iter().copied().zip(bulges);
        let (whole, torn): (Vec<_>, Vec<_>) =
            all.partition(|&([a, b, c], _)| holds(a, b) && holds(b, c) && holds(c, a));
        let (whole, bulges): (Vec<_>, Vec<_>) = whole.into_iter().unzip();
        let surface = Self::from_triangles(&whole, rest_positions, divisions)?.raised(&bulges);
        if torn.is_empty() {
            return Ok(surface);
        }
        let mut areas = vec![0.0; rest_positions.len()];
        for (item, (triangle, _)) in torn.iter().enumerate() {
            check_nodes(item, triangle, rest_positions.len())?;
            let [a, b, c] = triangle.map(|node| rest_positions[node as usize]);
            for &node in triangle {
                areas[node as usize] += (b - a).cross(c - a).length() / 6.0;
            }
        }
        let (nodes, areas): (Vec<u32>, Vec<f64>) =
            (0_u32..).zip(areas).filter(|&(_, area)| area > 0.0).unzip();
        let corners = Self::from_nodes(&nodes, &areas, rest_positions.len())?;
        Ok(surface.joined(&corners))
    }

    /// Whether its indices lie within a body of so many nodes and its numbers are finite, as those of a
    /// surface read from a file may not.
    pub(crate) fn is_sound(&self, node_count: usize) -> bool {
        let below = |list: &[u32], end: usize| list.iter().all(|&index| (index as usize) < end);
        let mut points = 0;
        let groups = self.groups.iter().all(|group| {
            let [first, end] = group.nodes.map(|node| node as usize);
            let [begin, last] = group.points.map(|point| point as usize);
            let follows = begin == points && begin <= last && first <= end;
            points = last;
            follows
                && end <= self.nodes.len()
                && (last - begin)
                    .checked_mul(end - first)
                    .and_then(|weights| weights.checked_add(group.weights as usize))
                    .is_some_and(|weights| weights <= self.weights.len())
        });
        groups
            && points == self.areas.len()
            && points == self.heights.len()
            && self.highest >= 0.0
            && self.heights.iter().all(|height| *height <= self.highest)
            && below(&self.members, node_count)
            && below(&self.nodes, self.members.len())
            && self
                .areas
                .iter()
                .chain(&self.weights)
                .chain(&self.heights)
                .all(|x| x.is_finite())
    }

    /// Nodes with their tributary areas (m²): a third of the adjacent triangles' each. Softer than
    /// triangles by 3 to 17 % in force at some thousand nodes, and cheaper.
    ///
    /// # Errors
    /// [`SurfaceError`] if a node is missing, an area not positive, or there is not one area per entry.
    pub fn from_nodes(
        nodes: &[u32],
        areas: &[f64],
        node_count: usize,
    ) -> Result<Self, SurfaceError> {
        if areas.len() != nodes.len() {
            let (areas, nodes) = (areas.len(), nodes.len());
            return Err(SurfaceError::Areas { areas, nodes });
        }
        let mut surface = Self {
            weights: vec![1.0],
            ..Self::default()
        };
        for (item, (&node, &area)) in nodes.iter().zip(areas).enumerate() {
            check_nodes(item, &[node], node_count)?;
            check_area(item, area)?;
            surface.push(&[node], 0, area, 1);
        }
        Ok(surface.numbered())
    }

    /// Points of both surfaces of one body.
    #[must_use]
    pub fn joined(mut self, other: &Self) -> Self {
        for node in &mut self.nodes {
            *node = self.members[*node as usize];
        }
        let first = index(self.weights.len());
        self.weights.extend_from_slice(&other.weights);
        for group in 0..other.group_count() {
            let members = other.group_members(group).iter();
            let nodes: Vec<u32> = members.map(|m| other.members[*m as usize]).collect();
            let points = other.points(group);
            let weights = first + other.groups[group as usize].weights;
            let area = other.areas[points.start as usize];
            self.push(&nodes, weights, area, points.len());
        }
        let known = self.heights.len() - other.heights.len();
        self.heights[known..].copy_from_slice(&other.heights);
        self.highest = self.highest.max(other.highest);
        self.numbered()
    }

    /// Bytes of the arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.members)
            + size_of_val(&*self.groups)
            + size_of_val(&*self.nodes)
            + size_of_val(&*self.areas)
            + size_of_val(&*self.heights)
            + size_of_val(&*self.weights)
    }

    /// Number of points.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.areas.len()
    }

    /// Sum of all areas (m²).
    #[must_use]
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// The body's nodes that points hang on, ascending.
    #[must_use]
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// One over the number of a group's members.
    pub(crate) fn share(&self, group: u32) -> f64 {
        let [begin, end] = self.groups[group as usize].nodes;
        f64::from(end - begin).recip()
    }

    pub(crate) fn group_count(&self) -> u32 {
        index(self.groups.len())
    }

    /// Points of a group.
    pub(crate) fn points(&self, group: u32) -> std::ops::Range<u32> {
        let [begin, end] = self.groups[group as usize].points;
        begin..end
    }

    /// The largest height (m) of a group, at least 0.
    pub(crate) fn top(&self, group: u32) -> f64 {
        let [begin, end] = self.groups[group as usize].points;
        let heights = self.heights[begin as usize..end as usize].iter();
        heights.copied().fold(0.0, f64::max)
    }

    /// Members that a group hangs on.
    pub(crate) fn group_members(&self, group: u32) -> &[u32] {
        let [begin, end] = self.groups[group as usize].nodes;
        &self.nodes[begin as usize..end as usize]
    }

    /// Members and weights of a point.
    pub(crate) fn weights_of(
        &self,
        group: u32,
        point: u32,
    ) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let members = self.group_members(group);
        let group = &self.groups[group as usize];
        let begin = group.weights as usize + (point - group.points[0]) as usize * members.len();
        let weights = &self.weights[begin..begin + members.len()];
        let members = members.iter().map(|member| *member as usize);
        members.zip(weights.iter().copied())
    }

    /// Turns the body's node numbers into positions in the list of members.
    fn numbered(mut self) -> Self {
        let end = self.nodes.iter().max().map_or(0, |node| *node as usize + 1);
        let mut places = vec![u32::MAX; end];
        for node in &self.nodes {
            places[*node as usize] = 0;
        }
        self.members.clear();
        for (node, place) in (0..).zip(&mut places).filter(|(_, place)| **place == 0) {
            *place = index(self.members.len());
            self.members.push(node);
        }
        for node in &mut self.nodes {
            *node = places[*node as usize];
        }
        self
    }

    /// Adds a group whose points' weights begin at `weights`.
    fn push(&mut self, nodes: &[u32], weights: u32, area: f64, points: usize) {
        let begin = [index(self.nodes.len()), index(self.areas.len())];
        self.nodes.extend_from_slice(nodes);
        self.areas.resize(self.areas.len() + points, area);
        self.heights.resize(self.areas.len(), 0.0);
        self.groups.push(Group {
            nodes: [begin[0], index(self.nodes.len())],
            points: [begin[1], index(self.areas.len())],
            weights,
        });
    }
}

fn index(count: usize) -> u32 {
    u32::try_from(count).expect("fewer than 2^32 quadrature points and weights")
}

fn check_nodes(item: usize, nodes: &[u32], node_count: usize) -> Result<(), SurfaceError> {
    match nodes.iter().find(|node| **node as usize >= node_count) {
        Some(&node) => Err(SurfaceError::NoSuchNode {
            item,
            node,
            node_count,
        }),
        None => Ok(()),
    }
}

fn check_area(item: usize, area: f64) -> Result<(), SurfaceError> {
    if area.is_finite() && area > 0.0 {
        Ok(())
    } else {
        Err(SurfaceError::BadArea { item, area })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_integrate_linear_functions_exactly() {
        let x = [DVec3::ZERO, DVec3::X * 2.0, DVec3::new(0.3, 1.5, 0.2)];
        for divisions in 1..7 {
            let surface = ContactSurface::from_triangles(&[[0, 1, 2]], &x, divisions).unwrap();
            let count = (divisions * divisions) as usize;
            assert_eq!(surface.point_count(), count, "points");
            let area = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]).length();
            assert!((surface.area() - area).abs() < 1e-14, "area");
            for k in 0..3 {
                let mean: f64 = surface.weights.iter().skip(k).step_by(3).sum();
                let points = f64::from(divisions * divisions);
                assert!(
                    (mean / points - 1.0 / 3.0).abs() < 1e-14,
                    "mean of weight {k}"
                );
            }
        }
    }

    #[test]
    fn joined_surfaces_have_all_points_on_their_nodes() {
        let x = [
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::new(1.0, 1.0, 0.3),
            DVec3::Z,
        ];
        let one = ContactSurface::from_triangles(&[[4, 2, 1]], &x, 2).unwrap();
        let two = ContactSurface::from_nodes(&[0, 3, 1], &[0.2, 0.3, 0.5], 5).unwrap();
        let both = one.clone().joined(&two);
        assert_eq!(both.members(), [0, 1, 2, 3, 4], "every node");
        assert_eq!(both.areas, [&one.areas[..], &two.areas].concat(), "areas");
        let places = |surface: &ContactSurface| -> Vec<DVec3> {
            (0..surface.group_count())
                .flat_map(|group| surface.points(group).map(move |point| (group, point)))
                .map(|(group, point)| {
                    let bound = surface.weights_of(group, point);
                    bound.map(|(m, w)| x[surface.members[m] as usize] * w).sum()
                })
                .collect()
        };
        let mut expected = places(&one);
        expected.extend(places(&two));
        assert_eq!(
            places(&both),
            expected,
            "points keep their order and places"
        );
    }

    #[test]
    fn a_torn_triangle_gives_its_area_to_its_corners() {
        let x = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
        let triangles = [[0, 1, 2], [1, 3, 2]];
        let whole = ContactSurface::from_triangles(&triangles, &x, 3).unwrap();
        let torn = |holds: fn(u32, u32) -> bool| {
            ContactSurface::from_torn_triangles((&triangles, &[]), &x, 3, holds).unwrap()
        };
        assert_eq!(torn(|_, _| true), whole, "nothing is torn");
        let surface = torn(|a, b| a != 3 && b != 3);
        assert_eq!(surface.point_count(), 9 + 3, "one of two");
        assert!(
            (surface.area() - whole.area()).abs() < 1e-15,
            "all of the area"
        );
        let bare = torn(|_, _| false);
        let thirds = [1.0, 2.0, 2.0, 1.0].map(|third| third / 6.0);
        let nodes = ContactSurface::from_nodes(&[0, 1, 2, 3], &thirds, 4).unwrap();
        assert_eq!(bare.members(), nodes.members(), "all of them");
        let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-15;
        assert!(bare.areas.iter().zip(&nodes.areas).all(same));
    }

    #[test]
    fn bad_input_is_named() {
        let x = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        let error = ContactSurface::from_triangles(&[[0, 1, 2]], &x, 2).unwrap_err();
        assert_eq!(error, SurfaceError::BadArea { item: 0, area: 0.0 }, "flat");
        let error = ContactSurface::from_triangles(&[[0, 1, 3]], &x, 2).unwrap_err();
        let SurfaceError::NoSuchNode { node: 3, .. } = error else {
            panic!("{error}");
        };
        let error = ContactSurface::from_triangles(&[[0, 1, 2]], &x, 0).unwrap_err();
        assert_eq!(error, SurfaceError::NoDivisions);
        let torn = ContactSurface::from_torn_triangles((&[[0, 1, 9]], &[]), &x, 2, |_, _| false);
        assert!(matches!(
            torn,
            Err(SurfaceError::NoSuchNode { node: 9, .. })
        ));
        let error = ContactSurface::from_nodes(&[0], &[], 3).unwrap_err();
        assert_eq!(error, SurfaceError::Areas { areas: 0, nodes: 1 });
        let error = ContactSurface::from_nodes(&[0], &[f64::NAN], 3).unwrap_err();
        assert!(error.to_string().contains("area"), "{error}");
    }
}
