"""Verification of the links of model files, without an engine: mass and inertia against shapes, twins and what can exist.

Each rule compares numbers of the file with other data of the file. The limits are measured on 62 robots of the package
example-robot-data 6.0.0, with 1,743 links that have a mass.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np

from conservative.attitude import Array
from conservative.errors import BadInput
from conservative.references.model_files.files import reason
from conservative.references.model_files.pieces import Piece, join, list_numbers, steiner
from conservative.references.model_files.robot_links import Robot, RobotLink, read_robots

from ..finding import Cause, Finding, Verdict, Verification
from ..mistakes.bodies import FILES, LOADED
from ..mistakes.mistake import Mistake
from .solids import DENSEST, Hull, density_of, hull_of, overhang, ratio, reach, spread_density, unlike
from .twins import Pair, find_pairs, part_of

NOTHING = 0.05
"""Largest relative change of an angular acceleration that is no fault, if several links are fixed to each other."""
NO_MASS = 1e-3
"""Share of the mass of a body below which even an impossible inertia does not matter: placeholders of 1e-6 kg are common."""
FARTHEST = (1.5, 4.0)
"""`reach`: from the first on undecided, because shapes may be simplified, from the second on wrong. In right robots below 1.2;
in popular ones with coarse shapes up to 3.8."""
SLIP = (0.4, 2.0)
"""Inertia relative to that of the hull after the repair of a decimal slip: less than a decade, so that one power is in it at
most. Of the links whose proportions are those of the hull, nine in ten are in it."""
LIGHT, HEAVY = 0.3, 2.0
"""Inertia relative to that of the hull from which on it can be too small or too large for the shapes."""
SLIPPED = 7.0
"""Inertia relative to that of the hull beyond which a slip is looked for, if it reaches outside. Right links: up to 4.9."""
ALIKE = 0.1
"""Largest `unlike` of an inertia that has the proportions of the hull."""
OUTSIDE = (0.05, 0.2)
"""Distance of a centre of mass from the hull, relative to its size: undecided, wrong. Right robots: up to 0.07."""
SIGN = (0.1, 2.0)
"""Least gain of `unlike` by other signs of the products, and least ratio, that show wrong signs. Right robots: 0.075."""
TWINS = (0.1, 0.25)
"""Relative difference of twins: undecided, wrong. Twins that are built differently have up to 0.16."""
TURNED = 0.1
"""Relative difference of the inertias of twins with the same moments that shows a wrong sign of a product."""
MATERIALS = "materials"
"""The reason for a largest density."""
SOLID = 12000.0
"""Density of the hull of its shapes, kg/m^3, from which on the shapes of a body may be symbols."""
MILLIMETRE = 1e-3
NO_DIGITS = 1e-200
"""Rounding, kg m^2, below which an inertia has no digits, because it follows from shapes."""
SPARSEST = 10.0
"""`spread_density`, kg/m^3, below which small shapes that may be symbols do not explain a large inertia."""
LARGEST = 1e60
"""Largest mass, inertia and distance in SI units that products of several of them leave finite; the smallest is its inverse."""
GRAVITY = 9.81
"""Acceleration of gravity, m/s^2."""

_BY_KEY: Mapping[str, Mistake] = {mistake.key: mistake for mistake in (*LOADED, *FILES)}


@dataclass(frozen=True)
class LinkFinding(Finding):
    """The finding on a link.

    Attributes
    ----------
    mass, moments
        Mass, kg, and principal moments, kg m^2, in the file.
    effect
        What the mistake does to the motion of the body, computed from the inertia of the file and the one expected.
    repair
        What to change in the file, if there is a single way; "" otherwise.
    """

    mass: float = math.nan
    moments: tuple[float, ...] = ()
    effect: str = ""
    repair: str = ""


@dataclass
class Fault:
    """A mistake of a link: its key, by how much, what it compares with, and the part that it should be, if that is known."""

    key: str
    text: str
    error: float
    allowed: float
    unit: str
    by: str
    expected: Piece | None = None
    repair: str = ""
    verdict: Verdict = Verdict.WRONG
    numbers: Mapping[str, float] = field(default_factory=dict)
    effect: str = ""


def verify_links(
    files: Sequence[Path],
    tell: Callable[[float, str], object] = lambda share, what: None,
    search: Sequence[Path] = (),
) -> list[Verification]:
    """Return a verification for each model file, with a finding for each link.

    Parameters
    ----------
    files
        URDF, SDF, MJCF or USD.
    tell
        Is called with the share that is done and the next step.
    search
        Folders of meshes and packages, in addition to the folder of the file.

    Raises
    ------
    BadInput, MissingEngine, MissingExtra
        The only file cannot be read. One of several files that cannot be read is not tested.
    """
    paths = list(dict.fromkeys(files))
    read = read_robots(paths, search, tell)
    if len(read) == 1 and isinstance(read[0], Exception):
        raise read[0]
    return [_verify(name, robots) for name, robots in zip(short_names(paths), read, strict=True)]


def short_names(paths: Sequence[Path]) -> list[str]:
    """Return the paths of files relative to the folder that has all of them."""
    folder = Path(os.path.commonpath([path.absolute().parent for path in paths])) if paths else Path()
    return [path.absolute().relative_to(folder).as_posix() for path in paths]


def _verify(name: str, robots: Sequence[Robot] | Exception) -> Verification:
    if isinstance(robots, Exception):
        text = f"the file has {reason(robots)}" if isinstance(robots, BadInput) else str(robots)
        finding = LinkFinding(name, "links", "", Verdict.NOT_TESTED, detail=text)
        return Verification(name, "model file", (finding,), "it cannot be read")
    findings = [finding for robot in robots for finding in _judge_safely(robot, name)]
    notes = [note for robot in robots for note in _notes(robot)]
    return Verification(name, "model file", tuple(findings), _summary(findings), tuple(dict.fromkeys(notes)))


def _notes(robot: Robot) -> Iterator[str]:
    yield from robot.notes
    unread = dict.fromkeys(text for link in robot.links for text in link.unread)
    if unread:
        count = sum(bool(link.unread) for link in robot.links)
        first = next(iter(unread))
        unread_links = f"{count} of {len(robot.links)} links have shapes that are not read, so that less is tested"
        yield f"{unread_links}: {first} (--search FOLDER)"
    for link in robot.links:
        if _is_in_millimetres(link):
            yield f"the shapes of {link.name!r} are 1,000 times as large as its inertia shows: is a mesh in mm?"


def _is_in_millimetres(link: RobotLink) -> bool:
    """Return True if a link has the inertia of its shapes at a thousandth of their size."""
    if (
        not link.shapes
        or not link.link.mass > 0
        or np.ptp(np.vstack([shape.points for shape in link.shapes]), axis=0).max() < 1
    ):
        return False
    part = part_of(link)
    return bool(np.isfinite(part.inertia).all()) and any(
        _is_like(part.inertia * MILLIMETRE**-2, hull, part.mass) for hull in _hulls(link)
    )


def _summary(findings: Sequence[Finding]) -> str:
    counts = Counter(finding.verdict for finding in findings)
    wrong = Counter(finding.mistake for finding in findings if finding.verdict is Verdict.WRONG)
    text = f"{counts[Verdict.WRONG]} of {len(findings)} links are wrong"
    text += f" ({', '.join(f'{key}: {count}' for key, count in wrong.most_common())})" if wrong else ""
    others = [f", {counts[verdict]} {verdict}" for verdict in (Verdict.UNDECIDED, Verdict.NOT_TESTED) if counts[verdict]]
    return text + "".join(others)


# -------------------------------------------------------------------------------------------------------- bodies of a robot


@dataclass(frozen=True, eq=False)
class Body:
    """Links that are fixed to each other and move as one: all shapes, in the axes of the first link."""

    members: Sequence[RobotLink]

    @property
    def root(self) -> RobotLink:
        """The first link, which a joint moves."""
        return self.members[0]

    def to_root(self, link: RobotLink) -> Array:
        """Return the pose (4, 4) of a link in the axes of the first one."""
        return np.linalg.inv(self.root.link.pose) @ link.link.pose

    @cached_property
    def hull(self) -> Hull | None:
        """The hull of all shapes; None if there are none, or one of them could not be read."""
        if any(link.unread for link in self.members):
            return None
        poses = [(self.to_root(link), link.shapes) for link in self.members]
        return hull_of([shape.points @ T[:3, :3].T + T[:3, 3] for T, shapes in poses for shape in shapes])

    def whole(self, changed: RobotLink | None = None, part: Piece | None = None) -> Piece:
        """Return mass and inertia of the body, with another `part` for a `changed` link in its own axes."""
        parts = [(part if link is changed and part else part_of(link)).place(self.to_root(link)) for link in self.members]
        return join(piece for piece in parts if piece.mass or piece.inertia.any())


def find_bodies(links: Sequence[RobotLink]) -> dict[str, Body]:
    """Return the body of each link by the link's name."""
    roots: dict[str, str] = {}
    groups: dict[str, list[RobotLink]] = {}
    for link in links:
        roots[link.name] = roots[link.parent] if link.joint == "fixed" and link.parent in roots else link.name
        groups.setdefault(roots[link.name], []).append(link)
    bodies = {root: Body(members) for root, members in groups.items()}
    return {name: bodies[root] for name, root in roots.items()}


