"""Taylor series of any order, projected onto the invariants."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial, wraps
from typing import Any, ClassVar

import numpy as np

from ..attitude import Array, axes_about, from_quaternion, to_quaternion, triple
from ..batch import Batch
from ..card import Card, Cost, Structure
from ..check import build_unchecked, describe, positive_number, set_fields
from ..deferred_imports import kernels
from ..errors import BadInput, IntegrationFailed, NotConverged
from ..grid import Grid
from ..invariants import JACOBI_INTEGRAL, momentum_W
from ..method import Method, Role, Run
from ..needs import ROTATION, Need
from ..potentials.field import FieldPotential, into_axes, to_tuples
from ..potentials.turning import Orbit, Turning, static_part
from ..potentials.uniform_gravity import UniformField
from ..scene import Scene
from ..trajectory import Bounds, Counters, Trajectory
from . import principal_axes
from .bounds import bounds_of
from .columns import stack_columns, take_pieces
from .many import Block, RunMany
from .principal_axes import PrincipalStart, field_axis, invariant_scales, principal_start, quadruple, spin_rate
from .run_kernel import in_main_thread, prepare_run
from .units import COARSE, SHORTEST, in_own_units

LOWEST, DEFAULT, HIGHEST = 4, 14, 18
"""Orders that the kernel has code for, and the one where nobody names one."""
RIGHT_ANGLE = 1e-15
"""Cosine of an angle that is a right one."""
NEARLY_EQUAL = 4e-12
"""Relative difference of two moments below which a body may be symmetric: no less than `Scene.symmetry_axis_B` allows."""
POLE = 0.2
"""Distance of the height of a top's axis from 1 and -1 that its reduced motion needs: its angles have poles there. At 0.05,
quadrature leaves 4e-9 rad where the series of order 18 leaves 1e-15."""
PARTS = 100
"""Steps between two samples that bounds allow for with a tolerance."""


@dataclass(frozen=True, init=False)
class Taylor(Method):
    """Taylor series of the motion in time, each step projected onto the invariants: the fastest general method in a field.

    The coefficients of a step follow from recurrences, because every product in the equations of motion is a product of two
    series; the powers in the torque of a spring or an attraction have a recurrence of their own (Barton, Willers & Zahar,
    1971). Energy, momenta and orthonormality are conserved to round-off by projection (Hairer, Lubich & Wanner, Geometric
    Numerical Integration, IV.4). The method is neither symmetric in time nor symplectic. Steps must be well below the period of
    the fastest rotation.

    With equal steps, the integrals of a free body, and of a symmetric top in gravity whose axis stays away from the vertical,
    leave one oscillation to integrate, and angles to compute by quadrature. No closed form is used. A step of a free body then
    takes half, and one of a top a third of the time.

    For random bodies in gravity, the fastest orders are 8 to 10 for errors of 1e-2 to 1e-4 rad, 12 to 14 for 1e-5 to 1e-9, and
    14 to 16 below. In the other fields they are about two lower.

    With a tolerance, steps have any length, and dt is only the distance of samples. Samples are values of the steps'
    polynomials, each projected onto the invariants, and as accurate as the steps. Use a tolerance for many samples: if every
    sample of the flipping brick at 100 Hz is stored, it takes 0.3 to 0.45 of the time of equal steps. Use it also for motions
    that are fast for a short time, such as a close passage of an attracting point. For a passage at a fortieth of the largest
    distance, tolerance 1e-12 takes 135 steps for an error of 3e-13 rad, while 4,000 equal steps leave 1e-8 rad. Steps are
    chosen as in Jorba & Zou, A software package for the numerical integration of ODEs by means of high-order Taylor methods
    (2005). The order is 6 plus two thirds of the digits of the tolerance, the best choice for random bodies near an attracting
    point.

    `integrate_many` integrates several bodies at once, one per lane of a vector register, with equal steps. The results differ
    from those of single bodies only by round-off: attitudes of random heavy tops differ by 3e-15 after 100 steps and 4e-13
    after 1,000. Free bodies and symmetric tops are not reduced in lanes, so their truncation errors differ as well. With a
    tolerance, and in turning fields, bodies run one by one.

    For free bodies use `MoserVeselov`, which has no truncation error, for symmetric tops `Lame`, and for potentials given as
    Python functions `Projected`.

    Parameters
    ----------
    order
        Order of the series, 4 to 18; default 14. None with a tolerance, which determines it.
    tolerance
        None for the steps of the grid. Otherwise steps are as long as the last two terms of the series are at most this large,
        relative to 1 for the attitude matrix and to the largest possible rate of the axis of largest inertia.

    Raises
    ------
    BadInput
        order is not an integer in that range, tolerance is not a positive number, or both are given.
    """

    order: int | None = None
    tolerance: float | None = None

    family: ClassVar[str] = "taylor"
    role: ClassVar[Role] = Role.OURS
    conserves = frozenset(
        {"energy", JACOBI_INTEGRAL, "momentum", "vertical momentum", "momentum along the field's axis", "axial momentum"}
    )
    card: ClassVar[Card] = Card(
        variants=("order=8", "order=12", "order=16", "tolerance=1e-9"),
        report=("order=12",),
        suite=("order=14",),
        many=("order=12", "order=8", "order=10", "order=14"),
        rank=1,
        group="explicit",
        candidates=("order=8", "order=12", "order=16"),
        cost=lambda method: Cost(step=60.0 + 0.55 * method.terms**2, correction=40.0),
        colour="#7B61FF",
        kernel="taylor",
        structure=lambda method: Structure(symmetric=False, symplectic=False, imposed=True),
        takes=ROTATION - {Need.FUNCTION} | {Need.TURNING, Need.ROTOR},
    )

    def __init__(self, order: int | None = None, tolerance: float | None = None) -> None:
        if tolerance is not None:
            positive_number("tolerance", tolerance, "a finite number above 0, or None")
            if order is not None:
                raise BadInput("order", describe(order), "None together with tolerance, which chooses the order")
        elif order is None:
            order = DEFAULT
        elif isinstance(order, bool) or not isinstance(order, int) or not LOWEST <= order <= HIGHEST:
            raise BadInput("order", describe(order), f"an integer from {LOWEST} to {HIGHEST}")
        set_fields(self, order=order, tolerance=tolerance)

    def bounds(self, scene: Scene, grid: Grid) -> Bounds:
        parts = 1 if self.tolerance is None else PARTS
        return bounds_of(scene, Grid(grid.dt, parts * grid.n_steps, parts * grid.n_steps))

    @property
    def terms(self) -> int:
        """Order of the series, also if a tolerance determines it."""
        if self.tolerance is None:
            return self.order or DEFAULT
        return max(LOWEST, min(HIGHEST, round(6 - 2 / 3 * math.log10(self.tolerance))))

    def unsupported(self, scene: Scene) -> str | None:
        return scene.derive(find_obstacle)

    @in_own_units
    def prepare(self, scene: Scene, grid: Grid) -> Run:
        label, start, model = scene.derive(convert, self)
        if self.tolerance is None:
            kernel = kernels("taylor")
            run = prepare_run(scene, grid, label, start, kernel, model, kernel.Coefficients(self.terms, grid.dt))
        else:
            run = prepare_dense(scene, grid, self, start, model)
        return turn_samples(run, scene.potential.orbit) if isinstance(scene.potential, Turning) else run

    def prepare_many(self, bodies: Batch, grid: Grid) -> RunMany | None:
        return prepare_bodies(bodies, grid, self.terms) if self.tolerance is None else None


def prepare_dense(scene: Scene, grid: Grid, method: Taylor, start: PrincipalStart, model: Any) -> Run:
    """Return the run of a method with a tolerance: the kernel fills attitudes and rates itself."""
    kernel, n, t = kernels("dense"), grid.n_samples, grid.t
    R_BP = () if start.R_BP is None else tuple(map(triple, start.R_BP))
    units = (1.0, 1.0, start.spin[1] / start.J_inverse[2] if start.spin else 1.0)
    frame = kernel.Frame(tuple(map(triple, axes_of(scene))), R_BP, units, start.spin[:1] if start.spin else ())
    numbers = *model, *frame, method.terms, grid.dt, method.tolerance, grid.n_steps, grid.every
    R_WB0, lanes, label = from_quaternion(to_quaternion(scene.R_WB0)), np.arange(kernel.REGISTER, dtype=float), method.label

    def run() -> Trajectory:
        R_WB, w_WB_B = np.empty((n + kernel.REGISTER, 3, 3)), np.empty((n + kernel.REGISTER, 3))
        R_WB[0], w_WB_B[0] = R_WB0, scene.w_WB_B0
        pause = kernel.PAUSE if in_main_thread() else 0
        done, *counts, size, _ = kernel.enter(*numbers, pause, lanes, R_WB.reshape(-1), w_WB_B.reshape(-1))
        failure = None if done == grid.n_steps else NotConverged(done + 1, done * grid.dt, size, kernel.FAILURE)
        good, counters = grid.count_samples(done), Counters(done, *counts)
        samples = {"t": t[:good].copy(), "R_WB": R_WB[:good], "w_WB_B": w_WB_B[:good]}
        return build_unchecked(Trajectory, scene=scene, **samples, label=label, counters=counters, failure=failure, choice=None)

    room = np.empty(9 * (n + kernel.REGISTER)), np.empty(3 * (n + kernel.REGISTER))
    run.__dict__["own_loop"] = partial(kernel.enter, *numbers, 0, lanes, *room)
    return run


def turn_samples(run: Run, orbit: Orbit) -> Run:
    """Return a run whose attitudes are turned from the axes of an orbit to the world's."""

    @wraps(run)
    def run_and_turn() -> Trajectory:
        found = run()
        return replace(found, R_WB=orbit.R_WO(found.t) @ found.R_WB)

    return run_and_turn


