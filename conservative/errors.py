"""Errors a user can act on: which argument, what was got, what is allowed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, Self

from .outcome import Outcome, OutcomeKind

if TYPE_CHECKING:
    from pathlib import Path


class _Error(Exception):
    """What can be sent to another process, whatever arguments its `__init__` takes."""

    def __reduce__(self) -> tuple[object, ...]:
        return _restore, (type(self), self.args, self.__dict__)


def _restore(kind: type[_Error], args: tuple[object, ...], values: dict[str, object]) -> _Error:
    """Return an error that was sent from another process: without a call of its constructor, which takes other arguments."""
    found = kind.__new__(kind, *args)
    found.args = args
    found.__dict__.update(values)
    return found


class BadInput(_Error, ValueError):
    """An invalid argument. The message contains its name, the value and the allowed values."""

    def __init__(self, argument: str, got: object, allowed: str) -> None:
        self.argument, self.got, self.allowed = argument, got, allowed
        super().__init__(f"{argument}: got {got}; allowed: {allowed}")


class Unsupported(BadInput):
    """The method does not support the scene."""


class NotLoadable(BadInput):
    """What a name is registered for cannot be imported. Attribute: `place`, what the entry point says."""

    def __init__(self, argument: str, name: str, place: str, cause: Exception) -> None:
        self.place = place
        got = f"{name!r}, registered as {place!r}, which cannot be loaded ({type(cause).__name__}: {cause})"
        super().__init__(argument, got, "an entry point that names what is there")


class NotWritten(BadInput):
    """A file or a folder cannot be written. Existing files are unchanged. Attributes: `path`, and the `cause`."""

    def __init__(
        self,
        argument: str,
        path: Path,
        cause: Exception,
        allowed: str = "a file in a folder that exists and can be written, on a disk with room for it",
    ) -> None:
        self.path, self.cause = path, cause
        super().__init__(argument, f"{str(path)!r} ({getattr(cause, 'strerror', None) or cause})", allowed)


class MissingEngine(_Error, ImportError):
    """An engine is not installed. The message contains the command that installs it."""

    def __init__(self, engine: str, package: str) -> None:
        self.engine, self.package = engine, package
        super().__init__(f"{engine} is not installed. Run: pip install {package}")


class MissingExtra(_Error, ImportError):
    """Packages of an extra are not installed. The message contains the command that installs them.

    Attributes: `what` needs them, the names of the `packages`, and the `extra`.
    """

    def __init__(self, what: str, packages: str, extra: str) -> None:
        self.what, self.packages, self.extra = what, packages, extra
        super().__init__(f"{what} needs {packages}. Run: pip install 'conservative-rotation[{extra}]'")


class IntegrationFailed(_Error, ArithmeticError):
    """A run failed. Attribute: `outcome`, which trajectories and tables contain."""

    outcome: Outcome

    def at_times(self, unit: float) -> Self:
        """Return the failure with its time, which is in units of `unit` s, in s; of failures without a time the same."""
        return self


class NotConverged(IntegrationFailed):
    """The equations of a step could not be solved.

    Attributes: `step` (number of the step that failed, from 1), `time` (s, at its start), `residual` (last size of the
    residual, or of the correction relative to the unknown) and `reason` (more about it; may be empty).
    """

    kind: ClassVar[OutcomeKind] = OutcomeKind.NOT_CONVERGED

    def __init__(self, step: int, time: float, residual: float, reason: str = "") -> None:
        self.step, self.time, self.residual, self.reason = step, time, residual, reason
        self.outcome = Outcome(self.kind, reason, step, time, residual)
        super().__init__(
            f"dt: got a step whose equations have no solution within reach: {self.outcome}; "
            "allowed: a shorter step, or on_failure='return' to keep what was reached"
        )

    def at_times(self, unit: float) -> Self:
        """Return the failure with its time, which is in units of `unit` s, in s."""
        return type(self)(self.step, self.time * unit, self.residual, self.reason)


class WrongBranch(NotConverged):
    """The solver found a solution of a step's equations on another branch than the one that continues the motion."""

    kind = OutcomeKind.WRONG_BRANCH