# --------------------------------------------------------------------------------------------------------------- the verdict


def _judge_safely(robot: Robot, subject: str) -> list[LinkFinding]:
    """Return the findings of `judge`, or one that says which numbers cannot be computed with. A library goes on after it."""
    try:
        with np.errstate(all="ignore"):
            return judge(robot, subject)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        text = f"its numbers cannot be computed with ({type(error).__name__})"
        return [LinkFinding(subject, "links", robot.name, Verdict.NOT_TESTED, detail=text)]


def _unusable(link: RobotLink) -> str:
    """Return why the numbers of a link cannot be computed with, or are not known; "" if they can."""
    own = link.link
    if not (np.isfinite(own.mass) and np.isfinite(own.inertia).all() and np.isfinite(own.frame).all()):
        return "its mass, centre of mass or inertia is not finite"
    sizes = np.abs([own.mass, *own.inertia.ravel(), *own.frame[:3, 3]])
    if sizes.max() > LARGEST or (0 < sizes[0] < 1 / LARGEST) or (own.inertia.any() and np.abs(own.inertia).max() < 1 / LARGEST):
        return f"its mass, centre of mass or inertia is beyond {LARGEST:.0e} or below {1 / LARGEST:.0e}"
    return link.unknown


def judge(robot: Robot, subject: str) -> list[LinkFinding]:
    """Return a finding for each link of a robot. Links are told apart by their names, which differ."""
    unusable = {link.name: text for link in robot.links if (text := _unusable(link))}
    links = [_emptied(link, unusable[link.name]) if link.name in unusable else link for link in robot.links]
    bodies, pairs = find_bodies(links), find_pairs(links)
    twin_of = {link.name: (pair, link is pair.right) for pair in pairs for link in (pair.left, pair.right)}
    faults = {link.name: list(_faults(link, bodies[link.name], twin_of.get(link.name))) for link in links}
    for pair in pairs:
        _compare_twins(pair, faults, bodies)
    broken = [
        LinkFinding(
            subject, "links", robot.name, Verdict.WRONG, detail=text, effect="engines that check it refuse the file"
        )
        for text in robot.broken
    ]  # fmt: skip
    return broken + [_finding(link, bodies[link.name], faults[link.name], subject, robot.name) for link in links]