def find_obstacle(scene: Scene) -> str | None:
    """Return why a scene's field is not supported, or None."""
    potential = static_part(scene.potential)
    if potential is not None and not hasattr(potential.kernel_field(scene.body.R_BP), "series"):
        return "it is for fields with a recurrence, which functions have not"
    if isinstance(scene.potential, Turning):
        axis = potential.axis_W
        if axis is None or abs(axis @ scene.potential.orbit.normal_W) > RIGHT_ANGLE:
            return "it is for fields that turn about an axis at right angles to their own, as that of a satellite"
    return None


def convert(scene: Scene, method: Taylor) -> tuple[str, PrincipalStart, Any]:
    """Return the label of a run, its start in principal axes and the kernel's model of it."""
    # Where body and field share an axis of symmetry, the frame does not spin, and the third component of L must not change.
    symmetric = scene.symmetry_axis_B is not None
    start, loose = principal_start(scene, "non_spinning" if symmetric else "body"), (1.0, 1.0, 0.0 if symmetric else 1.0)
    rotor = start.rotor or ()
    kernel, R_WD, momentum = kernels("taylor"), axes_of(scene), math.hypot(*(np.add(start.L, rotor) if rotor else start.L))
    free = not (field_axis(scene) or isinstance(scene.potential, Turning))
    if free and momentum > 0 and not start.spin and not rotor:
        # The momentum of a free body circulates about the axis of the largest or of the smallest moment: here about the third.
        J, L = np.array(start.J), np.array(start.L)
        shift = 2 - int(np.argmax(J) if L @ (L / J) * np.median(J) < L @ L else np.argmin(J))
        start = principal_axes.start_along(scene, np.roll(scene.body.R_BP, shift, axis=1), np.roll(scene.body.moments, shift))
    R_DP = R_WD.T @ scene.R_WB0 @ (np.eye(3) if start.R_BP is None else start.R_BP)
    found = None
    if method.tolerance is None and free and momentum > 0 and not rotor:
        found = reduce_free(start, R_DP)
    elif method.tolerance is None and isinstance(start.field, UniformField) and loose[2] == 0:
        found = reduce_top(start, R_DP)
    field, *rows = found or (kernel.Free(momentum) if free else start.field, triple(R_DP[2]), triple(R_DP[0]))
    body = start.J, start.J_inverse, field, loose, invariant_scales(scene)
    return method.label, start, kernel.Model(*body, quadruple(R_WD), *rows, start.q, start.L, rotor)


