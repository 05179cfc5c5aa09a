import importlib

import pytest

import conservative as cv
from conservative import deferred_imports
from conservative.attitude import rotation_about
from conservative.references.environments import folders

from ..shared_reader import reading_worker, shared_reader  # noqa: F401
from . import trial_engine
from .local_wheels import write_numpy, write_wheel
from .trial_engine import make_environment

# Generic parameters: turned body and world axes, an inertia with off-diagonal terms, a weight that is not 1.
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
    """Register the test engine, as an installed package does."""
    info = tmp_path / "trial_engine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: trial_engine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{deferred_imports.ENGINES}]\ntrial = {trial_engine.__name__}:Trial\n")
    with monkeypatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        importlib.invalidate_caches()
        deferred_imports.list_entries.cache_clear()
        yield
    deferred_imports.list_entries.cache_clear()


@pytest.fixture(scope="session")
def trial_home(tmp_path_factory):
    """Return a cache folder with an environment of the test engine."""
    home = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(home))
        make_environment(folders.folder_of_all())
    return home


@pytest.fixture
def trial_cache(trial_home, monkeypatch):
    """Return the folder of all environments; there is one of the test engine."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(trial_home))
    return folders.folder_of_all()


@pytest.fixture(scope="session")
def wheels(tmp_path_factory):
    """Return a folder of wheels of NumPy and of three versions of the trial engine's package."""
    folder = tmp_path_factory.mktemp("wheels")
    for version in ("1.0", "1.10", "1.9"):
        write_wheel(folder, version)
    write_numpy(folder)
    return folder


@pytest.fixture
def no_environments(tmp_path, monkeypatch, trial_registered):
    """Return the folder of all environments, which is empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return folders.folder_of_all()
