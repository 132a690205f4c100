"""A beam, a hanging block and a sphere on a cube by MuJoCo, Taichi, phyxel and finite elements in lanes: error and time.

`pip install numpy scipy mujoco taichi`, then `python3 benches/peers/all.py mechanics`, or this file with `--quick`: rows in
`out/mechanics/mechanics.csv`, the chart beside them. One thread each. References, phyxel and finite elements are those of
`cargo run --release -p benches -- mechanics`. Strains are small, all have one material. A peer's step is 0.9 of the
largest at which 300 steps from shaken velocities stay bounded. Its answer is that of a run that critical damping of its
slowest mode brings to rest, whose time does not count. Forces on the tool are over Young's modulus.

- MuJoCo takes Poisson's ratios below 0.5. It has explicit steps (`Euler`) and those that it recommends for flexes
  (`discrete`, implicit, here of 10 ms); both come to one rest. Its vertices get the masses that their elements have: by
  itself it gives each the same, and those of pinned ones to the others. Its contact is one point a triangle of the flex.
  Bodies of more than 2,300 nodes, and of MLS-MPM those of more than 2,000 cells, are left out: they take minutes a row.
  Quadratic cells take two intervals each, and boxes of odd ones have no row.
- Taichi has no elasticity of its own: these are kernels as its examples have them, serial and without atomics, tetrahedra
  in single precision, particles in double. The tetrahedra's penalty under the sphere would ask for shorter steps, which
  times leave alone, as with finite elements in lanes.
- MLS-MPM has no row under the sphere: its contact is no finer than a cell, and the contact's radius is one to three cells.
"""

import csv
import os
import subprocess
import sys
import time

os.environ["TI_LOG_LEVEL"] = "error"
for threads in ("RAYON", "OMP", "OPENBLAS"):
    os.environ[f"{threads}_NUM_THREADS"] = "1"

import mujoco
import numpy as np
import taichi as ti
from scipy.interpolate import RegularGridInterpolator

MODULUS, DENSITY = 1e4, 1e3
RADIUS, DEPTH, SMALL = 1.0, 0.1, 0.01
FACTOR = 0.9
OUT = "out/mechanics"
mujoco.set_mju_user_warning(lambda _: None)  # of the steps that are too long, each in a file


class Task:
    def __init__(self, name, low, high, gravity, slowest, held, seen, cells):
        self.name, self.gravity, self.held, self.seen, self.cells = name, gravity, held, seen, cells
        self.slowest = slowest  # mode (rad/s), nearly
        self.low, self.size = np.array(low), np.array(high) - low

    def lattice(self, cells):
        """Nodes, x fastest, with the weights of a lattice's nodal volumes."""
        k = np.stack(np.meshgrid(*[np.arange(c + 1) for c in cells[::-1]], indexing="ij")[::-1], -1).reshape(-1, 3)
        weights = np.prod(np.where((k == 0) | (k == cells), 0.5, 1.0), 1)
        return self.low + k * (self.size / cells), k, weights


TASKS = [
    Task("beam", (0, -0.1, -0.1), (1, 0.1, 0.1), 0.002, 0.65, lambda x: x[:, 0] < 1e-9, lambda x: x[:, 0] > 1 - 1e-9,
         [(10, 2, 2), (20, 4, 4), (30, 6, 6), (40, 8, 8)]),
    Task("block", (-0.035, -0.035, -0.21), (0.035, 0.035, 0), 0.1, 23.0, lambda x: x[:, 2] > -1e-9, lambda x: x[:, 2] < 1,
         [(3, 3, 9), (5, 5, 15), (7, 7, 21), (10, 10, 30)]),
    Task("sphere", (-1, -1, -2), (1, 1, 0), 0.0, 4.5,
         lambda x: (np.abs(x[:, :2]).max(1) > 1 - 1e-9) | (x[:, 2] < -2 + 1e-9), lambda x: x[:, 2] > -1e-9,
         [(6, 6, 6), (8, 8, 8), (12, 12, 12), (16, 16, 16)]),
]  # fmt: skip