class Diverged(IntegrationFailed):
    """The state is no longer finite, or an engine stopped. Attributes: `time` (s, of the last good sample), `reason`."""

    def __init__(self, time: float, reason: str = "the state is not finite") -> None:
        self.time, self.reason = time, reason
        self.outcome = Outcome(OutcomeKind.DIVERGED, reason, time=time)
        super().__init__(
            f"dt: got a run that {self.outcome}; allowed: a shorter step, a tighter tolerance, or on_failure='return'"
        )

    def at_times(self, unit: float) -> Self:
        """Return the failure with its time, which is in units of `unit` s, in s."""
        return type(self)(self.time * unit, self.reason)


class NotConserved(IntegrationFailed):
    """A run reached its end, but an invariant that its method conserves drifted.

    Attributes: `time` (s, of the last good sample), `quantity` (name of the invariant, or orthonormality), its largest `drift`
    and the `bound` for the outcome ok, both relative.
    """

    def __init__(self, time: float, quantity: str, drift: float, bound: float) -> None:
        self.time, self.quantity, self.drift, self.bound = time, quantity, drift, bound
        reason = f"{quantity} is off by {drift:.3g}, where {bound:.3g} is allowed"
        self.outcome = Outcome(OutcomeKind.NOT_CONSERVED, reason, time=time)
        super().__init__(
            f"dt: got a run that ended {self.outcome}; allowed: a shorter step, a tighter tolerance, or on_failure='return'"
        )


class InvalidResult(IntegrationFailed):
    """A method's result is not a trajectory of the scene on the grid. Attribute: `reason`."""

    def __init__(self, label: str, reason: str) -> None:
        self.label, self.reason = label, reason
        self.outcome = Outcome(OutcomeKind.INVALID, reason)
        super().__init__(
            f"method: got {reason} from {label}; "
            "allowed: a Trajectory of the scene, with arrays of float64 that have a sample for each time of the grid"
        )


class NotRun(IntegrationFailed):
    """The method does not support one body of many. Attribute: `reason`, the message of `integrate` for this body."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.outcome = Outcome(OutcomeKind.UNSUPPORTED, reason)
        super().__init__(reason)


class PotentialFailed(_Error, RuntimeError):
    """A user's function of a potential raised an exception, which is the `__cause__` of this one."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__(
            f"potential: got {cause!r} from its energy or gradient; "
            "allowed: functions that give finite numbers for every matrix (3, 3) near a rotation"
        )


class AccuracyNotReached(UserWarning):
    """The requested error is not reached, as rounding causes a larger one. Attributes: `error`, `estimate` (rad)."""

    def __init__(self, error: float, estimate: float) -> None:
        self.error, self.estimate = error, estimate
        super().__init__(
            f"an error of {error:g} rad is not reached, {estimate:.2g} rad is estimated: rounding has an effect as large as "
            "that on this motion. Ask for a larger error, or for a shorter t_end"
        )


EXTRAS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "engines": ("mujoco", "pinocchio", "heyoka"),
        "environments": ("uv", "platformdirs"),
        "report": ("click", "rich", "jinja2", "itables", "pandas", "altair", "vl_convert", "cloudpickle"),
        "ensembles": ("zarr",),
        "cluster": ("distributed", "cloudpickle"),
        "gate": ("click", "pytest", "pytest_benchmark", "heyoka"),
    }
)
"""Packages, under the names they are imported by, of each extra in pyproject.toml.

Packaging data, and nothing that the code here depends on: an extra that is missing has to be named before it is imported.
"""


def require_extra(what: str, extra: str, *packages: str) -> None:
    """Check that packages are there; none is imported.

    Parameters
    ----------
    what
        What needs them, such as `conservative report`.
    extra
        The extra that brings them, a key of `EXTRAS`.
    packages
        Their names as they are imported; by default all of the extra.

    Raises
    ------
    MissingExtra
        One of them is not installed.
    """
    missing = [package for package in packages or EXTRAS[extra] if find_spec(package) is None]
    if missing:
        raise MissingExtra(what, ", ".join(missing), extra)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return what to say is allowed instead of an unknown `name`: the nearest known one first."""
    known = sorted(known)
    close = get_close_matches(name, known, n=1)
    listing = ", ".join(known)
    return f"{close[0]!r} (nearest), or one of {listing}" if close else f"one of {listing}"
