"""The links of model files: faults that are planted into made robots are found and named, and right robots have no finding."""

import json
import re
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from conservative.benchmarks.verification.bodies import links as links_module
from conservative.benchmarks.verification.bodies import models
from conservative.benchmarks.verification.bodies.links import judge
from conservative.benchmarks.verification.bodies.solids import density_of, hull_of, reach
from conservative.benchmarks.verification.bodies.twins import other_side
from conservative.benchmarks.verification.finding import Finding, Verdict, Verification
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.bodies import FILES
from conservative.benchmarks.verification.verify import verify
from conservative.errors import BadInput
from conservative.references.model_files import robot_links
from conservative.references.model_files.collada import read_collada
from conservative.references.model_files.files import Unread
from conservative.references.model_files.pieces import Piece
from conservative.references.model_files.robot_links import read_robots_here
from conservative.reports.cli.main import main

from ...sampling import sampled

# ------------------------------------------------------------------------------------------------------------- made robots


@dataclass(frozen=True)
class Made:
    """A link of boxes (size, place, angles about x, y, z) with uniform density, and the joint that it is on."""

    mass: float
    boxes: tuple
    parent: str = ""
    at: tuple = (0, 0, 0)
    turn: tuple = (0, 0, 0)
    joint: str = "revolute"
    com: np.ndarray = None
    inertia: np.ndarray = None
    inertial: bool = True
    shapes: bool = True
    extra: str = field(default="", compare=False)

    def filled(self):
        """The link with the centre of mass and the inertia of its boxes, unless it has others."""
        volumes = np.array([np.prod(size) for size, _, _ in self.boxes])
        masses = self.mass * volumes / volumes.sum()
        places = np.array([place for _, place, _ in self.boxes], float)
        com = masses @ places / self.mass
        J = np.zeros((3, 3))
        for m, (size, place, angles) in zip(masses, self.boxes, strict=True):
            a, b, c = np.square(size)
            R = Rotation.from_euler("xyz", angles).as_matrix()
            d = np.array(place) - com
            J += R @ np.diag([b + c, a + c, a + b]) @ R.T * m / 12 + m * (d @ d * np.eye(3) - np.outer(d, d))
        return replace(
            self,
            com=com if self.com is None else np.array(self.com),
            inertia=J if self.inertia is None else np.array(self.inertia),
        )


def mirrored(made, **changes):
    """The link on the other side of the plane y = 0, with axes that are parallel to the first one's."""
    boxes = tuple((s, (x, -y, z), (-a, b, -c)) for s, (x, y, z), (a, b, c) in made.boxes)
    x, y, z = made.at
    return replace(made, boxes=boxes, at=(x, -y, z), **changes)


def triple(values):
    return " ".join(repr(float(value)) for value in values)


def urdf(links):
    """The file of a robot in URDF."""
    parts = []
    for name, link in links.items():
        made = link.filled()
        shapes = [
            f'<{tag}><origin xyz="{triple(place)}" rpy="{triple(angles)}"/>'
            f'<geometry><box size="{triple(size)}"/></geometry></{tag}>'
            for tag in ("visual", "collision") for size, place, angles in made.boxes
        ]  # fmt: skip
        pairs = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
        numbers = " ".join(f'i{key}="{float(made.inertia[i, j])!r}"' for key, i, j in pairs)
        inertial = (
            f'<inertial><origin xyz="{triple(made.com)}"/><mass value="{float(made.mass)!r}"/><inertia {numbers}/></inertial>'
        )
        parts.append(f'<link name="{name}">{inertial * made.inertial}{"".join(shapes) * made.shapes}{made.extra}</link>')
        if made.parent:
            ends = f'<parent link="{made.parent}"/><child link="{name}"/>'
            ends += f'<origin xyz="{triple(made.at)}" rpy="{triple(made.turn)}"/>'
            limits = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>' * (made.joint != "fixed")
            parts.append(f'<joint name="to_{name}" type="{made.joint}">{ends}{limits}</joint>')
    return f'<robot name="made">{"".join(parts)}</robot>'


def arm():
    """An arm of boxes that are not aligned with the axes, with two fingers and a camera."""
    finger = Made(0.05, (((0.02, 0.01, 0.06), (0.003, 0.002, 0.03), (0, 0, 0)),), "forearm", (0, 0.03, 0.35), joint="prismatic")
    return {
        "base": Made(60.0, (((0.5, 0.4, 0.2), (0, 0, 0.1), (0, 0, 0)), ((0.1, 0.1, 0.3), (0.1, 0, 0.3), (0, 0, 0)))),
        "upper_arm": Made(4.0, (((0.08, 0.1, 0.4), (0, 0.02, 0.2), (0.3, 0.2, 0)),), "base", (0, 0, 0.45)),
        "forearm": Made(2.0, (((0.06, 0.05, 0.3), (0, 0, 0.15), (0, 0.4, 0)),), "upper_arm", (0, 0, 0.4)),
        "left_finger": finger,
        "right_finger": mirrored(finger),
        "camera": Made(0.01, (((0.03, 0.03, 0.03), (0, 0, 0), (0, 0, 0)),), "forearm", (0.05, 0, 0.3), joint="fixed"),
    }


def biped():
    """A biped whose thighs have products of inertia with opposite signs."""
    thigh = Made(5.0, (((0.1, 0.12, 0.4), (0.02, 0.03, -0.2), (0.25, 0.15, 0.1)),), "pelvis", (0, 0.1, -0.1))
    shin = Made(3.0, (((0.08, 0.09, 0.4), (0, 0.01, -0.2), (0.1, 0.2, 0)),), "left_thigh", (0.02, 0.02, -0.4))
    foot = Made(1.0, (((0.22, 0.1, 0.04), (0.05, 0, -0.03), (0, 0.05, 0.2)),), "left_shin", (0, 0, -0.4))
    return {
        "pelvis": Made(15.0, (((0.2, 0.3, 0.2), (0, 0, 0), (0, 0, 0)),)),
        "left_thigh": thigh,
        "right_thigh": mirrored(thigh),
        "left_shin": shin,
        "right_shin": mirrored(shin, parent="right_thigh"),
        "left_foot": foot,
        "right_foot": mirrored(foot, parent="right_shin"),
    }


def rover():
    """A rover; both sides have the same wheel, which is turned on the right side."""
    wheel = Made(0.8, (((0.2, 0.05, 0.2), (0, 0.01, 0), (0, 0, 0)), ((0.2, 0.05, 0.2), (0, 0.01, 0), (0, np.pi / 4, 0))))
    wheels = {
        f"{end}{side}_wheel": replace(
            wheel, parent="chassis", at=(x, y, 0), turn=(0, 0, 0 if y > 0 else np.pi), joint="continuous"
        )
        for end, x in (("f", 0.2), ("r", -0.2)) for side, y in (("l", 0.2), ("r", -0.2))
    }  # fmt: skip
    mast = Made(1.5, (((0.05, 0.05, 0.5), (0, 0, 0.25), (0, 0.3, 0)),), "chassis", (0.1, 0, 0.1))
    return {"chassis": Made(12.0, (((0.6, 0.3, 0.15), (0, 0, 0.05), (0, 0, 0)),)), **wheels, "mast": mast}


