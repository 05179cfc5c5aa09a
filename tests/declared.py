"""The studies by what they declare."""

from conservative.benchmarks.studies.declaration import Extent, Named
from conservative.benchmarks.studies.studies import STUDIES

ONLY = tuple(name for name, each in STUDIES.items() if each.named is Named.ONLY)
"""Studies of engines only."""
ENGINES = tuple(name for name in ONLY if not STUDIES[name].scenes)
"""Those of any scene, which are in every report with engines."""
DRAWN = tuple(name for name, each in STUDIES.items() if each.draw)
"""Studies of bodies that are drawn."""
MAIN, FULL = (
    tuple(name for name, each in STUDIES.items() if each.extent <= extent and name not in (*ONLY, *DRAWN))
    for extent in (Extent.EVERY, Extent.FULL)
)
"""Studies of the scenes of every report, and of a full one that is quick."""