class MuJoCo:
    """A flex of tetrahedra, or of trilinear or quadratic cells."""

    def __init__(self, task, cells, nu, dof, integrator):
        self.x, k, weights = task.lattice(cells)
        order = 2 if dof == "quadratic" else 1
        if order == 2:
            weights = np.prod(np.where((k == 0) | (k == cells), 1, np.where(k % 2 == 1, 4, 2)) / 3, 1)
        held, spacing = task.held(self.x), task.size / cells
        # Its own vertices run along z first.
        self.order = np.lexsort((k[:, 2], k[:, 1], k[:, 0]))
        text = lambda values: " ".join(f"{v:.12g}" for v in values)
        cellcount = "" if dof == "full" else f'cellcount="{text([c // order for c in cells])}"'
        tool = f'<geom type="sphere" size="{RADIUS / SMALL}" pos="0 0 {RADIUS / SMALL - DEPTH * SMALL}"/>'
        self.model = mujoco.MjModel.from_xml_string(f"""<mujoco>
            <option integrator="{integrator}" gravity="0 0 {-task.gravity}"><flag autoreset="disable"/></option>
            <size memory="2G"/>
            <worldbody>{tool if task.name == "sphere" else ""}
            <flexcomp name="b" type="grid" dim="3" count="{text(np.array(cells) + 1)}" spacing="{text(spacing)}"
                pos="{text(task.low + task.size / 2)}" dof="{dof}" {cellcount} mass="1" radius="1e-7">
              <elasticity young="{MODULUS}" poisson="{nu}"/>
              <contact selfcollide="none" condim="1" priority="1" solimp="0.999 0.9999 1e-6"/>
              <pin id="{text(np.flatnonzero(held[self.order]))}"/>
            </flexcomp></worldbody></mujoco>""")
        bodies = self.model.flex_nodebodyid if dof != "full" else self.model.flex_vertbodyid
        free = ~held[self.order]
        self.model.body_mass[bodies[free]] = (weights[self.order] * DENSITY * np.prod(spacing))[free]
        mujoco.mj_setConst(self.model, data := mujoco.MjData(self.model))
        self.data, self.weights, self.force = data, weights, 0.0

    def reset(self, step):
        self.model.opt.timestep = step
        mujoco.mj_resetData(self.model, self.data)

    def shake(self, size):
        self.data.qvel[:] = size * np.random.default_rng(1).standard_normal(self.model.nv)

    def advance(self, steps):
        mujoco.mj_step(self.model, self.data, nstep=steps)
        return float(self.data.qvel @ self.data.qvel)

    def damp(self, factor):
        self.data.qvel[:] *= factor

    def positions(self):
        found = np.empty_like(self.x)
        found[self.order] = self.data.flexvert_xpos
        self.force = 0.0
        for contact in range(self.data.ncon):
            mujoco.mj_contactForce(self.model, self.data, contact, force := np.zeros(6))
            self.force += force[0] * abs(self.data.contact[contact].frame[2])
        return found


