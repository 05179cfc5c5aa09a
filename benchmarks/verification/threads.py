"""Threads: do runs that overlap give what the same runs give one after the other, bit for bit?

    python -m conservative.benchmarks.verification.threads --count 200000 --seed 1
    python -m conservative.benchmarks.verification.threads --method heyoka:1e-12 --method exact --count 5000

Every setting that tables show of every registered method runs on registered scenes, on random bodies, and on two scenes with
one potential of Python functions in common. Half of the runs share the scene with all the other threads, half have a copy.
"""

from __future__ import annotations

import hashlib
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain
from threading import Barrier

import click
import numpy as np

from conservative import registry
from conservative.attitude import Array, rotation_about
from conservative.body import RigidBody
from conservative.errors import MissingEngine
from conservative.integration.one import integrate
from conservative.method import Method, Role
from conservative.potentials.python_function import FunctionPotential
from conservative.scene import Scene

THREADS = 8
WRONG = "wrong"
SCENES = ("brick_flip", "symmetric_body", "lagrange_top", "sleeping_top", "asymmetric_top", "hanging_rest", "sprung_body")
RANDOM_SCENES = 4
STEPS = {True: (5, 40, 300), False: (2, 12)}
"""Numbers of steps: of methods with a kernel, which runs without the interpreter's lock, and of others."""
SHARES = {Role.OURS: 0.7, Role.ENGINE: 0.29, Role.TRUTH: 0.01}
"""Parts of the runs by role: what is slow is rare."""
SHARE_OF_FUNCTIONS = 0.005
"""Of a method's runs, about this part has the potential of Python functions."""
SWITCH_INTERVAL = 1e-5
"""Time, s, after which a thread hands the interpreter over: 500 times as often as usual."""


@dataclass(frozen=True, eq=False)
class Run:
    """One call of `integrate`: method, scene, step, s, and number of steps, of which each second is a sample."""

    method: Method
    scene: Scene
    dt: float
    n_steps: int

    def find_states(self, scene: Scene) -> str:
        """Return a digest of all that the run gives on a scene that is its own or a copy."""
        found = integrate(scene, self.dt, self.method, self.dt * self.n_steps, 2, on_failure="return")
        rest = f"{found.label} {found.counters} {found.outcome}"
        arrays = b"".join(array.tobytes() for array in (found.t, found.R_WB, found.w_WB_B))
        return hashlib.sha256(arrays + rest.encode()).hexdigest()


@dataclass(frozen=True)
class Findings:
    """What an attack found: of each method the number of runs, of wrong ones and of those that raised an exception."""

    runs: Counter[str]
    wrong: Counter[str]
    raised: Counter[str]
    messages: tuple[str, ...]

    @property
    def bad(self) -> int:
        """Number of runs that were wrong or raised an exception."""
        return self.wrong.total() + self.raised.total()

    def __str__(self) -> str:
        rows = (
            f"{name:40} {n:8} runs {self.wrong[name]:6} wrong {self.raised[name]:6} raised" for name, n in self.runs.items()
        )
        total = f"{self.runs.total()} runs in {THREADS} threads: {self.wrong.total()} wrong, {self.raised.total()} raised"
        return "\n".join((*sorted(rows), *self.messages[:10], total))


def list_scenes(rng: np.random.Generator) -> tuple[Scene, ...]:
    """Return the scenes: registered ones, random free bodies, and two with one potential of Python functions."""
    shared = quartic()
    mine = (random_scene(f"random {k}", rng) for k in range(RANDOM_SCENES))
    functions = (random_scene(f"functions {k}", rng, shared) for k in range(2))
    return (*map(registry.scene, SCENES), *mine, *functions)


def random_scene(name: str, rng: np.random.Generator, potential: FunctionPotential | None = None) -> Scene:
    """Return a scene of a random body with a random start."""
    second = rng.uniform(0.2, 1.0, 3)
    start = rotation_about(rng.normal(size=3), rng.uniform(0, np.pi))
    return Scene(name, RigidBody(second.sum() - second), start, rng.normal(size=3), 2.0, potential)


def quartic() -> FunctionPotential:
    """Return a potential whose Python functions hand the interpreter over in the middle of every answer."""
    hook = np.array([0.0, 0.1, 0.4])

    def energy(R: Array) -> float:
        return float(sum(x**4 for x in (R @ hook).tolist()))

    def gradient(R: Array) -> Array:
        return np.outer(4 * (R @ hook) ** 3, hook)

    return FunctionPotential(energy, gradient)


