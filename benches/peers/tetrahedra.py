"""Fills closed surfaces with tetrahedra: phyxel-discretize, gmsh and TetGen.

`pip install numpy gmsh pyvista tetgen`, then `python3 benches/peers/tetrahedra.py [FILE..] [--nodes N]`. Without a file it
takes a ball of 5,120 triangles. It builds and runs `cargo run --release -p phyxel-discretize --example quality`. Each
is asked for about as many nodes as are named; times leave reading files out but for phyxel's, whose row is of
sampling alone too. All on one thread but phyxel, which takes RAYON_NUM_THREADS=1 as well.
"""

import os
import subprocess
import sys
import tempfile
import time
import warnings

os.environ["RAYON_NUM_THREADS"] = "1"
warnings.filterwarnings("ignore", category=DeprecationWarning)

import gmsh
import numpy as np
import pyvista as pv
import tetgen

EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


def quality(points, tets, volume, seconds, name):
    """A row in the format of `quality`."""
    x = points[tets]
    six = np.einsum("ij,ij->i", np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), x[:, 3] - x[:, 0])
    volumes = np.abs(six) / 6
    angles = []
    for a, b in EDGES:
        c, d = (k for k in range(4) if k not in (a, b))
        axis = x[:, b] - x[:, a]
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        across = [x[:, k] - x[:, a] for k in (c, d)]
        across = [v - np.einsum("ij,ij->i", v, axis)[:, None] * axis for v in across]
        u, v = (w / np.linalg.norm(w, axis=1)[:, None] for w in across)
        angles.append(np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", u, v), -1, 1))))
    nodal = np.bincount(tets.ravel(), np.repeat(volumes / 4, 4), len(points))
    used = nodal[np.bincount(tets.ravel(), minlength=len(points)) > 0]
    lengths = np.concatenate([np.linalg.norm(x[:, a] - x[:, b], axis=1) for a, b in EDGES])
    print(
        f"| {name} | {len(used)} | {len(tets)} | {np.min(angles):.1f} | {np.max(angles):.1f} "
        f"| {lengths.min() / lengths.mean():.2f} | {used.min() / used.mean():.3f} "
        f"| {100 * (volumes.sum() / volume - 1):+.2f} % | {1e3 * seconds:.0f} ms |",
        flush=True,
    )


def by_gmsh(file, surface, spacing):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMin", spacing)
    gmsh.option.setNumber("Mesh.MeshSizeMax", spacing)
    gmsh.merge(file)
    start = time.perf_counter()
    gmsh.model.mesh.classifySurfaces(np.pi, True, True)
    gmsh.model.mesh.createGeometry()
    shells = gmsh.model.getEntities(2)
    gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([tag for _, tag in shells])])
    gmsh.model.geo.synchronize()
    gmsh.model.mesh.generate(3)
    seconds = time.perf_counter() - start
    tags, points, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(4)
    gmsh.finalize()
    place = np.zeros(int(tags.max()) + 1, int)
    place[tags.astype(int)] = np.arange(len(tags))
    return points.reshape(-1, 3), place[corners.astype(int)].reshape(-1, 4), seconds


def by_tetgen(file, surface, spacing):
    # The volume of an even tetrahedron of that edge; TetGen keeps the surface's own triangles.
    start = time.perf_counter()
    mesher = tetgen.TetGen(surface)
    mesher.tetrahedralize(order=1, mindihedral=15, minratio=1.4, fixedvolume=True, maxvolume=spacing**3 / 8.5)
    seconds = time.perf_counter() - start
    grid = mesher.grid
    return np.asarray(grid.points), grid.cells_dict[10], seconds


files, nodes = [], 6000
arguments = iter(sys.argv[1:])
for argument in arguments:
    if argument == "--nodes":
        nodes = int(next(arguments))
    else:
        files.append(argument)
folder = tempfile.mkdtemp()
if not files:
    files = [os.path.join(folder, "ball.stl")]
    pv.Icosphere(radius=1.0, nsub=4).save(files[0])
print("| mesh | nodes | tets | min dihedral | max dihedral | shortest/mean edge | min/mean nodal volume | volume error | time |")
print("|---|---:|---:|---:|---:|---:|---:|---:|---:|")
for file in files:
    command = "cargo run --quiet --release -p phyxel-discretize --example quality --".split()
    told = subprocess.run([*command, "--nodes", str(nodes), file], check=True, capture_output=True, text=True)
    for line in told.stdout.splitlines()[2:]:
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if "own" not in cells[0]:
            # All but the stable step, which the others are not asked for.
            print("| phyxel | " + " | ".join(cells[1:7] + cells[8:]) + " |", flush=True)
    surface = pv.read(file).clean().triangulate().extract_surface(algorithm=None)
    surface.save(stl := os.path.join(folder, "surface.stl"))
    # The spacing that gives as many nodes with even tetrahedra (about 5.6 to a node), inner nodes alone.
    spacing = (surface.volume / nodes * 8.5 / 5.6) ** (1 / 3)
    for name, by in [("gmsh", by_gmsh), ("TetGen", by_tetgen)]:
        try:
            wanted = spacing
            for _ in range(3):
                points, tets, seconds = by(stl, surface, wanted)
                # Nearer to the number that is asked for; what is told is the last time alone.
                wanted *= (len(np.unique(tets)) / nodes) ** (1 / 3)
            quality(points, tets, surface.volume, seconds, name)
        except Exception as problem:  # their own words: a mesh that they refuse is a row, too
            print(f"| {name} | {problem} |", flush=True)
