"""All comparisons with others' programs in one run: `python3 benches/peers/all.py`.

What to install stands in the first lines of each.
"""

import os
import subprocess
import sys

folder = os.path.dirname(os.path.abspath(__file__))
for name in ("interpolation", "tetrahedra", "pictures"):
    print(f"{name}:", flush=True)
    subprocess.run([sys.executable, os.path.join(folder, f"{name}.py")], check=True)
