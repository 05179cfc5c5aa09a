"""Conservative integration of rigid-body rotation, and the words that every method here shares.

import conservative as cv

trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)
"""

from . import scenes as scenes
from . import shapes as shapes
from .body import RigidBody as RigidBody
from .collocation import Gauss as Gauss
from .convected import Convected as Convected
from .errors import BadInput as BadInput
from .errors import Diverged as Diverged
from .errors import IntegrationFailed as IntegrationFailed
from .errors import MissingEngine as MissingEngine
from .errors import NotConverged as NotConverged
from .errors import PotentialFailed as PotentialFailed
from .errors import Unsupported as Unsupported
from .errors import WrongBranch as WrongBranch
from .function_potential import FunctionPotential as FunctionPotential
from .gravity_gradient import GravityGradient as GravityGradient
from .invariants import Invariant as Invariant
from .lame import Lame as Lame
from .method import Grid as Grid
from .method import Method as Method
from .method import integrate as integrate
from .moser_veselov import MoserVeselov as MoserVeselov
from .point_potentials import LinearSpring as LinearSpring
from .point_potentials import PointAttraction as PointAttraction
from .potential import Potential as Potential
from .potential import UniformGravity as UniformGravity
from .reduced import Reduced as Reduced
from .scene import Scene as Scene
from .substepped import Substepped as Substepped
from .trajectory import Counters as Counters
from .trajectory import Trajectory as Trajectory
from .version import VERSION as VERSION

__version__ = VERSION
