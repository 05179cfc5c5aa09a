"""A recorded motion next to the exact motion, and next to motions with a fault."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from conservative.attitude import Array, from_quaternion, hat
from conservative.references.engine import principal_axes
from conservative.references.exact.method import Exact, free_body, lagrange_top
from conservative.references.solvers.scipy import Derivative, SolveIvp, list_derivatives, solve_pieces, wheel_rates
from conservative.scene import Scene

States = tuple[Array | None, Array | None]
"""Attitudes (n, 3, 3), body to world, and rates (n, 3), rad/s, body axes; None if the file has none."""
TOLERANCE, COARSER = 2.3e-14, 20.0  # the smallest relative one of SciPy; its multiple that shows the error of a motion


@dataclass(frozen=True, eq=False)
class Compared:
    """A recorded motion at times t (n,), s, and the scene whose motion it should be.

    If `from_row` is True, the scene starts in the first row, otherwise as the user's scene does. `start` is the time of that
    state, s: a field or a load that depends on time has its value then. `tolerance` is the relative one of SciPy, for motions
    without a closed form.
    """

    scene: Scene
    t: Array
    data: States
    from_row: bool
    start: float = 0.0
    tolerance: float = TOLERANCE

    def read(self, R_WB: Array | None, w_WB_B: Array | None) -> Compared:
        """Return the case of other attitudes and rates. The scene keeps the part of its initial state that they do not have."""
        data = {"R_WB0": R_WB, "w_WB_B0": w_WB_B}
        start = {name: values[0] for name, values in data.items() if self.from_row and values is not None}
        return replace(self, scene=self.scene.rename(self.scene.name, **start), data=(R_WB, w_WB_B))

    def take(self, rows: slice) -> Compared:
        """Return some of the rows, with the same initial state."""
        R, w = (None if each is None else each[rows] for each in self.data)
        return replace(self, t=self.t[rows], data=(R, w))

    def first(self, angle: float, least: int) -> Compared:
        """Return the rows in which the body turns by an angle, rad, or at least so many."""
        return self.take(slice(0, max(least, int(np.searchsorted(self.t, self.t[0] + angle / self.scale)))))

    @cached_property
    def scale(self) -> float:
        """Rate, rad/s, that errors of rates are relative to: the largest."""
        rates = self.scene.w_WB_B0[None] if self.data[1] is None else self.data[1]
        return float(np.linalg.norm(rates, axis=1).max()) or 1.0

    @cached_property
    def closed(self) -> bool:
        """Whether the exact motion is known in closed form."""
        scene = self.scene
        return Exact().unsupported(scene) is None and (scene.potential is None or scene.symmetry_axis_B is not None)

    @property
    def torque_free(self) -> bool:
        """Whether nothing acts on the body, and no rotor in it: only the ratios of its moments matter."""
        return self.closed and self.scene.potential is None

    @cached_property
    def error(self) -> Array:
        """The errors (2, n) of the data."""
        return self.errors(self.truth(self.t))

    @cached_property
    def own_error(self) -> Array:
        """The largest error (n,) of the exact motion up to each row: its change by a coarser tolerance. 0 in closed form."""
        coarse = replace(self, data=self.truth(self.t), tolerance=COARSER * self.tolerance)
        return np.maximum.accumulate(coarse.error.max(axis=0))

    def truth(self, t: Array) -> States:
        """Return the exact motion at ascending times (n,), s, from `start` on."""
        body, field, R0, w0 = self.scene.body, self.scene.potential, self.scene.R_WB0, self.scene.w_WB_B0
        if not self.closed:
            return self.move(t)
        elapsed = t - self.start
        return free_body(body, R0, w0, elapsed) if field is None else lagrange_top(body, field, R0, w0, elapsed)  # type: ignore[arg-type]

    def move(self, t: Array, gyroscopic: bool = True, damping: float = 0.0) -> States:
        """Return the motion by integration, without the gyroscopic torque or with rates that lose `damping`, 1/s."""
        axes, wheel, states = principal_axes(self.scene), wheel_rates(self.scene), np.full((len(t), 7), np.nan)
        rotor = hat(axes.rotor * (self.scene.body.motor is None))  # the state has the momentum of a rotor with a motor

        def changed(exact: Derivative) -> Derivative:
            def slope(t: float, y: Array) -> Array:
                out, w = exact(t, y), y[4:] - wheel(t)
                out[4:] -= damping * w
                if not gyroscopic:
                    out[4:] -= (hat(axes.J * y[4:]) @ w + rotor @ w) / axes.J
                return out

            return exact if gyroscopic and not damping else slope

        pieces = [(a, b, changed(exact)) for a, b, exact in list_derivatives(self.scene, float(t[-1]), self.start)]
        with np.errstate(all="ignore"):  # a motion that diverges ends in nan
            atol = self.tolerance * np.repeat([1.0, self.scale], [4, 3])
            found = solve_pieces(self.scene, pieces, t, SolveIvp("DOP853", self.tolerance, atol))[0]
            states[: len(found)] = found
            return self.motion(states)

    def motion(self, y: Array) -> States:
        """Return the motion of states (n, 7): quaternions, scalar first, and rates, rad/s, in principal axes."""
        R_FB = principal_axes(self.scene).R_BF.T
        return from_quaternion(y[:, :4] / np.linalg.norm(y[:, :4], axis=1, keepdims=True)) @ R_FB, y[:, 4:] @ R_FB

    def differences(self, motion: States) -> Array:
        """Return a motion minus the data (n, 12), in rad and relative to `scale`; 0 for what the file does not have."""
        out = [np.zeros((len(self.t), n)) for n in (9, 3)]
        for i, unit in enumerate((np.sqrt(2), self.scale)):
            if (made := motion[i]) is not None and (data := self.data[i]) is not None:
                out[i] = (made - data).reshape(out[i].shape) / unit
        return np.clip(np.nan_to_num(np.concatenate(out, axis=1), nan=1e3), -1e3, 1e3)

    def errors(self, motion: States) -> Array:
        """Return the sizes (2, n) of `differences`: angles between attitudes, rad, and differences of rates."""
        d = self.differences(motion)
        return np.stack([2 * np.arcsin(np.minimum(np.linalg.norm(d[:, :9], axis=1) / 2, 1)), np.linalg.norm(d[:, 9:], axis=1)])