def reduce_free(start: PrincipalStart, R_DP: Array) -> tuple[Any, ...]:
    """Return the kernel's field, x and angles of a free body whose momentum circulates about the third axis."""
    axial, momentum, g = kernels("axial"), math.hypot(*start.L), R_DP[2]
    axis = math.copysign(1.0, g[2])
    row, factors = axial.move_along(g, (0.0, 0.0, axis), R_DP[0]), momentum * np.array(start.J_inverse)
    slopes = np.roll(factors, 1) - np.roll(factors, -1)  # g1' = slope g2 g3 and its kin; the squares are linear in each other
    products = np.roll(slopes, 1) * np.roll(slopes, -1)
    linear = products @ g**2 - 3 * products * g**2
    numbers = triple(factors), triple(linear), triple(4 * products), float(g**2 @ factors), axis, triple(np.array(row))
    return axial.Polhode(*numbers), triple(g), ((0.0, 0.0),)


def reduce_top(start: PrincipalStart, R_DP: Array) -> tuple[Any, ...] | None:
    """Return the kernel's field, x and angles of a symmetric top in gravity; None if its axis comes near the vertical."""
    g, w, wide = R_DP[2], np.array(start.L) * start.J_inverse, math.hypot(*R_DP[2, :2])
    if abs(g[2]) >= 1.0 - POLE:
        return None
    along, spin, moment = float(g @ w), float(w[2]), 2.0 * start.field.z * start.J_inverse[0]
    turns = tuple((R_DP[:2, 2] / wide).tolist()), (-g[0] / wide, g[1] / wide)
    top = kernels("axial").Nutation(along, spin, w[0] ** 2 + w[1] ** 2 + moment * g[2], moment, turns)
    if max(top.cubic(end)[0] for end in (POLE - 1.0, 1.0 - POLE)) >= 0:  # u'^2, negative where the top does not come
        return None
    return top, (g[2], g[0] * w[1] - g[1] * w[0]), ((0.0, 0.0), (0.0, 0.0))


