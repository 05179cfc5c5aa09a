"""Conservative integration of rigid-body rotation, and the words that every method here shares.

import conservative as cv

trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)
"""

from . import scenes, shapes
from .body import RigidBody
from .collocation import Gauss
from .convected import Convected
from .errors import (
    AccuracyNotReached,
    BadInput,
    Diverged,
    IntegrationFailed,
    MissingEngine,
    NotConverged,
    PotentialFailed,
    Unsupported,
    WrongBranch,
)
from .function_potential import FunctionPotential
from .gravity_gradient import GravityGradient
from .invariants import Invariant
from .lame import Lame
from .method import Grid, Method, integrate
from .moser_veselov import MoserVeselov
from .point_potentials import LinearSpring, PointAttraction
from .potential import Potential, UniformGravity
from .projected import Projected
from .reduced import Reduced
from .scene import Scene
from .substepped import Substepped
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
    "MoserVeselov",
    "NotConverged",
    "PointAttraction",
    "Potential",
    "PotentialFailed",
    "Projected",
    "Reduced",
    "RigidBody",
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