def drone():
    """A drone with turned arms and flat rotors."""
    arm_ = Made(0.2, (((0.25, 0.03, 0.02), (0.1, 0.05, 0), (0, 0.1, 0.5)),), "body", (0.05, 0.05, 0))
    rotor = Made(0.02, (((0.24, 0.02, 0.002), (0, 0, 0), (0, 0, 0)),), "arm_l", (0.2, 0.1, 0.03), joint="continuous")
    return {
        "body": Made(1.2, (((0.2, 0.15, 0.06), (0, 0, 0), (0, 0, 0)),)),
        "arm_l": arm_,
        "arm_r": mirrored(arm_),
        "rotor_l": rotor,
        "rotor_r": mirrored(rotor, parent="arm_r"),
        "battery": Made(0.5, (((0.1, 0.04, 0.03), (0, 0, -0.05), (0.1, 0, 0.3)),), "body", (0, 0, 0), joint="revolute"),
    }


ROBOTS = {"arm": arm, "biped": biped, "rover": rover, "drone": drone}
LINKS = {
    "arm": ("base", "upper_arm"),
    "biped": ("pelvis", "left_thigh"),
    "rover": ("chassis", "mast"),
    "drone": ("body", "battery"),
}
"""A root and a link with products of inertia of each robot."""
PAIRS = {"arm": "left_finger", "biped": "right_shin", "rover": "fr_wheel", "drone": "arm_r"}


def findings(tmp_path, links, text=None, name="made.urdf"):
    """The findings on the links of a robot by name."""
    path = tmp_path / name
    path.write_text(text or urdf(links))
    return {finding.case: finding for robot in read_robots_here(path) for finding in judge(robot, name)}


# --------------------------------------------------------------------------------------------------------- forty made faults


def impossible(made):
    moments, axes = np.linalg.eigh(made.inertia)
    return {"inertia": axes @ np.diag([moments[0], moments[1], 1.35 * (moments[0] + moments[1])]) @ axes.T}


def slipped_moment(made):
    return {"inertia": made.inertia + np.diag([0, 9 * made.inertia[1, 1], 0])}


def negated(made):
    return {"inertia": 2 * np.diag(np.diag(made.inertia)) - made.inertia}


def about_the_origin(made):
    d = made.com + np.array([0, 0, 1.0])
    return {"com": d, "inertia": made.inertia}


FAULTS = {
    "impossible": ("impossible inertia", 1, impossible, None),
    "placeholder": (
        "placeholder inertia",
        0,
        lambda made: {"inertia": 10.0 ** np.floor(np.log10(made.mass) - 5) * np.eye(3)},
        None,
    ),
    "slip of the inertia": ("decimal slip", 1, lambda made: {"inertia": made.inertia / 1000}, "multiply the inertia by 10^3"),
    "slip up": ("decimal slip", 0, lambda made: {"inertia": 10 * made.inertia}, "multiply the inertia by 10^-1"),
    "slip of a moment": ("decimal slip", 0, slipped_moment, "multiply iyy by 10^-1"),
    "twin": ("twins differ", 2, lambda made: {"inertia": 2.5 * made.inertia}, "the mirrored values of"),
    "grams": ("decimal slip", 0, lambda made: {"mass": 1000 * made.mass}, "multiply the mass by 10^-3"),
    "millimetres": ("centre of mass outside the shapes", 1, lambda made: {"com": 1000 * made.com}, "by 10^-3"),
    "sign of products": ("sign of the products of inertia", 1, negated, "change the sign of"),
    "no inertial": ("no inertial element", 1, lambda made: {"inertial": False}, None),
}
"""Keys of the mistakes, the link (0, 1, or 2 for one of a pair), the change, and a part of the repair, if there is one."""


OPEN = {("slip up", "rover"), ("slip up", "drone")}
"""Of light bodies, with 440 and 670 kg/m^3: ten times the mass is as plausible as a tenth of the inertia."""


def test_there_are_forty_faults():
    assert len(FAULTS) * len(ROBOTS) == 40
    assert {key for key, *_ in FAULTS.values()} <= set(BY_KEY)


@pytest.mark.parametrize(("fault", "robot"), [(fault, robot) for fault in FAULTS for robot in ROBOTS])
def test_a_planted_fault_is_found_named_and_repaired(tmp_path, fault, robot):
    key, which, change, repair = FAULTS[fault]
    links = ROBOTS[robot]()
    name = (*LINKS[robot], PAIRS[robot])[which]
    made = links[name].filled()
    links[name] = replace(made, **change(made))
    found = findings(tmp_path, links)
    assert (found[name].verdict, found[name].mistake) == (Verdict.WRONG, key), found[name]
    others = {case: (finding.verdict, finding.detail) for case, finding in found.items() if case != name}
    assert {verdict for verdict, _ in others.values()} == {Verdict.RIGHT}, others
    assert found[name].effect
    if (fault, robot) in OPEN:
        assert not found[name].repair
        assert "multiply the inertia by 10^-1 or multiply the mass by 10^1" in found[name].detail
    elif repair:
        assert repair in found[name].repair


@pytest.mark.parametrize("robot", ROBOTS)
def test_right_robots_have_no_finding(tmp_path, robot):
    found = findings(tmp_path, ROBOTS[robot]())
    assert {finding.verdict for finding in found.values()} == {Verdict.RIGHT}
    assert not any(finding.detail for finding in found.values())


# ------------------------------------------------------------------------------------------- unusual, and nevertheless right


def test_what_is_unusual_but_right_has_no_finding(tmp_path):
    size = np.array([0.3, 0.2, 0.1])
    a, b, c = size**2
    shell = 3.0 / 12 * np.diag([b + c, a + c, a + b]) * 1.6  # a hollow box has up to 5/3 of the inertia of a full one
    rotor = np.diag([0.00012, 0.00012, 0.0002])  # 0.5 kg of copper, 28 mm in radius, in a light box
    plate = np.diag([0.01, 0.02, 0.03])  # in a plane: the largest moment is the sum of the others
    links = {
        "base": Made(3.0, ((size, (0, 0, 0), (0, 0, 0)),), inertia=shell),
        "motor": Made(0.55, (((0.15, 0.12, 0.1), (0, 0, 0), (0, 0, 0)),), "base", (0.3, 0, 0), inertia=rotor),
        "plate": Made(1.0, (((0.5, 0.35, 0.00005), (0, 0, 0), (0, 0, 0)),), "base", (0, 0, 0.3), inertia=plate),
        "imu": Made(0.01, (((0.03, 0.03, 0.02), (0, 0, 0), (0, 0, 0)),), "base", (0, 0, 0.1), inertia=1e-6 * np.eye(3)),
        "anchor": Made(1e-6, (((0.01,) * 3, (0, 0, 0), (0, 0, 0)),), "base", joint="fixed", inertia=np.diag([0, 0, 3e-6])),
        "point": Made(0.01, (((0.01,) * 3, (0, 0, 0), (0, 0, 0)),), "base", joint="fixed", inertia=np.zeros((3, 3))),
        "cross": Made(1.0, (((0.01,) * 3, (0, 0, 0), (0, 0, 0)),), "base", joint="revolute", inertial=False, shapes=False),
        "tip": Made(1.0, (((0.01,) * 3, (0, 0, 0), (0, 0, 0)),), "cross", joint="fixed", inertial=False),
    }
    links["tip"] = replace(links["tip"], parent="plate")
    found = findings(tmp_path, links)
    assert {name: finding.verdict for name, finding in found.items()} == dict.fromkeys(links, Verdict.RIGHT), found
    assert "does not change the motion" in found["anchor"].detail
    assert "does not change the motion" in found["point"].detail


