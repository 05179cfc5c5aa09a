"""The class of the test engine, and an environment for it that links to the packages of this one."""

import json
import sys

import numpy

from conservative.references.environments.engine_method import engine_class

from ..environments import Environment
from . import trial

VERSION = "1.0"


Trial = engine_class(trial)


def make_environment(folder, version=VERSION):
    """Create an environment of the test engine in a folder of all environments."""
    place = folder / "trial" / version
    place.parent.mkdir(parents=True, exist_ok=True)
    Environment.create(place)
    (site,) = place.glob("lib/python*/site-packages")
    (site / "dies_at_import.py").write_text("import os\nos.kill(os.getpid(), 11)\n")
    packages = [f"numpy=={numpy.__version__}"]
    record = {"engine": "trial", "version": version, "runtime": f"Python {sys.version.split()[0]}", "packages": packages}
    (place / "record.json").write_text(json.dumps(record))
    return place
