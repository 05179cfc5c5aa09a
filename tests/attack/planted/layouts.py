"""Layouts: how files of simulators, loggers and telephones write times, attitudes and rates. The generator's own writers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from . import motion

DEG, RPM = float(np.degrees(1.0)), 30 / np.pi


@dataclass(frozen=True)
class Layout:
    """A table: names of its columns, and functions that make their values.

    Attributes
    ----------
    names
        Names of all columns.
    columns
        From attitudes (n, 4), rates (n, 3) and times (n,), s, to blocks: ("q", values) with attitudes, ("w", values) with
        rates, ("", values) with other values. The time comes where "t" stands, or "sec" for seconds and nanoseconds.
    has
        "q" if the quaternion is visible, "R" for attitudes, "w" for rates.
    unit
        Unit of rates, per rad/s.
    second
        Unit of times, per s; whole numbers from 1e6 on.
    options
        Options of the command that the layout needs.
    angle
        Error of an angle, rad, for an error of 1 in the numbers.
    separator, comma, origin, before, after, form, ending
        Separator of fields, decimal commas, time of the first row, s, lines before and after the header, "table", "JSON" or
        "lists", and the ending of the file.
    unnamed
        True if nothing names the unit of whole times.
    """

    names: tuple[str, ...]
    columns: Callable[[Any, Any, Any], list[tuple[str, Any]]]
    has: str
    unit: float = 1.0
    second: float = 1.0
    options: dict[str, Any] = field(default_factory=dict)
    angle: float = 2.0
    separator: str = ","
    comma: bool = False
    origin: float = 0.0
    before: str = ""
    after: str = ""
    form: str = "table"
    ending: str = ".csv"
    unnamed: bool = False

    @property
    def whole(self) -> bool:
        """Whether times are whole numbers."""
        return self.second >= 1e6


def last(q: Any) -> Any:
    return q[:, [1, 2, 3, 0]]


def euler(q: Any, axes: str, degrees: bool = True) -> Any:
    return Rotation.from_quat(last(q)).as_euler(axes, degrees=degrees)


def matrices(q: Any) -> Any:
    return Rotation.from_quat(last(q)).as_matrix().reshape(-1, 9)


def mrp(q: Any) -> Any:
    q = np.where(q[:, :1] < 0, -q, q)
    return q[:, 1:] / (1 + q[:, :1])


def axis_angle(q: Any) -> Any:
    v = motion.vector(q)
    size = np.linalg.norm(v, axis=1, keepdims=True)
    axis = np.where(size > 0, v / np.where(size > 0, size, 1), [0.0, 0, 1])
    return np.hstack([axis, size])


def plain(n: int, value: float, step: float = 0.0) -> Any:
    """Return a column of other values, such as a temperature."""
    return (value + step * np.arange(n))[:, None]


def triple(name: str, ends: str = "xyz", unit: str = "") -> tuple[str, ...]:
    return tuple(f"{name}{end}{unit}" for end in ends)


def nine(name: str) -> tuple[str, ...]:
    return tuple(f"{name}{i}" for i in range(9))


COVARIANCE = np.diag([1e-4, 1e-4, 1e-4]).ravel()
W, WU = triple("w_", unit=" (rad/s)"), triple("w")
Q = ("q_w", "q_x", "q_y", "q_z")
LAYOUTS: dict[str, Layout] = {
    "quaternions wxyz": Layout(("t", *Q, *W), lambda q, w, t: [("t", t), ("q", q), ("w", w)], "q R w"),
    "quaternions xyzw": Layout(
        ("time", "qx", "qy", "qz", "qw", *WU), lambda q, w, t: [("t", t), ("q", last(q)), ("w", w)], "q R w",
        options={"units": "rad"},
    ),
    "numbered quaternions": Layout(
        ("t", "q0", "q1", "q2", "q3", *triple("omega_", unit=" (rad/s)")), lambda q, w, t: [("t", t), ("q", q), ("w", w)],
        "q R w", options={"quaternion": "wxyz"},
    ),
    "numbered quaternions, scalar last": Layout(
        ("t", "q1", "q2", "q3", "q4", *triple("omega_", unit=" (deg/s)")),
        lambda q, w, t: [("t", t), ("q", last(q)), ("w", DEG * w)], "q R w", DEG, options={"quaternion": "xyzw"},
    ),
    "matrices": Layout(
        ("t", *(f"R_WB_{i}{j}" for i in "123" for j in "123"), *triple("w_", unit=" (deg/s)")),
        lambda q, w, t: [("t", t), ("q", matrices(q)), ("w", DEG * w)], "R w", DEG, angle=0.8,
    ),
    "matrices alone, from 0": Layout(
        ("time (s)", *(f"m{i}{j}" for i in "012" for j in "012")), lambda q, w, t: [("t", t), ("q", matrices(q))], "R",
        angle=0.8,
    ),
    "yaw, pitch, roll": Layout(
        ("time", "yaw (deg)", "pitch (deg)", "roll (deg)", "p (deg/s)", "q (deg/s)", "r (deg/s)"),
        lambda q, w, t: [("t", t), ("q", euler(q, "ZYX")), ("w", DEG * w)], "R w", DEG, options={"euler": "zyx"},
        angle=1.5 / DEG,
    ),
    "heading, pitch, bank": Layout(
        ("t", "heading (deg)", "pitch (deg)", "bank (deg)"), lambda q, w, t: [("t", t), ("q", euler(q, "ZYX"))], "R",
        options={"euler": "zyx"}, angle=1.5 / DEG,
    ),
    "angles 3-1-3": Layout(
        ("t", "phi (rad)", "theta (rad)", "psi (rad)"), lambda q, w, t: [("t", t), ("q", euler(q, "ZXZ", False))], "R",
        options={"euler": "zxz"}, angle=1.5,
    ),
    "angles xyz": Layout(
        ("t", *triple("euler_", unit=" (rad)"), *W), lambda q, w, t: [("t", t), ("q", euler(q, "XYZ", False)), ("w", w)], "R w",
        options={"euler": "xyz"}, angle=1.5,
    ),
    "rotation vectors": Layout(
        ("t", "rx", "ry", "rz", *triple("w_", unit=" (rpm)")),
        lambda q, w, t: [("t", t), ("q", motion.vector(q)), ("w", RPM * w)], "R w", RPM, angle=1.0,
    ),
    "axis and angle": Layout(
        ("t", "axis_x", "axis_y", "axis_z", "angle (rad)", *W), lambda q, w, t: [("t", t), ("q", axis_angle(q)), ("w", w)],
        "R w", angle=2.5,
    ),
    "Basilisk": Layout(
        ("t", "sigma_1", "sigma_2", "sigma_3", "omega_1", "omega_2", "omega_3"),
        lambda q, w, t: [("t", t), ("q", mrp(q)), ("w", w)], "R w", options={"units": "rad"}, angle=4.0,
    ),
    "world rates": Layout(
        ("t", *Q, *W), lambda q, w, t: [("t", t), ("q", q), ("w", motion.spin(q, w))], "q R w", options={"rates": "world"}
    ),
    "TUM": Layout(
        ("# timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"),
        lambda q, w, t: [("t", t), ("", 0 * w), ("q", last(q))], "q R", separator=" ", ending=".txt",
    ),
    "phyphox": Layout(
        ('"Time (s)"', *triple('"Gyroscope ', unit=' (rad/s)"')), lambda q, w, t: [("t", t), ("w", w)], "w"
    ),
    "phyphox, decimal commas": Layout(
        ('"Time (s)"', *triple('"Gyroscope ', unit=' (rad/s)"'), '"Absolute (rad/s)"'),
        lambda q, w, t: [("t", t), ("w", w), ("", np.linalg.norm(w, axis=1, keepdims=True))], "w", separator=";", comma=True,
    ),
    "EuRoC": Layout(
        ("#timestamp [ns]", *triple("w_RS_S_", unit=" [rad s^-1]"), *triple("a_RS_S_", unit=" [m s^-2]")),
        lambda q, w, t: [("t", t), ("w", w), ("", np.tile([0.1, -0.2, 9.8], (len(t), 1)))], "w", second=1e9,
        origin=1403636579.0,
    ),
    "ROS": Layout(
        ("%time", "field.header.seq", *triple("field.orientation.", "xyzw"), *nine("field.orientation_covariance"),
         *triple("field.angular_velocity."), *nine("field.angular_velocity_covariance"), *triple("field.linear_acceleration.")),
        lambda q, w, t: [("t", t), ("", plain(len(t), 0, 1)), ("q", last(q)), ("", np.tile(COVARIANCE, (len(t), 1))), ("w", w),
                         ("", np.tile(COVARIANCE, (len(t), 1))), ("", np.tile([0.0, 0, 9.81], (len(t), 1)))],
        "q R w", second=1e9, origin=1.7e9,
    ),
    "ROS 2, two columns of time": Layout(
        ("header.stamp.sec", "header.stamp.nanosec", *triple("orientation.", "xyzw"), *triple("angular_velocity.")),
        lambda q, w, t: [("sec", t), ("q", last(q)), ("w", w)], "q R w", second=1e9, origin=1.7e9,
    ),
    "PX4 odometry": Layout(
        ("timestamp", "timestamp_sample", "x", "y", "z", "q[0]", "q[1]", "q[2]", "q[3]", "vx", "vy", "vz", "rollspeed",
         "pitchspeed", "yawspeed"),
        lambda q, w, t: [("t", t), ("t", t), ("", 0 * w), ("q", q), ("", 0 * w), ("w", w)], "q R w", second=1e6,
        options={"units": "rad", "quaternion": "wxyz"}, origin=12.0, unnamed=True,
    ),
    "ArduPilot": Layout(
        ("TimeUS", "I", *triple("Gyr", "XYZ"), *triple("Acc", "XYZ"), "EG", "EA", "T"),
        lambda q, w, t: [("t", t), ("", plain(len(t), 0)), ("w", w), ("", np.tile([0.0, 0, -9.8], (len(t), 1))),
                         ("", plain(len(t), 0)), ("", plain(len(t), 0)), ("", plain(len(t), 31.5, 1e-3))],
        "w", second=1e6, options={"units": "rad/s"}, origin=3.0,
    ),
    "MuJoCo": Layout(
        ("time", *(f"qpos[{i}]" for i in range(7)), *(f"qvel[{i}]" for i in range(6))),
        lambda q, w, t: [("t", t), ("", 0 * w), ("q", q), ("", 0 * w), ("w", w)], "q R w",
    ),
    "JSON lines": Layout(
        ("t", *(f"orientation.{x}" for x in "wxyz"), *(f"angular_velocity.{x}" for x in "xyz"), "temperature"),
        lambda q, w, t: [("t", t), ("q", q), ("w", w), ("", plain(len(t), 24.5, 1e-3))], "q R w", options={"units": "rad"},
        form="JSON", ending=".jsonl",
    ),
    "JSON lines with lists": Layout(
        ("time", "quat_wxyz.0", "quat_wxyz.1", "quat_wxyz.2", "quat_wxyz.3", "gyro.0", "gyro.1", "gyro.2"),
        lambda q, w, t: [("t", t), ("q", q), ("w", w)], "q R w", options={"units": "rad"}, form="lists", ending=".jsonl",
    ),
    "PlotJuggler": Layout(
        ("__time", *(f"/imu/angular_velocity/{x}" for x in "xyz"), *(f"/imu/orientation/{x}" for x in "wxyz")),
        lambda q, w, t: [("t", t), ("w", w), ("q", q)], "q R w",
    ),
    "temperature and a second clock": Layout(
        ("timestamp", "T", *triple("w", unit=" (rad/s)"), "qw", "qx", "qy", "qz", "arrival_time"),
        lambda q, w, t: [("t", t), ("", plain(len(t), 20.0, 2.6 / len(t))), ("w", w), ("q", q), ("", (t + 0.013)[:, None])],
        "q R w", separator="\t", ending=".tsv",
    ),
    "a line of units": Layout(
        ("time", *Q, *triple("gyro_")), lambda q, w, t: [("t", t), ("q", q), ("w", DEG * w)], "q R w", DEG,
        after="s,-,-,-,-,deg/s,deg/s,deg/s\n",
    ),
    "biases and deviations": Layout(
        ("t [ms]", *triple("gyro_", unit=" [rad/s]"), *triple("gyro_bias_", unit=" [rad/s]"), *triple("gyro_std_"),
         "quat_x", "quat_y", "quat_z", "quat_w"),
        lambda q, w, t: [("t", t), ("w", w), ("", 0 * w + 0.002), ("", 0 * w + 0.01), ("q", last(q))], "q R w", second=1e3,
    ),
    "comments and blanks": Layout(
        ("t", "wx", "wy", "wz", "R11", "R12", "R13", "R21", "R22", "R23", "R31", "R32", "R33"),
        lambda q, w, t: [("t", t), ("w", w), ("q", matrices(q))], "R w", options={"units": "rad"}, angle=0.8, separator=" ",
        before="# written by a simulator\n# SI units\n", ending=".dat",
    ),
    "named columns": Layout(
        ("clock", "a1", "a2", "a3", "b1", "b2", "b3", "b4"), lambda q, w, t: [("t", t), ("w", w), ("q", q)], "q R w",
        options={"columns": "time=clock,w=a1:a2:a3,q=b1:b2:b3:b4", "units": "rad", "quaternion": "wxyz"},
    ),
    "without a header": Layout(
        (), lambda q, w, t: [("t", t), ("w", w)], "w", options={"columns": "time=1,w=2:3:4", "units": "rad"}, separator=" ",
        ending=".txt",
    ),
}  # fmt: skip


def digits_of(noise: str) -> str:
    """Return the format of numbers."""
    return {"4 digits": "%.4g", "6 digits": "%.6g", "9 digits": "%.9g", "single": "%.9g"}.get(noise, "%.17g")


def lines_of(layout: Layout, blocks: list[tuple[str, Any]], number: str, empty: Any) -> list[str]:
    """Return the lines of rows. `empty` (n,) says which rows have no attitudes: nan, or null in JSON."""
    n = len(empty)
    cells: list[list[str]] = [[] for _ in range(n)]
    for kind, values in blocks:
        if kind == "t":
            text = [repr(int(x)) for x in values] if layout.whole else [f"{x:.15g}" for x in values]
            columns = [text]
        elif kind == "sec":
            columns = [[repr(int(x) // 10**9) for x in values], [repr(int(x) % 10**9) for x in values]]
        else:
            columns = [[number % x for x in column] for column in np.asarray(values).T]
        if kind in ("q", "w"):
            columns = [["nan" if gone else x for x, gone in zip(column, empty, strict=True)] for column in columns]
        for column in columns:
            for row, x in zip(cells, column, strict=True):
                row.append(x)
    if layout.form == "table":
        rows = [layout.separator.join(row) for row in cells]
        return [row.replace(".", ",") for row in rows] if layout.comma else rows
    return [json_line(layout, row) for row in cells]


def json_line(layout: Layout, row: list[str]) -> str:
    """Return a JSON object whose names are joined by points; numbers are lists, other names objects."""
    out: dict[str, Any] = {}
    for name, x in zip(layout.names, row, strict=True):
        first, _, rest = name.partition(".")
        value = None if x == "nan" else float(x)
        if not rest:
            out[first] = value
        elif layout.form == "lists":
            out.setdefault(first, []).append(value)
        else:
            out.setdefault(first, {})[rest] = value
    return json.dumps(out)


def file_of(layout: Layout, rows: list[str]) -> str:
    """Return the text of a file."""
    header = layout.separator.join(layout.names) + "\n" if layout.names and layout.form == "table" else ""
    return layout.before + header + layout.after + "\n".join(rows) + "\n"