def test_shapes_that_cannot_hold_the_mass_decide_nothing(tmp_path):
    links = arm()
    made = links["upper_arm"].filled()
    symbol = ((0.01, 0.01, 0.01), (0, 0, 0), (0, 0, 0))
    links["upper_arm"] = replace(made, boxes=(symbol,))
    found = findings(tmp_path, links)["upper_arm"]
    assert found.verdict is Verdict.UNDECIDED
    assert "symbols" in found.detail
    links["upper_arm"] = replace(made, boxes=((4.0 * np.array(symbol[0]), *symbol[1:]),), mass=0.1, inertia=made.inertia / 40)
    assert findings(tmp_path, links)["upper_arm"].verdict is Verdict.WRONG


def test_an_impossible_inertia_of_a_part_that_hardly_matters_is_wrong_because_engines_refuse_it(tmp_path):
    links = arm()
    links["camera"] = replace(links["camera"], mass=0.05, inertia=1e-6 * np.diag([1.0, 1.0, 3.5]))
    found = findings(tmp_path, links)["camera"]
    assert (found.verdict, found.mistake) == (Verdict.WRONG, "impossible inertia")
    assert "refuse" in found.effect


def test_twins_may_have_axes_of_their_own(tmp_path):
    """The right wheel of the rover is the left one, turned by 180 degrees; products and centres follow the axes of each."""
    links = rover()
    spoke = ((0.05, 0.05, 0.3), (0.05, 0.02, 0.1), (0.2, 0.3, 0.1))
    turned = {name: replace(link, boxes=(*link.boxes, spoke)) for name, link in links.items() if "wheel" in name}
    found = findings(tmp_path, {**links, **turned})
    assert {finding.verdict for finding in found.values()} == {Verdict.RIGHT}


def test_twins_that_their_shapes_do_not_tell_apart_are_both_named(tmp_path):
    links = biped()
    made = links["right_shin"].filled()
    links = {name: replace(link, shapes=False) if "shin" in name else link for name, link in links.items()}
    links["right_shin"] = replace(made, inertia=1.6 * made.inertia, shapes=False)
    found = findings(tmp_path, links)
    for name in ("left_shin", "right_shin"):
        assert (found[name].verdict, found[name].mistake) == (Verdict.WRONG, "twins differ")
        assert not found[name].repair


def test_twins_that_differ_in_their_mass_only_are_undecided(tmp_path):
    """A box may be full on one side. With the mass alone, the inertia contradicts the shapes."""
    for factor in (1.6, 3.0):
        links = biped()
        made = links["right_shin"].filled()
        links["right_shin"] = replace(made, mass=factor * made.mass, inertia=factor * made.inertia)
        found = findings(tmp_path, links)
        assert {found[name].verdict for name in ("left_shin", "right_shin")} == {Verdict.UNDECIDED}
    links["right_shin"] = replace(made, mass=3 * made.mass)
    assert findings(tmp_path, links)["right_shin"].mistake == "twins differ"


def test_twins_with_other_shapes_that_fit_their_inertias_are_right(tmp_path):
    box = (((0.3, 0.1, 0.2), (0, 0, 0), (0, 0, 0)),)
    for name in ("box", "bracket"):
        links = {
            "base": arm()["base"],
            f"left_{name}": Made(3.0, box, "base", (0, 0.5, 0)),
            f"right_{name}": Made(0.5, (((0.02, 0.02, 0.3), (0, 0, 0), (0, 0, 0)),), "base", (0, -0.5, 0)),
        }
        assert {finding.verdict for finding in findings(tmp_path, links).values()} == {Verdict.RIGHT}
        made = links[f"right_{name}"].filled()
        links[f"right_{name}"] = replace(made, inertia=1.6 * made.inertia)
        found = findings(tmp_path, links)
        assert Verdict.WRONG not in {finding.verdict for finding in found.values()}


def test_a_link_is_not_the_twin_of_one_that_it_is_on(tmp_path):
    links = {
        "base": arm()["base"],
        "link_r": Made(1.0, (((0.1, 0.1, 0.1), (0, 0, 0), (0, 0, 0)),), "base", inertia=0.0017 * np.eye(3), shapes=False),
        "middle": Made(1.0, (((0.1, 0.1, 0.1), (0, 0, 0), (0, 0, 0)),), "link_r"),
        "link_l": Made(3.0, (((0.3, 0.1, 0.1), (0, 0, 0), (0, 0, 0)),), "middle", shapes=False),
    }
    assert {finding.verdict for finding in findings(tmp_path, links).values()} == {Verdict.RIGHT}
    links["link_l"] = replace(links["link_l"], parent="base")
    assert findings(tmp_path, links)["link_l"].mistake == "twins differ"


# --------------------------------------------------------------------------------------------------- slips and their repairs


BOX = ((0.2, 0.1, 0.05), (0, 0, 0), (0, 0, 0))


def one(mass, times_mass=1.0, times_inertia=1.0, boxes=(BOX,), **others):
    """A base with a link `a` of boxes, whose mass and inertia are multiplied by factors."""
    made = Made(mass, boxes, "base").filled()
    made = replace(made, mass=mass * times_mass, inertia=made.inertia * times_inertia)
    return {"base": arm()["base"], "a": replace(made, **others)}


@pytest.mark.parametrize("power", [-9, -7, -6, -5, -4, -3, -2, 2, 3, 4, 6, 9])
def test_units_of_an_inertia_are_powers_of_ten(tmp_path, power):
    found = findings(tmp_path, one(3.0, times_inertia=10.0**-power))["a"]
    assert (found.verdict, found.mistake, found.repair) == ("wrong", "decimal slip", f"multiply the inertia by 10^{power}")