def list_methods() -> tuple[Method, ...]:
    """Return the settings that tables show of all registered methods, without engines that are not installed."""
    return tuple(chain.from_iterable(map(_variants, registry.list_families().values())))


def _variants(family: type[Method]) -> tuple[Method, ...]:
    try:
        return family.variants()
    except MissingEngine:
        return ()


def list_runs(methods: Iterable[Method], scenes: Sequence[Scene]) -> dict[Method, list[Run]]:
    """Return every run of each method on the scenes that it can do."""
    found = {method: [run for scene in scenes for run in _runs_of(method, scene)] for method in methods}
    return {method: runs for method, runs in found.items() if runs}


def _runs_of(method: Method, scene: Scene) -> Iterator[Run]:
    if method.unsupported(scene) is None:
        dt = min(scene.dt, 0.9 * method.longest_step(scene))
        lengths = STEPS[bool(method.kernel) and not of_functions(scene)]
        yield from (Run(method, scene, dt, n) for n in lengths)


def of_functions(scene: Scene) -> bool:
    """Return whether what acts on the scene's body is made of Python functions."""
    return isinstance(scene.potential, FunctionPotential)


def draw_runs(known: dict[Method, list[Run]], count: int, rng: np.random.Generator) -> list[Run]:
    """Return `count` runs drawn at random, by `SHARES`; within a role every method is as likely as any other."""
    methods = list(known)
    of_role = Counter(method.role for method in methods)
    weights = np.array([SHARES[method.role] / of_role[method.role] for method in methods])
    numbers = rng.multinomial(count, weights / weights.sum())
    found = [run for method, n in zip(methods, numbers, strict=True) for run in _draw_of_method(known[method], n, rng)]
    return [found[k] for k in rng.permutation(len(found))]


def _draw_of_method(runs: list[Run], n: int, rng: np.random.Generator) -> list[Run]:
    weights = np.array([SHARE_OF_FUNCTIONS if of_functions(run.scene) else 1.0 for run in runs])
    return [runs[k] for k in rng.choice(len(runs), n, p=weights / weights.sum())]


@contextmanager
def frequent_switches() -> Iterator[None]:
    """Hand the interpreter over to other threads as often as can be, for a while."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_INTERVAL)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def attack(runs: Sequence[Run]) -> Findings:
    """Return what runs give in `THREADS` threads, compared with what each gives alone."""
    alone = {run: run.find_states(run.scene) for run in dict.fromkeys(runs)}
    start = Barrier(THREADS)

    def compare_all(part: Sequence[tuple[int, Run]]) -> list[tuple[str, str]]:
        start.wait()
        return [(run.method.name, _compare(run, alone[run], share=k // THREADS % 2 == 0)) for k, run in part]

    numbered = list(enumerate(runs))
    with frequent_switches(), ThreadPoolExecutor(THREADS) as pool:
        parts = pool.map(compare_all, [numbered[k::THREADS] for k in range(THREADS)])
        return _sum_up(list(chain.from_iterable(parts)))


def _compare(run: Run, alone: str, share: bool) -> str:
    """Return "" where a run gives what it gave alone, else what is wrong."""
    try:
        found = run.find_states(run.scene if share else run.scene.rename(run.scene.name))
    except Exception as error:
        return f"{run.method.name} on {run.scene.name}: {error!r}"
    return "" if found == alone else WRONG


def _sum_up(verdicts: Sequence[tuple[str, str]]) -> Findings:
    raised = [(name, verdict) for name, verdict in verdicts if verdict not in ("", WRONG)]
    return Findings(
        Counter(name for name, _ in verdicts),
        Counter(name for name, verdict in verdicts if verdict == WRONG),
        Counter(name for name, _ in raised),
        tuple(verdict for _, verdict in raised),
    )


def find(count: int, seed: int, methods: Sequence[Method]) -> Findings:
    """Return what an attack of `count` runs of these methods finds."""
    rng = np.random.default_rng(seed)
    return attack(draw_runs(list_runs(methods, list_scenes(rng)), count, rng))


@click.command(help="Compare runs that overlap in threads with the same runs one after the other.")
@click.option("--count", default=200_000, help="Runs.", show_default=True)
@click.option("--seed", default=1, help="Of what is drawn.", show_default=True)
@click.option("--method", "names", multiple=True, help="Method with its settings, as often as wanted; default all.")
def main(count: int, seed: int, names: tuple[str, ...]) -> None:
    """Print what was found; exit code 1 where anything was wrong."""
    found = find(count, seed, tuple(map(registry.method, names)) or list_methods())
    click.echo(found)
    sys.exit(found.bad > 0)


if __name__ == "__main__":
    main()
