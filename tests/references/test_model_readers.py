"""Model files of others: hostile ones, robots, what the formats leave open, and readers that disagree."""

import math
import os
import re
import zipfile
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import numpy as np
import pytest

from conservative import registry
from conservative.benchmarks.verification.bodies import verify_files
from conservative.benchmarks.verification.bodies.identify import accelerations
from conservative.benchmarks.verification.bodies.loaded import (
    CATALOGUE,
    Program,
    decide_body,
    decide_refusal,
    find_warning,
)
from conservative.benchmarks.verification.finding import Verdict
from conservative.errors import BadInput, MissingEngine
from conservative.references.model_files import readers
from conservative.references.model_files.pieces import Piece, distance, weigh
from conservative.references.model_files.readers import Model, read_files, read_here
from conservative.references.model_files.reference import by_usd_core
from conservative.references.model_files.robots import Body

pytest.importorskip("lxml")
pytest.importorskip("pxr")


RIGHT, WRONG, UNDECIDED = Verdict.RIGHT, Verdict.WRONG, Verdict.UNDECIDED


def findings(*paths, engines):
    """The findings of engines on files, by the name of the body and of the engine."""
    verified = verify_files(paths, engines)
    return {
        (finding.case, finding.subject.split()[0]): finding for verification in verified for finding in verification.findings
    }


@pytest.fixture
def read(tmp_path):
    """Return a function that writes a model file and returns its bodies."""

    def write_and_read(name, text, search=()):
        path = tmp_path / name
        path.write_text(text) if isinstance(text, str) else path.write_bytes(text)
        folder = tmp_path / "copies"
        folder.mkdir(exist_ok=True)
        return read_here(path, name, folder, search)

    return write_and_read


MOMENTS = 'ixx="0.010" ixy="0.001" ixz="0" iyy="0.024" iyz="0.002" izz="0.030"'
TENSOR = np.array([[0.010, 0.001, 0], [0.001, 0.024, 0.002], [0, 0.002, 0.030]])
INERTIAL = f'<inertial><mass value="2"/><inertia {MOMENTS}/></inertial>'
SDF_INERTIA = "<inertia><ixx>0.02</ixx><iyy>0.03</iyy><izz>0.04</izz></inertia>"


def urdf(inside=INERTIAL, more="", attributes=""):
    return f'<robot name="r"{attributes}><link name="a">{inside}</link>{more}</robot>'


def sdf(inside, model=""):
    return f'<sdf version="1.11"><model name="m"><link name="a">{inside}</link>{model}</model></sdf>'


def mjcf(inside, head="", attributes=""):
    return f'<mujoco>{head}<worldbody><body name="a"{attributes}>{inside}</body></worldbody></mujoco>'


def usda(inside, apis='"PhysicsRigidBodyAPI", "PhysicsMassAPI"', units="metersPerUnit = 1\n kilogramsPerUnit = 1"):
    return f'#usda 1.0\n(\n {units}\n)\ndef Xform "b" (prepend apiSchemas = [{apis}])\n{{\n{inside}\n}}\n'


# ------------------------------------------------------------------------------------------------------------- hostile files


def mesh(name):
    return sdf(f'<inertial auto="true"/><collision name="c"><geometry><mesh><uri>{name}</uri></mesh></geometry></collision>')


ENTITY = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>'
LOL = "<!DOCTYPE r [<!ENTITY a0 'lol'>" + "".join(f"<!ENTITY a{i + 1} '{f'&a{i};' * 10}'>" for i in range(9)) + "]>"


def joint(kind, parent, child):
    return f'<joint name="{child}j" type="{kind}"><parent link="{parent}"/><child link="{child}"/></joint>'