def test_a_repair_that_is_offered_leaves_the_link_right(tmp_path):
    """Mass and inertia are multiplied by any powers of ten: g and g mm^2, or a slip in one or in both."""
    count = 0
    for p, q in product(range(-3, 4), (-9, -7, -6, -3, -2, -1, 0, 1, 2, 3, 6, 7, 9)):
        for mass in (0.3, 3.0):
            found = findings(tmp_path, one(mass, 10.0**p, 10.0**q))["a"]
            if match := re.fullmatch(r"multiply the (mass|inertia) by 10\^(-?\d+)", found.repair):
                count += 1
                if match[1] == "mass":
                    repaired = one(mass, 10.0 ** (p + int(match[2])), 10.0**q)
                else:
                    repaired = one(mass, 10.0**p, 10.0 ** (q + int(match[2])))
                assert findings(tmp_path, repaired)["a"].verdict is Verdict.RIGHT
            else:
                assert not found.repair
    assert count > 50  # measured: 60 of 182


def test_a_slip_that_mass_and_inertia_explain_has_a_repair_only_if_the_twin_shows_which(tmp_path):
    links = one(3.0, times_mass=0.1)
    found = findings(tmp_path, links)["a"]
    assert (found.verdict, found.mistake, found.repair) == (Verdict.WRONG, "decimal slip", "")
    good = replace(one(3.0)["a"], at=(0, 0.2, 0))
    for wrong, repair in (
        (replace(links["a"], at=(0, -0.2, 0)), "multiply the mass by 10^1"),
        (replace(one(3.0, times_inertia=10)["a"], at=(0, -0.2, 0)), "multiply the inertia by 10^-1"),
    ):
        pair = {"base": links["base"], "left_a": good, "right_a": wrong}
        found = findings(tmp_path, pair)
        assert found["right_a"].repair == repair
        assert found["left_a"].verdict is Verdict.RIGHT
        both = {"base": links["base"], "left_a": replace(wrong, at=(0, 0.2, 0)), "right_a": wrong}  # it shows nothing then
        assert findings(tmp_path, both)["right_a"].repair == findings(tmp_path, {**links, "a": wrong})["a"].repair


def test_pounds_and_inches_are_no_power_of_ten(tmp_path):
    found = findings(tmp_path, one(3.0, 1 / 0.45359237, 1 / 2.9263965e-4))["a"]
    assert (found.verdict, found.repair) == (Verdict.WRONG, "")
    assert "inches" in found.detail


@pytest.mark.parametrize("shapes", [True, False])
def test_a_slip_of_one_moment_has_a_repair_only_with_shapes(tmp_path, shapes):
    made = one(3.0)["a"].filled()
    links = one(3.0, inertia=made.inertia * np.diag([1, 10, 1]), shapes=shapes)
    found = findings(tmp_path, links)["a"]
    assert found.verdict is Verdict.WRONG
    assert found.repair == ("multiply iyy by 10^-1" if shapes else "")


@pytest.mark.parametrize(
    ("moments", "verdict"),
    [
        ((0.1, 0.1, 0.3), "undecided"),  # 0.149, 0.149 and 0.251 are rounded to it
        ((0.1, 0.1, 0.4), "wrong"),
        ((0.1, 0.1, 0.31), "wrong"),
        ((0.11, 0.11, 0.23), "right"),  # a rounding of three halves of a digit, below a tenth of the moment
        ((0.11, 0.11, 0.24), "wrong"),
        ((0.1, 0.1, 0.2), "right"),
    ],
)
def test_digits_excuse_a_moment(tmp_path, moments, verdict):
    links = one(1.0, inertia=np.diag(moments), shapes=False)
    assert findings(tmp_path, links)["a"].verdict == verdict


@pytest.mark.parametrize(("density", "verdict"), [(19250, "right"), (22500, "right"), (60000, "wrong")])
def test_tungsten_and_gold_are_materials(tmp_path, density, verdict):
    volume = 0.05**3
    found = findings(tmp_path, one(density * volume, boxes=(((0.05,) * 3, (0, 0, 0), (0, 0, 0)),)))["a"]
    assert found.verdict == verdict


def test_other_axes_of_a_rod_are_wrong(tmp_path):
    rod = ((0.4, 0.04, 0.04), (0, 0, 0), (0, 0, 0))
    made = Made(1.0, (rod,)).filled()
    found = findings(tmp_path, one(1.0, boxes=(rod,), inertia=made.inertia[np.ix_([1, 0, 2], [1, 0, 2])]))["a"]
    assert (found.verdict, found.mistake) == (Verdict.WRONG, "inertia outside the shapes")


@pytest.mark.parametrize("size", [(0.4, 0.04, 0.04), (0.3, 0.1, 0.1), (0.2, 0.12, 0.12)])
@pytest.mark.parametrize("angle", [0.3, 0.6, 1.2])
def test_the_sign_of_products_is_found_for_thin_and_thick_links(tmp_path, size, angle):
    rod = (size, (0, 0, 0), (0, 0, angle))
    made = Made(1.0, (rod,)).filled()
    found = findings(tmp_path, one(1.0, boxes=(rod,), inertia=negated(made)["inertia"]))["a"]
    assert (found.mistake, found.repair) == ("sign of the products of inertia", "change the sign of ixy")
    turned = min(2 * angle, np.pi - 2 * angle)
    assert f"turned by {np.degrees(turned):.0f} degrees" in found.effect


@pytest.mark.parametrize(
    ("size", "place"), [((0.4, 0.03, 0.03), (0.2, 0, 0)), ((0.4, 0.05, 0.06), (0.2, 0, 0.05)), ((0.2, 0.1, 0.1), (0.4, 0, 0))]
)  # fmt: skip
def test_an_inertia_about_the_origin_of_the_link(tmp_path, size, place):
    box = (size, place, (0, 0, 0))
    d = np.array(place, float)
    made = Made(1.0, (box,)).filled()
    about = made.inertia + d @ d * np.eye(3) - np.outer(d, d)
    found = findings(tmp_path, one(1.0, boxes=(box,), inertia=about))["a"]
    assert (found.verdict, found.mistake) == (Verdict.WRONG, "inertia moved twice")
    assert findings(tmp_path, one(1.0, boxes=(box,)))["a"].verdict is Verdict.RIGHT


def test_a_proxy_that_cannot_hold_the_mass_does_not_bound_the_inertia(tmp_path):
    proxy = ((0.02, 0.02, 0.02), (0, 0, 0), (0, 0, 0))
    found = findings(tmp_path, one(2.0, boxes=(proxy,), inertia=np.diag([0.00213, 0.0277, 0.0277])))["a"]
    assert found.verdict is Verdict.UNDECIDED
    assert findings(tmp_path, one(2.0, boxes=(proxy,), inertia=30 * np.eye(3)))["a"].verdict is Verdict.WRONG


