"""The bodies of model files, the bodies that engines make of them, and the mistakes between the two."""

import csv
import json
import re
import shlex
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from conservative import deferred_imports
from conservative.benchmarks.verification.bodies import loaded, verify_files
from conservative.benchmarks.verification.bodies.explain import find_causes
from conservative.benchmarks.verification.bodies.identify import accelerations, identify, make_cases
from conservative.benchmarks.verification.bodies.loaded import CATALOGUE, decide_refusal
from conservative.benchmarks.verification.finding import EXIT_CODES, Finding, Verdict
from conservative.benchmarks.verification.mistakes import BY_KEY
from conservative.benchmarks.verification.mistakes.bodies import FITTED, LOADED
from conservative.errors import BadInput, MissingEngine
from conservative.references.model_files import loaders
from conservative.references.model_files.pieces import Piece, distance, join_links, weigh
from conservative.references.model_files.readers import read_here
from conservative.references.worker import client

from ...environments import PATIENCE
from ...sampling import sampled

pytestmark = pytest.mark.usefixtures("shared_reader")
GENERIC = CATALOGUE / "chain_of_fixed_children.urdf"
TRAPS = sorted(path for path in CATALOGUE.iterdir() if path.suffix not in (".obj", ".md"))


RIGHT, WRONG, UNDECIDED, NOT_TESTED = Verdict.RIGHT, Verdict.WRONG, Verdict.UNDECIDED, Verdict.NOT_TESTED


def findings(files, *engines):
    """The findings on files by the name of the engine and of the body."""
    verified = verify_files([Path(file) for file in files], engines)
    return {
        (finding.subject.split()[0], finding.case): finding for verification in verified for finding in verification.findings
    }


def read_links(path):
    """The links of a file with one body as this package reads them."""
    return model_of(path).links


def model_of(path, links=None):
    """The body of a file with one body, read here; with other links if they are given."""
    with tempfile.TemporaryDirectory() as folder:
        (model,) = read_here(path, path.name, Path(folder))
    return replace(model, links=links) if links else model


def write_urdf(rng, path):
    """Write a chain of two to four random links on fixed joints."""
    links = []
    for number in range(rng.integers(2, 5)):
        moments = rng.uniform(0.1, 1, 3)
        R = Rotation.random(random_state=rng).as_matrix()
        J = R @ (np.diag([moments.sum()] * 3) - np.diag(moments)) @ R.T
        inertia = " ".join(f'i{a}{b}="{J["xyz".index(a), "xyz".index(b)]!r}"' for a, b in ("xx", "xy", "xz", "yy", "yz", "zz"))
        origins = ['<origin xyz="{} {} {}" rpy="{} {} {}"/>'.format(*rng.uniform(-3, 3, 6).tolist()) for _ in range(2)]
        links.append(
            f'<link name="l{number}"><inertial>{origins[0]}<mass value="{rng.uniform(0.1, 5)!r}"/><inertia {inertia}/>'
        )
        links.append("</inertial></link>")
        if number:
            ends = f'<parent link="l{rng.integers(number)}"/><child link="l{number}"/>'
            links.append(f'<joint name="j{number}" type="fixed">{ends}{origins[1]}</joint>')
    path.write_text(f'<robot name="r">{"".join(links)}</robot>'.replace("np.float64(", "").replace(')"', '"'))
    return path


# ------------------------------------------------------------------------------------------------------- the body of a file


def test_the_body_of_a_urdf_file_is_that_of_pinocchio_and_yourdfpy(tmp_path):
    pin = pytest.importorskip("pinocchio")
    yourdfpy = pytest.importorskip("yourdfpy")
    rng = np.random.default_rng(7)
    for _ in range(50):
        path = write_urdf(rng, tmp_path / "body.urdf")
        links = read_links(path)
        inertia = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer()).inertias[1]
        assert distance(join_links(links), Piece(inertia.mass, inertia.lever, inertia.inertia)) < 1e-12  # measured: 1.2e-15
        robot = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=False).robot
        for link, other in zip(links, robot.links, strict=True):
            assert np.abs(link.frame - other.inertial.origin).max() < 1e-12
            assert np.abs(link.inertia - other.inertial.inertia).max() < 1e-12