def _emptied(link: RobotLink, text: str) -> RobotLink:
    """Return a link whose mass is not known; its shapes stay."""
    empty = replace(link.link, mass=0.0, inertia=np.zeros((3, 3)), frame=np.eye(4))
    return replace(link, link=empty, written=False, unknown=text)


def _finding(link: RobotLink, body: Body, faults: Sequence[Fault], subject: str, model: str) -> LinkFinding:
    name = f"{model}: {link.name}" if model else link.name
    moments = tuple(np.linalg.eigvalsh(link.link.inertia).tolist())
    right = LinkFinding(subject, "links", name, Verdict.RIGHT, mass=link.link.mass, moments=moments)
    if link.unknown:
        return replace(right, verdict=Verdict.NOT_TESTED, mass=math.nan, moments=(), detail=link.unknown)
    if not faults:
        return right if link.written else replace(right, detail="it has no inertia of its own")
    matter = [fault for fault in faults if not _harmless(link, body, fault)]
    if not matter:
        text = f"{faults[0].text}, which does not change the motion of {body.root.name!r}, to which it is fixed"
        return replace(right, detail=text)
    if unknown := [member.name for member in body.members if member.unknown]:
        matter = [_unless_the_rest_decides(fault, part_of(link), unknown[0]) for fault in matter]
    wrong = [fault for fault in matter if fault.verdict is Verdict.WRONG] or matter
    main = wrong[0]
    effects = [fault.effect or _effect(link, body, fault) for fault in wrong]
    repair = "; ".join(filter(None, (fault.repair for fault in wrong)))
    sentences = [_BY_KEY[fault.key].sentence.format(**fault.numbers) for fault in wrong]
    keys = tuple(dict.fromkeys(fault.key for fault in wrong))
    cause = Cause(keys, ". ".join(dict.fromkeys(sentences)), numbers=main.numbers, remedy=repair)
    return replace(
        right,
        verdict=main.verdict,
        error=main.error,
        allowed=main.allowed,
        unit=main.unit,
        by=main.by,
        causes=(cause,) if main.verdict is Verdict.WRONG else (),
        detail="; ".join(fault.text for fault in wrong),
        effect="; ".join(dict.fromkeys(filter(None, effects))),
        repair=repair,
    )


def _unless_the_rest_decides(fault: Fault, part: Piece, name: str) -> Fault:
    """Return a fault as undecided if the mass of a link that is fixed to it is not known, and may make it harmless."""
    if part.flaw:
        return fault
    return replace(fault, verdict=Verdict.UNDECIDED, text=f"{fault.text}; it is fixed to {name!r}, whose mass is not known")


def _harmless(link: RobotLink, body: Body, fault: Fault) -> bool:
    """Return True if a fault of one of several links that are fixed to each other does not change the motion."""
    if not any(member.link.mass > 0 for member in body.members if member is not link):
        return False
    part = part_of(link)
    expected = fault.expected or replace(part, inertia=np.zeros((3, 3)))
    now, then = body.whole(), body.whole(link, expected)
    if part.flaw and part.inertia.any() and part.mass > NO_MASS * now.mass:
        return False  # some engines refuse it
    if now.flaw or then.flaw:
        return False
    low, high = _accelerations(now.inertia, then.inertia)
    size = math.sqrt(np.trace(then.inertia) / then.mass)
    return max(abs(low - 1), abs(high - 1)) < NOTHING and bool(np.linalg.norm(now.com - then.com) < NOTHING * size)


def _accelerations(inertia: Array, expected: Array) -> tuple[float, float]:
    """Return the smallest and largest ratio of angular accelerations under one torque, of a body and of the expected one."""
    moments, axes = np.linalg.eigh(expected)
    inverse = axes / np.sqrt(moments)
    values = np.linalg.eigvalsh(inverse.T @ inertia @ inverse)
    return float(1 / values[-1]), float(1 / values[0]) if values[0] > 0 else math.inf


def _effect(link: RobotLink, body: Body, fault: Fault) -> str:
    """Return a sentence on the effect of a fault on the motion of the body of a link."""
    effect = _motion(link, body, fault)
    if part_of(link).flaw and link.link.inertia.any() and link is not body.root:
        return "; ".join(filter(None, [effect or "it hardly changes the motion", "engines that check it refuse the file"]))
    return effect