def test_a_link_without_a_mass_or_with_a_negative_one(tmp_path):
    for mass, effect in ((0.0, "without limit under a force"), (-1.0, "the other way")):
        text = urdf(one(1.0)).replace('mass value="1.0"', f'mass value="{mass}"')
        found = findings(tmp_path, {}, text)["a"]
        assert effect in found.effect
        assert f"{mass:g} kg" in found.detail


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("left_arm", "right_arm"),
        ("LShoulderYaw", "RShoulderYaw"),
        ("arm_left_1_link", "arm_right_1_link"),
        ("FL_calf", "FR_calf"),
        ("lf_foot", "rf_foot"),
        ("LeftHand", "RightHand"),
        ("LEFT_SHIN", "RIGHT_SHIN"),
        ("link_l", "link_r"),
        ("/World/left_leg", "/World/right_leg"),
        ("elbow", ""),
        ("caliper", ""),
    ],
)  # fmt: skip
def test_names_of_the_other_side(name, other):
    assert other_side(name) == other


# ----------------------------------------------------------------------------------------------------------------- the effect


def test_the_effect_is_the_ratio_of_the_accelerations(tmp_path):
    links = arm()
    made = links["base"].filled()
    links["base"] = replace(made, inertia=0.001 * np.eye(3))
    found = findings(tmp_path, links)["base"]
    (times,) = re.findall(r"([\d,]+) times too fast", found.effect)
    # The effect is relative to the hull of the shapes, which is a little more than the two boxes.
    wanted = np.linalg.eigvalsh(made.inertia)[-1] / 0.001
    assert float(times.replace(",", "")) == pytest.approx(wanted, rel=0.4)  # measured: 2,200 and 2,060


def test_bounds_hold_for_any_mass_distribution():
    """Points with random masses in a box: the radius of gyration is within reach, and no body is denser than a ball."""
    rng = np.random.default_rng(55)
    for _ in range(50):
        corners = rng.normal(size=(12, 3)) * rng.uniform(0.1, 1, 3)
        hull = hull_of([corners])
        weights = rng.dirichlet(np.full(12, 0.3))
        com = weights @ corners
        d = corners - com
        J = np.einsum("n,ni,ni->", weights, d, d) * np.eye(3) - np.einsum("n,ni,nj->ij", weights, d, d)
        assert reach(Piece(1.0, com, J), hull) <= 1 + 1e-9  # measured: up to 1
        assert hull.outside(com) <= 1e-12
        part = Piece(2.0, np.zeros(3), 2 * hull.solid.inertia)
        assert density_of(part, ()) <= density_of(part, [hull]) * (1 + 1e-9)
        assert density_of(part, [hull]) == pytest.approx(2 / hull.volume, rel=1e-9)
    radius = (3 * 60 / (4 * np.pi * 7850)) ** (1 / 3)
    assert density_of(Piece(60.0, np.zeros(3), 0.4 * 60 * radius**2 * np.eye(3)), ()) == pytest.approx(7850, rel=1e-12)


# ---------------------------------------------------------------------------------------------------------------- the formats


def mjcf(inertia="0.01 0.02 0.025"):
    return f"""<mujoco><compiler balanceinertia="true"/><worldbody><body name="base"><freejoint/>
    <inertial pos="0.1 0 0" mass="2" diaginertia="{inertia}"/><geom type="box" size="0.2 0.15 0.1" pos="0.1 0 0"/>
    <body name="tip" pos="0.3 0 0"><joint axis="0 0 1"/><geom type="sphere" size="0.05"/></body></body></worldbody></mujoco>"""


USD = """#usda 1.0
(metersPerUnit = 0.01
 upAxis = "Z")
def Xform "World" {{
    def Cube "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsCollisionAPI"])
    {{
        double size = 20
        float physics:mass = 3
        float3 physics:diagonalInertia = ({moments})
        point3f physics:centerOfMass = ({com})
    }}
}}
"""
SDF = """<sdf version="1.9"><model name="m"><link name="base"><pose>1 2 3 0 0 0</pose><inertial>
<pose>{com} 0 0 0</pose><mass>3</mass><inertia><ixx>0.02</ixx><iyy>{iyy}</iyy><izz>0.02</izz></inertia></inertial>
<visual name="v"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></visual></link></model></sdf>"""


def test_mjcf_is_judged_by_its_own_numbers(tmp_path):
    pytest.importorskip("mujoco")
    right = findings(tmp_path, {}, mjcf(), "m.xml")
    assert {name: finding.verdict for name, finding in right.items()} == {"base": Verdict.RIGHT, "tip": Verdict.RIGHT}
    assert right["base"].mass == 2
    wrong = findings(tmp_path, {}, mjcf("0.01 0.02 0.05"), "m.xml")["base"]  # MuJoCo would balance it
    assert (wrong.verdict, wrong.mistake) == (Verdict.WRONG, "impossible inertia")
    assert wrong.moments == pytest.approx((0.01, 0.02, 0.05))


def test_usd_in_centimetres(tmp_path):
    pytest.importorskip("pxr")
    right = findings(tmp_path, {}, USD.format(moments="200, 200, 200", com="0, 0, 0"), "m.usda")["/World/base"]
    assert (right.verdict, right.moments) == (Verdict.RIGHT, pytest.approx((0.02, 0.02, 0.02)))
    wrong = findings(tmp_path, {}, USD.format(moments="0.02, 0.02, 0.02", com="0, 0, 0"), "m.usda")["/World/base"]  # in kg m^2
    assert wrong.mistake in ("decimal slip", "placeholder inertia")
    wrong = findings(tmp_path, {}, USD.format(moments="200, 200, 200", com="0, 30, 0"), "m.usda")["/World/base"]
    assert wrong.mistake == "centre of mass outside the shapes"


def test_sdf(tmp_path):
    assert findings(tmp_path, {}, SDF.format(com="0 0 0", iyy=0.02), "m.sdf")["base"].verdict is Verdict.RIGHT
    assert findings(tmp_path, {}, SDF.format(com="0 0 0", iyy=0.2), "m.sdf")["base"].repair == "multiply iyy by 10^-1"
    assert findings(tmp_path, {}, SDF.format(com="0 0.5 0", iyy=0.02), "m.sdf")["base"].mistake.startswith("centre")


MOVING = """<sdf version="1.9"><model name="m">{static}<link name="base"><inertial><mass>3</mass><inertia><ixx>0.02</ixx>
<iyy>0.02</iyy><izz>0.02</izz></inertia></inertial></link><link name="tip">{inertial}
<visual name="v"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></visual></link>
<joint name="j" type="{kind}"><parent>base</parent><child>tip</child></joint></model></sdf>"""
SIX = "<inertial><mass>3</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial>"


@pytest.mark.parametrize(
    ("static", "inertial", "kind", "verdict"),
    [
        ("", "", "revolute", "wrong"),
        ("", "<inertial/>", "revolute", "wrong"),
        ("", "<inertial><mass>2</mass></inertial>", "revolute", "wrong"),
        ("", SIX, "revolute", "right"),
        ("", "", "fixed", "wrong"),  # it adds 1 kg m^2 to 0.02 kg m^2
        ("<static>true</static>", "", "revolute", "right"),
    ],
)
def test_the_default_of_sdf_is_a_placeholder(tmp_path, static, inertial, kind, verdict):
    found = findings(tmp_path, {}, MOVING.format(static=static, inertial=inertial, kind=kind), "m.sdf")["tip"]
    assert (found.verdict, found.mistake) == (verdict, "placeholder inertia" if verdict == "wrong" else "")


