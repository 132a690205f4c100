"""Comparisons with others' programs, all or those that are named: `python3 benches/peers/all.py [NAME..]`.

What to install stands in the first lines of each.
"""

import os
import subprocess
import sys

folder = os.path.dirname(os.path.abspath(__file__))
for name in sys.argv[1:] or ("interpolation", "tetrahedra", "pictures", "mechanics"):
    print(f"{name}:", flush=True)
    subprocess.run([sys.executable, os.path.join(folder, f"{name}.py")], check=True)
