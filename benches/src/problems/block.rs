//! Bodies of tetrahedra on which problems with a known answer are set.

use glam::{DMat3, DVec3};
use phyxel::elastic_stencils;
use phyxel_discretize::{
    SampledNodes, boundary_triangles, lattice_tetrahedra, nodal_boundary_vectors, nodal_volumes,
    space_filling_order, tetrahedra_edges,
};
use phyxel_elastic::{Elastic, Material, Materials, Nodes, Settings};
use phyxel_mls::{ConservativeSettings, GradientStencils, Neighborhoods, inverse_square_weights};
use testkit::kuhn::{self, mirrored_block};

use super::solid::Solid;
use crate::StudyError;
use crate::error::not_solved;

/// Nodes of a lattice of `cells`, moved by `map` (cell coordinates in 0..=1), with the tetrahedra of
/// [`lattice_tetrahedra`].
pub fn lattice(cells: [u32; 3], map: impl Fn(DVec3) -> DVec3) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let n = cells.map(|c| c + 1);
    let size = DVec3::from_array(cells.map(f64::from));
    let mut nodes = Vec::new();
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                nodes.push(map(DVec3::from_array([i, j, k].map(f64::from)) / size));
            }
        }
    }
    let tetrahedra = lattice_tetrahedra(n);
    (nodes, tetrahedra)
}

/// The same with the nodes on `lines` (m), ascending, along each axis.
pub fn lattice_on(lines: [&[f64]; 3]) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let cells = lines.map(|line| u32::try_from(line.len().saturating_sub(1)).unwrap_or(u32::MAX));
    lattice(cells, |s| {
        let line = |axis: usize| {
            let place = s[axis] * f64::from(cells[axis]);
            lines[axis].get(place.round() as usize).map_or(0.0, |x| *x)
        };
        DVec3::new(line(0), line(1), line(2))
    })
}

/// Nodes of tetrahedra with volumes, boundary vectors and conservative stencils.
#[derive(Debug, Clone)]
pub struct Block {
    /// Rest positions (m).
    pub rest: Vec<DVec3>,
    /// Tetrahedra.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Surface triangles, anticlockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Nodal volumes (m³).
    pub volumes: Vec<f64>,
    /// Who is coupled with whom: the edges of the tetrahedra.
    pub graph: Neighborhoods,
    /// Conservative stencils.
    pub stencils: GradientStencils,
}

impl Block {
    /// A body of positively oriented tetrahedra, its nodes in the order given.
    pub fn new(rest: Vec<DVec3>, tetrahedra: Vec<[u32; 4]>) -> Result<Self, StudyError> {
        let volumes = nodal_volumes(&rest, &tetrahedra);
        let triangles = boundary_triangles(&tetrahedra, |_| true);
        let boundary = nodal_boundary_vectors(&rest, &triangles);
        Self::with(rest, tetrahedra, triangles, volumes, boundary)
    }

    /// A body as it is sampled in scenes.
    pub fn sampled(found: SampledNodes) -> Result<Self, StudyError> {
        let (rest, tetrahedra) = (found.positions, found.tetrahedra);
        let (volumes, boundary) = (found.volumes, found.boundary_vectors);
        Self::with(rest, tetrahedra, found.surface_triangles, volumes, boundary)
    }

    fn with(
        rest: Vec<DVec3>,
        tetrahedra: Vec<[u32; 4]>,
        triangles: Vec<[u32; 3]>,
        volumes: Vec<f64>,
        boundary: Vec<DVec3>,
    ) -> Result<Self, StudyError> {
        let (offsets, indices) = tetrahedra_edges(rest.len(), &tetrahedra);
        let graph = Neighborhoods::from_graph(offsets, indices)?;
        let stencils = conservative(&rest, &volumes, &boundary, &graph)?;
        Ok(Self {
            rest,
            tetrahedra,
            triangles,
            volumes,
            graph,
            stencils,
        })
    }

    /// A block of the test kit.
    ///
    /// # Panics
    /// If it is not valid.
    pub fn of(block: kuhn::Block) -> Self {
        let (rest, volumes, boundary) = (block.positions, block.volumes, block.boundary_vectors);
        let graph = Neighborhoods::from_graph(block.offsets, block.indices).expect("a graph");
        Self {
            stencils: conservative(&rest, &volumes, &boundary, &graph).expect("a valid block"),
            rest,
            tetrahedra: block.tetrahedra,
            triangles: block.triangles,
            volumes,
            graph,
        }
    }

    /// The box `[0, size]` (m) of `cells` of the test kit, nodes moved by up to `jitter` of a cell.
    pub fn jittered(cells: [usize; 3], size: DVec3, jitter: f64, seed: u64) -> Self {
        Self::of(mirrored_block(cells, size, jitter, seed))
    }