def test_all_formats_of_a_trap_have_the_same_body():
    """MJCF is read by MuJoCo and USD by usd-core, so this compares the readers. USD has single precision: measured 1.6e-7."""
    own = {"degrees", "nested_frames", "shapes", "robot", "body_below_a_body"}  # other bodies in other formats, or several
    for name in {path.stem for path in TRAPS} - own:
        first, *others = [join_links(read_links(path)) for path in TRAPS if path.stem == name]
        for other in others:
            assert distance(first, other) < 1e-6, name


def test_shapes_have_the_inertia_of_their_points():
    rng = np.random.default_rng(3)
    pose = np.eye(4)
    pose[:3] = rng.normal(size=(3, 4))  # turns, shears and scales
    points = rng.uniform(-1, 1, size=(400_000, 3))
    a, h = 0.4, 0.9
    r, z = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    inside = {
        ("box", (0.5, 0.7, 1.1)): (2 * np.abs(points) < (0.5, 0.7, 1.1)).all(axis=1),
        ("sphere", 0.8): (points**2).sum(axis=1) < 0.64,
        ("ellipsoid", (0.5, 0.7, 0.9)): ((points / (0.5, 0.7, 0.9)) ** 2).sum(axis=1) < 1,
        ("cylinder", (a, h)): (r < a) & (z < h / 2),
        ("capsule", (a, h)): np.hypot(r, np.maximum(z - h / 2, 0)) < a,
    }
    for (kind, sizes), chosen in inside.items():
        (part,) = weigh(kind, sizes, pose, 700.0)
        x = points[chosen] @ pose[:3, :3].T + pose[:3, 3]
        mass = 700 * 8 * chosen.mean() * abs(np.linalg.det(pose[:3, :3]))
        d = x - x.mean(axis=0)
        sampled = mass * ((d**2).sum(axis=1).mean() * np.eye(3) - d.T @ d / len(d))
        assert distance(part, Piece(mass, x.mean(axis=0), sampled)) < 0.02, kind  # measured: 3e-3 to 9e-3


# ------------------------------------------------------------------------------------- the body that an engine's motion shows


def test_accelerations_obey_momentum_and_give_the_body_back():
    rng = np.random.default_rng(5)
    for scale in 10.0 ** rng.uniform(-15, 3, 50):
        R = Rotation.random(random_state=rng).as_matrix()
        part = Piece(rng.uniform(0.5, 2) * scale**0.6, rng.normal(size=3) * scale**0.2, scale * (R * (1.1, 2.0, 2.7)) @ R.T)
        cases = make_cases(part)
        found = accelerations(part, cases)
        _, w, _, torque = np.reshape(cases, (-1, 4, 3)).transpose(1, 0, 2)
        J = part.inertia + part.mass * (part.com @ part.com * np.eye(3) - np.outer(part.com, part.com))
        about_origin = found[:, 3:] @ J + np.cross(w, w @ J) + part.mass * np.cross(part.com, found[:, :3])
        assert np.abs(about_origin - torque).max() < 1e-13 * np.abs(torque).max()  # measured: 1.4e-15
        near = replace(part, mass=1.3 * part.mass, com=1.1 * part.com, inertia=part.inertia + 0.3 * scale * np.eye(3))
        assert distance(part, identify(cases, found, near)) < 1e-12  # measured: 1.1e-14


