"""The studies by what they declare."""

from conservative.benchmarks.studies.declaration import Extent, Named
from conservative.benchmarks.studies.studies import STUDIES

ENGINES = tuple(name for name, each in STUDIES.items() if each.named is Named.ONLY)
"""Studies of engines only."""
DRAWN = tuple(name for name, each in STUDIES.items() if each.draw)
"""Studies of bodies that are drawn."""
MAIN, FULL = (
    tuple(name for name, each in STUDIES.items() if each.extent <= extent and name not in (*ENGINES, *DRAWN))
    for extent in (Extent.EVERY, Extent.FULL)
)
"""Studies of the scenes of every report, and of a full one that is quick."""
