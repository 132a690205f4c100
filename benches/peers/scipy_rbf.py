"""Interpolates the function of `cargo run --release -p phyxel-mls --example scattered` with SciPy.

`pip install numpy scipy`, then `python3 benches/peers/scipy_rbf.py`. The points are the same.
"""

import sys
import time

import numpy as np
from scipy.interpolate import RBFInterpolator


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


nodes, queries = points(10_000, 1), points(100_000, 2)
values = field(nodes)
for neighbors in [int(k) for k in sys.argv[1:]] or [20, 40, 80]:
    start = time.perf_counter()
    interpolator = RBFInterpolator(nodes, values, neighbors=neighbors)
    made = time.perf_counter()
    found = interpolator(queries)
    asked = time.perf_counter()
    error = np.sqrt(np.mean((found - field(queries)) ** 2))
    print(
        f"{neighbors} neighbors: {1e3 * (made - start):.0f} ms to make, "
        f"{1e3 * (asked - made):.0f} ms to ask, RMS error {error:.2e}"
    )