@pytest.mark.parametrize("mistake", LOADED, ids=lambda mistake: mistake.key)
def test_a_loader_with_a_mistake_is_named(mistake):
    """The mistakes leave up to 2e-14 of errors of 0.02 and more."""
    path = CATALOGUE / ("shape_that_disagrees.urdf" if "geometry" in mistake.key else GENERIC.name)
    if mistake.key == "unit mass of empty links":
        path = CATALOGUE / "massless_links.urdf"
    links = read_links(path)
    inertia = join_links(read_links(CATALOGUE / "products_of_inertia.urdf")).inertia
    links = [replace(link, inertia=inertia) for link in links]
    if mistake.key.endswith(" ignored"):  # an option of the file that changes the root link
        other = {mistake.key.removesuffix(" ignored"): Piece(3.0, np.array([0.1, 0, 0]), np.diag([0.5, 0.6, 0.7]))}
        links = [replace(links[0], without=other), *links[1:]]
    wanted, made = join_links(links), join_links(mistake.change(links))
    cases = make_cases(wanted)
    seen = identify(cases, accelerations(made, cases), wanted)
    (cause,) = find_causes(links, seen, 1e-6)
    assert (cause.keys, cause.sentence) == ((mistake.key,), mistake.sentence)
    assert cause.left < 1e-12
    assert cause.of > 1e-3


def test_mistakes_that_explain_a_body_equally_well_are_all_named():
    """A quarter turn about z exchanges two moments, so its inverse, and moments in another order, make the same body."""
    links = read_links(CATALOGUE / "turned_inertial_frame.urdf")
    quarter = np.eye(4)
    quarter[:3, :3] = Rotation.from_euler("z", np.pi / 2).as_matrix()
    links = [replace(links[0], frame=quarter, inertia=np.diag([0.01, 0.024, 0.03]))]
    causes = find_causes(links, join_links([replace(links[0], frame=np.eye(4))]), 1e-4)
    assert {cause.key for cause in causes} == {"inertial frame not turned", "moments in the order 2 1 3"}


def test_numbers_of_a_mistake_are_fitted():
    links = read_links(GENERIC)
    wanted, (_, axes) = join_links(links), np.linalg.eigh(join_links(links).inertia)
    moments = np.linalg.eigvalsh(wanted.inertia)
    floor = moments[:2].mean()
    raised = (axes * np.maximum(moments, floor)) @ axes.T
    grams = replace(wanted, mass=1000 * wanted.mass, com=100 * wanted.com, inertia=1e7 * wanted.inertia)
    for key, seen, numbers in (
        ("factors", replace(wanted, mass=2 * wanted.mass, inertia=4 * wanted.inertia), (2.0, 1.0, 4.0)),
        ("factors", grams, (1e3, 1e2, 1e7)),
        ("moments raised", replace(wanted, inertia=raised), (floor,)),
        ("equal moments", replace(wanted, inertia=0.05 * np.eye(3)), (0.05,)),
    ):
        (cause,) = find_causes(links, seen, 1e-6)
        assert cause.keys == (key,)
        np.testing.assert_allclose(list(cause.numbers.values()), numbers, rtol=1e-12)
        assert all(f"{number:.6g}" in cause.sentence for number in numbers)
    assert not find_causes(links, replace(wanted, com=wanted.com + 0.01 * np.array([1, -2, 3])), 1e-6)


def test_the_error_of_an_engine_is_relative_to_the_inertia_that_it_has():
    """Newton raises 1e-12 to 1e-6 kg m^2 in single precision, with an error as large as the inertia of the file."""
    links = read_links(CATALOGUE / "moments_1e-12.urdf")
    wanted = join_links(links)
    (cause,) = find_causes(links, replace(wanted, inertia=1e-6 * np.eye(3) + wanted.inertia), 1e-2)
    assert cause.keys == ("moments raised",)


@pytest.mark.parametrize(("option", "file"), [("inertiagrouprange", "group_of_shapes"), ("settotalmass", "total_mass")])
def test_an_option_that_is_ignored_is_named(option, file, tmp_path):
    """The bodies of the catalogue without the option, by the first reading of the same file without it."""
    path, plain = CATALOGUE / f"{file}.xml", tmp_path / "plain.xml"
    plain.write_text(re.sub(rf'{option}="[^"]*"', "", path.read_text()))
    (cause,) = find_causes(read_links(path), model_of(plain).reference, 1e-6)
    assert cause.sentence == f"`{option}` is ignored"
    assert cause.left < 1e-12  # measured 5e-16