def _motion(link: RobotLink, body: Body, fault: Fault) -> str:
    part = part_of(link)
    whole = body.whole()
    if fault.key == "no inertial element":
        return "it has no mass: an engine refuses it, or it accelerates without limit"
    if not whole.mass > 0:
        return "a force accelerates it the other way" if whole.mass < 0 else "it accelerates without limit under a force"
    moments = np.linalg.eigvalsh(whole.inertia) if whole.mass else np.zeros(3)
    if moments[0] < 0 and moments[0] < -1e-9 * moments[2]:
        return "a torque about one axis turns it the other way, and its energy has no lower bound"
    if not moments[0] > 1e-9 * moments[2]:
        return "it accelerates without limit under a torque about one axis"
    no_body = "no body moves like this: its free motion is the motion of no rigid body"
    if fault.expected is None:
        return no_body if fault.key == "impossible inertia" else ""
    then = body.whole(link, fault.expected)
    if then.flaw:  # another link of the body is impossible
        return no_body
    texts = []
    if max(whole.mass / then.mass, then.mass / whole.mass) > 1.5:
        fast = then.mass > whole.mass
        times = max(whole.mass / then.mass, then.mass / whole.mass)
        texts.append(f"it accelerates {_rounded(times)} times too {'fast' if fast else 'slowly'} under the same force")
    moved = float(np.linalg.norm(part.com - fault.expected.com))
    if moved > 1e-3 * math.sqrt(np.trace(then.inertia) / then.mass):
        torque = GRAVITY * part.mass * moved
        texts.append(f"its weight acts {_length(moved)} away, which changes torques by up to {torque:.2g} N m")
    if np.linalg.eigvalsh(then.inertia)[0] > 0:
        low, high = _accelerations(whole.inertia, then.inertia)
        texts.append(_too_fast(low, high))
        if fault.key == "sign of the products of inertia":
            texts.append(f"its principal axes are turned by {_angle(whole.inertia, then.inertia):.0f} degrees")
            if axis := _reversed(whole.inertia, then.inertia):
                texts.append(f"spun about {axis}, it pulls at its bearings to the other side")
    return "; ".join(filter(None, texts))


def _too_fast(low: float, high: float) -> str:
    times = max(high, 1 / low)
    if times < 1.005:
        return ""
    rounded = f"{100 * (times - 1):.2g} %" if times < 1.5 else f"{_rounded(times)} times"
    return f"it turns up to {rounded} too {'fast' if high > 1 / low else 'slowly'} under the same torque"


def _rounded(times: float) -> str:
    return f"{float(f'{times:.2g}'):,.10g}"


def _reversed(inertia: Array, expected: Array) -> str:
    """Return the axis about which a steady rotation needs the opposite torque w x J w; "" if there is none."""
    torques = [[np.cross(axis, tensor @ axis) for axis in np.eye(3)] for tensor in (inertia, expected)]
    least = 1e-3 * np.trace(expected)
    sizes = [
        float(np.linalg.norm(now)) if now @ then < 0 and np.linalg.norm(now) > least else 0.0
        for now, then in zip(*torques, strict=True)
    ]
    return "xyz"[int(np.argmax(sizes))] if any(sizes) else ""


def _length(metres: float) -> str:
    return f"{metres:.2g} m" if metres >= 0.01 else f"{1000 * metres:.2g} mm"


def _angle(inertia: Array, other: Array) -> float:
    """Return the angle between the axes of the moments of two inertias that differ most from the others, degrees."""
    moments = np.linalg.eigvalsh(other)
    alone = 0 if moments[1] - moments[0] > moments[2] - moments[1] else 2  # equal moments have no axes of their own
    axes = [np.linalg.eigh(tensor)[1][:, alone] for tensor in (inertia, other)]
    return math.degrees(math.acos(min(1.0, abs(float(axes[0] @ axes[1])))))


# ------------------------------------------------------------------------------------------------------------------ the rules


def _faults(link: RobotLink, body: Body, twin: tuple[Pair, bool] | None) -> Iterator[Fault]:
    """Yield the faults of a link that its own numbers, its shapes and the body that it is fixed to show."""
    part = part_of(link)
    if not link.written:
        yield from _missing(link, body)
        return
    if not part.mass and not part.inertia.any():
        yield from _missing(link, body)
        return
    own = _hulls(link)
    solid = _solid(part, own)
    if link.assumed and link is body.root and link.joint and link.joint != "fixed":
        default = f"{part.mass:g} kg, {part.inertia[0, 0]:g} kg m^2"
        text = f"the file has no mass and inertia of it, so that the default holds: {default}"
        yield Fault("placeholder inertia", text, math.nan, math.nan, "", "", solid or _ball(part))
        return
    sign = _sign(link, part, own) if part.mass > 0 else None
    if sign is not None and sign.expected is not None and not _is_right(link, sign.expected, own, body):
        sign = None
    if part.flaw:
        yield sign or _impossible(link, part, own, body, twin)
        if not part.mass > 0 or not part.inertia.any():
            return
    elif fault := sign or _size(link, part, own, body, solid, twin):
        yield fault
    if fault := _centre(link, part, body):
        yield _unless_symbols(fault, body)


def _is_right(link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body) -> bool:
    """Return True if a link would be right with another part, by the rules on its inertia: a repair has to be."""
    if part.flaw or _sign(link, part, hulls) is not None:
        return False
    size = _measure(part, hulls, body, link)
    return not (size.small or size.large or size.slipped or size.far > FARTHEST[0])


def _unless_symbols(fault: Fault, body: Body) -> Fault:
    """Return a fault as undecided if the shapes cannot hold the mass of the body: small spheres may be symbols."""
    mass = sum(link.link.mass for link in body.members)
    if body.hull is None or mass < SOLID * body.hull.volume:
        return fault
    text = f"{fault.text}; but the shapes, whose hull would have {_rounded(mass / body.hull.volume)} kg/m^3, may be symbols"
    return replace(fault, verdict=Verdict.UNDECIDED, text=text)


def _hulls(link: RobotLink) -> list[Hull]:
    """Return the hulls of the visual and of the collision shapes of a link."""
    if link.unread:
        return []
    hulls = (hull_of([shape.points for shape in link.shapes if shape.visual is visual]) for visual in (True, False))
    return [hull for hull in hulls if hull]