@ti.data_oriented
class Tetrahedra:
    """Explicit neo-Hookean linear tetrahedra; under the sphere six points a triangle with phyxel's penalty."""

    def __init__(self, task, cells, nu):
        self.x, k, _ = task.lattice(cells)
        self.gravity = task.gravity
        self.mu, self.la = MODULUS / 2 / (1 + nu), MODULUS * nu / (1 + nu) / (1 - 2 * nu)
        spacing = task.size[0] / cells[0]
        self.penalty, self.pressing = 40 * MODULUS / spacing, 1.0
        number = lambda at: at @ np.cumprod([1, cells[0] + 1, cells[1] + 1])
        cell = k[(k < cells).all(1)]
        tetrahedra = []
        for axes in [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]:
            # Kuhn's division, mirrored in odd cells.
            steps = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(axes)]], 0)
            tetrahedra.append(number(cell[:, None] + (steps ^ (cell[:, None] & 1))))
        tetrahedra = np.stack(tetrahedra, 1).reshape(-1, 4)
        edges = (self.x[tetrahedra[:, 1:]] - self.x[tetrahedra[:, :1]]).transpose(0, 2, 1)
        volumes = np.abs(np.linalg.det(edges)) / 6
        self.weights = np.bincount(tetrahedra.ravel(), np.repeat(volumes / 4, 4))
        masses = np.where(task.held(self.x), np.inf, DENSITY * self.weights)
        top = np.sort(np.stack([np.delete(tetrahedra, a, 1) for a in range(4)]).reshape(-1, 3), 1)
        top = np.unique(top[task.seen(self.x)[top].all(1)], axis=0) if task.name == "sphere" else np.zeros((0, 3), int)
        many = len(self.x)
        self.area = spacing**2 / 2
        self.tetrahedra = ti.Vector.field(4, ti.i32, len(tetrahedra))
        self.inverse = ti.Matrix.field(3, 3, float, len(tetrahedra))
        self.volume, self.mass = ti.field(float, len(tetrahedra)), ti.field(float, many)
        self.start, self.u, self.v, self.f = (ti.Vector.field(3, float, many) for _ in range(4))
        self.top = ti.Vector.field(3, ti.i32, max(len(top), 1))
        self.triangles = len(top)
        self.tool = ti.field(float, ())
        for field, values in [(self.tetrahedra, tetrahedra), (self.inverse, np.linalg.inv(edges)), (self.mass, masses),
                              (self.volume, volumes), (self.start, self.x)]:  # fmt: skip
            field.from_numpy(values.astype(np.int32 if values.dtype.kind == "i" else np.float32))
        if len(top):
            self.top.from_numpy(top.astype(np.int32))

    def advance(self, steps):
        return self.run(steps, self.dt, self.penalty * self.pressing)

    @ti.kernel
    def run(self, steps: ti.i32, dt: float, penalty: float) -> ti.f64:
        kinetic = ti.cast(0, ti.f64)
        ti.loop_config(serialize=True)
        for _ in range(steps):
            for i in range(self.f.shape[0]):
                self.f[i] = ti.Vector.zero(float, 3)
            for e in range(self.volume.shape[0]):
                t = self.tetrahedra[e]
                u = ti.Matrix.cols([self.u[t[1]] - self.u[t[0]], self.u[t[2]] - self.u[t[0]], self.u[t[3]] - self.u[t[0]]])
                F = u @ self.inverse[e] + ti.Matrix.identity(float, 3)
                J = F.determinant()
                turned = F.inverse().transpose()
                P = self.mu * (F - turned) + self.la * ti.log(J) * turned
                H = -self.volume[e] * P @ self.inverse[e].transpose()
                a, b, c = H[:, 0], H[:, 1], H[:, 2]
                self.f[t[1]] = self.f[t[1]] + a
                self.f[t[2]] = self.f[t[2]] + b
                self.f[t[3]] = self.f[t[3]] + c
                self.f[t[0]] = self.f[t[0]] - (a + b + c)
            if ti.static(self.triangles > 0):
                self.press(penalty)
            kinetic = ti.cast(0, ti.f64)
            for i in range(self.f.shape[0]):
                fall = ti.Vector([0.0, 0.0, -self.gravity * ti.min(1.0, 1 / self.mass[i] * 1e30)])
                self.v[i] += dt * (self.f[i] / self.mass[i] + fall)
                self.u[i] += dt * self.v[i]
                kinetic += self.v[i].norm_sqr()
        return kinetic

    @ti.func
    def press(self, penalty):
        self.tool[None] = 0.0
        radius = ti.static(RADIUS / SMALL)
        for e in range(self.triangles):
            t = self.top[e]
            for q in ti.static(range(6)):
                far = ti.static(0.108103018168070 if q < 3 else 0.816847572980459)
                near, part = ti.static((1 - far) / 2, 0.223381589678011 if q < 3 else 0.109951743655322)
                b = ti.Vector([near, near, near])
                b[ti.static(q % 3)] = far
                x = ti.Vector.zero(float, 3)
                for a in ti.static(range(3)):
                    x += b[a] * (self.start[t[a]] + self.u[t[a]])
                # Depth and direction without the cancellation of large radii.
                x[2] += ti.static(DEPTH * SMALL)
                away = x - ti.Vector([0.0, 0.0, radius])
                depth = (2 * radius * x[2] - x.norm_sqr()) / (radius + away.norm())
                if depth > 0:
                    force = away / away.norm() * (penalty * depth * part * self.area)
                    self.tool[None] += -force[2]
                    for a in ti.static(range(3)):
                        self.f[t[a]] = self.f[t[a]] + b[a] * force

    @ti.kernel
    def damp(self, factor: float):
        for i in self.v:
            self.v[i] *= factor

    def shake(self, size):
        noise = size * np.random.default_rng(1).standard_normal(self.x.shape) * np.isfinite(self.mass.to_numpy())[:, None]
        self.v.from_numpy(noise.astype(np.float32))

    def reset(self, step):
        self.dt = step
        self.u.fill(0)
        self.v.fill(0)

    def positions(self):
        self.force = self.tool[None]
        return self.x + self.u.to_numpy()