def made_findings(model, **seen):
    """Findings and details of engines that have bodies."""
    pairs = []
    for name, part in seen.items():
        opinion = loaded.decide_body(model, name, part, 1e-4)
        finding = Finding(f"{name} 1", "bodies", model.label, opinion.verdict, allowed=1e-4, causes=opinion.causes)
        body = {key: np.asarray(value).tolist() for key, value in vars(part).items()}
        pairs.append((finding, loaded.LoadedBody(finding.subject, model.label, {}, model.flaw, body, name)))
    return [finding for finding, _ in loaded.weigh_votes(model, pairs)]


def test_two_engines_of_different_families_that_agree_against_both_readers_are_undecided():
    model = model_of(CATALOGUE / "products_of_inertia.urdf")
    other = replace(model.truth, inertia=model.truth.inertia + 0.01 * np.diag([1, 2, 2.5]), mass=3.0)
    third = replace(other, mass=4.0)

    def verdicts(**seen):
        return [finding.verdict for finding in made_findings(model, **seen)]

    assert verdicts(drake=other) == [WRONG]
    assert verdicts(drake=other, pybullet=other) == [UNDECIDED, UNDECIDED]
    assert "pybullet 1 has the same body" in made_findings(model, drake=other, pybullet=other)[0].detail
    assert verdicts(drake=other, pybullet=third) == [WRONG, WRONG]
    assert verdicts(drake=other, pybullet=model.truth) == [WRONG, RIGHT]
    for same in (("pinocchio", "dart"), ("mujoco", "mjwarp"), ("mujoco", "mujoco_js")):  # the same parser of URDF
        assert verdicts(**dict.fromkeys(same, other)) == [WRONG, WRONG]
    assert verdicts(drake=other, pinocchio=other, dart=third) == [UNDECIDED, UNDECIDED, WRONG]
    # A known mistake explains both, so that it is the mistake of both.
    ignored = replace(model.truth, inertia=np.diag(np.diag(model.truth.inertia)))
    assert verdicts(drake=ignored, pybullet=ignored) == [WRONG, WRONG]
    # Numbers can be fitted to anything.
    double = replace(model.truth, mass=2 * model.truth.mass, inertia=2 * model.truth.inertia)
    assert verdicts(drake=double, pybullet=double) == [UNDECIDED, UNDECIDED]


def test_a_flaw_of_the_file_is_no_matter_of_votes():
    model = model_of(CATALOGUE / "triangle_inequality.urdf")
    assert [finding.verdict for finding in made_findings(model, drake=model.truth, pybullet=model.truth)] == [WRONG, WRONG]


def test_families_are_of_known_engines_and_disjoint():
    for kind, families in loaders.FAMILIES.items():
        engines = [engine for names in families.values() for engine in names]
        assert len(engines) == len(set(engines)), kind
        assert set(engines) <= {*loaders.LOADERS, *loaded.OTHERS}
    assert set(loaders.FAMILIES) == {"urdf", "mjcf", "sdf", "usd"}


def test_mistakes_of_loaders_are_in_the_table_of_all():
    for each in (*LOADED, *FITTED):
        assert BY_KEY[each.key].sentence == each.sentence


# ----------------------------------------------------------------------------------------------------------------- engines


def test_local_engines_read_the_catalogue(monkeypatch, tmp_path):
    """A few of its models, which are verified if no file is named."""
    pytest.importorskip("pinocchio")
    right = ("turned_inertial_frame", "products_of_inertia", "turned_fixed_child", "shape_that_disagrees", "moments_1e-12")
    for name in (*(f"{trap}.urdf" for trap in right), "triangle_inequality.urdf", "quaternion.urdf", "density.sdf"):
        shutil.copy(CATALOGUE / name, tmp_path)
    monkeypatch.setattr(loaded, "CATALOGUE", tmp_path)
    found = findings([], "mujoco", "pinocchio")
    verdicts = {key: each.verdict for key, each in found.items()}
    for trap in right:
        assert verdicts["mujoco", f"{trap}.urdf"] == verdicts["pinocchio", f"{trap}.urdf"] == RIGHT
    assert verdicts["mujoco", "triangle_inequality.urdf"] == RIGHT  # it refuses the file
    assert verdicts["pinocchio", "triangle_inequality.urdf"] == WRONG  # it accepts an impossible body
    assert verdicts["mujoco", "density.sdf"] == NOT_TESTED
    assert "SDF" in found["mujoco", "density.sdf"].detail
    assert found["mujoco", "quaternion.urdf"].mistake == "inertial frame not turned"


