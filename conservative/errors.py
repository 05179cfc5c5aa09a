"""Errors and warnings. Each message ends with a remedy."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar, NoReturn, TypeVar

from .outcome import Outcome, OutcomeKind
from .posix import unstoppable

if TYPE_CHECKING:
    from pathlib import Path

T = TypeVar("T")


class _Error(Exception):
    """An exception that can be pickled, whatever arguments its `__init__` takes."""

    def __reduce__(self) -> tuple[object, ...]:
        return restore, (type(self), self.args, vars(self))


def restore(kind: type[T], args: tuple[object, ...], values: Mapping[str, object]) -> T:
    """Return a pickled exception or object without calling its `__init__`."""
    value = kind.__new__(kind, *args)
    if isinstance(value, BaseException):
        value.args = args
    vars(value).update(values)
    return value


LONGEST = 2000
"""Most characters of a part of a message. Names and values of files can have millions."""


def shorten(text: object) -> str:
    """Return a text, without its middle if it has more than `LONGEST` characters."""
    text = str(text)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} ... {text[-LONGEST // 4 :]}"


class BadInput(_Error, ValueError):
    """An invalid argument, such as `dt: got -1; expected a finite number of seconds above 0`.

    Attributes: `argument` (its name), `got` (the value as text) and `allowed` (the valid values, in words).
    """

    def __init__(self, argument: str, got: object, allowed: str) -> None:
        self.argument, self.got, self.allowed = argument, got, allowed
        super().__init__(f"{shorten(argument)}: got {shorten(got)}; expected {shorten(allowed)}")


REMOVED: Mapping[str, str] = MappingProxyType(
    {
        ".mp4": "write a .gif, and convert it: ffmpeg -i FILE.gif FILE.mp4",
        ".pdf": "write an .svg, and convert it: rsvg-convert --format pdf FILE.svg",
        ".parquet": "CSV: pandas.read_parquet(FILE).to_csv(NEW, index=False)",
        ".gz": "the unpacked file: gunzip FILE",
        **dict.fromkeys((".a", ".aem"), "its rows as CSV, below a line of names, such as time q_x q_y q_z q_w"),
        "run --parquet": "Write CSV with --csv FILE, and convert it: pandas.read_csv(FILE).to_parquet(NEW)",
        "study --latex": "Use --csv, or --markdown and a converter such as pandoc",
        "study engines_at_one_step": "Run: conservative study paper --engines NAMES for errors, drifts and flips, or "
        "conservative study speed --engines NAMES for times",
        "study engines_over_steps": "Run: conservative study convergence --engines NAMES for orders, or "
        "conservative study work_precision --engines NAMES for times",
        "to_xarray": "to_pandas(), which returns the same samples as a table",
        **{"needs": "features", "takes": "supports", "card": "method_info"},
    }
)
"""Removals since the last release, and what to use instead: endings of files, options, studies, and attributes."""


CONVERTED: Mapping[str, str] = MappingProxyType({".mp4": ".gif", ".pdf": ".svg"})
"""Endings of the files from which files of removed endings can be made. The advice helps where those can be written."""


class RemovedAttribute:
    """An attribute that is gone. An error says what to use instead."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    def __get__(self, instance: object, owner: type) -> NoReturn:
        raise AttributeError(f"{owner.__name__}.{self.name} is gone. Use {REMOVED[self.name]}")


class Unsupported(BadInput):
    """The method does not support the scene."""


REINSTALL = "the entry points of these files: run pip install -e . again in their folder, or reinstall conservative-rotation"
"""Advice if the installation is older than the files: entry points are copied when a package is installed."""


class NotLoadable(BadInput):
    """A registered scene, method or reader cannot be imported. Attribute: `place`, the value of its entry point."""

    def __init__(self, argument: str, name: str, place: str, cause: Exception) -> None:
        self.place = place
        got = f"{name!r}, registered as {place!r}, which cannot be loaded ({type(cause).__name__}: {cause})"
        stale = place.startswith(f"{__package__}.") and isinstance(cause, ModuleNotFoundError | AttributeError)
        super().__init__(argument, got, REINSTALL if stale else "an entry point that can be imported")