def axes_of(scene: Scene) -> Array:
    """Return the rotation (3, 3) to the world from axes D, of which the third is the field's and, if it turns, it turns about
    the second. Where nothing acts, the third is the direction of the momentum.
    """
    if isinstance(scene.potential, Turning):
        second, third = scene.potential.orbit.normal_W, np.asarray(scene.potential.potential.axis_W)
        return np.stack([np.cross(second, third), second, third], axis=1)
    axis, momentum = field_axis(scene), momentum_W(scene.body, scene.R_WB0, scene.w_WB_B0)
    size = float(np.linalg.norm(momentum))
    return axes_about(np.array(axis) if axis else momentum / size if size > 0 else np.array((0.0, 0.0, 1.0)))


def prepare_bodies(bodies: Batch, grid: Grid, order: int) -> RunMany | None:
    """Return the run of bodies by series of an order; None if they have to run alone.

    What `convert` makes of one scene is made of all bodies at once, in units in which each is of order one.
    """
    potential, n, s = bodies.scene.potential, len(bodies), grid.n_samples
    if bodies.scene.body.rotor_momentum is not None or not isinstance(potential, FieldPotential | None):
        return None
    kernel = kernels("taylor")
    moments, J, R_BP, symmetric = find_frames(bodies)
    w = into_axes(bodies.w_WB_B0, R_BP)
    field = None if potential is None else potential.fields(bodies.parameters, R_BP)
    axis_W = np.zeros((n, 3)) if field is None else np.asarray(field.axis_W())
    energy = np.sum(moments * w * w, axis=1) / 2 + (0.0 if field is None else field.scale())
    mass, time = find_units(moments, energy, grid.dt)
    energy_unit = mass / time / time
    L = w * time[:, None] * (moments / mass[:, None])
    if field is None or not axis_W.any():
        axis_W = (bodies.R_WB0 @ (R_BP @ (w * moments)[..., None]))[..., 0]
        field = kernel.Free(np.linalg.norm(L, axis=1))
    else:
        field = field.in_units(energy_unit)
        if isinstance(field, UniformField):  # of symmetric bodies the moment is along the axis but for round-off
            field = field._replace(x=np.where(symmetric, 0.0, field.x), y=np.where(symmetric, 0.0, field.y))
    R_WD = np.broadcast_to(directions(axis_W if axis_W.strides[0] else axis_W[:1]), (n, 3, 3))
    R_DP = R_WD.swapaxes(1, 2) @ bodies.R_WB0 @ R_BP
    energy, one = np.where(energy > 0, energy, 1.0) / energy_unit, np.ones(n)
    J_in_units = J / mass[:, None]
    start = kernel.Bodies(
        J=J_in_units,
        J_inverse=1 / J_in_units,
        field=field,
        loose=np.column_stack([one, one, ~symmetric]),
        scales=np.column_stack([energy, np.sqrt(2 * energy * (moments / mass[:, None]).max(axis=1))]),
        g=R_DP[:, 2],
        a=R_DP[:, 0],
        L=L,
        h=grid.dt / time,
        axes=R_WD,
        R_BP=R_BP,
        units=np.column_stack([one, one, np.where(symmetric, J[:, 2] / moments[:, 2], 1.0)]) / time[:, None],
    )
    motion = kernel.Motion(start.g, start.a, L / J_in_units, np.zeros(n), np.zeros(n))
    width, like = kernels("compiler.lanes").REGISTER, (zeros_like(start), zeros_like(motion))
    columns, motions = (stack_columns(list(flatten(each, n)), width) for each in (start, motion))
    m = columns.shape[1]
    spin = np.where(symmetric, spin_rate(moments[:, 0], moments[:, 2], w[:, 2] * moments[:, 2]), 0.0)
    angles = np.outer(grid.t, np.pad(spin, (0, m - n))) if symmetric.any() else np.zeros((1, m))
    turns = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    R_WB0, cost = from_quaternion(to_quaternion(bodies.R_WB0)), m * (20e-9 + 0.7e-9 * order**2)

    def run() -> Block:
        ends, R_WB, w_WB_B = motions.copy(), np.empty((m, s, 3, 3)), np.empty((m, s, 3))
        given, samples = (order, like, columns, ends, turns), (R_WB.reshape(-1), w_WB_B.reshape(-1))
        take_pieces(
            grid.n_steps, cost, lambda done, last: kernel.enter_many(*given, done, last, grid.n_steps, grid.every, *samples)
        )
        R_WB[:n, 0], w_WB_B[:n, 0] = R_WB0, bodies.w_WB_B0
        failures: dict[int, IntegrationFailed] = {}
        for i in np.flatnonzero(ends[-2, :n]).tolist():
            done = int(ends[-2, i]) - 1
            failures[i] = NotConverged(done + 1, done * grid.dt, float(ends[-1, i]), kernel.FAILURE)
            R_WB[i, grid.count_samples(done) :], w_WB_B[i, grid.count_samples(done) :] = np.nan, np.nan
        return Block(R_WB[:n], w_WB_B[:n], ends[-2, :n] == 0, failures)

    return run