@ti.data_oriented
class Particles:
    """MLS-MPM (Hu et al. 2018): quadratic B-splines, eight particles a cell, neo-Hookean, grid nodes of the clamp at rest."""

    def __init__(self, task, cells, nu):
        self.h, self.gravity = task.size[0] / cells[0], task.gravity
        self.mu, self.la = MODULUS / 2 / (1 + nu), MODULUS * nu / (1 + nu) / (1 - 2 * nu)
        fine = [2 * c for c in cells]
        halves = np.stack(np.meshgrid(*map(np.arange, fine), indexing="ij"), -1).reshape(-1, 3)
        self.x = task.low + (halves + 0.5) * self.h / 2
        self.weights = np.ones(len(self.x))
        if task.name == "beam":
            # The end's displacement is extrapolated from the two layers before it.
            layer = np.round((task.low[0] + task.size[0] - self.x[:, 0]) / self.h * 2 - 0.5)
            self.weights = np.where(layer == 0, 1.5, np.where(layer == 1, -0.5, 0.0))
        self.origin = task.low - 3 * self.h
        self.n = [c + 7 for c in cells]
        nodes = self.origin + np.stack(np.meshgrid(*map(np.arange, self.n), indexing="ij"), -1) * self.h
        many = len(self.x)
        self.volume = (self.h / 2) ** 3
        self.p, self.v = (ti.Vector.field(3, float, many) for _ in range(2))
        self.C, self.H = (ti.Matrix.field(3, 3, float, many) for _ in range(2))
        self.gv, self.gm = ti.Vector.field(3, float, self.n), ti.field(float, self.n)
        self.free = ti.field(float, self.n)
        self.free.from_numpy((~task.held(nodes.reshape(-1, 3))).reshape(self.n).astype(np.float64))
        # Displacements (cells) and their gradients are kept apart from what they add to.
        self.start = ti.Vector.field(3, float, many)
        self.start.from_numpy(((self.x - self.origin) / self.h).astype(np.float64))

    def reset(self, step):
        self.dt = step
        for field in (self.p, self.v, self.C, self.H):
            field.fill(0)

    def advance(self, steps):
        return self.run(steps, self.dt)

    @ti.kernel
    def run(self, steps: ti.i32, dt: float) -> ti.f64:
        kinetic = ti.cast(0, ti.f64)
        mass, one = ti.static(DENSITY * self.volume), ti.Matrix.identity(float, 3)
        ti.loop_config(serialize=True)
        for _ in range(steps):
            for I in ti.grouped(ti.ndrange(*self.n)):
                self.gv[I], self.gm[I] = ti.Vector.zero(float, 3), 0.0
            for i in range(self.p.shape[0]):
                x = self.start[i] + self.p[i]
                # Where steps are not stable, particles must not leave the grid.
                base = ti.max(0, ti.min(int(x - 0.5), ti.Vector([n - 3 for n in self.n])))
                fx = x - base
                w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
                self.H[i] += dt * self.C[i] @ (self.H[i] + one)
                H = self.H[i]
                stress = self.mu * (H + H.transpose() + H @ H.transpose()) + self.la * ti.log((H + one).determinant()) * one
                affine = mass * self.C[i] - dt * self.volume * 4 / self.h**2 * stress
                for a, b, c in ti.static(ti.ndrange(3, 3, 3)):
                    off = ti.Vector([a, b, c])
                    weight = w[a][0] * w[b][1] * w[c][2]
                    node = base + off
                    momentum = mass * self.v[i] + affine @ ((off - fx) * self.h)
                    self.gv[node] = self.gv[node] + weight * momentum
                    self.gm[node] = self.gm[node] + weight * mass
            for I in ti.grouped(ti.ndrange(*self.n)):
                if self.gm[I] > 0:
                    self.gv[I] = self.free[I] * (self.gv[I] / self.gm[I] - ti.Vector([0.0, 0.0, dt * self.gravity]))
            kinetic = ti.cast(0, ti.f64)
            for i in range(self.p.shape[0]):
                x = self.start[i] + self.p[i]
                base = ti.max(0, ti.min(int(x - 0.5), ti.Vector([n - 3 for n in self.n])))
                fx = x - base
                w = [0.5 * (1.5 - fx) ** 2, 0.75 - (fx - 1) ** 2, 0.5 * (fx - 0.5) ** 2]
                v, C = ti.Vector.zero(float, 3), ti.Matrix.zero(float, 3, 3)
                for a, b, c in ti.static(ti.ndrange(3, 3, 3)):
                    off = ti.Vector([a, b, c])
                    part = w[a][0] * w[b][1] * w[c][2] * self.gv[base + off]
                    v += part
                    C += 4 / self.h * part.outer_product(off - fx)
                self.v[i], self.C[i] = v, C
                self.p[i] += dt / self.h * v
                kinetic += v.norm_sqr()
        return kinetic

    @ti.kernel
    def damp(self, factor: float):
        for i in self.v:
            self.v[i] *= factor
            self.C[i] *= factor

    def shake(self, size):
        self.v.from_numpy((size * np.random.default_rng(1).standard_normal(self.x.shape)).astype(np.float64))

    def positions(self):
        self.force = 0.0
        return self.x + self.h * self.p.to_numpy()