def _solid(part: Piece, hulls: Sequence[Hull]) -> Piece | None:
    """Return the part with the inertia of the hull that is most like it, at its mass and about its centre."""
    if not hulls or not part.mass > 0:
        return None
    best = min(hulls, key=lambda hull: unlike(part.inertia, hull.solid.inertia))
    return replace(part, inertia=best.solid.inertia * part.mass)


def _missing(link: RobotLink, body: Body) -> Iterator[Fault]:
    """Yield a fault if a joint moves a body that has shapes and no mass."""
    if link is not body.root or not link.joint or link.joint == "fixed":
        return
    if any(member.link.mass or member.unknown for member in body.members):
        return
    if not any(member.shapes or member.unread for member in body.members):
        return
    text = f"the joint to it is {link.joint}, it has shapes, and neither it nor what is fixed to it has a mass"
    yield Fault("no inertial element", text, math.nan, math.nan, "", "")


def _impossible(link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body, twin: tuple[Pair, bool] | None) -> Fault:
    """Return the fault of an inertia that no body has. It is undecided if the digits of the file leave it open."""
    moments, solid = np.linalg.eigvalsh(part.inertia), _solid(part, hulls)
    if part.mass > 0 and not part.inertia.any():
        text = f"a mass of {part.mass:.4g} kg without inertia"
        return Fault("no inertia", text, math.nan, math.nan, "", "what a body can have", solid)
    error = float((moments[2] - moments[0] - moments[1] if part.excess else -moments[0]) / (np.abs(moments).max() or 1.0))
    text = f"{part.flaw}: {list_numbers(moments)} kg m^2" if part.mass > 0 else f"{part.flaw}: {part.mass:.4g} kg"
    fault = Fault("impossible inertia", text, error, 0.0, "relative", "what a body can have", solid)
    if part.mass > 0 and moments[0] > 0 and part.excess < part.rounding * (1 + 1e-9):
        text, effect = f"{text}, by less than the rounding of its digits", "engines that check it refuse the file"
        return replace(fault, verdict=Verdict.UNDECIDED, text=text, effect=effect)
    if not part.mass > 0:
        return fault
    mirrored = twin[0].mirrored(twin[1]) if twin else None
    mirrored = mirrored if mirrored and _is_right(link, mirrored, hulls, body) else None
    slips = list(_single_slips(link, part, hulls, body, mirrored))
    if len(slips) == 1:
        name, power, inertia = slips[0]
        return replace(
            fault, key="decimal slip", expected=replace(part, inertia=inertia), repair=f"multiply {name} by 10^{power}",
            numbers={"power": float(power)},
        )  # fmt: skip
    if mirrored is not None and twin:
        other = twin[0].left if twin[1] else twin[0].right
        return replace(fault, expected=mirrored, repair=f"the mirrored values of {other.name!r}")
    return fault


def _close(inertia: Array, other: Array) -> bool:
    return bool(np.linalg.norm(inertia - other) < 0.05 * np.linalg.norm(other))


_NUMBERS = (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))


def _single_slips(
    link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body, mirrored: Piece | None
) -> Iterator[tuple[str, int, Array]]:
    """Yield the numbers of an inertia that a power of ten turns into one that the shapes and the twin have.

    Without shapes and without a twin nothing shows which number is wrong.
    """
    if not hulls and mirrored is None:
        return
    turn = link.link.frame[:3, :3]
    for (name, i, j), power in product(_NUMBERS, (*range(-POWERS, 0), *range(1, POWERS + 1))):
        inertia = link.link.inertia.copy()
        if not inertia[i, j]:
            continue
        inertia[i, j] = inertia[j, i] = inertia[i, j] * 10.0**power
        placed = turn @ inertia @ turn.T
        like_hull = not hulls or any(_is_like(placed, hull, part.mass) for hull in hulls)
        like_twin = mirrored is None or _close(placed, mirrored.inertia)
        if like_hull and like_twin and _is_right(link, replace(part, inertia=placed), hulls, body):
            yield name, power, placed


def _is_like(inertia: Array, hull: Hull, mass: float) -> bool:
    """Return True if an inertia has the proportions of a hull, and about its size."""
    return unlike(inertia, hull.solid.inertia) < ALIKE and SLIP[0] < ratio(inertia, hull.solid.inertia * mass) < SLIP[1]


@dataclass(frozen=True)
class Size:
    """The size of an inertia, compared with the shapes.

    `relative` is the inertia relative to that of the hull at the same mass, `alike` if it has the proportions of a hull,
    `density` that of a body with this mass and inertia, kg/m^3, and `far` the `reach`. `small`, `large` and `slipped` are what
    makes it wrong.
    """

    relative: float
    alike: bool
    density: float
    far: float
    small: bool
    large: bool
    slipped: bool


def _measure(part: Piece, hulls: Sequence[Hull], body: Body, link: RobotLink) -> Size:
    ratios = [ratio(part.inertia, hull.solid.inertia * part.mass) for hull in hulls]
    relative = min(ratios, key=lambda value: abs(math.log(value))) if ratios and min(ratios) > 0 else 1.0
    alike = [hull for hull in hulls if unlike(part.inertia, hull.solid.inertia) < ALIKE]
    density = density_of(part, alike if relative < LIGHT else ())  # a plate may be drawn too thin
    placed = part.place(body.to_root(link))
    far = reach(placed, body.hull) if body.hull else 0.0
    beyond = bool(ratios) and body.hull is not None and overhang(placed, body.hull) > OVERHANG
    large = far > FARTHEST[1] and (relative > HEAVY or not ratios or beyond)
    slipped = bool(alike) and relative > SLIPPED and far > FARTHEST[0]
    return Size(relative, bool(alike), density, far, density > DENSEST, large, slipped)


