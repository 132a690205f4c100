"""Presses half an elastic sphere or cylinder against a rigid plane by finite elements: the reference of `benches -- contact`.

`pip install numpy scipy`, then `python3 benches/peers/sphere.py`. Half a sphere of 2 cm, clamped on its equator's plane, meets a
plane 1 mm in front of its pole; by symmetry that is one of two equal spheres. Stable neo-Hookean law of scenes
(`mu/2 (F:F - 3) - mu (J - 1) + (lambda + mu)/2 (J - 1)^2`), quadrilaterals of eight nodes with 3 x 3 points, refined towards the
pole, penalty at four points an edge, Newton's method. The sphere's are axisymmetric; the cylinder's are in plane strain, with
Poisson's ratio 0. Printed are the force of three meshes (N, of the cylinder N/m), of the sphere over Hertz's, and the radius or
half width in contact; then those of a push a hundredth as deep, which comes near Hertz.
"""

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import spsolve

RADIUS, MODULUS = 0.02, 5e3


def shape_functions(x, y):
    """Of the element with eight nodes (corners, then middles of edges), with derivatives by x and y."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    n = [0.25 * (1 + x * a) * (1 + y * b) * (x * a + y * b - 1) for a, b in corners]
    dx = [0.25 * a * (1 + y * b) * (2 * x * a + y * b) for a, b in corners]
    dy = [0.25 * b * (1 + x * a) * (x * a + 2 * y * b) for a, b in corners]
    n += [0.5 * (1 - x * x) * (1 - y), 0.5 * (1 - y * y) * (1 + x), 0.5 * (1 - x * x) * (1 + y), 0.5 * (1 - y * y) * (1 - x)]
    dx += [-x * (1 - y), 0.5 * (1 - y * y), -x * (1 + y), -0.5 * (1 - y * y)]
    dy += [-0.5 * (1 - x * x), -y * (1 + x), 0.5 * (1 - x * x), -y * (1 - x)]
    return np.array(n), np.array([dx, dy])


class Half:
    """Of a sphere, or of a cylinder."""

    def __init__(self, count, grade, sphere):
        self.sphere, self.ratio = sphere, 0.3 if sphere else 0.0
        self.mu = MODULUS / 2 / (1 + self.ratio)
        self.bulk = self.mu / (1 - 2 * self.ratio)  # lambda + mu
        near = lambda t: (np.exp(grade * t) - 1) / (np.exp(grade) - 1)
        line = near(np.arange(count + 1) / count)
        line = np.sort(np.concatenate([line, 0.5 * (line[1:] + line[:-1])]))
        numbers, nodes = {}, []

        def node(i, j):
            if (i, j) not in numbers:
                u, v = line[i], 1 - line[2 * count - j]
                numbers[i, j] = len(nodes)
                nodes.append((RADIUS * u * np.sqrt(1 - v * v / 2), RADIUS * v * np.sqrt(1 - u * u / 2)))
            return numbers[i, j]

        around = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        cells = [(2 * i, 2 * j) for j in range(count) for i in range(count)]
        self.elements = np.array([[node(a + i, b + j) for i, j in around] for a, b in cells])
        self.top = np.array([[node(2 * i + k, 2 * count) for k in range(3)] for i in range(count)])
        self.rest = np.array(nodes)
        held = np.zeros((len(nodes), 2), bool)
        held[[k for (i, _), k in numbers.items() if i == 0], 0] = True
        held[[k for (_, j), k in numbers.items() if j == 0]] = True
        self.free = np.where(~held.ravel())[0]
        self.points = []
        gauss = np.polynomial.legendre.leggauss(3)
        for x, wx in zip(*gauss):
            for y, wy in zip(*gauss):
                n, d = shape_functions(x, y)
                jacobian = np.einsum("ka,eai->eki", d, self.rest[self.elements])
                slopes = np.einsum("eik,ka->eai", np.linalg.inv(jacobian), d)
                radius = self.rest[self.elements][:, :, 0] @ n
                volume = np.abs(np.linalg.det(jacobian)) * wx * wy * self.around(radius)
                # Rows of F: rr, rz, zr, zz and the hoop.
                b = np.zeros((len(self.elements), 5, 16))
                b[:, 0, 0::2] = b[:, 2, 1::2] = slopes[:, :, 0]
                b[:, 1, 0::2] = b[:, 3, 1::2] = slopes[:, :, 1]
                b[:, 4, 0::2] = n / radius[:, None] if sphere else 0
                self.points.append((b, volume))

    def around(self, radius):
        """What the half plane stands for: a ring, or both sides."""
        return 2 * np.pi * radius if self.sphere else 2

    def evaluate(self, u, plane, penalty):
        """Forces, stiffness, force of the plane, radius in contact."""
        size, moved = u.size, u.reshape(-1, 2)
        degrees = np.stack([2 * self.elements, 2 * self.elements + 1], 2).reshape(-1, 16)
        forces, stiffness = np.zeros(size), np.zeros((len(degrees), 16, 16))
        for b, volume in self.points:
            f = np.einsum("eka,ea->ek", b, u[degrees]) + np.array([1, 0, 0, 1, 1])
            rr, rz, zr, zz, hoop = f.T
            area = rr * zz - rz * zr
            minors = np.stack([zz * hoop, -zr * hoop, -rz * hoop, rr * hoop, area], 1)
            pressure = -self.mu + self.bulk * (area * hoop - 1)
            stress = self.mu * f + pressure[:, None] * minors
            tangent = self.mu * np.eye(5) + self.bulk * np.einsum("ei,ej->eij", minors, minors)
            for i, j, second in [(0, 3, hoop), (1, 2, -hoop), (0, 4, zz), (1, 4, -zr), (2, 4, -rz), (3, 4, rr)]:
                tangent[:, i, j] += pressure * second
                tangent[:, j, i] += pressure * second
            np.add.at(forces, degrees, np.einsum("e,ek,eka->ea", volume, stress, b))
            stiffness += np.einsum("e,eka,ekl,elb->eab", volume, b, tangent, b, optimize=True)
        entries = [(np.repeat(degrees, 16, 1).ravel(), np.tile(degrees, (1, 16)).ravel(), stiffness.ravel())]
        push, touched = 0.0, 0.0
        along = 2 * self.top + 1
        for s, weight in zip(*np.polynomial.legendre.leggauss(4)):
            n = np.array([0.5 * s * (s - 1), 1 - s * s, 0.5 * s * (s + 1)])
            x = np.einsum("a,eai->ei", n, self.rest[self.top])
            edge = np.einsum("a,eai->ei", [s - 0.5, -2 * s, s + 0.5], self.rest[self.top])
            now = x + np.einsum("a,eai->ei", n, moved[self.top])
            area = self.around(x[:, 0]) * np.hypot(*edge.T) * weight * penalty * (now[:, 1] > plane)
            np.add.at(forces, along, (area * (now[:, 1] - plane))[:, None] * n)
            push += np.sum(area * (now[:, 1] - plane))
            touched = max(touched, np.max(now[:, 0] * (area > 0)))
            entries.append((np.repeat(along, 3, 1).ravel(), np.tile(along, (1, 3)).ravel(), np.einsum("e,a,b->eab", area, n, n).ravel()))
        rows, columns, values = (np.concatenate(part) for part in zip(*entries))
        return forces, sparse.csr_matrix((values, (rows, columns)), (size, size)), push, touched

    def press(self, depth, penalty, steps=4):
        u = np.zeros(self.rest.size)
        for step in range(1, steps + 1):
            for _ in range(40):
                forces, stiffness, push, touched = self.evaluate(u, RADIUS - depth * step / steps, penalty)
                if np.abs(forces[self.free]).max() < 1e-9 * push:
                    break
                u[self.free] -= spsolve(stiffness[self.free][:, self.free].tocsc(), forces[self.free])
        return push, touched


for sphere, depth, grade, meshes in [(True, 1e-3, 4, (16, 24, 32)), (True, 1e-5, 7, (32,)), (False, 1e-3, 4, (16, 24, 32))]:
    hertz = 4 / 3 * MODULUS / (1 - 0.3**2) * np.sqrt(RADIUS * depth**3)
    for count in meshes:
        push, touched = Half(count, grade, sphere).press(depth, 20 * MODULUS / RADIUS / depth)
        over = f", {push / hertz:.4f} of Hertz" if sphere else " a metre"
        print(f"{depth * 1e3} mm, {count} x {count}: {push:.6g} N{over}, {1e3 * touched:.3g} mm in contact")