class NotWritten(BadInput):
    """A file or a folder cannot be written. Existing files are unchanged. Attributes: `path` and `cause`."""

    def __init__(
        self,
        argument: str,
        path: Path,
        cause: Exception,
        allowed: str = "a file in a folder that exists and can be written, on a disk with enough space",
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

    Attributes: `what` (the command or function that needs them), `packages` and `extra`.
    """

    def __init__(self, what: str, packages: str, extra: str) -> None:
        self.what, self.packages, self.extra = what, packages, extra
        super().__init__(f"{what} needs {packages}. Run: pip install 'conservative-rotation[{extra}]'")


_SHORTER_STEP = "Use a shorter step or a tighter tolerance, or keep the valid samples: on_failure='return'"


class IntegrationFailed(_Error, ArithmeticError):
    """A run failed. Attribute: `outcome`."""

    outcome: Outcome


class NotConverged(IntegrationFailed):
    """The equations of a step could not be solved.

    Attributes: `step` (number of the step, from 1), `time` (s, at its start), `residual` (last residual, or last correction
    relative to the unknown) and `reason` (details, may be empty).
    """

    kind: ClassVar[OutcomeKind] = OutcomeKind.NOT_CONVERGED

    def __init__(self, step: int, time: float, residual: float, reason: str = "") -> None:
        self.step, self.time, self.residual, self.reason = step, time, residual, reason
        self.outcome = Outcome(self.kind, reason, step, time, residual)
        super().__init__(f"The run ended: {self.outcome}. Use a shorter step, or keep the valid samples: on_failure='return'")


class WrongBranch(NotConverged):
    """The solver converged to a solution of a step's equations that does not continue the motion."""

    kind = OutcomeKind.WRONG_BRANCH


class Diverged(IntegrationFailed):
    """The state is not finite, or an engine stopped. Attributes: `time` (s, of the last valid sample) and `reason`."""

    def __init__(self, time: float, reason: str = "the state is not finite") -> None:
        self.time, self.reason = time, reason
        self.outcome = Outcome(OutcomeKind.DIVERGED, reason, time=time)
        super().__init__(f"The run ended: {self.outcome}. {_SHORTER_STEP}")


class NotConserved(IntegrationFailed):
    """A run reached its end, but an invariant that its method conserves drifted.

    Attributes: `time` (s, of the last valid sample), `quantity` (an invariant, or orthonormality), its largest `drift` and the
    `bound` on it, both relative.
    """

    def __init__(self, time: float, quantity: str, drift: float, bound: float) -> None:
        self.time, self.quantity, self.drift, self.bound = time, quantity, drift, bound
        reason = f"the drift of {quantity} is {drift:.3g}, the bound {bound:.3g}"
        self.outcome = Outcome(OutcomeKind.NOT_CONSERVED, reason, time=time)
        super().__init__(f"The run ended: {self.outcome}. {_SHORTER_STEP}")


class InvalidResult(IntegrationFailed):
    """A method's result is not a trajectory of the scene on the grid. Attribute: `reason`."""

    def __init__(self, label: str, reason: str) -> None:
        self.label, self.reason = label, reason
        self.outcome = Outcome(OutcomeKind.INVALID, reason)
        super().__init__(
            f"method: got {reason} from {label}; expected a Trajectory of the scene with float64 arrays "
            "and one sample for each time of the grid"
        )


class NotRun(IntegrationFailed):
    """The method does not support one body of a batch. Attribute: `reason`."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        self.outcome = Outcome(OutcomeKind.UNSUPPORTED, reason)
        super().__init__(reason)


class PotentialFailed(_Error, RuntimeError):
    """A user's function of a potential raised an exception, the `__cause__` of this one."""

    def __init__(self, cause: BaseException) -> None:
        super().__init__(
            f"potential: got {cause!r} from its energy or gradient; "
            "expected functions that return finite numbers for every matrix (3, 3) near a rotation"
        )


class TorqueFailed(_Error, RuntimeError):
    """A torque, or the factor of a damping, has no value at a time of the run. Attributes: `time` (s), `got` and `allowed`."""

    def __init__(self, time: float, got: str, name: str = "torque", value: str = "three finite numbers (3,), N m") -> None:
        self.time, self.got = time, got
        self.allowed = f"{value}, at every time of the run, including its last step"
        super().__init__(f"{name}: got {got} at t = {time:g} s; expected {self.allowed}")


class AccuracyNotReached(UserWarning):
    """A requested error is not reached.

    Attributes: `error`, `estimate` and `rounding`, the effect of round-off alone, rad; `rough`, a time, s, near which a
    function or force of the scene is not smooth, or None.
    """

    def __init__(self, error: float, estimate: float, rounding: float = math.nan, rough: float | None = None) -> None:
        self.error, self.estimate, self.rounding, self.rough = error, estimate, rounding, rough
        causes = []
        if rough is not None:
            causes.append(
                f"A function or force of the scene is not smooth: near t = {rough:.6g} s shorter steps help less than the "
                "order of the method says. If a function jumps or has a corner at known times, declare them: breaks=(...)"
            )
        if rounding >= error / 2:
            causes.append(f"Rounding the numbers of the scene alone changes this motion by {rounding:.2g} rad")
        cause = ". ".join(causes or ["Shorter steps were not tried or did not help"])
        super().__init__(
            f"The error of {error:g} rad is not reached; {estimate:.2g} rad is estimated. {cause}. "
            "Ask for a larger error or a shorter t_end"
        )


class ImpossibleInertia(UserWarning):
    """No mass distribution has these moments. Attributes: `moments` (3,), kg m^2, and `bodies`, the number of such bodies."""

    def __init__(self, moments: Iterable[float], bodies: int = 1) -> None:
        self.moments, self.bodies = tuple(moments), bodies
        numbers = ", ".join(f"{moment:g}" for moment in self.moments)
        others = f" (and {bodies - 1} more bodies)" if bodies > 1 else ""
        super().__init__(
            f"No mass distribution has the moments {numbers} kg m^2{others}: one exceeds the sum of the other two. The "
            "equations hold for them, as in the problem EULR of Hairer, Nørsett and Wanner. Engines refuse or change it. "
            "Check the units and the axes of the inertia"
        )


class LargeEnsemble(UserWarning):
    """The samples of an ensemble take much memory. Attribute: `size`, bytes."""

    def __init__(self, size: int, bodies: int, samples: int) -> None:
        self.size = size
        super().__init__(
            f"{samples} samples of {bodies} bodies take {size / 1e9:.2g} GB of memory. Store fewer of them by sample_every, or "
            "write them to a folder by path"
        )


class LoadNotResolved(UserWarning):
    """Steps are too long for a function of time or a table.

    Attributes: `dt`, the longest step that resolves it, `step` (0 if no step does), and the `interval`, all s; `corners`, their
    number in a table, 0 for a function.
    """

    def __init__(self, dt: float, step: float, interval: tuple[float, float], corners: int = 0) -> None:
        self.dt, self.step, self.interval, self.corners = dt, step, interval, corners
        message = f"Steps of {dt:g} s do not resolve a torque, damping or motor between {interval[0]:g} and {interval[1]:g} s: "
        if corners:
            message += (
                f"its table has {corners} corners, more than there are steps. Steps are divided at the corners, so samples are "
                f"not affected, but they do not show the motion in between. Use steps of at most {step:g} s to see it"
            )
        elif step:
            message += (
                f"its integral changes with the step. Use steps of at most {step:g} s, or declare the times at which the "
                "function is not smooth: breaks=(...)"
            )
        else:
            message += "it is noise there, which no step resolves. Give it as a table (times, values)"
        super().__init__(message)


class SceneNotCompared(UserWarning):
    """A stored ensemble may be of another scene than the one given. Attributes: `scene`, its name, and `part`, not compared."""

    def __init__(self, scene: str, part: str) -> None:
        self.scene, self.part = scene, part
        super().__init__(
            f"The scene {scene!r} was not compared completely with the scene of the stored run, because it has {part}. "
            "Energies and momenta are computed with this scene: make sure that it is the scene of the run"
        )


class RotationNotResolved(UserWarning):
    """Steps are too long for the rotation of a rod about its axis. Attributes: `dt`, s, and `rate`, rad/s, the fastest one."""

    def __init__(self, method: str, dt: float, rate: float, longest: float) -> None:
        self.dt, self.rate = dt, rate
        super().__init__(
            f"Steps of {dt:g} s do not resolve the rotation of this rod about its axis: its energy allows {rate:.3g} rad/s, "
            f"{dt * rate:.3g} rad in a step. {method} can produce this rotation by its errors, also if the exact motion has "
            f"none, and its result can be completely wrong. Use steps of at most {longest:.3g} s, or an error instead of a "
            "method and a step: integrate(scene, error=1e-6)"
        )


EXTRAS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "engines": ("mujoco", "pinocchio", "heyoka", "lxml"),
        "environments": ("uv", "platformdirs", "psutil"),
        "report": ("jinja2", "itables", "pandas", "altair", "vl_convert", "cloudpickle"),
        "ensembles": ("zarr",),
        "video": ("PIL",),
        "models": ("pxr", "trimesh", "lxml", "cloudpickle"),
        "cluster": ("distributed", "cloudpickle"),
        "docs": ("sphinx", "myst_nb", "furo", "sphinx_click"),
        "gate": ("pytest", "pytest_benchmark", "heyoka"),
    }
)
"""Import names of the packages of each extra in pyproject.toml."""


