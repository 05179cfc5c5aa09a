"""Conservative integration of rigid-body rotation, and the words that every method here shares.

The shortest use of it:

    import conservative as cv

    trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)
"""

from . import scenes, shapes
from .body import RigidBody
from .errors import (
    AccuracyNotReached,
    BadInput,
    Diverged,
    IntegrationFailed,
    MissingEngine,
    MissingExtra,
    NotConverged,
    PotentialFailed,
    Unsupported,
    WrongBranch,
)
from .invariants import Invariant
from .method import Grid, Method, Role, integrate
from .methods.convected import Convected
from .methods.gauss import Gauss
from .methods.lame import Lame
from .methods.moser_veselov import MoserVeselov
from .methods.projected import Projected
from .methods.reduced import Reduced
from .methods.substepped import Substepped
from .outcome import Outcome, OutcomeKind
from .potentials.gravity_gradient import GravityGradient
from .potentials.point_to_point import LinearSpring, PointAttraction
from .potentials.potential import Potential, UniformGravity
from .potentials.python_function import FunctionPotential
from .scene import Scene
from .trajectory import Counters, Trajectory
from .version import VERSION

__all__ = [
    "VERSION",
    "AccuracyNotReached",
    "BadInput",
    "Convected",
    "Counters",
    "Diverged",
    "FunctionPotential",
    "Gauss",
    "GravityGradient",
    "Grid",
    "IntegrationFailed",
    "Invariant",
    "Lame",
    "LinearSpring",
    "Method",
    "MissingEngine",
    "MissingExtra",
    "MoserVeselov",
    "NotConverged",
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
    "Trajectory",
    "UniformGravity",
    "Unsupported",
    "WrongBranch",
    "integrate",
    "scenes",
    "shapes",
]

__version__ = VERSION
