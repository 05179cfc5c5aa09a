"""SDF: versions after 1.6 are refused, with a warning."""

import sys
from pathlib import Path

import dartpy

text, refused, path = open(sys.argv[1]).read(), [], Path("version.sdf").absolute()
for version in ("1.4", "1.5", "1.6", "1.7", "1.8", "1.9", "1.10", "1.11"):
    path.write_text(text.replace('version="1.6"', f'version="{version}"'))
    if dartpy.utils.SdfParser.readSkeleton(str(path)) is None:
        refused.append(version)
if "1.6" in refused:
    sys.exit("it refuses 1.6, too")
print(f"refused: {', '.join(refused) or 'none'} of 1.4 to 1.11:", "wrong" if refused else "right")