    /// The same body with its nodes along a space-filling curve, as a simulation has them.
    pub fn ordered(nodes: &[DVec3], tetrahedra: &[[u32; 4]]) -> Result<Self, StudyError> {
        let order = space_filling_order(nodes);
        let mut place = vec![0_u32; nodes.len()];
        let olds = order.apply(&(0..nodes.len()).collect::<Vec<_>>());
        for (new, old) in (0_u32..).zip(olds) {
            place[old] = new;
        }
        let tetrahedra = tetrahedra.iter().map(|t| t.map(|v| place[v as usize]));
        Self::new(order.apply(nodes), tetrahedra.collect())
    }

    /// Nodes that pass a test of their place at rest.
    pub fn nodes(&self, chosen: impl Fn(DVec3) -> bool) -> Vec<u32> {
        let with = (0_u32..).zip(&self.rest).filter(|(_, x)| chosen(**x));
        with.map(|(node, _)| node).collect()
    }

    /// Root of the squares of `off`, of each node's position and position at rest (m), weighed with the volumes.
    pub fn norm(&self, positions: &[DVec3], off: impl Fn(DVec3, DVec3) -> DVec3) -> f64 {
        let nodes = positions.iter().zip(&self.rest).zip(&self.volumes);
        let squares = nodes.map(|((x, rest), v)| off(*x, *rest).length_squared() * v);
        squares.sum::<f64>().sqrt()
    }

    /// Nodal forces (N) of a traction (Pa) on the triangles whose corners all pass a test.
    pub fn traction(&self, on: impl Fn(DVec3) -> bool, traction: DVec3) -> Vec<DVec3> {
        let mut forces = vec![DVec3::ZERO; self.rest.len()];
        for face in &self.triangles {
            let [p, q, r] = face.map(|v| self.rest[v as usize]);
            if on(p) && on(q) && on(r) {
                for v in face {
                    forces[*v as usize] += traction * (q - p).cross(r - p).length() / 6.0;
                }
            }
        }
        forces
    }

    /// The elastic model of one material on `stencils`: the body's own, or those of a cut.
    pub fn elastic(
        &self,
        stencils: &GradientStencils,
        material: Material,
        settings: &Settings,
    ) -> Result<Elastic, StudyError> {
        let stencils = elastic_stencils(stencils, &self.graph);
        let nodes = Nodes::new(&self.rest, &self.volumes);
        let materials = Materials::Uniform(material);
        Ok(Elastic::new(&stencils, &nodes, &materials, settings)?)
    }

    /// Diagonal blocks (N/m) of the stiffness at rest: `Σ_i V_i ((λ + μ) g gᵀ + μ |g|² I)` and the
    /// part of the pair penalty that acts on single nodes.
    pub(crate) fn diagonal_blocks(&self, solid: Solid, control: f64) -> Vec<DMat3> {
        let (mu, lambda) = solid.lame();
        let part = |g: DVec3| {
            DMat3::from_cols(g * g.x, g * g.y, g * g.z) * (lambda + mu)
                + DMat3::from_diagonal(DVec3::splat(mu * g.length_squared()))
        };
        let (graph, stencils) = (&self.graph, &self.stencils);
        let gradients = stencils.pair_gradients(&self.rest, graph);
        let mut blocks = vec![DMat3::ZERO; self.rest.len()];
        for (i, x) in self.rest.iter().enumerate() {
            blocks[i] += part(gradients[graph.pairs(i)].iter().sum()) * self.volumes[i];
            let row = || graph.pairs(i).zip(graph.row(i));
            let spread: f64 = row()
                .map(|(p, &j)| stencils.weights[p] * x.distance_squared(self.rest[j as usize]))
                .sum();
            for (p, &j) in row() {
                blocks[j as usize] += part(gradients[p]) * self.volumes[i];
                let c = control * mu * self.volumes[i] / spread * stencils.weights[p];
                let c = DMat3::from_diagonal(DVec3::splat(c));
                blocks[i] += c;
                blocks[j as usize] += c;
            }
        }
        blocks
    }
}

fn conservative(
    rest: &[DVec3],
    volumes: &[f64],
    boundary: &[DVec3],
    graph: &Neighborhoods,
) -> Result<GradientStencils, StudyError> {
    let weights = inverse_square_weights(rest, graph);
    let settings = ConservativeSettings::default();
    let made = GradientStencils::conservative(rest, volumes, boundary, graph, weights, &settings)?;
    match made.report {
        Some(report) if report.residual >= 1e-9 => Err(not_solved(report.residual)),
        _ => Ok(made),
    }
}

/// Triangles whose corners all pass a test.
pub(crate) fn faces_where(
    triangles: &[[u32; 3]],
    rest: &[DVec3],
    chosen: impl Fn(DVec3) -> bool,
) -> Vec<[u32; 3]> {
    let inside = |t: &&[u32; 3]| t.iter().all(|v| chosen(rest[*v as usize]));
    triangles.iter().filter(inside).copied().collect()
}
