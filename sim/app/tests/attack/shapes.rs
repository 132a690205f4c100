//! Surfaces made of polygons, and ways to spoil them.

use glam::{DMat3, DVec3};

use testkit::cloud::Random;

/// A surface as files have it.
#[derive(Clone, Default)]
pub(crate) struct Surface {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) faces: Vec<Vec<usize>>,
}

impl Surface {
    /// Volume by a signed sum over fans, exact for plane faces of any shape.
    pub(crate) fn volume(&self) -> f64 {
        let origin = self.vertices.iter().sum::<DVec3>() / self.vertices.len().max(1) as f64;
        let fans = self.faces.iter().flat_map(|face| {
            let at = |k: usize| self.vertices[face[k]] - origin;
            (2..face.len()).map(move |k| at(0).dot(at(k - 1).cross(at(k))) / 6.0)
        });
        fans.sum()
    }

    pub(crate) fn add(&mut self, other: &Self, flip: bool) {
        let base = self.vertices.len();
        self.vertices.extend(&other.vertices);
        for face in &other.faces {
            let mut face: Vec<usize> = face.iter().map(|v| v + base).collect();
            if flip {
                face.reverse();
            }
            self.faces.push(face);
        }
    }

    fn map(&self, f: impl Fn(DVec3) -> DVec3) -> Self {
        Self {
            vertices: self.vertices.iter().map(|v| f(*v)).collect(),
            faces: self.faces.clone(),
        }
    }

    pub(crate) fn size(&self) -> DVec3 {
        let far = |f: fn(DVec3, DVec3) -> DVec3| self.vertices.iter().copied().reduce(f).unwrap();
        far(DVec3::max) - far(DVec3::min)
    }
}

/// A prism over a polygon, counter-clockwise from above.
fn prism(floor: &[(f64, f64)]) -> Surface {
    let n = floor.len();
    let at = |z: f64| floor.iter().map(move |(x, y)| DVec3::new(*x, *y, z));
    let mut faces = vec![(0..n).rev().collect(), (n..2 * n).collect::<Vec<_>>()];
    faces.extend((0..n).map(|k| vec![k, (k + 1) % n, n + (k + 1) % n, n + k]));
    Surface {
        vertices: at(0.0).chain(at(1.0)).collect(),
        faces,
    }
}

/// A grid wrapped round: a torus.
fn torus(around: usize, across: usize) -> Surface {
    let angle = |k: usize, n: usize| std::f64::consts::TAU * k as f64 / n as f64;
    let at = |i: usize, j: usize| i % around * across + j % across;
    let places = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
    Surface {
        vertices: places
            .clone()
            .map(|(i, j)| {
                let (u, w) = (angle(i, around), angle(j, across));
                let r = 1.0 + 0.4 * w.cos();
                DVec3::new(r * u.cos(), r * u.sin(), 0.4 * w.sin())
            })
            .collect(),
        // Triangles: the quads are not plane.
        faces: places
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                [vec![a, b, c], vec![a, c, d]]
            })
            .collect(),
    }
}

/// An octahedron divided so often, on a ball.
fn ball(divisions: usize) -> Surface {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut surface = Surface::default();
    let mut triangles = Vec::new();
    for signs in 0..8_u32 {
        let corner = |axis: usize| axes[axis] * [1.0, -1.0][(signs >> axis & 1) as usize];
        let [a, b, c] = [0, 1, 2].map(corner);
        let even = signs.count_ones() % 2 == 0;
        triangles.push(if even { [a, b, c] } else { [a, c, b] });
    }
    for _ in 0..divisions {
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [(a + b), (b + c), (c + a)].map(DVec3::normalize);
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    for triangle in triangles {
        let face = triangle.map(|p| {
            let found = surface.vertices.iter().position(|v| v.distance(p) < 1e-9);
            found.unwrap_or_else(|| {
                surface.vertices.push(p);
                surface.vertices.len() - 1
            })
        });
        surface.faces.push(face.to_vec());
    }
    surface
}

/// One closed surface.
fn single(random: &mut Random) -> Surface {
    match random.below(6) {
        0 => prism(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]),
        1 => prism(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 1.0),
            (1.0, 1.0),
            (1.0, 4.0),
            (0.0, 4.0),
        ]),
        2 => torus(5 + random.below(20), 3 + random.below(12)),
        3 => ball(random.below(4)),
        4 => prism(&[(0.0, 0.0), (1.0, 0.2), (0.3, 1.0)]),
        _ => {
            // A star of some points.
            let points = 3 + random.below(6);
            let inner = random.range(0.3, 0.9);
            let corners: Vec<(f64, f64)> = (0..2 * points)
                .map(|k| {
                    let angle = std::f64::consts::PI * k as f64 / points as f64;
                    let r = if k % 2 == 0 { 1.0 } else { inner };
                    (r * angle.cos(), r * angle.sin())
                })
                .collect();
            prism(&corners)
        }
    }
}