def find_frames(bodies: Batch) -> tuple[Array, Array, Array, Any]:
    """Return the axes in which bodies are integrated: (moments, J, R_BP, symmetric).

    Moments (n, 3), kg m^2, are along these axes, and rotations R_BP (n, 3, 3) take them to the body's. A body that is symmetric
    together with its field (n,) is described in the frame that does not spin, so that its motion has the moments J (n, 3), J1
    three times. Bodies that may be symmetric are examined one by one, unless all are the same.
    """
    moments, R_BP = (np.array(each) for each in bodies.principal)
    J, symmetric = moments.copy(), np.zeros(len(bodies), bool)
    gaps = np.abs(moments - np.roll(moments, 1, axis=1)).min(axis=1)
    near = np.flatnonzero(gaps <= NEARLY_EQUAL * moments.max(axis=1))
    alike = bodies.inertia is None and not bodies.parameters
    for part in [near] if alike and len(near) else near[:, None]:
        i = int(part[0])
        axis_B = bodies.take(i).symmetry_axis_B
        if axis_B is not None:
            x, y, J3 = np.roll(moments[i], 2 - int(np.argmax(np.abs(axis_B @ R_BP[i]))))
            J1 = (x + y) / 2
            symmetric[part], J[part], moments[part], R_BP[part] = True, J1, (J1, J1, J3), axes_about(axis_B)
    return moments, J, R_BP, symmetric


def find_units(moments: Array, energy: Array, dt: float) -> list[Array]:
    """Return units (n,) of moments, kg m^2, and of time, s, for a step dt, s: powers of two (`units.find_units`).

    Bodies have moments (n, 3), kg m^2, and energies (n,), J.
    """
    moment, step = np.frexp(moments.max(axis=1))[1], int(np.frexp(dt)[1])
    rate = (np.frexp(energy)[1] - moment) // 2
    time = np.where(energy > 0, np.minimum(-rate, step - SHORTEST), step)
    return [np.ldexp(1.0, COARSE * np.trunc(each / COARSE).astype(int)) for each in (moment, time)]


def directions(axes: Array) -> Array:
    """Return rotations (n, 3, 3) whose third columns point along vectors (n, 3): those of `axes_about`; along e_z for 0."""
    sizes = np.linalg.norm(axes, axis=1)[:, None]
    third = np.where(sizes > 0, axes, (0.0, 0.0, 1.0)) / np.where(sizes > 0, sizes, 1.0)
    first = np.cross(np.eye(3)[(np.argmax(np.abs(third), axis=1) + 2) % 3], third)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(third, first), third], axis=2)


def flatten(value: Any, n: int) -> Iterator[Array]:
    """Yield the numbers (n, .) of arrays (n, ...) in a tuple of tuples."""
    if not isinstance(value, tuple):
        yield np.reshape(value, (n, -1))
        return
    for part in value:
        yield from flatten(part, n)


def zeros_like(value: Any) -> Any:
    """Return the tuple of tuples that arrays (n, ...) in a tuple of tuples are for one body, of zeros."""
    if isinstance(value, tuple):
        return type(value)(*map(zeros_like, value))
    return to_tuples(np.zeros(np.shape(value)[1:]))
