import importlib

import pytest

import conservative as cv
from conservative import deferred_imports
from conservative.attitude import rotation_about

from .trial_engine import Trial

# Nothing special about any of these: turned body and world axes, an inertia with off-diagonal terms, a weight that is not 1.
R_BP = rotation_about((1, 2, 3), 0.7)
R_WB0 = rotation_about((1, -1, 0.3), 1.1)
ASYMMETRIC = cv.RigidBody(R_BP @ [[2.1, 0, 0], [0, 3.3, 0], [0, 0, 4.2]] @ R_BP.T)
SYMMETRIC = cv.RigidBody(R_BP @ [[2.1, 0, 0], [0, 2.1, 0], [0, 0, 3.2]] @ R_BP.T)
RATES = (0.9, -1.1, 0.7)


@pytest.fixture(scope="session")
def free():
    return cv.Scene("free", ASYMMETRIC, R_WB0, RATES, 2.0)


@pytest.fixture(scope="session")
def heavy():
    return cv.Scene("heavy", ASYMMETRIC, R_WB0, RATES, 2.0, cv.UniformGravity(3.1, (0.3, -0.2, 0.5)))


@pytest.fixture(scope="session")
def top():
    return cv.Scene("top", SYMMETRIC, R_WB0, RATES, 2.0, cv.UniformGravity(3.1, 0.5 * R_BP[:, 2]))


@pytest.fixture(scope="session")
def spun():
    return cv.Scene("spun", SYMMETRIC, R_WB0, RATES, 2.0)


@pytest.fixture(scope="session", params=["free", "heavy", "top", "spun"])
def generic(request):
    """Return each of the four scenes above."""
    return request.getfixturevalue(request.param)


@pytest.fixture
def trial_registered(tmp_path, monkeypatch):
    """Register the engine of the tests, as a package that is installed does."""
    info = tmp_path / "trial_engine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: trial_engine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{deferred_imports.ENGINES}]\ntrial = {Trial.__module__}:Trial\n")
    with monkeypatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        importlib.invalidate_caches()
        deferred_imports.list_entries.cache_clear()
        yield
    deferred_imports.list_entries.cache_clear()