def test_the_default_of_sdf_is_a_placeholder_although_the_shapes_allow_it(tmp_path):
    text = MOVING.format(static="", inertial="", kind="revolute").replace("0.2 0.2 0.2", "2.4 2.4 2.4")  # 0.96 kg m^2
    assert findings(tmp_path, {}, text, "m.sdf")["tip"].mistake == "placeholder inertia"


def test_links_of_models_within_a_model_of_sdf(tmp_path):
    """They have joints and twins in other models, and poses of all models that they are in."""
    arm_ = '<model name="{}_arm"><pose>0 {} 0 0 0 0</pose><link name="l">{}{}</link></model>'
    visual = '<visual name="v"><geometry><box><size>0.2 0.2 0.2</size></box></geometry></visual>'
    heavy = SIX.replace("<iyy>0.02", "<iyy>0.03")
    joints = "".join(
        f'<joint name="{side}" type="{kind}"><parent>base</parent><child>{side}_arm::l</child></joint>'
        for side, kind in (("left", "revolute"), ("right", "fixed"))
    )
    for inertial, verdict in ((SIX, Verdict.RIGHT), (heavy, Verdict.WRONG)):
        models_ = arm_.format("left", 0.3, SIX, visual) + arm_.format("right", -0.3, inertial, visual)
        text = f'<sdf version="1.9"><model name="m"><link name="base">{SIX}{visual}</link>{models_}{joints}</model></sdf>'
        found = findings(tmp_path, {}, text, "m.sdf")
        assert {name: finding.verdict for name, finding in found.items() if name != "right_arm::l"} == {
            "base": Verdict.RIGHT, "left_arm::l": Verdict.RIGHT
        }  # fmt: skip
        assert found["right_arm::l"].verdict is verdict
    (robot,) = read_robots_here(tmp_path / "m.sdf")
    assert {link.name: (link.joint, link.link.pose[1, 3]) for link in robot.links} == {
        "base": ("", 0), "left_arm::l": ("revolute", 0.3), "right_arm::l": ("fixed", -0.3)
    }  # fmt: skip


BODY = """#usda 1.0
(metersPerUnit = 1
 upAxis = "Z")
def Xform "a" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{{
    {body}
    def Cube "c" ({collision})
    {{
        double size = 0.2
        {collider}
    }}
}}
"""
COLLIDER = 'prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMassAPI"]'


@pytest.mark.parametrize(
    ("body", "collision", "collider", "verdict", "mass"),
    [
        ("", COLLIDER, "", "right", 8.0),
        ("float physics:mass = 2", COLLIDER, "", "right", 2.0),
        ("float physics:mass = -2", COLLIDER, "", "right", 8.0),  # such a mass does not count
        ("float physics:mass = 2\n    point3f physics:centerOfMass = (0, 3, 0)", COLLIDER, "", "wrong", 2.0),
        ("float3 physics:diagonalInertia = (1, 1, 7)", COLLIDER, "", "wrong", 8.0),
        ("float3 physics:diagonalInertia = (-1, 1, 1)", COLLIDER, "", "wrong", 8.0),
        (
            "",
            COLLIDER,
            "float physics:mass = 60\n        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)",
            "wrong",
            60.0,
        ),
        ("", COLLIDER, "float physics:mass = 60", "right", 60.0),
        ("float physics:mass = 2", "", "", "not tested", np.nan),
        ("float3 physics:diagonalInertia = (1, 1, 1)", "", "", "not tested", np.nan),
        ("", "", "", "not tested", np.nan),
    ],
)
def test_usd_with_a_part_of_mass_and_inertia(tmp_path, body, collision, collider, verdict, mass):
    """The rest follows from the colliders by the rules of ComputeMassProperties; without any it is not tested."""
    pytest.importorskip("pxr")
    text = BODY.format(body=body, collision=collision, collider=collider)
    found = findings(tmp_path, {}, text, "m.usda")["/a"]
    assert found.verdict == verdict, found
    assert found.mass == pytest.approx(mass, nan_ok=True)


@pytest.mark.parametrize(
    ("joints", "wrong"),
    [
        ((("base", "a"),), 0),
        ((("base", "gone"),), 1),
        ((("gone", "a"),), 1),
        ((("base", "a"), ("b", "a")), 1),
    ],
)
def test_joints_that_parsers_refuse_are_wrong(tmp_path, joints, wrong):
    links = {"base": arm()["base"], "a": one(3.0)["a"], "b": one(3.0)["a"]}
    text = urdf({name: replace(link, parent="") for name, link in links.items()})
    joint = '<joint name="j{}" type="revolute"><parent link="{}"/><child link="{}"/></joint>'
    text = text.replace("</robot>", "".join(joint.format(k, *ends) for k, ends in enumerate(joints)) + "</robot>")
    (tmp_path / "m.urdf").write_text(text)
    (robot,) = read_robots_here(tmp_path / "m.urdf")
    assert sum(finding.verdict is Verdict.WRONG for finding in judge(robot, "m.urdf")) == wrong


def test_options_of_mujoco_that_change_the_masses_are_named(tmp_path):
    pytest.importorskip("mujoco")
    for option, named in (('balanceinertia="true"', True), ('boundinertia="0.1"', True), ('autolimits="true"', False)):
        (tmp_path / "m.xml").write_text(mjcf().replace('balanceinertia="true"', option))
        (robot,) = read_robots_here(tmp_path / "m.xml")
        assert any(option.partition("=")[0] in note for note in robot.notes) is named


def test_meshes_in_millimetres_are_noted(tmp_path):
    for scale, noted in ((1000, True), (100, False), (1, False)):
        text = urdf(one(3.0, boxes=((tuple(scale * np.array(BOX[0])), *BOX[1:]),), inertia=one(3.0)["a"].filled().inertia))
        (tmp_path / f"{scale}.urdf").write_text(text)
        (robot,) = read_robots_here(tmp_path / f"{scale}.urdf")
        assert any("in mm" in note for note in links_module._notes(robot)) is noted


COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit meter="0.01"/></asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count="12">0 0 0 10 0 0 0 10 0 0 0 10</float_array>
</source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene><node><translate>1 0 0</translate><rotate>0 0 1 90</rotate><instance_geometry url="#g"/>
</node></visual_scene></library_visual_scenes></COLLADA>"""


def test_points_of_collada_are_in_metres_and_in_the_axes_of_the_scene():
    points = read_collada(COLLADA.encode())
    assert points == pytest.approx(np.array([[0.01, 0, 0], [0.01, 0.1, 0], [-0.09, 0, 0], [0.01, 0, 0.1]]), abs=1e-12)
    for text in ("no XML", COLLADA.replace("<float_array", "<int_array").replace("/float_array", "/int_array")):
        with pytest.raises(Unread):
            read_collada(text.encode())


def test_a_mesh_that_is_not_there_is_no_fault(tmp_path):
    links = arm()
    mesh = '<visual><geometry><mesh filename="package://p/gone.stl"/></geometry></visual>'
    links["upper_arm"] = replace(links["upper_arm"].filled(), com=np.array([0, 0, 5.0]), extra=mesh)
    found = findings(tmp_path, links)
    assert found["upper_arm"].verdict is Verdict.RIGHT  # its shapes are not known
    assert found["base"].verdict is Verdict.RIGHT


# ---------------------------------------------------------------------------------------------------------------- the command


@pytest.fixture
def read_in_this_process(monkeypatch):
    """Files are read here: each reading has a process of its own otherwise."""

    class Here:
        close = staticmethod(lambda: None)

    monkeypatch.setattr(robot_links, "python_worker", lambda *_: Here())
    monkeypatch.setattr(robot_links, "run_within", lambda seconds, work, process: work())


@pytest.fixture
def library(tmp_path):
    """A folder of two packages with a robot each, of which one has a fault, and XML that is no model."""
    wrong = biped()
    wrong["pelvis"] = replace(wrong["pelvis"].filled(), inertia=0.0001 * np.eye(3))
    for name, links in (("good", arm()), ("bad", wrong)):
        folder = tmp_path / "library" / f"{name}_description" / "urdf"
        folder.mkdir(parents=True)
        (folder / f"{name}.urdf").write_text(urdf(links))
        (folder.parent / "package.xml").write_text("<package/>")
        (folder / "template.xml").write_text('<robot xmlns:xacro="x"><xacro:macro/><link name="a"/></robot>')
    return tmp_path / "library"


def test_a_library_is_verified_without_an_engine(library, monkeypatch, read_in_this_process):
    monkeypatch.setattr(models, "installed_loaders", set)
    bad, good = verify(str(library))
    assert (bad.verdict, good.verdict) == (Verdict.WRONG, Verdict.RIGHT)
    assert [finding.case for finding in bad.findings] == list(biped())
    assert {finding.check for finding in (*bad.findings, *good.findings)} == {"links"}
    assert "placeholder inertia: 1" in bad.reason


def test_the_command_writes_one_page_with_a_line_per_link(library, tmp_path, read_in_this_process):
    pytest.importorskip("jinja2")
    out = tmp_path / "page"
    result = CliRunner().invoke(main, ["verify", str(library), "--only", "links", "--out", str(out)])
    assert result.exit_code == 1, result.output
    page = re.sub(r"<wbr>|\n", "", (out / "verify.html").read_text())
    names = [*arm(), *biped()]
    assert all(
        f">{name}<" in page.replace("<wbr>", "").replace("\n", "") or name in page.replace("<wbr>", "") for name in names
    )
    data = json.loads((out / "verify.json").read_text())
    lines = [finding for subject in data["subjects"] for finding in subject["findings"]]
    assert sorted(line["case"] for line in lines) == sorted(names)
    (pelvis,) = (line for line in lines if line["verdict"] == "wrong")
    assert (pelvis["case"], pelvis["causes"][0]["keys"]) == ("pelvis", ["placeholder inertia"])
    assert "too fast" in pelvis["effect"]
    right = CliRunner().invoke(main, ["verify", str(library / "good_description" / "urdf" / "good.urdf"), "--only", "links"])
    assert right.exit_code == 0, right.output


def test_one_bad_file_of_a_library_is_not_tested_and_alone_it_is_bad_input(library, read_in_this_process):
    broken = library / "bad_description" / "urdf" / "bad.urdf"
    broken.write_text('<robot name="r"><link name="a"><inertial><mass value="nan"/></inertial></link></robot>')
    bad, good = verify(str(library), only="links")
    assert (bad.verdict, good.verdict) == (Verdict.NOT_TESTED, Verdict.RIGHT)
    with pytest.raises(BadInput, match="nan"):
        verify(str(broken), only="links")


# ------------------------------------------------------------------------------------------- files that are not made for this


TRIANGLE = 1e-3 * np.diag([1.0, 1.0, 3.11])
"""An inertia that no body has, by more than its digits."""


def broken_arm():
    links = arm()
    links["upper_arm"] = replace(links["upper_arm"], inertia=TRIANGLE)
    return links


def test_a_package_is_a_library_although_it_has_other_files(tmp_path, read_in_this_process):
    package = tmp_path / "package"
    for name in ("urdf", "launch", "meshes", ".git"):
        (package / name).mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "CMakeLists.txt").write_text("project(package)")
    (package / "config.json").write_text('{"a": 1}')
    (package / "launch" / "a.xml").write_text("<launch/>")
    (package / "urdf" / "broken.urdf").write_text(urdf(broken_arm()))
    (package / ".git" / "old.urdf").write_text(urdf(arm()))
    for only in ("links", ()):
        (found,) = verify(str(package), only=only)
        assert (found.subject, found.verdict) == ("broken.urdf", Verdict.WRONG)
        for name in ("package.xml", "launch/a.xml", "CMakeLists.txt", "config.json"):
            assert any(name in note for note in found.notes)


def test_models_below_a_model_are_verified_by_their_relative_names(tmp_path, read_in_this_process):
    library = tmp_path / "library"
    (library / "sub").mkdir(parents=True)
    (library / "arm.urdf").write_text(urdf(arm()))
    (library / "sub" / "arm.urdf").write_text(urdf(broken_arm()))
    (library / "sub" / "empty.urdf").write_text("")
    (library / "sub" / "scene.xml").write_text('<mujoco><include file="part.xml"/></mujoco>')
    (library / "sub" / "part.xml").write_text("<mujocoinclude/>")
    found = verify(str(library), only="links")
    assert {file.subject: file.verdict for file in found} == {
        "arm.urdf": Verdict.RIGHT,
        "sub/arm.urdf": Verdict.WRONG,
        "sub/empty.urdf": Verdict.NOT_TESTED,
    }
    assert any("sub/scene.xml" in note and "sub/part.xml" in note for note in found[0].notes)


def test_a_recording_in_a_folder_of_models_needs_a_body(tmp_path, read_in_this_process):
    (tmp_path / "arm.urdf").write_text(urdf(arm()))
    (tmp_path / "run.csv").write_text("t,wx,wy,wz\n" + "\n".join(f"{k / 10},1,2,3" for k in range(5)))
    with pytest.raises(BadInput, match="body"):
        verify(str(tmp_path))
    (found,) = verify(str(tmp_path), only="links")
    assert any("run.csv" in note for note in found.notes)


@pytest.mark.parametrize(
    ("mass", "moment"), [(1e-300, 1e-320), (1e300, 1e300), (1.0, 1e-320), (1e-300, 1.0), (1e300, 0.0), (1.0, 1e155)]
)
def test_numbers_beyond_the_range_are_not_tested(tmp_path, mass, moment):
    links = arm()
    links["left_finger"] = replace(links["left_finger"], mass=mass, inertia=moment * np.eye(3))
    found = findings(tmp_path, links)
    assert found["left_finger"].verdict is Verdict.NOT_TESTED
    assert {finding.verdict for name, finding in found.items() if name != "left_finger"} == {Verdict.RIGHT}


def test_usd_with_numbers_that_are_not_finite_is_not_tested(tmp_path, read_in_this_process):
    pytest.importorskip("pxr")
    for name, moments in (("nan.usda", "nan, 200, 200"), ("inf.usda", "inf, 200, 200"), ("ok.usda", "200, 200, 200")):
        (tmp_path / name).write_text(USD.format(moments=moments, com="0, 0, 0"))
    found = {file.subject: file.verdict for file in verify(str(tmp_path), only="links")}
    assert found == {"inf.usda": Verdict.NOT_TESTED, "nan.usda": Verdict.NOT_TESTED, "ok.usda": Verdict.RIGHT}


def test_an_error_of_arithmetic_in_one_file_does_not_stop_a_library(library, monkeypatch, read_in_this_process):
    def fail(robot, subject):
        raise np.linalg.LinAlgError("no convergence") if subject.startswith("bad") else ZeroDivisionError

    monkeypatch.setattr(links_module, "judge", fail)
    assert [file.verdict for file in verify(str(library), only="links")] == [Verdict.NOT_TESTED] * 2


def test_two_links_of_one_name_are_judged_by_their_own_numbers(tmp_path):
    for second, verdicts in ((TRIANGLE, ("right", "wrong")), (1e-3 * np.eye(3), ("right", "right"))):
        link = '<link name="tip"><inertial><mass value="1"/><inertia ixx="{}" iyy="{}" izz="{}"/></inertial></link>'
        pair = [link.format(*np.diag(tensor)) for tensor in (1e-3 * np.eye(3), second)]
        found = findings(tmp_path, {}, f'<robot name="r">{"".join(pair)}</robot>')
        assert (found["tip"].verdict, found["tip (again)"].verdict) == verdicts
        assert found[""].verdict is Verdict.WRONG  # parsers refuse the file


def test_bodies_without_a_name_are_told_apart(tmp_path):
    pytest.importorskip("mujoco")
    body = '<body{} pos="{} 0 0"><joint/><inertial pos="{} 0 0" mass="3" diaginertia="{}"/>{}</body>'
    right, box = "0.003125 0.010625 0.0125", '<geom type="box" size="0.1 0.05 0.025"/>'
    bodies = [
        body.format("", 0, 0, right, '<geom type="mesh" mesh="m"/>'),
        body.format("", 1, 0.5, right, box),
        body.format(' name="body 0"', 2, 0, "3.125e-05 0.00010625 0.000125", box),
        body.format(' name="body 1"', 3, 0, right, box),
    ]
    text = f'<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody>{"".join(bodies)}</worldbody></mujoco>'
    found = list(findings(tmp_path, {}, text, "m.xml").values())
    assert [finding.mistake for finding in found] == ["", "centre of mass outside the shapes", "decimal slip", ""]


MASSLESS = """<mujoco><asset><mesh name="m" file="gone.stl"/></asset><worldbody><body name="arm"><joint/>{arm}
<geom type="box" size="0.1 0.05 0.05" {geom}/><body name="camera" pos="0 0 0.05">{camera}</body></body></worldbody></mujoco>"""
INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="{0} {0} {0}"/>'


@pytest.mark.parametrize(
    ("arm_", "geom", "camera", "verdicts"),
    [
        ("", 'mass="0"', "", ("wrong", "right")),
        ("", 'density="0"', "", ("wrong", "right")),
        ("", "", "", ("right", "right")),
        ("", 'mass="0"', '<geom type="mesh" mesh="m"/>', ("right", "not tested")),
        ("", "", '<geom size="0.01"/><geom type="mesh" mesh="m" density="0"/>', ("right", "right")),
        (INERTIAL.format("1e-5"), "", '<geom size="0.01" mass="0"/>', ("wrong", "right")),
        (INERTIAL.format("1e-5"), "", '<geom type="mesh" mesh="m"/>', ("undecided", "not tested")),
        (INERTIAL.format("0.003"), "", '<geom type="mesh" mesh="m"/>', ("right", "not tested")),
    ],
)  # fmt: skip
def test_mjcf_without_a_mass(tmp_path, arm_, geom, camera, verdicts):
    """Geometries of mass 0 have none. A mass that follows from a mesh that is not there is not known."""
    pytest.importorskip("mujoco")
    found = findings(tmp_path, {}, MASSLESS.format(arm=arm_, geom=geom, camera=camera), "m.xml")
    assert tuple(finding.verdict for finding in found.values()) == verdicts


def test_engines_load_the_files_of_a_library_that_can_be_read(library, monkeypatch, read_in_this_process):
    (library / "bad_description" / "urdf" / "bad.urdf").write_text("no model")
    loaded = []

    def load(files, *_):
        loaded.extend(path.name for path in files)
        finding = Finding("good.urdf", "bodies", "engine", Verdict.RIGHT)
        return [Verification("good.urdf", "model file", (finding,)) for _ in files]

    monkeypatch.setattr(models, "installed_loaders", lambda: {"engine"})
    monkeypatch.setattr(models, "verify_files", load)
    bad, good = verify(str(library))
    assert loaded == ["good.urdf"]
    assert (bad.verdict, good.verdict) == (Verdict.NOT_TESTED, Verdict.RIGHT)
    assert {finding.check for finding in good.findings} == {"links", "bodies"}


def test_engines_are_refused_without_the_check_that_uses_them(library):
    with pytest.raises(BadInput, match="bodies"):
        verify(str(library), only="links", engines="mujoco")


@pytest.mark.parametrize("key", sampled([mistake.key for mistake in FILES]))
def test_the_effect_of_each_mistake_of_the_catalogue_is_found(tmp_path, key):
    """The catalogue's own effect, on a link with the products of a turned box, or on one of twins."""
    (mistake,) = (each for each in FILES if each.key == key)
    name = "right_thigh" if key == "twins differ" else "left_thigh"
    path = tmp_path / "m.urdf"
    path.write_text(urdf(biped()))
    (robot,) = read_robots_here(path)
    robot.links = [
        replace(link, link=mistake.change(link.link)) if link.name == name else link for link in robot.links
    ]  # fmt: skip
    found = {finding.case: finding for finding in judge(robot, "m.urdf")}[name]
    assert found.verdict is Verdict.WRONG
    assert key in {each for cause in found.causes for each in cause.keys} or (key, found.mistake) in {
        ("inertia outside the shapes", "decimal slip"), ("inertia too small", "decimal slip")
    }  # fmt: skip