def _size(
    link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body, solid: Piece | None, twin: tuple[Pair, bool] | None
) -> Fault | None:
    """Return the fault of an inertia that is too small or too large for the mass and the shapes."""
    size = _measure(part, hulls, body, link)
    text = f"moments {list_numbers(np.linalg.eigvalsh(part.inertia))} kg m^2 for {part.mass:.4g} kg"
    text += f", {_times(size.relative)} what its shapes have" if solid else ""
    expected = solid or _ball(part)
    if size.small:
        text += f"; a body like this would have {float(f'{size.density:.4g}'):,.10g} kg/m^3"
    elif size.far > FARTHEST[0]:
        text += f"; its radius of gyration is {math.sqrt(size.far):.3g} times as far as its shapes reach"
    if moved := _moved_twice(link, part, hulls, body, size):
        text += "; about the origin of the link it is the inertia of its shapes"
        repair = "subtract the term of the parallel axis theorem: the inertia is about the origin of the link"
        error = float(np.linalg.norm(part.inertia - moved.inertia) / np.linalg.norm(moved.inertia))
        return Fault("inertia moved twice", text, error, 0.0, "relative", "shapes", moved, repair)
    if not (size.small or size.large or size.slipped):
        doubt = Fault("inertia outside the shapes", text, size.far, FARTHEST[0], "times", "shapes", expected)
        return replace(doubt, verdict=Verdict.UNDECIDED) if size.far > FARTHEST[0] else None
    error, allowed, unit, by = (
        (size.density, DENSEST, "kg/m^3", MATERIALS) if size.small else (size.far, FARTHEST[0], "times", "shapes")
    )
    if is_placeholder(link.link.inertia) and link.link.rounding > NO_DIGITS:
        fault = Fault("placeholder inertia", text, error, allowed, unit, by, expected)
    elif slips := list(_slips(link, part, hulls, body, size)):
        told = [slip for slip in slips if _agrees_with_twin(slip[0], part, twin)]
        repaired, repair, power = (told or slips)[0]
        if len(told) != 1:
            text += f"; {' or '.join(slip[1] for slip in slips)} would repair it, and the file does not show which"
            repair = ""
        elif _is_in_inches(size.relative, power):
            text += f"; inches or feet instead of metres explain it better than to {repair}"
            repair = ""
        fault = Fault(
            "decimal slip", text, error, allowed, unit, by, repaired, repair, numbers={"power": float(power)} if repair else {}
        )
    else:
        fault = Fault(
            "inertia too small" if size.small else "inertia outside the shapes", text, error, allowed, unit, by, expected
        )
    sparse = spread_density(part) < SPARSEST
    return fault if size.small or sparse else _unless_symbols(fault, body)


def _slips(link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body, size: Size) -> Iterator[tuple[Piece, str, int]]:
    """Yield the repairs of the inertia or the mass by a power of ten after which the link is right."""
    if not size.alike:
        return
    volume = max(hull.volume for hull in hulls)
    for power in range(-POWERS, POWERS + 1):
        if not power or not SLIP[0] < size.relative * 10.0**power < SLIP[1]:
            continue
        inertia, mass = part.inertia * 10.0**power, part.mass * 10.0**-power
        for repaired, text, exponent in (
            (replace(part, inertia=inertia), "multiply the inertia by", power),
            (replace(part, mass=mass), "multiply the mass by", -power),
        ):
            usual = DENSITIES[0] < repaired.mass / volume < DENSITIES[1]
            if usual and _is_right(link, repaired, hulls, body):
                yield repaired, f"{text} 10^{exponent}", exponent


def _agrees_with_twin(repaired: Piece, part: Piece, twin: tuple[Pair, bool] | None) -> bool:
    """Return False if a repair leaves or makes a difference from the twin. A twin with the same slip shows nothing."""
    if twin is None:
        return True
    other = part_of(twin[0].left if twin[1] else twin[0].right)
    return bool(other.flaw) or _differs(other, part) < TWINS[0] or _differs(other, repaired) < TWINS[1]


def _differs(part: Piece, other: Piece) -> float:
    """Return the larger relative difference of masses and principal moments."""
    moments = [np.linalg.eigvalsh(piece.inertia) for piece in (part, other)]
    of_moments = float(np.abs(moments[1] - moments[0]).max() / max(np.abs(moments).max(), 1e-300))
    return max(of_moments, abs(part.mass - other.mass) / max(part.mass, other.mass))


def _is_in_inches(relative: float, power: int) -> bool:
    """Return True if inches or feet explain the size of an inertia relative to the mass better than a power of ten."""
    away = abs(math.log(relative * 10.0 ** -abs(power))) if relative > 1 else math.inf
    return any(abs(relative * foot**2 - 1) < NOTHING and away > 2 * NOTHING for foot in (0.0254, 0.3048))


def _moved_twice(link: RobotLink, part: Piece, hulls: Sequence[Hull], body: Body, size: Size) -> Piece | None:
    """Return the inertia about the centre of mass of a part whose inertia is about the origin of the link, or None.

    About the origin it is the inertia of a hull, I_c + m (d.d 1 - d d'), to its digits, and about the centre it is not. If it
    is outside the shapes in any case, to a few per cent, or only in its proportions if it is far outside.
    """
    moved = replace(part, inertia=part.inertia - steiner(part.mass, part.com))
    if not np.linalg.norm(part.com) > 0 or moved.flaw or not _is_right(link, moved, hulls, body):
        return None
    tolerance = ORIGIN[1] if size.far > ORIGIN[2] else ORIGIN[0]
    for hull in hulls:
        own = hull.solid.inertia * part.mass
        if np.linalg.norm(part.inertia - own) < ORIGIN[3] * np.linalg.norm(own):
            return None
    exact = any(
        np.linalg.norm(moved.inertia - own) < max(part.rounding, tolerance * float(np.linalg.norm(own)))
        for own in (hull.solid.inertia * part.mass for hull in hulls)
    )
    return moved if exact or (size.large and any(_is_like(moved.inertia, hull, part.mass) for hull in hulls)) else None


