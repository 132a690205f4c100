"""Draws a ball of 100,000 points with normals at 1280 x 720: phyxel-splat and pyvista.

`pip install numpy pyvista`, then `python3 benches/peers/pictures.py`; without a display VTK draws by EGL or Mesa, on the
processor where there is no card. `cargo run --release -p benches -- splat` has the same by phyxel-splat in its table
`ball`. Errors are against
the ball itself: pixels of its disk that show nothing, pixels outside that show something, and RMS of the depth over the
ball's radius.
"""

import os
import time

import numpy as np
import pyvista as pv

COUNT, SIZE = 100_000, (1280, 720)

i = np.arange(COUNT)
z = 1 - (2 * i + 1) / COUNT
around = 2.399963229728653 * i
ball = np.c_[np.sqrt(1 - z * z) * np.cos(around), np.sqrt(1 - z * z) * np.sin(around), z]


def draw(name, **style):
    start = time.perf_counter()
    plotter = pv.Plotter(off_screen=True, window_size=SIZE)
    cloud = pv.PolyData(ball)
    cloud.point_data.active_normals = ball
    plotter.add_mesh(cloud, color=(0.5, 0.1, 0.08), **style)
    plotter.camera_position = [(0, -4, 0), (0, 0, 0), (0, 0, 1)]
    plotter.camera.view_angle = 35
    plotter.show(auto_close=False)
    first = time.perf_counter() - start
    times = []
    for turn in range(5):
        # From another side each time, so that nothing is drawn from what was kept.
        plotter.camera.azimuth = 20.0 * (turn + 1)
        start = time.perf_counter()
        plotter.render()
        plotter.screenshot(return_img=True)
        times.append(time.perf_counter() - start)
    plotter.camera.azimuth = 0.0
    plotter.render()
    depth = -plotter.get_image_depth()
    # Rays through the middles of pixels; the ball is 4 radii away.
    scale = np.tan(np.radians(35 / 2)) / (SIZE[1] / 2)
    x = (np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) * scale
    y = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2)[:, None] * scale
    square = 1 + x * x + y * y
    inside = 16 - 15 * square
    hit = inside > 0
    exact = (4 - np.sqrt(np.where(hit, inside, 0))) / square
    seen = np.isfinite(depth)
    both = hit & seen
    holes = np.count_nonzero(hit & ~seen)
    error = np.sqrt(np.mean((depth - exact)[both] ** 2))
    print(
        f"{name}: {1e3 * np.median(times):.0f} ms a picture ({1e3 * first:.0f} the first), {holes} holes, "
        f"{np.count_nonzero(seen & ~hit)} pixels outside, depth {error:.1e}",
        flush=True,
    )
    if folder := os.environ.get("PICTURES"):
        plotter.screenshot(os.path.join(folder, name.replace(" ", "-") + ".png"))
    plotter.close()


draw("pyvista points of 5 pixels", style="points", point_size=5)
draw("pyvista points as spheres", style="points", point_size=5, render_points_as_spheres=True)
