"""MJCF: bodies with fixed children that have inertias are refused."""

import sys

from brax.io import mjcf

try:
    mjcf.load_model(mjcf.load_mjmodel(sys.argv[1]))
    print("it loads the file: right")
except ValueError as error:
    print(f"{' '.join(str(error).split())[:80]}: wrong")