ORIGIN = (1e-3, 0.03, 1.1, 0.2)
"""Relative difference up to which an inertia about the origin is that of a hull; the same if its `reach` is beyond the third
number, so that it is wrong in any case; difference about the centre of mass below which it is not about the origin."""
POWERS = 9
"""Largest power of ten of a slip: g mm^2 are 1e-9 kg m^2."""
OVERHANG = 0.1
"""Distance of the radius of gyration from twice the reach of the shapes, relative to their size, that shows other axes."""
DENSITIES = (50.0, 9000.0)
"""Densities of hulls of right links, kg/m^3."""


def _ball(part: Piece) -> Piece:
    """Return a ball of water with the mass of a part: an inertia of the right order, if there are no shapes."""
    radius = (3 * part.mass / (4 * math.pi * 1000.0)) ** (1 / 3)
    return replace(part, inertia=0.4 * part.mass * radius**2 * np.eye(3))


def _times(value: float) -> str:
    return f"1/{_rounded(1 / value)} of" if value < 1 else f"{_rounded(value)} times"


def is_placeholder(inertia: Array) -> bool:
    """Return True if an inertia has no products, and moments of one significant digit of which two are equal."""
    moments = np.diag(inertia)
    if np.abs(inertia - np.diag(moments)).max() > 0 or not (moments > 0).all():
        return False
    leading = moments / 10.0 ** np.floor(np.log10(moments) + 1e-9)
    return len(set(moments.tolist())) < 3 and bool(np.abs(leading - np.rint(leading)).max() < 1e-9)


def _sign(link: RobotLink, part: Piece, hulls: Sequence[Hull]) -> Fault | None:
    """Return the fault of products of inertia whose sign contradicts all hulls."""
    if not hulls:
        return None
    turn = link.link.frame[:3, :3]
    found = []
    for flips in product((1.0, -1.0), repeat=3):
        if flips == (1.0, 1.0, 1.0):
            continue
        inertia = link.link.inertia.copy()
        changed = []
        for flip, (name, i, j) in zip(flips, _NUMBERS[3:], strict=True):
            if flip < 0:
                inertia[i, j] = inertia[j, i] = -inertia[i, j]
                changed += [name] * bool(abs(inertia[i, j]) > 0.01 * np.trace(inertia))
        placed = turn @ inertia @ turn.T
        pairs = [(unlike(part.inertia, hull.solid.inertia), unlike(placed, hull.solid.inertia)) for hull in hulls]
        gain = min(before - after for before, after in pairs)
        if changed and gain > SIGN[0] and all(before > SIGN[1] * after for before, after in pairs):
            found.append((gain, -len(changed), changed, placed))
    if not found:
        return None
    gain, _, changed, placed = max(found, key=lambda item: item[:2])
    before = min(unlike(part.inertia, hull.solid.inertia) for hull in hulls)
    names = ", ".join(changed)
    text = f"with the other sign of {names}, the inertia differs from its shapes by {before - gain:.2g} instead of {before:.2g}"
    expected = replace(part, inertia=placed)
    return Fault(
        "sign of the products of inertia", text, gain, SIGN[0], "relative", "shapes", expected, f"change the sign of {names}"
    )


def _centre(link: RobotLink, part: Piece, body: Body) -> Fault | None:
    """Return the fault of a centre of mass outside the shapes of the body that a link is part of."""
    hull = body.hull
    if hull is None:
        return None
    T = body.to_root(link)
    distance = hull.outside(T[:3, :3] @ part.com + T[:3, 3])
    relative = distance / hull.size
    if relative < OUTSIDE[0]:
        return None
    own = hull_of([shape.points for shape in link.shapes]) or None
    text = f"the centre of mass is {_length(distance)} outside shapes of the size {_length(hull.size)}"
    repairs = list(_moved(part.com, own)) if own else []
    middle = own.solid.com if own else np.linalg.inv(T)[:3, :3] @ (hull.solid.com - T[:3, 3])
    expected, repair = replace(part, com=middle), ""
    if len(repairs) == 1:
        repair, com = repairs[0]
        expected = replace(part, com=com)
    # A part without shapes of its own may be outside the shapes of what it is fixed to.
    verdict = Verdict.WRONG if relative > OUTSIDE[1] and link.shapes else Verdict.UNDECIDED
    return Fault(
        "centre of mass outside the shapes", text, relative, OUTSIDE[0], "relative", "shapes", expected, repair, verdict
    )


def _moved(com: Array, hull: Hull) -> Iterator[tuple[str, Array]]:
    """Yield the changes of a centre of mass that bring it well inside the hull: another sign of one number, or another unit."""
    options = [
        (f"change the sign of {'xyz'[axis]} of the centre of mass", com * np.where(np.arange(3) == axis, -1, 1))
        for axis in range(3)
    ]
    options += [(f"multiply the centre of mass by 10^{-power}", com / 10.0**power) for power in (1, 2, 3)]
    for text, moved in options:
        if np.linalg.norm(moved - com) > 1e-9 and hull.outside(moved) < -0.02 * hull.size:
            yield text, moved


