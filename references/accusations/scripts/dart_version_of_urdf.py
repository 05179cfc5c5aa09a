"""URDF: version 1.1 is refused, with a warning."""

import sys
from pathlib import Path

import dartpy

text, path, loaded = Path(sys.argv[1]).read_text(), Path("version.urdf").absolute(), []
for version in ("1.0", "1.1"):
    path.write_text(text.replace('version="1.1"', f'version="{version}"'))
    if dartpy.utils.DartLoader().parseSkeleton(str(path)) is not None:
        loaded.append(version)
if "1.0" not in loaded:
    sys.exit("it refuses 1.0, too")
print(f"of 1.0 and 1.1 it loads {', '.join(loaded)}:", "right" if "1.1" in loaded else "wrong")