LINKS = "".join(f'<link name="{name}">{INERTIAL}</link>' for name in "bcd")
SDF_LINKS = "".join(f'<link name="{name}"/>' for name in "bcd")
SDF_CIRCLE = "".join(
    f'<joint name="{b}j" type="fixed"><parent>{a}</parent><child>{b}</child></joint>' for a, b in ("bc", "cd", "db")
)
HOSTILE = {
    "external entity.urdf": (ENTITY + urdf("&x;" + INERTIAL), "DOCTYPE"),
    "entities.urdf": (LOL + urdf("&a9;" + INERTIAL), "amplification|DOCTYPE"),
    "entities in an attribute.sdf": (LOL + sdf("").replace('"m"', '"&a9;"'), "amplification|DOCTYPE"),
    "deep.urdf": ("<robot>" * 10_000 + "</robot>" * 10_000, "depth"),
    "nan.urdf": (urdf(INERTIAL.replace("0.024", "nan")), "not finite"),
    "overflow.urdf": (urdf(INERTIAL.replace("0.024", "1e999")), "not finite"),
    "nan.sdf": (sdf(f"<inertial><mass>nan</mass>{SDF_INERTIA}</inertial>"), "not finite"),
    "nan.usda": (usda("float physics:mass = nan\nfloat3 physics:diagonalInertia = (1, 2, nan)"), "finite"),
    "underscore.urdf": (urdf(INERTIAL.replace('value="2"', 'value="1_0"')), "'1_0', which is no number"),
    "other digits.urdf": (urdf(INERTIAL.replace('value="2"', 'value="\u0662"')), "which is no number"),
    "short pose.sdf": (
        sdf("<pose>1 2 3</pose><inertial><mass>1</mass></inertial>"),
        "'1 2 3', which is 3 numbers instead of 6",
    ),
    "no turn.sdf": (sdf('<pose rotation_format="quat_xyzw">0 0 0 0 0 0 0</pose>'), "the quaternion 0 0 0 0 of 'a'"),
    "no frame.sdf": (sdf('<pose relative_to="x"/>'), "a reference to 'x', which is not there"),
    "version.sdf": (sdf("").replace("1.11", "new"), "the version 'new'"),
    "namespace.xml": (mjcf("").replace("<mujoco", '<mujoco xmlns="http://x"'), "a namespace"),
    "words.urdf": (urdf(INERTIAL.replace("0.024", "heavy")), "heavy"),
    "circle.urdf": (
        urdf(more=LINKS + joint("fixed", "b", "c") + joint("fixed", "c", "d") + joint("fixed", "d", "b")),
        "circle",
    ),
    "turning circle.urdf": (urdf(more=LINKS + joint("continuous", "b", "c") + joint("fixed", "c", "b")), "circle"),
    "own parent.urdf": (urdf(more=joint("fixed", "a", "a")), "circle"),
    "circle.sdf": (sdf("", SDF_LINKS + SDF_CIRCLE), "circle"),
    "circle of frames.sdf": (
        sdf('<pose relative_to="f"/>', '<frame name="f" attached_to="g"/><frame name="g" attached_to="f"/>'),
        "circle",
    ),
    "two parents.urdf": (urdf(more=LINKS + joint("fixed", "a", "b") + joint("fixed", "c", "b")), "two joints"),
    "no parent.urdf": (urdf(more=LINKS + joint("fixed", "x", "b")), "'x', which is not there"),
    "no child.urdf": (urdf(more=joint("fixed", "a", "x")), "'x', which is not there"),
    "mesh.json.sdf": (mesh("data.json"), "obj, stl, ply, off"),
    "mesh.npy.sdf": (mesh("data.npy"), "obj, stl, ply, off"),
    "mesh.pkl.sdf": (mesh("data.pkl"), "obj, stl, ply, off"),
    "mesh.zip.sdf": (mesh("data.zip"), "obj, stl, ply, off"),
    "broken.dae.sdf": (mesh("data.dae"), "obj, stl, ply, off"),
    "broken.stl.sdf": (mesh("data.stl"), "data.stl"),
    "empty.obj.sdf": (mesh("data.obj"), "data.obj"),
    "system.sdf": (mesh("/etc/passwd"), "outside"),
    "file uri.sdf": (mesh("file:///etc/passwd"), "outside"),
    "above.sdf": (mesh("../outside.obj"), "outside"),
    "link.sdf": (mesh("link.obj"), "outside"),
    "include.xml": ('<mujoco><include file="../outside.xml"/></mujoco>', "outside"),
    "include itself.xml": ('<mujoco><include file="include itself.xml"/></mujoco>', "include each other"),
    "mesh above.xml": (
        mjcf('<geom type="mesh" mesh="outside"/>', '<asset><mesh file="../outside.obj"/></asset>'),
        "outside",
    ),
    "layer.usda": ("#usda 1.0\n(\n subLayers = [@../outside.usda@]\n metersPerUnit = 1\n)\n", "outside"),
    "nothing.urdf": ("", "empty|no XML"),
    "zeros.urdf": (b"\0" * 100, "XML|Document|Start"),
    "zeros.usd": (b"\0" * 100, "usd-core|error"),
    "zip.urdf": (b"PK\3\4" + b"\0" * 50, "XML|Document|Start|empty"),
    "no inertia of a mesh.usda": (
        usda('def Mesh "m" (prepend apiSchemas = ["PhysicsCollisionAPI"])\n{\n}\n', '"PhysicsRigidBodyAPI"'),
        "",
    ),
    "reference to nothing.usda": (
        usda("", '"PhysicsRigidBodyAPI"').replace("(prepend", "(references = @none.usda@\n prepend"),
        "",
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused_in_a_sentence(read, tmp_path, name):
    text, words = HOSTILE[name]
    for kind in ("json", "npy", "pkl", "dae", "stl"):
        (tmp_path / f"data.{kind}").write_bytes(b"\x80\x04garbage")
    (tmp_path / "data.obj").write_text("v 0 0 0\n")
    with zipfile.ZipFile(tmp_path / "data.zip", "w") as archive:
        archive.writestr("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    for outside in ("outside.obj", "outside.xml", "outside.usda"):
        (tmp_path.parent / outside).write_text((CATALOGUE / "part.obj").read_text())
    (tmp_path / "link.obj").symlink_to(tmp_path.parent / "outside.obj")
    with pytest.raises(BadInput, match=rf"(?s)file: got .*({words})") as caught:
        read(name, text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 1000
    assert not re.search("broadcast|scipy|numpy|ValueError|file: got.*file: got", str(caught.value))


def test_reading_has_limits_of_time_memory_and_size(tmp_path, monkeypatch):
    copies = '<replicate count="10000"><replicate count="10000"><geom size="0.1"/></replicate></replicate>'
    bomb = tmp_path / "bomb.xml"
    bomb.write_text(mjcf("<freejoint/>" + copies))
    with monkeypatch.context() as patch:
        patch.setattr(readers, "SECONDS", 1.0)  # it filled the machine's memory, or took minutes
        with pytest.raises(BadInput, match=r"reading ended.* 2 GiB|error"):
            read_files([bomb], tmp_path)
    large = tmp_path / "large.urdf"
    with large.open("wb") as stream:
        stream.truncate(100 << 20)  # no bytes on disk
    with pytest.raises(BadInput, match="100 MiB, more than 64 MiB"):
        read_files([large], tmp_path)
    os.mkfifo(fifo := tmp_path / "fifo.urdf")
    with pytest.raises(BadInput, match="not an ordinary file"):
        read_files([fifo], tmp_path)


# ------------------------------------------------------------------------------------ what the formats say, by hand, and do not


def body_of(models):
    (model,) = models
    assert not model.disagree
    return model.truth


def test_urdf_1_1_has_quaternions_and_1_0_ignores_them(read):
    """A turn of 45 degrees about z, by hand; the two readers agree to 1e-16."""
    quaternion = f'quat_xyzw="0 0 {math.sin(math.pi / 8)!r} {math.cos(math.pi / 8)!r}"'
    inertial = f'<inertial><origin xyz="0 0 0" {quaternion}/><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.024"'
    inertial += ' iyz="0" izz="0.03"/></inertial>'
    turned = body_of(read("new.urdf", urdf(inertial, attributes=' version="1.1"'))).inertia
    np.testing.assert_allclose(turned, [[0.017, -0.007, 0], [-0.007, 0.017, 0], [0, 0, 0.03]], atol=1e-15)
    (model,) = read("old.urdf", urdf(inertial, attributes=' version="1.0"'))
    np.testing.assert_allclose(model.truth.inertia, np.diag([0.01, 0.024, 0.03]), atol=1e-15)
    assert any("quat_xyzw" in note for note in model.notes)


@pytest.mark.usefixtures("shared_reader")
def test_the_readers_of_scenes_and_of_engines_agree_about_a_urdf(read, tmp_path):
    quaternion = '<origin xyz="0.02 -0.01 0.03" quat_xyzw="0 0 0.6 0.8"/>'
    ours = body_of(read("a.urdf", urdf(INERTIAL.replace("<mass", f"{quaternion}<mass"), attributes=' version="1.1"')))
    (tmp_path / "s.toml").write_text('t_end = 1.0\n[body]\nurdf = "a.urdf"\nname = "a"\n[start]\nw_WB_B = [1, 2, 3]\n')
    assert np.abs(registry.scene(str(tmp_path / "s.toml")).body.inertia - ours.inertia).max() < 1e-16  # measured 7e-18


def cube(*lines):
    """A cube of 1 m with attributes, one a line."""
    inside = "\n".join(["double size = 1", *lines])
    return f'def Cube "c" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMassAPI"])\n{{\n{inside}\n}}\n'


def moved(x):
    return f'double3 xformOp:translate = ({x}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'


def scaled(x, y, z):
    return f'double3 xformOp:scale = ({x}, {y}, {z})\nuniform token[] xformOpOrder = ["xformOp:scale"]\n'


MASS, COM = "float physics:mass = {}\n", "point3f physics:centerOfMass = ({}, 0, 0)\n"
DIAGONAL, DENSITY = "float3 physics:diagonalInertia = ({}, {}, {})\n", "float physics:density = {}\n"
BODY = '"PhysicsRigidBodyAPI"'
OFF = cube("bool physics:collisionEnabled = 0").replace('"c"', '"d"')
BELOW = f'def Xform "e" (prepend apiSchemas = [{BODY}])\n{{\nbool physics:rigidBodyEnabled = 0\n{moved(2)}{cube()}}}\n'
ONE = np.eye(3)
USD = {
    "mass, centre and inertia of the collider": (
        usda(cube(MASS.format(3), DIAGONAL.format(1, 2, 2.5), COM.format(0.1)), BODY),
        Piece(3.0, np.array([0.1, 0, 0]), np.diag([1, 2, 2.5])),
    ),
    "a collider that is not enabled": (usda(cube(MASS.format(3)) + OFF, BODY), Piece(3.0, np.zeros(3), ONE / 2)),
    "the density of the collider before that of the body": (
        usda(DENSITY.format(7) + cube(DENSITY.format(500))),
        Piece(500.0, np.zeros(3), ONE * 500 / 6),
    ),
    "a density of the body": (usda(DENSITY.format(7) + cube()), Piece(7.0, np.zeros(3), ONE * 7 / 6)),
    "a mass of the body before those of colliders": (
        usda(MASS.format(12) + cube(MASS.format(3))),
        Piece(12.0, np.zeros(3), ONE * 2.0),
    ),
    "a scaled body": (
        usda(scaled(2, 2, 2) + MASS.format(2) + COM.format(0.3) + DIAGONAL.format(0.1, 0.2, 0.25)),
        Piece(2.0, np.array([0.6, 0, 0]), np.diag([0.1, 0.2, 0.25])),
    ),
    "a scaled collider of the density of water": (
        usda(cube(scaled(1, 2, 3))),
        Piece(6000.0, np.zeros(3), 500.0 * np.diag([13, 10, 5])),
    ),
    "grams and centimetres": (
        usda(MASS.format(12e3) + cube(), units="metersPerUnit = 0.01\n kilogramsPerUnit = 0.001"),
        Piece(12.0, np.zeros(3), ONE * 12 * 1e-4 / 6),
    ),
    "a density in centimetres": (
        usda(DENSITY.format(5e-4) + cube(), units="metersPerUnit = 0.01"),
        Piece(5e-4, np.zeros(3), ONE * 5e-4 * 1e-4 / 6),
    ),
    "a collider of a body below that is not enabled": (
        usda(DENSITY.format(500) + cube() + BELOW),
        Piece(1000.0, np.array([1.0, 0, 0]), ONE * 500 / 3 + np.diag([0, 1000, 1000])),
    ),
    "a mass and a density that are not positive": (
        usda(MASS.format(-1) + DENSITY.format(500) + cube(MASS.format(-2), DENSITY.format(-3))),
        Piece(500.0, np.zeros(3), ONE * 500 / 6),
    ),
}


@pytest.mark.parametrize("name", USD)
def test_usd_by_hand(read, name):
    """usd-core has single precision: measured up to 2e-7."""
    text, wanted = USD[name]
    assert distance(wanted, body_of(read("b.usda", text))) < 1e-6


def test_axes_that_usd_core_does_not_write_are_not_read(tmp_path, monkeypatch):
    """Its quaternion is any memory if the file has moments and no axes."""
    from pxr import Gf, UsdPhysics

    text, wanted = USD["a scaled body"]
    (tmp_path / "b.usda").write_text(text)
    answer = (2.0, Gf.Vec3f(0.1, 0.2, 0.25), Gf.Vec3f(0.6, 0, 0), Gf.Quatf(1, 2, 3, 4))
    monkeypatch.setattr(UsdPhysics.RigidBodyAPI, "ComputeMassProperties", lambda *_: answer)
    assert distance(wanted, by_usd_core(tmp_path / "b.usda")[0]) < 1e-6


def test_usd_leaves_open_whether_inertia_moves_to_another_centre_of_mass(read):
    (model,) = read("b.usda", usda(COM.format(0.2) + MASS.format(6) + cube(scaled(1, 2, 3))))
    assert "disagree" in model.disagree
    assert (
        decide_body(model, "newton", model.own, 1e-4).verdict
        == decide_body(model, "newton", model.reference, 1e-4).verdict
        is UNDECIDED
    )
    assert decide_body(model, "newton", replace(model.own, mass=9.0), 1e-4).verdict is UNDECIDED


def test_meshes_that_are_not_needed_are_not_required(read):
    mesh = '<visual><geometry><mesh filename="package://p/a.dae"/></geometry></visual>'
    collision = mesh.replace("visual", "collision")
    (model,) = read("a.urdf", urdf(INERTIAL + mesh + collision))
    np.testing.assert_allclose(model.truth.inertia, TENSOR, atol=1e-18)
    assert "mesh" not in model.path.read_text()
    assert any("package://p/a.dae" in note for note in model.notes)
    inertial = f"<inertial><mass>1.2</mass>{SDF_INERTIA}</inertial>"
    for shape in ("<mesh><uri>model://t/a.stl</uri></mesh>", "<polyline><point>0 0</point></polyline>", "<heightmap/>"):
        (model,) = read("a.sdf", sdf(f'{inertial}<collision name="c"><geometry>{shape}</geometry></collision>'))
        assert model.truth.mass == 1.2
        assert model.notes


def test_packages_are_found_in_search_paths(read, tmp_path):
    (tmp_path / "else" / "p").mkdir(parents=True)
    (tmp_path / "else" / "p" / "part.obj").write_text((CATALOGUE / "part.obj").read_text())
    text = mesh("package://p/part.obj")
    with pytest.raises(BadInput, match="which is not there"):
        read("a.sdf", text)
    (found,) = read("a.sdf", text, (tmp_path / "else",))
    assert found.truth.mass > 0
    assert str(tmp_path / "else") in found.path.read_text()  # for the engines, which do not know the search path


SDF_MASS = f"<mass>1</mass>{SDF_INERTIA}"
RELATIVE = '<inertial><pose relative_to="{}">0 0 1 0 0 0</pose>' + f"{SDF_MASS}</inertial>"
FRAME = '<frame name="f"><pose>0 0 1 0 0 0</pose></frame>'
TETRAHEDRON = """def Mesh "m" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    int[] faceVertexCounts = [3, 3, 3, 3]
    int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
    uniform token physics:approximation = "boundingCube"
}"""
NOTED = {
    "an unknown attribute": (urdf(INERTIAL.replace('value="2"', 'value="2" unit="g"')), "unit", "doubts"),
    "an unknown element": (sdf(f"<inertial>{SDF_MASS}<fluid_added_mass/></inertial>"), "fluid_added_mass", "doubts"),
    "a pose relative to a frame": (sdf(RELATIVE.format("f"), FRAME), "'f'", "invalid"),
    "a pose relative to its link": (sdf(RELATIVE.format("a")), "'a'", "doubts"),
    "products that are missing": (
        urdf('<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'),
        "ixy, ixz, iyz",
        "invalid",
    ),
    "two inertials": (urdf(INERTIAL + INERTIAL), "several elements <inertial>", "invalid"),
    "an extension of Gazebo": (urdf(more='<gazebo reference="a"><mass>3</mass></gazebo>'), "gazebo", "notes"),
    "an extension of MuJoCo": (urdf(more='<mujoco><compiler balanceinertia="true"/></mujoco>'), "balanceinertia", "asks"),
    "an extension of Drake": (urdf(more='<drake:mass value="3"/>'), "drake:mass", "asks"),
    "one with a namespace": (sdf(f'<inertial>{SDF_MASS}</inertial><drake:x xmlns:drake="d"/>'), "drake:x", "notes"),
    "an attribute of a vendor": (
        usda(MASS.format(2) + DIAGONAL.format(1, 2, 2) + COM.format(0) + "float physxRigidBody:x = 1"),
        "physxRigidBody:x",
        "notes",
    ),
    "an approximation of a mesh": (usda(TETRAHEDRON), "boundingCube", "doubts"),
}


@pytest.mark.parametrize("name", NOTED)
def test_nothing_is_ignored_silently(read, name):
    text, words, where = NOTED[name]
    suffix = {"<rob": "urdf", "<sdf": "sdf", "#usd": "usda"}[text[:4]]
    (model,) = read(f"a.{suffix}", text)
    assert words in str(getattr(model, where))
    assert words in str(model.notes)
    if where in ("doubts", "invalid"):  # no engine is wrong or refuses without a reason
        other = replace(model.truth, mass=9 * model.truth.mass)
        assert decide_body(model, "dart", other, 1e-4).verdict is UNDECIDED
        assert decide_refusal(model, "dart", "no").verdict in (RIGHT, UNDECIDED)


def test_a_plain_file_has_no_notes_and_every_outcome(read):
    """The negative control of the notes: a wrong body, a refusal and a right one are called so."""
    (model,) = read("a.urdf", urdf())
    assert not model.notes
    assert decide_body(model, "dart", model.truth, 1e-4)[:2] == (RIGHT, "")
    assert decide_body(model, "dart", replace(model.truth, mass=9.0), 1e-4).verdict is WRONG
    assert decide_refusal(model, "dart", "no").verdict is WRONG


def test_an_engine_that_does_what_its_own_extension_asks_is_right(read):
    """MuJoCo's own options, on bodies by hand; another engine is not asked."""
    box = '<collision><geometry><box size="0.2 0.3 0.4"/></geometry></collision>'
    (asks,) = read("g.urdf", urdf(INERTIAL + box, '<mujoco><compiler inertiafromgeom="true"/></mujoco>'))
    of_box = Piece(24.0, np.zeros(3), 2 * np.diag([0.25, 0.2, 0.13]))
    opinion = decide_body(asks, "mujoco", of_box, 1e-4)
    assert opinion.verdict is RIGHT
    assert "inertiafromgeom" in opinion.detail
    assert decide_body(asks, "dart", of_box, 1e-4).verdict is WRONG
    assert decide_body(asks, "mujoco", replace(of_box, mass=3.0), 1e-4).verdict is UNDECIDED
    (plain,) = read("p.urdf", urdf(INERTIAL + box))
    opinion = decide_body(plain, "mujoco", of_box, 1e-4)
    assert opinion.verdict is WRONG
    assert [cause.key for cause in opinion.causes] == ["mass of the geometry"]
    (other,) = read("o.urdf", urdf(INERTIAL + box, '<mujoco><compiler balanceinertia="true" angle="radian"/></mujoco>'))
    assert decide_body(other, "mujoco", of_box, 1e-4).verdict is WRONG  # the option changes no body that can exist


def test_what_is_said_about_an_impossible_inertia_is_true_of_the_engine(read):
    thin = '<inertial><mass value="2"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.04"/></inertial>'
    (model,) = read("a.urdf", urdf(thin))
    assert model.flaw == "a moment exceeds the sum of the others"
    assert "a moment exceeds the sum of the others; it has" in decide_body(model, "dart", model.truth, 1e-4).detail
    mean = replace(model.truth, inertia=np.eye(3) * 0.07 / 3)
    opinion = decide_body(model, "dart", mean, 1e-4)
    assert opinion.verdict is WRONG
    assert "inertia 0.01 0.02 0.04 0 0 0 and 0.02333 0.02333 0.02333 0 0 0" in opinion.detail
    assert "without a warning" in opinion.detail
    moved = replace(mean, mass=3.0)
    assert "mass 2 and 3 kg, inertia" in decide_body(model, "dart", moved, 1e-4).detail
    assert decide_body(model, "dart", mean, 1e-4, "inertia").verdict is RIGHT
    (asks,) = read("b.urdf", urdf(thin, '<mujoco><compiler balanceinertia="true"/></mujoco>'))
    assert decide_body(asks, "mujoco", mean, 1e-4).verdict is RIGHT


def plate(*moments):
    values = " ".join(f'i{name}="{value}"' for name, value in zip(("xx", "yy", "zz", "xy", "xz", "yz"), moments, strict=True))
    return urdf(f'<inertial><mass value="2"/><inertia {values}/></inertial>')


def test_the_digits_of_a_planar_body_excuse_it(read):
    """Largest excess of three rounded moments: 1.5 of the last digit, up to a tenth of the largest one."""
    (model,) = read("a.urdf", plate(0.0123, 0.0257, 0.0381, 0, 0, 0))
    assert not model.flaw
    assert "digits" in str(model.notes)
    assert decide_body(model, "dart", model.truth, 1e-4)[:2] == (RIGHT, "")
    flat = replace(model.truth, inertia=np.diag([0.0123, 0.0257, 0.0380]))
    assert decide_body(model, "dart", flat, 1e-4)[:2] == (RIGHT, "")
    assert decide_refusal(model, "mujoco", "no").verdict is UNDECIDED
    assert decide_body(model, "dart", replace(model.truth, mass=3.0), 1e-4).verdict is WRONG
    other = replace(model.truth, inertia=ONE * 0.01)
    assert decide_body(model, "dart", other, 1e-4).verdict is WRONG
    assert decide_body(model, "dart", other, 1e-4, "inertia").verdict is UNDECIDED
    for moments in ((0.0123, 0.0257, 0.0390, 0, 0, 0), (0.1, 0.1, 0.3, 0, 0, 0)):
        (model,) = read("b.urdf", plate(*moments))
        assert model.flaw == "a moment exceeds the sum of the others"


def test_the_flaw_of_a_file_comes_before_doubts_about_it(read):
    (model,) = read("a.urdf", urdf(INERTIAL.replace('value="2"', 'value="-2" unit="g"')))
    assert model.flaw == "the mass is not positive"
    assert decide_body(model, "dart", model.truth, 1e-4).verdict is WRONG
    assert decide_body(model, "dart", model.truth, 1e-4, "mass").verdict is RIGHT
    (usd,) = read("a.usda", usda(MASS.format(-2) + COM.format(0) + DIAGONAL.format(1, 2, 2)))
    assert usd.flaw  # usd-core has another mass, which no body has either


def test_only_options_that_change_what_differs_excuse_an_engine(read):
    option = '<mujoco><compiler boundmass="3" meshdir="x"/></mujoco>'
    (model,) = read("a.urdf", urdf(INERTIAL, option))
    heavier = replace(model.truth, mass=3.0)
    assert decide_body(model, "mujoco", heavier, 1e-4).verdict is UNDECIDED
    assert decide_body(model, "dart", heavier, 1e-4).verdict is WRONG
    assert decide_body(model, "mujoco", replace(model.truth, inertia=2 * TENSOR), 1e-4).verdict is WRONG
    (model,) = read("b.urdf", urdf(INERTIAL, option.replace("boundmass", "autolimits")))
    assert decide_body(model, "mujoco", heavier, 1e-4).verdict is WRONG


def test_later_attributes_and_names_of_worlds_leave_a_file_open(read):
    box = '<collision name="c"><geometry><box><size>0.2 0.3 0.4</size></box></geometry></collision>'
    auto = sdf(f'<inertial auto="true"><mass>6</mass></inertial>{box}')
    (new,) = read("new.sdf", auto)  # by hand: 6 kg in a box, 6/12 (b^2 + c^2)
    np.testing.assert_allclose(new.truth.inertia, np.diag([0.125, 0.1, 0.065]), rtol=1e-12)
    assert not new.doubts
    (heavy,) = read("heavy.sdf", sdf(f'<inertial auto="true"><density>500</density></inertial>{box}'))
    assert heavy.truth.mass == pytest.approx(500 * 0.2 * 0.3 * 0.4)
    (old,) = read("old.sdf", auto.replace("1.11", "1.6"))
    assert "of SDF 1.11, and the file of SDF 1.6" in str(old.doubts)
    (world,) = read("world.urdf", urdf().replace('"a"', '"world"'))
    assert world.doubts


def test_round_shapes_whose_scale_differs_by_axis_are_left_open(read):
    """OpenUSD draws an ellipsoid, and its parser of the schema makes a sphere of the largest scale."""
    sphere = cube().replace("Cube", "Sphere").replace("double size", "double radius")
    (same,) = read("a.usda", usda(sphere.replace("}", scaled(2, 2, 2) + "}"), BODY))
    assert not same.disagree
    np.testing.assert_allclose(same.truth.mass, 1000 * 4 / 3 * np.pi * 8, rtol=1e-6)
    (other,) = read("b.usda", usda(sphere.replace("}", scaled(1, 2, 3) + "}"), BODY))
    assert other.disagree.startswith("the readers disagree, usd-core")
    assert "mass 1.131e+05 and 2.513e+04 kg" in other.disagree
    assert decide_body(other, "newton", other.own, 1e-4).verdict is UNDECIDED


def test_with_one_reader_nothing_is_said_against_an_engine(read):
    (model,) = read("a.sdf", sdf(f"<inertial>{SDF_MASS}</inertial>"))  # without Drake
    wrong = replace(model.truth, inertia=np.eye(3))
    assert decide_body(model, "dart", wrong, 1e-4).verdict is decide_refusal(model, "dart", "no").verdict is UNDECIDED
    assert decide_body(model, "dart", model.truth, 1e-4)[:2] == (RIGHT, "")


@pytest.mark.parametrize("suffix", ["xml", "mjcf"])
def test_both_readings_follow_files_within_files(read, tmp_path, suffix):
    """Classes, options and shapes in other files, one of which includes another; and a joint in a frame moves its body."""
    (tmp_path / "deep.xml").write_text('<mujocoinclude><geom class="c" pos="0.1 0 0"/></mujocoinclude>')
    (tmp_path / "part.xml").write_text('<mujocoinclude><geom class="c"/><include file="deep.xml"/></mujocoinclude>')
    classes = '<default><default class="c"><geom type="box" size="0.1 0.2 0.3" mass="2"/></default></default>'
    (tmp_path / "head.xml").write_text(f'<mujoco><compiler angle="radian"/>{classes}</mujoco>')
    arm = '<body name="arm"><frame euler="0 0 1"><joint/></frame><geom class="c"/></body>'
    alone = mjcf('<freejoint/><include file="part.xml"/>', '<include file="head.xml"/>')
    (model,) = read(f"a.{suffix}", alone)
    base, moved = read(f"b.{suffix}", mjcf(f'<freejoint/><include file="part.xml"/>{arm}', '<include file="head.xml"/>'))
    for part in (model, base):
        assert distance(part.own, part.reference) < 1e-12  # measured 2e-16
        assert part.truth.mass == 4.0
    assert (moved.label.endswith("arm"), moved.truth.mass, moved.body.pivots[0][0]) == (True, 2.0, "hinge")


def test_without_mujoco_there_is_one_reading_of_mjcf(read, monkeypatch):
    def missing(*_):
        raise MissingEngine("MuJoCo", "mujoco")

    monkeypatch.setattr(readers, "version", missing)
    box = '<freejoint/><geom type="box" size="0.1 0.2 0.3" mass="2"{}/>'
    (model,) = read("a.xml", mjcf(box.format("")))
    assert (model.reader, model.reference) == ("", None)
    assert "pip install mujoco" in model.lonely
    np.testing.assert_allclose(model.truth.inertia, 2 / 3 * np.diag([0.13, 0.1, 0.05]), rtol=1e-12)
    assert decide_body(model, "dart", replace(model.truth, mass=9.0), 1e-4).verdict is UNDECIDED
    with pytest.raises(MissingEngine):
        read("b.xml", mjcf(box.format(' shellinertia="true"').replace("box", "ellipsoid")))


def test_words_of_engines_are_about_the_body_and_keep_their_units():
    assert not find_warning(
        "Loading mass_test.urdf: link inertia_link, masses.urdf is massless_", ["mass_test", "inertia_link", "masses"]
    )
    found = find_warning("Ok. \x1b[1;33mWarning: mass [-2.3] of inertia_link. More.", ["inertia_link"])
    assert found == "Warning: mass [-2.3] of ...."
    program = Program.__new__(Program)
    program._ask = lambda *_: {"refused": "m/s in /m/a.urdf, not in /else/m/b, but m/c", "output": ""}
    assert program._load(Model(body=Body("", Path("/m/a.urdf"))), None)["refused"] == "m/s in a.urdf, not in /else/m/b, but m/c"


def test_notes_name_the_joint_and_no_namespace(read):
    quaternion = '<origin quat_xyzw="0 0 0 1"/></joint>'
    chain = (
        LINKS + joint("fixed", "a", "b").replace("</joint>", quaternion) + joint("fixed", "b", "c") + joint("fixed", "c", "d")
    )
    (model,) = read("a.urdf", urdf(more=chain))
    assert "quat_xyzw of 'bj' is ignored in URDF 1.0" in str(model.notes)
    (model,) = read("b.sdf", sdf(f'<inertial>{SDF_MASS}</inertial><x:y xmlns:x="http://x"/>'))
    assert "<link> has 'x:y'" in str(model.notes)
    (model,) = read("c.urdf", urdf(attributes=' xmlns="http://x"'))
    assert "namespace" in str(model.doubts)


def test_what_is_beside_the_mass_is_no_reason_to_call_an_engine_a_refuser(read, tmp_path):
    path = tmp_path / "a.urdf"
    path.write_text(urdf(more='<transmission name="t"/>'))
    (model,) = read("a.urdf", path.read_text())
    program = Program.__new__(Program)
    program.engine, program.label, program.single = "drake", "drake", False
    answer = {"output": "", "accelerations": None}
    program._load = lambda model, cases: answer | {
        "refused": "no type" * ("transmission" in model.path.read_text()), "accelerations": accelerations(model.truth, cases)
    }  # fmt: skip
    assert program.check(model)[0].verdict is UNDECIDED
    program._load = lambda model, cases: answer | {"refused": "no"}
    assert program.check(model)[0].verdict is WRONG

    def touch(model, cases):
        floor = np.sin(cases[:, 0]) * ("<trans" in model.path.read_text())
        return answer | {"refused": "", "accelerations": accelerations(model.truth, cases) + floor}

    program._load = touch
    assert program.check(model)[0].verdict is RIGHT  # without the floor that it touches


OPEN = {
    "axes.xml": mjcf('<freejoint align="true"/><geom size="0.1" pos="1 2 3"/>'),
    "held.usda": usda("bool physics:kinematicEnabled = 1\n" + MASS.format(2) + COM.format(0) + DIAGONAL.format(1, 2, 2)),
    "no rule.xml": mjcf('<freejoint/><geom type="ellipsoid" size="0.1 0.2 0.3" shellinertia="true"/>'),
}


@pytest.mark.parametrize("name", OPEN)
def test_nothing_is_said_about_what_a_file_leaves_open(read, name):
    (model,) = read(name, OPEN[name])
    assert decide_body(model, "dart", replace(model.truth, mass=9.0), 1e-4).verdict is UNDECIDED


def test_the_shells_of_boxes_and_spheres_are_those_of_mujoco(read):
    """Measured: 1e-15. Two engines that compute the solid box were undecided."""
    shells = '<geom type="sphere" size="0.13" density="7" shellinertia="true" pos="0.1 0 0"/>'
    shells += '<geom type="box" size="0.1 0.23 0.3" euler="10 20 30" shellinertia="true" pos="0.1 0.3 0"/>'
    (model,) = read("a.xml", mjcf(f"<freejoint/>{shells}"))
    assert distance(model.own, model.reference) < 1e-12
    assert decide_body(model, "dart", replace(model.truth, inertia=model.truth.inertia * 0.7), 1e-4).verdict is WRONG


def test_instances_in_a_usd_file_are_read(read):
    inside = 'def Xform "x" (\n instanceable = true\n references = </proto>\n)\n{\n}\n'
    (model,) = read("a.usda", usda(inside, BODY) + f'class Xform "proto"\n{{\n{cube()}}}\n')
    assert model.truth.mass == pytest.approx(1000, rel=1e-6)


def test_axes_are_those_of_the_root_of_fixed_bodies(read):
    """1 kg at 0.2 m and 2 kg at 0 have their centre at 0.2/3 from the root, wherever the root is in the file."""
    text = placed("arm", 1, 0.2) + usd_joint("Fixed", "j", "b", "arm") + usda(MASS.format(2) + cube()).partition(")\n")[2]
    (model,) = read("a.usda", "#usda 1.0\n(\n metersPerUnit = 1\n kilogramsPerUnit = 1\n)\n" + text)
    assert model.body.name == "/b"
    np.testing.assert_allclose(body_of([model]).com, [0.2 / 3, 0, 0], atol=1e-6)


@pytest.mark.engine("brax")
def test_armature_damping_and_fluids_do_not_count_against_brax():
    path = CATALOGUE / "joints_and_fluids.xml"
    assert [finding.verdict for finding in findings(path, engines=["brax"]).values()] == [RIGHT]


@pytest.mark.parametrize("shift", [0.01, -0.3])
def test_a_wrong_centre_of_mass_is_seen(read, shift):
    """A program that loads the file with another centre of mass is wrong, and right without that."""
    (model,) = read("a.urdf", urdf(INERTIAL.replace("<mass", '<origin xyz="0.02 -0.01 0.03"/><mass')))
    program = Program.__new__(Program)
    program.engine, program.label, program.single = "dart", "dart", False
    for moved, verdict in ((0.0, RIGHT), (shift, WRONG)):
        loaded = replace(model.truth, com=model.truth.com + np.array([0, moved, 0]))
        program._load = lambda model, cases, loaded=loaded: {
            "refused": "", "output": "", "accelerations": accelerations(loaded, cases)
        }  # fmt: skip
        finding, body = program.check(model)
        assert finding.verdict is verdict
        np.testing.assert_allclose(body.seen["com"], loaded.com, atol=1e-12)  # of the engine and not of the file


def test_numbers_of_an_engine_are_those_it_has(read):
    """Forces that suit a body of 1e-15 kg m^2 say nothing about the unit inertia that an engine has instead."""
    tiny = '<inertial><mass value="1e-7"/><inertia ixx="1e-15" ixy="0" ixz="0" iyy="2e-15" iyz="0" izz="2.5e-15"/></inertial>'
    (model,) = read("a.urdf", urdf(tiny))
    program = Program.__new__(Program)
    program.engine, program.label, program.single = "dart", "dart", False
    loaded = Piece(1.0, np.array([0.1, 0, 0]), np.diag([1, 1.5, 2.0]))
    program._load = lambda model, cases: {"refused": "", "output": "", "accelerations": accelerations(loaded, cases)}
    seen = Piece(**{name: np.array(value) for name, value in program.check(model)[1].seen.items()})
    assert distance(loaded, seen) < 1e-12
    program._load = lambda model, cases: {
        "refused": "", "output": "", "accelerations": np.hstack([cases[:, 1, :3], np.zeros((len(cases), 3))])
    }  # fmt: skip
    finding, body = program.check(model)
    assert body.seen is None
    assert "as if its inertia were infinite" in finding.detail
    program._load = lambda model, cases: {"refused": "", "output": "", "accelerations": np.zeros((len(cases), 6))}
    finding, _ = program.check(model)
    assert finding.verdict is WRONG
    assert "no force moves it" in finding.detail


# ----------------------------------------------------------------------------------------------------------------------- robots


HIP = INERTIAL.replace(MOMENTS, 'ixx="-0.0012" ixy="0" ixz="0" iyy="-0.0011" iyz="0" izz="0.0003"')
FOOT = f'<link name="hip">{HIP}</link><link name="foot">{INERTIAL}</link><link name="tip"/>'
ROBOT = urdf(more=FOOT + joint("revolute", "a", "hip") + joint("fixed", "hip", "foot") + joint("fixed", "foot", "tip"))
SDF_ROBOT = sdf(
    f"<inertial><mass>2</mass>{SDF_INERTIA}</inertial>",
    f"""<link name="arm"><pose relative_to="f">0 0.1 0 0 0 0.3</pose><inertial><mass>1</mass>{SDF_INERTIA}</inertial></link>
    <link name="hand"><pose relative_to="arm">0.2 0 0 0.1 0 0</pose><inertial><mass>0.5</mass>{SDF_INERTIA}</inertial></link>
    <frame name="f"><pose>1 2 3 0.1 0.2 0.3</pose></frame>
    <joint name="j" type="revolute"><parent>a</parent><child>arm</child><axis><xyz>0 0 1</xyz></axis></joint>
    <joint name="k" type="fixed"><parent>arm</parent><child>hand</child></joint>""",
)
MJCF_ROBOT = mjcf(
    """<joint type="slide"/><geom size="0.1" mass="2"/>
    <body name="arm" pos="1 2 3" euler="10 20 30" childclass="c"><joint/><geom class="d" mass="1"/>
    <body name="hand" pos="0.2 0 0"><geom size="0.1" mass="0.5"/></body></body>""",
    '<default><default class="c"><geom type="box" size="0.1 0.2 0.3"/></default><default class="d"><geom type="capsule"'
    ' size="0.1 0.2"/></default></default>',
)


def usd_joint(kind, name, first, second):
    return f'def Physics{kind}Joint "{name}"\n{{\nrel physics:body0 = </{first}>\nrel physics:body1 = </{second}>\n}}\n'


def placed(name, mass, at):
    return (
        f'def Xform "{name}" (prepend apiSchemas = [{BODY}, "PhysicsMassAPI"])\n{{\n{MASS.format(mass)}{moved(at)}{cube()}}}\n'
    )


USD_ROBOT = usda(MASS.format(2) + cube()) + placed("arm", 1, 5) + placed("hand", 0.5, 5.2)
USD_ROBOT += usd_joint("Revolute", "j", "b", "arm") + usd_joint("Fixed", "k", "arm", "hand")


@pytest.mark.parametrize(("name", "text"), [("r.sdf", SDF_ROBOT), ("r.xml", MJCF_ROBOT), ("r.usda", USD_ROBOT)])
def test_every_link_of_a_robot_is_a_free_body_with_what_is_fixed_to_it(read, name, text):
    base, arm = read(name, text)
    assert base.label.endswith(("a", "b"))
    assert arm.label.endswith("arm")
    assert base.truth.mass == 2.0
    assert arm.truth.mass == 1.5
    assert not base.disagree + arm.disagree
    if name == "r.sdf" or name == "r.xml":
        np.testing.assert_allclose(arm.truth.com, [0.2 / 3, 0, 0], atol=1e-15)
    else:
        np.testing.assert_allclose(arm.truth.com, [0.2 / 3, 0, 0], atol=1e-6)
    assert all("free body" in str(each.notes) for each in (base, arm))


HELD = {
    "world.urdf": urdf(more='<link name="world"/>' + joint("fixed", "world", "a")),
    "floating.urdf": urdf(more='<link name="world"/>' + joint("floating", "world", "a")),
    "held.xml": mjcf(
        '<inertial pos="0 0 0" mass="2" diaginertia="0.02 0.03 0.04"/>', '<worldbody><geom size="1"/></worldbody>'
    ),
    "static.sdf": sdf(f"<inertial><mass>2</mass>{SDF_INERTIA}</inertial>", '<static>true</static><link name="ground"/>'),
}


@pytest.mark.parametrize("name", HELD)
def test_a_body_that_the_file_holds_is_set_free(read, name):
    (model,) = read(name, HELD[name])
    assert model.truth.mass == 2.0
    assert "free body" in str(model.notes)
    text = model.path.read_text()
    assert "static" not in text
    assert "world" not in text.replace("worldbody", "")


@pytest.fixture(scope="module")
def verified(tmp_path_factory):
    """The verifications of two files by two engines, which are started once: a bad link, and what acts beside the mass."""
    folder = tmp_path_factory.mktemp("models")
    robot, beside = folder / "robot.urdf", folder / "a.xml"
    robot.write_text(ROBOT.replace(joint("fixed", "hip", "foot"), joint("revolute", "hip", "foot")))
    head = '<option density="1000" viscosity="1" wind="1 2 3"/><default><joint armature="1" damping="1"/></default>'
    beside.write_text(mjcf('<joint type="free"/><geom type="box" size="0.1 0.2 0.3"/>', head))
    return dict(zip(("robot", "beside"), verify_files([robot, beside], ["mujoco", "pinocchio"]), strict=True))


def test_the_bad_link_of_a_robot_is_named(read, verified):
    base, hip = read("robot.urdf", ROBOT)
    assert [(each.label, each.truth.mass) for each in (base, hip)] == [("robot.urdf: a", 2.0), ("robot.urdf: hip", 4.0)]
    found = verified["robot"]
    assert {(finding.case, finding.subject.split()[0]): finding.verdict for finding in found.findings} == {
        ("robot.urdf: a", "mujoco"): RIGHT,
        ("robot.urdf: a", "pinocchio"): RIGHT,
        ("robot.urdf: hip", "mujoco"): RIGHT,  # it refuses the link
        ("robot.urdf: hip", "pinocchio"): WRONG,  # it accepts it
        ("robot.urdf: foot", "mujoco"): RIGHT,
        ("robot.urdf: foot", "pinocchio"): RIGHT,
    }
    assert found.exit_code == 1
    (note,) = (each for each in found.notes if "no body is like this" in each)
    assert note.startswith("hip: ")
    assert "-0.0012 -0.0011 0.0003" in note


def test_a_bad_link_below_a_good_body_excuses_a_refusal_and_a_repair(read):
    """MuJoCo refuses such a body, Drake warns and repairs the link, and the whole body may be possible."""
    bad = HIP.replace("0.0003", "0.00003")
    (model,) = read("a.urdf", urdf(more=f'<link name="foot">{bad}</link>' + joint("fixed", "a", "foot")))
    assert not model.flaw
    assert "'foot', a link of the body: a principal moment is not positive" in str(model.notes)
    assert decide_refusal(model, "mujoco", "no").verdict is RIGHT
    assert decide_body(model, "drake", replace(model.truth, mass=2.0), 1e-4).verdict is UNDECIDED
    assert decide_body(model, "pinocchio", model.truth, 1e-4)[:2] == (RIGHT, "")


def test_what_a_model_has_beside_mass_does_not_change_the_body_that_mujoco_has(verified):
    """Armature, damping and a fluid act on the accelerations of a body and are not its mass."""
    assert [finding.verdict for finding in verified["beside"].findings] == [RIGHT, RIGHT]


@pytest.mark.slow
def test_robots_of_packages(tmp_path):
    """Ten robots with 210 links: what is right in four engines, and that no engine is wrong where it was checked by hand.

    pip install example-robot-data gymnasium
    """
    links, wrong = 0, []
    for package, names in ROBOTS.items():
        try:
            files = distribution(package).files or []
        except PackageNotFoundError:
            pytest.skip(f"{package} is not installed")
        paths = [Path(str(file.locate())) for file in files if str(file).endswith(names)]
        assert len(paths) == len(names)
        verified = verify_files(paths, ["mujoco", "pinocchio"])
        pairs = [pair for each in verified for pair in zip(each.findings, each.details, strict=True)]
        links += len({finding.case for finding, _ in pairs})
        wrong += [finding for finding, body in pairs if finding.verdict is WRONG and not body.flaw]
    assert links == 210
    assert not wrong  # MuJoCo and Pinocchio read all possible links of these robots right


ROBOTS = {
    "example-robot-data": (
        "urdf/panda.urdf",
        "robots/talos_reduced.urdf",
        "robots/icub_reduced.urdf",
        "anymal_c_simple_description/urdf/anymal.urdf",
        "urdf/ur5_robot.urdf",
        "robots/tiago.urdf",
        "robots/hyq_no_sensors.urdf",
        "robots/cassie.sdf",
    ),
    "gymnasium": ("mujoco/assets/humanoid.xml", "mujoco/assets/ant.xml"),
}


# ----------------------------------------------------------------------------------------------------------------------- shapes


def test_volumes_are_those_of_trimesh():
    """Closed formulas and a mesh of the same shape: measured up to 6e-3 for the facets of round shapes, 1e-15 for boxes."""
    trimesh = pytest.importorskip("trimesh")
    made = trimesh.creation
    cases = {
        ("box", (0.5, 0.7, 1.1)): made.box((0.5, 0.7, 1.1)),
        ("sphere", 0.4): made.icosphere(5, 0.4),
        ("cylinder", (0.4, 0.9)): made.cylinder(0.4, 0.9, sections=400),
        ("capsule", (0.4, 0.9)): made.capsule(0.9, 0.4, count=[128, 128]),
        ("cone", (0.4, 0.9)): made.cone(0.4, 0.9, sections=400),
    }
    for (kind, sizes), solid in cases.items():
        (part,) = weigh(kind, sizes, np.eye(4), 1.0)
        own = weigh("mesh", [solid.vertices, solid.faces], np.eye(4), 1.0)[0]
        theirs = Piece(solid.volume, solid.center_mass, solid.moment_inertia)
        assert distance(theirs, own) < 1e-9, kind
        centre = np.array([0, 0, 0.45 * (kind == "cone")])  # trimesh puts the base of a cone at 0
        assert distance(replace(part, com=part.com + centre), theirs) < 1e-2, kind
