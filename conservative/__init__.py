"""Conservative integration of rigid-body rotation, and the words that every method here shares.

The shortest use of it:

    import conservative as cv

    trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)

Names are imported when they are first used: the pytest plugin lies below this package, and must not cost anybody NumPy.
"""

from importlib import import_module

TYPE_CHECKING = False  # not that of typing, which takes longer to import than all else here

if TYPE_CHECKING:
    from . import scenes as scenes
    from . import shapes as shapes
    from .body import RigidBody as RigidBody
    from .errors import AccuracyNotReached as AccuracyNotReached
    from .errors import BadInput as BadInput
    from .errors import Diverged as Diverged
    from .errors import IntegrationFailed as IntegrationFailed
    from .errors import InvalidResult as InvalidResult
    from .errors import MissingEngine as MissingEngine
    from .errors import MissingExtra as MissingExtra
    from .errors import NotConserved as NotConserved
    from .errors import NotConverged as NotConverged
    from .errors import NotWritten as NotWritten
    from .errors import PotentialFailed as PotentialFailed
    from .errors import Unsupported as Unsupported
    from .errors import WrongBranch as WrongBranch
    from .integration import integrate as integrate
    from .invariants import Invariant as Invariant
    from .method import Grid as Grid
    from .method import Method as Method
    from .method import Role as Role
    from .methods.convected import Convected as Convected
    from .methods.gauss import Gauss as Gauss
    from .methods.lame import Lame as Lame
    from .methods.moser_veselov import MoserVeselov as MoserVeselov
    from .methods.projected import Projected as Projected
    from .methods.reduced import Reduced as Reduced
    from .methods.substepped import Substepped as Substepped
    from .methods.taylor import Taylor as Taylor
    from .outcome import Outcome as Outcome
    from .outcome import OutcomeKind as OutcomeKind
    from .potentials.gravity_gradient import GravityGradient as GravityGradient
    from .potentials.point_to_point import LinearSpring as LinearSpring
    from .potentials.point_to_point import PointAttraction as PointAttraction
    from .potentials.potential import Potential as Potential
    from .potentials.python_function import FunctionPotential as FunctionPotential
    from .potentials.turning import Orbit as Orbit
    from .potentials.turning import Turning as Turning
    from .potentials.uniform_gravity import UniformGravity as UniformGravity
    from .scene import Scene as Scene
    from .trajectory import Bounds as Bounds
    from .trajectory import Counters as Counters
    from .trajectory import Trajectory as Trajectory
    from .version import VERSION as VERSION

_MODULES = ("scenes", "shapes")
_PLACES = {
    "VERSION": "version",
    "AccuracyNotReached": "errors",
    "BadInput": "errors",
    "Bounds": "trajectory",
    "Convected": "methods.convected",
    "Counters": "trajectory",
    "Diverged": "errors",
    "FunctionPotential": "potentials.python_function",
    "Gauss": "methods.gauss",
    "GravityGradient": "potentials.gravity_gradient",
    "Grid": "method",
    "IntegrationFailed": "errors",
    "InvalidResult": "errors",
    "Invariant": "invariants",
    "Lame": "methods.lame",
    "LinearSpring": "potentials.point_to_point",
    "Method": "method",
    "MissingEngine": "errors",
    "MissingExtra": "errors",
    "MoserVeselov": "methods.moser_veselov",
    "NotConserved": "errors",
    "NotConverged": "errors",
    "NotWritten": "errors",
    "Orbit": "potentials.turning",
    "Outcome": "outcome",
    "OutcomeKind": "outcome",
    "PointAttraction": "potentials.point_to_point",
    "Potential": "potentials.potential",
    "PotentialFailed": "errors",
    "Projected": "methods.projected",
    "Reduced": "methods.reduced",
    "RigidBody": "body",
    "Role": "method",
    "Scene": "scene",
    "Substepped": "methods.substepped",
    "Taylor": "methods.taylor",
    "Trajectory": "trajectory",
    "Turning": "potentials.turning",
    "UniformGravity": "potentials.uniform_gravity",
    "Unsupported": "errors",
    "WrongBranch": "errors",
    "integrate": "integration",
}

__all__ = [
    "VERSION",
    "AccuracyNotReached",
    "BadInput",
    "Bounds",
    "Convected",
    "Counters",
    "Diverged",
    "FunctionPotential",
    "Gauss",
    "GravityGradient",
    "Grid",
    "IntegrationFailed",
    "InvalidResult",
    "Invariant",
    "Lame",
    "LinearSpring",
    "Method",
    "MissingEngine",
    "MissingExtra",
    "MoserVeselov",
    "NotConserved",
    "NotConverged",
    "NotWritten",
    "Orbit",
    "Outcome",
    "OutcomeKind",
    "PointAttraction",
    "Potential",
    "PotentialFailed",
    "Projected",
    "Reduced",
    "RigidBody",
    "Role",
    "Scene",
    "Substepped",
    "Taylor",
    "Trajectory",
    "Turning",
    "UniformGravity",
    "Unsupported",
    "WrongBranch",
    "integrate",
    "scenes",
    "shapes",
]


def __getattr__(name: str) -> object:
    """Import a public name at its first use (PEP 562)."""
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name == "__version__":
        return __getattr__("VERSION")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