/// A closed surface, and the volume of the body that it bounds.
pub(crate) fn body(random: &mut Random) -> (Surface, f64) {
    let mut surface = single(random);
    if random.chance(0.3) {
        let squash =
            [0, 1, 2].map(|_| 10_f64.powf(random.range(-3.0, 0.5) * random.range(0.0, 1.0)));
        surface = surface.map(|p| p * DVec3::from_array(squash));
    }
    let mut volume = surface.volume();
    let size = surface.size();
    let middle = surface.vertices.iter().sum::<DVec3>() / surface.vertices.len() as f64;
    match random.below(8) {
        // Another body beside it, or the same twice.
        0 => {
            let other = surface.map(|p| p + 2.0 * size);
            let flip = random.chance(0.3);
            surface.add(&other, flip);
            volume *= 2.0;
        }
        1 => {
            let same = surface.clone();
            surface.add(&same, random.chance(0.3));
        }
        // A smaller one within a star-shaped one: a cavity, or nothing.
        2 if surface.faces.len() == 6 => {
            let inner = surface.map(|p| middle + 0.5 * (p - middle));
            let flip = random.chance(0.5);
            surface.add(&inner, flip);
            if flip {
                volume *= 7.0 / 8.0;
            }
        }
        _ => {}
    }
    if random.chance(0.3) {
        let angles = [0, 1].map(|_| random.range(0.0, 6.0));
        let turn = DMat3::from_rotation_x(angles[0]) * DMat3::from_rotation_z(angles[1]);
        surface = surface.map(|p| turn * p);
    }
    if random.chance(0.3) {
        let scale = 10_f64.powf(random.range(-4.0, 4.0));
        surface = surface.map(|p| scale * p);
        volume *= scale.powi(3);
    }
    if random.chance(0.2) {
        let shift = surface.size() * random.range(-5.0, 5.0);
        surface = surface.map(|p| p + shift);
    }
    (surface, volume)
}

/// Spoils a surface; whether the volume of the body is still to be had.
pub(crate) fn spoil(surface: &mut Surface, random: &mut Random) -> bool {
    let (faces, vertices) = (surface.faces.len(), surface.vertices.len());
    let (face, vertex) = (random.below(faces), random.below(vertices));
    let size = surface.size();
    match random.below(12) {
        // All or a few turned over.
        0 => surface.faces.iter_mut().for_each(|face| face.reverse()),
        1 => surface.faces[face].reverse(),
        // Repeated, degenerate or without neighbours.
        2 => surface.faces.push(surface.faces[face].clone()),
        3 => surface
            .faces
            .push(vec![vertex, vertex, (vertex + 1) % vertices]),
        4 => surface.vertices.push(size * random.range(-1e4, 1e4)),
        // Every face has vertices of its own.
        5 => {
            let old = surface.clone();
            surface.vertices.clear();
            for face in &mut surface.faces {
                for v in face {
                    surface.vertices.push(old.vertices[*v]);
                    *v = surface.vertices.len() - 1;
                }
            }
        }
        6 => {
            surface.faces.remove(face);
            return false;
        }
        7 => {
            surface.vertices[vertex] += size * 10_f64.powf(random.range(-1.0, 7.0));
            return false;
        }
        8 => {
            for v in &mut surface.vertices {
                *v += size * random.range(-0.1, 0.1);
            }
            return false;
        }
        9 => {
            let odd = [f64::NAN, 1e300, 1e-300, 1e40, f64::INFINITY];
            surface.vertices[vertex].x = *random.pick(&odd);
            return false;
        }
        10 => {
            surface.faces[face].swap(0, 1);
            return false;
        }
        _ => {
            let other = surface.vertices[random.below(vertices)];
            surface.vertices[vertex] = other;
            return false;
        }
    }
    true
}