def stable_step(peer, guess):
    """The largest step at which 300 steps from shaken velocities stay bounded, to 5 %."""

    def bounded(factor):
        peer.reset(guess * factor)
        peer.shake(1e-2)
        first = peer.advance(1)
        try:
            last = peer.advance(300)
        except mujoco.FatalError:  # of contacts with nodes that are nowhere
            return False
        return np.isfinite(last) and last < 1e3 * first

    low, high = 0.3, 5.0
    while high / low > 1.05:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if bounded(middle) else (low, middle)
    return guess * low


def settle(peer, step, slowest, answer, tolerance):
    """The answer at rest, under critical damping of the slowest mode (rad/s)."""
    seen = []
    for _ in range(40):
        for _ in range(int(np.pi / slowest / step)):
            peer.damp(np.exp(-2 * slowest * step))
            peer.advance(1)
        seen.append(answer(peer))
        if not np.isfinite(seen[-1]) or len(seen) > 4 and max(seen[-3:]) - min(seen[-3:]) < tolerance * abs(seen[-1]):
            return np.mean(seen[-3:])
    print(f"not at rest: {seen[-3:]}", file=sys.stderr)
    return float("nan")


def seconds(peer):
    """Processor time of a step, the least mean of several measurements."""
    peer.advance(1)
    count, best = 1, []
    while len(best) < 5:
        start = time.process_time()
        peer.advance(count)
        taken = time.process_time() - start
        if taken < 0.06:
            count = max(count + 1, int(count * 0.08 / max(taken, 1e-3)))
        else:
            best.append(taken / count)
    return min(best)


def field(nu):
    """The reference's displacements under the sphere, at points of the whole cube."""
    rows = np.loadtxt(f"{OUT}/field-{nu}.csv", delimiter=",", skiprows=1)
    x, y, z = (np.unique(rows[:, a]) for a in range(3))
    values = rows[:, 3:].reshape(len(z), len(y), len(x), 3).transpose(2, 1, 0, 3)
    found = RegularGridInterpolator((x, y, z), values)
    return lambda p: found(np.c_[np.abs(p[:, :2]), p[:, 2]]) * np.c_[np.sign(p[:, :2]), np.ones(len(p))]


