"""The numbers by which baselines and versions recognize a motion: all fields of a scene change them, but its name does not."""

from dataclasses import fields, replace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.suite import points
from conservative.benchmarks.suite.description import describe
from conservative.benchmarks.suite.motion import PROBES, Motion
from conservative.identity import fields_of_motion

from ..crossing import FREE, HEAVY, ROWS, TIMES, VALUES
from ..independent import Case

BASE = replace(FREE, field=HEAVY, rotor=np.array((0.6, -0.5, 0.9)), torque=(TIMES, VALUES), damping=0.1 * FREE.J)
FLYING = ROWS[cv.features.Feature.FLIGHT]
MADE = cv.Invariant("made", "J", 1.0, lambda R, w: w[:, 0])


def scene(case: Case = BASE, **changes) -> cv.Scene:
    return case.scene("described").rename("described", **changes)


CHANGED = {
    "body": scene(replace(BASE, rotor=np.array((0.6, -0.5, 0.91)))),
    "R_WB0": scene(R_WB0=BASE.R0 @ cv.Scene("s", cv.RigidBody((1, 2, 2.5)), FREE.R0, (0, 0, 1), 1.0).R_WB0),
    "w_WB_B0": scene(w_WB_B0=BASE.w0 * 1.001),
    "t_end": scene(t_end=1.9, dt=scene().dt),
    "potential": scene(replace(BASE, field=("gravity", 6.01, HEAVY[2]))),
    "torque": scene(replace(BASE, torque=(TIMES, 1.001 * VALUES))),
    "damping": scene(replace(BASE, damping=0.101 * FREE.J)),
    "extra_invariants": scene(extra_invariants=(MADE,)),
    "flight": FLYING.scene(FLYING.other).rename("described", w_WB_B0=FLYING.case.w0),
}


def identities(built: cv.Scene) -> tuple[str, str, str]:
    """Return the identity within this program, beyond it, and in a baseline."""
    return built.key, Motion(describe(built, np.array(PROBES))).key, points.Point(built, cv.Projected()).definition


def test_every_field_of_motion_has_a_changed_scene():
    assert set(CHANGED) == set(fields_of_motion(cv.Scene))


@pytest.mark.parametrize("name", CHANGED)
def test_another_value_of_a_field_is_another_motion(name):
    base = scene() if name != "flight" else FLYING.scene()
    changed = CHANGED[name]
    others = {field.name for field in fields(cv.Scene)} - {name, "name", "group", "source", "dt"}
    for each in others:  # only this field differs
        one, other = (getattr(made, each) for made in (base, changed))
        assert cv.identity.digest(one) == cv.identity.digest(other), each
    assert not {*identities(base)} & {*identities(changed)}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (cv.Torque((1, 2, 3), "body"), cv.Torque((1, 2, 3), "world")),
        (cv.Torque(lambda t: (0, 0, np.sin(t))), cv.Torque(lambda t: (0, 0, 1.01 * np.sin(t)))),
        (cv.Torque(lambda t, R: 0.1 * R[0]), cv.Torque(lambda t, R: 0.1 * R[1])),
    ],
    ids=["axes", "time", "attitude"],
)
def test_another_torque_is_another_motion(one, other):
    assert not {*identities(scene(FREE, torque=one))} & {*identities(scene(FREE, torque=other))}


def test_the_name_of_a_scene_is_not_part_of_its_motion():
    assert identities(scene())[:2] == identities(scene().rename("other", group="x", source="y"))[:2]