# --------------------------------------------------------------------------------------------------------------------- twins


def _compare_twins(pair: Pair, faults: dict[str, list[Fault]], bodies: Mapping[str, Body]) -> None:
    """Add the faults of twins that differ, to the one that its shapes contradict, or to both."""
    left, right = part_of(pair.left), part_of(pair.right)
    if pair.maps and not (left.flaw or right.flaw):
        wanted = pair.mirrored(True)
        assert wanted is not None
    else:
        wanted = None
    moments = [np.linalg.eigvalsh(part.inertia) for part in (left, right)]
    apart = {
        "mass": abs(right.mass - left.mass) / max(left.mass, right.mass),
        "moments": float(np.abs(moments[1] - moments[0]).max() / max(np.abs(moments).max(), 1e-300)),
    }
    if wanted is not None:
        size = math.sqrt(np.trace(wanted.inertia) / wanted.mass)
        apart["centre of mass"] = float(np.linalg.norm(wanted.com - right.com) / size)
        turned = float(np.linalg.norm(wanted.inertia - right.inertia) / np.linalg.norm(wanted.inertia))
        if max(apart["mass"], apart["moments"]) < NOTHING and turned > TURNED:
            apart["products of inertia"] = turned
    name, worst = max(apart.items(), key=lambda item: item[1])
    limit = TURNED if name == "products of inertia" else TWINS[1]
    if worst < (TURNED if name == "products of inertia" else TWINS[0]):
        return
    own = [_hulls(link) for link in (pair.left, pair.right)]
    same_shapes = _have_same_shapes(*own)
    fitting = [_fits(part, hulls) for part, hulls in zip((left, right), own, strict=True)]
    if same_shapes is False and all(fitting):
        return  # two links that differ, and both are right
    verdict = Verdict.WRONG if worst > limit else Verdict.UNDECIDED
    if same_shapes is False or (name in ("mass", "moments") and _differ_in_mass_only(left, right)):
        verdict = Verdict.UNDECIDED  # a design may have other shapes, materials or contents on each side
    suspects = _suspects(pair, faults)
    for link, other, of_right in ((pair.left, pair.right, False), (pair.right, pair.left, True)):
        if link not in suspects or any(fault.verdict is Verdict.WRONG for fault in faults[link.name]):
            continue
        expected = pair.mirrored(of_right)
        alone = len(suspects) == 1
        verb = "differs" if name in ("mass", "centre of mass") else "differ"
        text = f"the {name} {verb} from {other.name!r} by {100 * worst:.3g} %"
        text += ": one of the two is wrong" if verdict is Verdict.WRONG and not alone else ""
        repaired = expected is not None and _is_right(link, expected, _hulls(link), bodies[link.name])
        repair = f"the mirrored values of {other.name!r}" if alone and repaired else ""
        faults[link.name].insert(0, Fault("twins differ", text, worst, limit, "relative", "twin", expected, repair, verdict))


SAME_SHAPES = 0.1
"""Relative difference of volumes and moments up to which the hulls of twins have the same shape."""
FITS = 0.2
"""Relative difference from the inertia of the hull up to which a link fits its own shapes."""


def _have_same_shapes(left: Sequence[Hull], right: Sequence[Hull]) -> bool | None:
    """Return whether the hulls of twins have the same shapes, except for the axes; None if a twin has no shapes."""
    if not left or not right:
        return None
    differences = []
    for hull, other in zip(left, right, strict=False):
        pairs = [(hull.volume, other.volume), *zip(*(np.linalg.eigvalsh(h.solid.inertia) for h in (hull, other)), strict=True)]
        differences += [float(abs(a - b) / max(a, b)) for a, b in pairs]
    return max(differences) < SAME_SHAPES


def _fits(part: Piece, hulls: Sequence[Hull]) -> bool:
    """Return True if an inertia is that of a hull with uniform density."""
    solids = [hull.solid.inertia * part.mass for hull in hulls]
    return any(np.linalg.norm(part.inertia - solid) < FITS * np.linalg.norm(solid) for solid in solids)


def _differ_in_mass_only(left: Piece, right: Piece) -> bool:
    """Return True if twins have the same inertia for 1 kg."""
    moments = [np.linalg.eigvalsh(part.inertia) / part.mass for part in (left, right)]
    return bool(np.abs(moments[0] - moments[1]).max() < TWINS[0] * np.abs(moments).max())


def _suspects(pair: Pair, faults: Mapping[str, list[Fault]]) -> list[RobotLink]:
    """Return the twins that may be wrong: the one with a fault of its own, or the one that is less like its shapes, or both."""
    links = [pair.left, pair.right]
    if wrong := [link for link in links if any(fault.verdict is Verdict.WRONG for fault in faults[link.name])]:
        return wrong
    misfits = []
    for link in links:
        part, hulls = part_of(link), _hulls(link)
        if not hulls:
            return links
        shape = min(unlike(part.inertia, hull.solid.inertia) for hull in hulls)
        scale = min(abs(math.log(ratio(part.inertia, hull.solid.inertia * part.mass))) for hull in hulls)
        away = min(float(np.linalg.norm(part.com - hull.solid.com)) / hull.size for hull in hulls)
        misfits.append((shape, scale, away))
    worse = [sum(a > 1.5 * b + 0.02 for a, b in zip(misfits[i], misfits[1 - i], strict=True)) for i in (0, 1)]
    if worse[0] and not worse[1]:
        return [links[0]]
    if worse[1] and not worse[0]:
        return [links[1]]
    return links
