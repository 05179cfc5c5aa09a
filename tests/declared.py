"""The studies by what they declare."""

from conservative.benchmarks.studies.declaration import Extent
from conservative.benchmarks.studies.studies import STUDIES

NAMED = tuple(name for name, each in STUDIES.items() if each.named and not each.draw)
"""Studies of scenes that also measure the engines that are named for a report."""
DRAWN = tuple(name for name, each in STUDIES.items() if each.draw)
"""Studies of bodies that are drawn."""
MAIN, FULL = (
    tuple(name for name, each in STUDIES.items() if each.extent <= extent and name not in DRAWN)
    for extent in (Extent.EVERY, Extent.FULL)
)
"""Studies of the scenes of every report, and of a full one that is quick."""
