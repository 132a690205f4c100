"""Interpolates a smooth function from 10,000 random points at 100,000 others: phyxel-mls, SciPy, Compadre and VTK.

`pip install numpy scipy pyvista`, then `python3 benches/peers/interpolation.py`. It runs
`cargo run --release -p benches -- prove scattered` first, whose points are the same, all on one thread (the thread
counts below are set before NumPy is loaded). Neighbours of SciPy may be named as arguments.

Compadre 1.0.35 (polynomials by moving least squares, order 2 by default here) comes as sources with all of Kokkos: unpack
`pip download --no-binary :all: --no-build-isolation compadre`, build it by CMake below 4 with SWIG below 4.1, Fortran and
LAPACK (`-DCompadre_USE_PYTHON=ON -DPYTHON_CALLING_BUILD=ON -DCMAKE_BUILD_TYPE=Release`), and name the folder
`python` of the build in COMPADRE. Without it its rows are left out.
"""

import os
import subprocess
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RAYON_NUM_THREADS", "VTK_SMP_MAX_THREADS", "KOKKOS_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np
import pyvista as pv
from scipy.interpolate import LinearNDInterpolator, RBFInterpolator


def points(count, seed):
    """Uniform in the unit cube: SplitMix64, the upper 53 bits."""
    with np.errstate(over="ignore"):
        step = np.uint64(0x9E3779B97F4A7C15)
        z = np.uint64(seed) + step * np.arange(1, 3 * count + 1, dtype=np.uint64)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        bits = (z ^ (z >> np.uint64(31))) >> np.uint64(11)
    return (bits.astype(float) / 2.0**53).reshape(-1, 3)


def field(x):
    return np.sin(3 * x[:, 0]) * np.cos(2 * x[:, 1]) + x[:, 2] ** 2 * x[:, 0]


def row(name, make, ask):
    """The shorter of two runs, as phyxel's are two."""
    runs = []
    for _ in range(2):
        start = time.perf_counter()
        made_of = make()
        made = time.perf_counter()
        found = ask(made_of)
        runs.append((time.perf_counter() - made, made - start))
    asked, made = min(runs)
    held = np.isfinite(found)
    error = np.sqrt(np.mean((found - field(queries))[held] ** 2))
    print(
        f"{name}: {1e3 * made:.0f} ms to make, {1e3 * asked:.0f} ms to ask, "
        f"RMS error {error:.2e}, {np.count_nonzero(~held)} without an answer",
        flush=True,
    )


def vtk(**settings):
    """pyvista's `interpolate`: an average of the points within a radius, weighted by their distance."""
    cloud = pv.PolyData(nodes)
    cloud["u"] = values
    found = pv.PolyData(queries).interpolate(cloud, null_value=np.nan, **settings)
    return np.asarray(found["u"])


def compadre(module, order, factor):
    """Its own search, `factor` times the radius that holds as many neighbours as the basis has functions; room for 4 times as many."""
    solver = module.GMLS_Python(order, "QR", order, 3)
    solver.setWeightingType("power")
    solver.setWeightingOrder(4)
    solver.generateKDTree(nodes)
    solver.generateNeighborListsFromKNNSearchAndSet(queries, order, 3, factor, 4.0)
    solver.setSourceSites(nodes)
    solver.generatePointEvaluationStencil(100, False)  # in batches that fit the cache
    return np.array(solver.applyStencil(values))


subprocess.run(
    ["cargo", "run", "--quiet", "--release", "-p", "benches", "--", "prove", "scattered"], check=True
)
nodes, queries = points(10_000, 1), points(100_000, 2)
values = field(nodes)
for neighbors in [int(k) for k in sys.argv[1:]] or [20, 40, 80]:
    row(
        f"SciPy RBFInterpolator, {neighbors} neighbours",
        lambda: RBFInterpolator(nodes, values, neighbors=neighbors),
        lambda rbf: rbf(queries),
    )
if folder := os.environ.get("COMPADRE"):
    sys.path.append(folder)
    import GMLS_Module

    kokkos = GMLS_Module.Kokkos_Python()
    for order, factor in [(1, 1.5), (2, 1.2), (2, 1.5)]:
        name = f"Compadre, order {order}, {factor} radii"
        row(name, lambda: None, lambda _: compadre(GMLS_Module, order, factor))
row("SciPy LinearNDInterpolator", lambda: LinearNDInterpolator(nodes, values), lambda linear: linear(queries))
row("VTK, Gaussian of radius 0.1", lambda: None, lambda _: vtk(radius=0.1, sharpness=4.0))