def require_extra(what: str, extra: str, *packages: str) -> None:
    """Raise `MissingExtra` if a package that `what`, such as `conservative report`, needs is not installed.

    `extra` is a key of `EXTRAS`. `packages` are import names, by default all of the extra. Packages that are given are
    imported, without an interruption by Ctrl-C.
    """
    missing = [package for package in packages or EXTRAS[extra] if find_spec(package) is None]
    if missing:
        raise MissingExtra(what, ", ".join(missing), extra)
    with unstoppable():
        for package in packages:
            import_module(package)


MOST_LISTED = 12
"""Number of names that a message lists."""


def nearest(name: str, known: Iterable[str], command: str = "") -> str:
    """Return the known names as the text of a message, the one nearest to `name` first.

    If there are more than `MOST_LISTED`, the text has the nearest ones and the `command` that lists all.
    """
    known = sorted(known)
    cases = {other.lower(): other for other in known}
    close = [cases[match] for match in get_close_matches(name.lower(), cases, n=3)]
    few = len(known) <= MOST_LISTED or not command
    others = "" if few else "".join(f", {other!r}" for other in close[1:])
    everything = f"one of {', '.join(known)}" if few else f"one of {len(known)} names; list them with: {command}"
    return f"{close[0]!r} (nearest){others}, or {everything}" if close else everything
