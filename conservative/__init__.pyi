"""Public names, each with its module: the one list of them. `__init__.py` and type checkers read it."""

from . import scenes as scenes
from . import shapes as shapes
from .body import RigidBody as RigidBody
from .card import Card as Card
from .errors import AccuracyNotReached as AccuracyNotReached
from .errors import BadInput as BadInput
from .errors import Diverged as Diverged
from .errors import IntegrationFailed as IntegrationFailed
from .errors import InvalidResult as InvalidResult
from .errors import MissingEngine as MissingEngine
from .errors import MissingExtra as MissingExtra
from .errors import NotConserved as NotConserved
from .errors import NotConverged as NotConverged
from .errors import NotRun as NotRun
from .errors import NotWritten as NotWritten
from .errors import PotentialFailed as PotentialFailed
from .errors import Unsupported as Unsupported
from .errors import WrongBranch as WrongBranch
from .grid import Grid as Grid
from .integration.ensemble import Ensemble as Ensemble
from .integration.ensemble import open_ensemble as open_ensemble
from .integration.many import integrate_many as integrate_many
from .integration.one import integrate as integrate
from .integration.spread import spread as spread
from .invariants import Invariant as Invariant
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

__all__: list[str]
__version__: str