def test_a_file_is_as_wrong_as_its_worst_body_in_any_engine():
    pytest.importorskip("pinocchio")
    good, bad, other = verify_files([GENERIC, CATALOGUE / "robot.urdf", CATALOGUE / "density.sdf"], ["mujoco", "pinocchio"])
    assert [each.verdict for each in (good, bad)] == [RIGHT, WRONG]
    assert [each.exit_code for each in (good, bad)] == [0, 1]
    assert other.exit_code == EXIT_CODES[NOT_TESTED] == 3
    assert {each.kind for each in (good, bad, other)} == {"model file"}
    assert (bad.subject, len(bad.findings), len(bad.details)) == ("robot.urdf", 6, 6)
    (wrong,) = (finding for finding in bad.findings if finding.verdict is WRONG)
    assert (wrong.subject.split()[0], wrong.case, wrong.check) == ("pinocchio", "robot.urdf: hip", "bodies")
    assert {(detail.subject, detail.case) for detail in bad.details} == {
        (finding.subject, finding.case) for finding in bad.findings
    }
    assert all(finding.error < 1e-12 < finding.allowed == 1e-4 for finding in good.findings)  # measured: 6e-15


def test_a_loader_that_crashes_or_hangs_is_that_engines_answer(monkeypatch, tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text("import os, time\ndef probe(engine, path, **_):\n    os.abort() if 'turned' in path else time.sleep(1800)\n")
    monkeypatch.setattr(loaders, "__file__", str(bad))
    program = loaded.Program("mujoco")
    program._adapter = str(bad)
    aborts = CATALOGUE / "turned_inertial_frame.urdf", "SIGABRT", PATIENCE
    for path, words, limit in (aborts, (GENERIC, "timeout", 1.0)):
        monkeypatch.setattr(loaded, "LIMIT", limit)
        finding, body = program.check(model_of(path))
        assert finding.verdict is WRONG
        assert words in finding.detail
        assert body.seen is None
    program.worker.close()


LINK = '<link name="a"><inertial><origin xyz="0 0 0"/><mass value="1"/><inertia {}/></inertial>{}</link>'
MOMENTS = 'ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"'


@pytest.mark.parametrize(
    ("suffix", "text", "words"),
    [
        ("urdf", '<robot name="r"><link name="a"/></robot>', "no bodies that have a mass"),
        ("urdf", f'<robot name="r">{LINK.format(MOMENTS.replace("1", "one"), "")}</robot>', "one"),
        ("urdf", "<robot", "XML"),
        ("xml", "<svg/>", "<svg>"),
        ("usda", '#usda 1.0\n\ndef Xform "W" {}\n', "metersPerUnit"),
        ("usda", "#usda 1.0\n(", "usd-core"),
    ],
)
def test_a_file_that_is_not_one_rigid_body_is_refused_in_a_sentence(tmp_path, suffix, text, words):
    path = tmp_path / f"bad.{suffix}"
    path.write_text(text)
    with pytest.raises(BadInput, match="file: got") as caught:
        read_here(path, path.name, tmp_path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(BadInput, match="file: got"):
        verify_files([path], ["mujoco"])


def test_unknown_files_and_engines_are_named():
    with pytest.raises(BadInput, match="none"):
        verify_files([Path("none.urdf")])
    with pytest.raises(BadInput, match="expected one of"):
        verify_files([GENERIC], ["nothing"])
    with pytest.raises(MissingEngine, match="conservative engines install"):
        verify_files([GENERIC], ["mujoco@0.1"])


# ------------------------------------------------------------------------------------------------------------ programs of users

LOADER = [sys.executable, "-I", Path(__file__).parents[2] / "references" / "programs" / "loader.py"]
GREETING = {"protocol": 1, "program": "p", "version": "1", "framing": "lines"}


@pytest.fixture
def register(tmp_path, monkeypatch):
    """Return a function that registers programs, from their names and command lines."""
    monkeypatch.setenv("CONSERVATIVE_PROJECT", str(tmp_path))
    deferred_imports.list_entries.cache_clear()
    before = set(client._workers)
    yield lambda **lines: (tmp_path / "conservative.toml").write_text(
        "[engines]\n" + "".join(f"{name} = {json.dumps(shlex.join(map(str, words)))}\n" for name, words in lines.items())
    )
    deferred_imports.list_entries.cache_clear()
    for worker in set(client._workers) - before:  # the reader of all tests goes on
        worker.close()


def test_a_program_is_right_or_its_mistake_is_named(register, tmp_path):
    """The largest relative error of its accelerations is 1e-15 with the right loader."""
    register(careful=LOADER, unturned=[*LOADER, "unturned"])
    turned, offset, fixed = (
        CATALOGUE / f"{name}.urdf" for name in ("turned_inertial_frame", "offset_centre_of_mass", "fixed_child")
    )
    crash = tmp_path / "crash.urdf"
    crash.write_text(offset.read_text())
    sdf, mjcf = (CATALOGUE / f"fixed_child.{kind}" for kind in ("sdf", "xml"))
    found = findings([turned, offset, fixed, crash, sdf, mjcf], "careful", "unturned")
    verdicts = {key: each.verdict for key, each in found.items()}
    assert verdicts["careful", turned.name] == verdicts["careful", offset.name] == verdicts["unturned", offset.name] == RIGHT
    assert found["careful", turned.name].error < 1e-12
    assert verdicts["unturned", turned.name] == WRONG
    assert found["unturned", turned.name].mistake == "inertial frame not turned"
    for name, text in ((fixed.name, "ValueError: 2 links"), (crash.name, "SIGABRT")):
        assert verdicts["careful", name] == WRONG
        assert text in found["careful", name].detail
    for name, text in ((sdf.name, "only URDF"), (mjcf.name, "MJCF")):  # the second is not in its formats, so it is not asked
        assert verdicts["careful", name] == NOT_TESTED
        assert text in found["careful", name].detail


@pytest.mark.parametrize(
    ("formats", "accelerations", "words"),
    sampled(
        [
            ((), None, "expected a program with the request `load`, which PROTOCOL.md describes"),
            (5, None, "its answer to `hello` cannot be used"),
            (("urdf",), [[1, 2, 3]] * 24, "its `accelerations` are not numbers (24, 6)"),
            (("urdf",), [[1], [1, 2]], "its `accelerations` are not numbers (24, 6)"),
            (("urdf",), [["nan"] * 6] * 24, "accelerations that are not finite"),
            (("urdf",), "none", "answers `load` with `accelerations`: 'none'; expected an array of numbers"),
        ],
        4,
    ),
)
def test_a_program_without_usable_accelerations_is_described(formats, accelerations, words, register, tmp_path):
    answers = [GREETING | {"engine": {"formats": formats}}, {"accelerations": accelerations}]
    hello, load = map(json.dumps, answers)
    # It reads on: a request to a program that is just ending is a crash or a restart, by chance.
    lines = "input()", f"print({hello!r}, flush=True)", f"while input(): print({load!r}, flush=True)"
    (tmp_path / "p.py").write_text("\n".join(lines))
    register(p=[sys.executable, tmp_path / "p.py"])
    if accelerations is None:
        with pytest.raises((BadInput, MissingEngine)) as caught:
            verify_files([GENERIC], ["p"])
        assert words in str(caught.value)
    else:
        finding = findings([GENERIC], "p")["p", GENERIC.name]
        assert finding.verdict is WRONG
        assert words in finding.detail


@pytest.mark.engine("mujoco_js")
def test_mujoco_for_javascript_answers_like_mujoco_of_the_same_version():
    """The same outcome for all files, and in 3.14.0 the same body to 1e-15. That version of `mujoco` is installed, too."""
    here = answers("mujoco_js", "")
    there = answers(f"mujoco=={next(iter(here.values()))[0].subject.split()[1]}", "")
    assert {name: each.verdict for name, (each, _) in here.items()} == {name: each.verdict for name, (each, _) in there.items()}
    for name, (_, body) in here.items():
        if body.seen:
            seen = [Piece(**{key: np.array(value) for key, value in each.items()}) for each in (body.seen, there[name][1].seen)]
            assert distance(*seen) < 1e-12, name
    assert sum(each.verdict is RIGHT for each, _ in here.values()) >= 40


# ------------------------------------------------------------------------------------------------------- known bugs of engines


def answers(name, suffix=".urdf"):
    """Findings and details of an engine for the files of the catalogue with a suffix, by default those in URDF, by trap."""
    program = loaded.Program(name)
    try:
        copied = ("robot", "missing_mesh", "body_below_a_body")  # engines do not get the file itself
        paths = [path for path in TRAPS if path.suffix.endswith(suffix) and path.stem not in copied]
        return {path.stem if suffix else path.name: program.check(model_of(path)) for path in paths}
    finally:
        program.worker.close()


def wrong(found, key=""):
    """Names of bodies that are wrong, by a mistake if it is given."""
    return {
        name
        for name, (each, body) in found.items()
        if each.verdict is WRONG and body.seen and (not key or key in {key for cause in each.causes for key in cause.keys})
    }


@pytest.mark.engine("mujoco@3.13.0")
def test_mujoco_lost_the_rotation_of_inertial_frames_until_3_14():
    """Issue 3559 of MuJoCo, fixed by its pull request 3560."""
    before, after = answers("mujoco@3.13.0"), answers("mujoco@3.14.0")
    lost = wrong(before, "inertial frame not turned")
    assert {"turned_inertial_frame", "large_angles", "gimbal_lock", "turned_frame_with_products"} <= lost
    assert wrong(after) == {"quaternion", "quaternion_of_a_joint"}  # of URDF 1.1, which it does not read


@pytest.mark.engine("newton@1.0.0")
def test_newton_turned_inertia_on_one_side_until_1_1():
    """Pull request 2245 of Newton. Its first releases need an older Warp than the newest.

    echo warp-lang==1.12.0 > warp.txt; UV_CONSTRAINT=$PWD/warp.txt conservative engines install newton@1.0.0 newton@1.1.0
    """
    before, after = answers("newton@1.0.0"), answers("newton@1.1.0")
    turned = {"turned_inertial_frame", "large_angles", "gimbal_lock", "turned_frame_with_products"}
    assert turned <= wrong(before)
    assert {"turned_inertial_frame", "turned_frame_with_products"} <= wrong(before, "inertia turned on one side")
    assert not turned & wrong(after)


def test_every_rule_of_the_formats_has_a_model_and_every_model_a_rule():
    """132 rules."""
    with (CATALOGUE.parent / "rules.csv").open(newline="") as file:
        rules = [(row["format"], row["models"].split(", ")) for row in csv.DictReader(file)]
    named = [model for _, models in rules for model in models]
    assert sorted(named) == sorted(path.name for path in TRAPS)
    assert {kind: sum(kind == each for each, _ in rules) for kind, _ in rules} == {"URDF": 31, "SDF": 34, "MJCF": 34, "USD": 33}
    suffixes = {"URDF": ".urdf", "SDF": ".sdf", "MJCF": ".xml", "USD": ".usda"}
    assert all(model.endswith(suffixes[kind]) for kind, models in rules for model in models)
    assert all(Path(path).stat().st_size < 5000 for path in TRAPS)


@pytest.mark.parametrize(("lonely", "verdict"), [("", Verdict.WRONG), ("one reader only", Verdict.UNDECIDED)])
def test_nothing_is_said_against_a_refusal_of_what_only_one_reader_reads(lonely, verdict):
    model = SimpleNamespace(
        flaw="", invalid=[], bad=[], doubt=lambda engine: "", lonely=lonely, truth=SimpleNamespace(excess=0.0)
    )
    assert decide_refusal(model, "engine", "reason").verdict is verdict