def measure(task, cells, nu, method, make, known):
    """Rows of a method: with MuJoCo, of both kinds of steps, which come to the same rest."""
    sound = (MODULUS * (1 - nu) / (1 + nu) / (1 - 2 * nu) / DENSITY) ** 0.5
    taichi = method.startswith("Taichi")
    if taichi:
        ti.init(arch=ti.cpu, cpu_max_num_threads=1, default_fp=ti.f64 if "MPM" in method else ti.f32)
    peer = make("Euler")
    peer.pressing = 0.0
    step = 0.9 * stable_step(peer, task.size[0] / cells[0] / sound)
    peer.pressing = 1.0
    press = task.name == "sphere" and taichi
    # Where the penalty would ask for shorter steps nodes move by a tenth, in as many operations.
    peer.reset(0.1 * step if press else step)
    row = {"task": task.name, "poissons_ratio": nu, "method": method, "nodes": len(peer.x)}
    row |= {"step": step, "seconds": seconds(peer)}
    # MuJoCo's contact chatters at longer steps, and a little at these.
    step *= 0.8 if task.name != "sphere" else 0.4 if taichi else 0.1
    peer.reset(step)
    seen = peer.weights * (1 if "MPM" in method else task.seen(peer.x))

    def answer(peer):
        moved = peer.positions() - peer.x
        return peer.force / MODULUS / SMALL if task.name == "sphere" else -(seen @ moved[:, 2]) / seen.sum()

    row["answer"] = settle(peer, step, task.slowest, answer, 1e-4 if taichi or task.gravity else 5e-3)
    row["error"] = 100 * (row["answer"] / known - 1)
    if task.name == "sphere":
        reference = field(nu)(peer.x)
        moved = (peer.positions() - peer.x) / SMALL
        row["norm"] = 100 * np.linalg.norm(moved - reference) / np.linalg.norm(reference)
    yield row
    if not taichi:
        peer = make("discrete")
        peer.reset(0.01)
        yield row | {"method": f"{method}, discrete", "step": 0.01, "seconds": seconds(peer)}


def methods(task, cells, nu):
    # Larger ones take it minutes a row.
    small = np.prod(np.array(cells) + 1) < 2300
    for dof, name in [("full", "linear"), ("trilinear", "trilinear"), ("quadratic", "quadratic")]:
        if small and (dof != "quadratic" or all(c % 2 == 0 for c in cells)):
            yield f"MuJoCo, {name}", lambda integrator, dof=dof: MuJoCo(task, cells, nu, dof, integrator)
    yield "Taichi, tetrahedra", lambda _: Tetrahedra(task, cells, nu)
    if task.name != "sphere" and np.prod(cells) < 2000:
        yield "Taichi, MLS-MPM", lambda _: Particles(task, cells, nu)


def rows(quick):
    """All rows: of `benches -- mechanics`, then of the peers."""
    command = ["cargo", "run", "--quiet", "--release", "-p", "benches", "--", "mechanics", "--out", OUT]
    subprocess.run(command + ["--quick"] * quick, check=True)
    with open(f"{OUT}/mechanics.csv") as file:
        found = list(csv.DictReader(file))
    known = {(r["task"], float(r["poissons_ratio"])): float(r["answer"]) for r in found if r["method"] == "reference"}
    yield from found
    for nu in [0.45] if quick else [0.45, 0.3, 0.49]:
        for task in TASKS:
            for cells in task.cells[: 2 if quick else 4] if nu == 0.45 else task.cells[1:2]:
                for method, make in methods(task, cells, nu):
                    for row in measure(task, cells, nu, method, make, known[task.name, nu]):
                        yield row
                        print(", ".join(f"{k} {v:.4g}" if isinstance(v, float) else str(v) for k, v in row.items()), flush=True)
    yield from speeds()


def speeds():
    """Steps of larger lattices by Taichi, beside the forces of `benches -- mechanics`."""
    for side in (18, 46):
        ti.init(arch=ti.cpu, cpu_max_num_threads=1)
        cells = (side - 1,) * 3
        nowhere = lambda x: x[:, 0] < 0
        peer = Tetrahedra(Task("forces", (0, 0, 0), (1, 1, 1), 0.0, 1.0, nowhere, nowhere, [cells]), cells, 0.4)
        peer.reset(1e-6)
        row = {"task": "forces", "poissons_ratio": 0.4, "method": "Taichi, tetrahedra", "nodes": len(peer.x)}
        yield row | {"seconds": seconds(peer)}


def main():
    print(f"MuJoCo {mujoco.__version__}, Taichi {'.'.join(map(str, ti.__version__))}, one thread each", flush=True)
    found = list(rows("--quick" in sys.argv))
    with open(f"{OUT}/mechanics.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(found[0]))
        writer.writeheader()
        writer.writerows(found)
    command = ["cargo", "run", "--quiet", "--release", "-p", "benches", "--", "mechanics", "--chart", f"{OUT}/mechanics.csv"]
    subprocess.run([*command, "--out", OUT], check=True)


if __name__ == "__main__":
    main()
