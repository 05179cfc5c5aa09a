import numpy as np
import pytest

import conservative as cv
from conservative import deferred_imports, registry
from conservative.attitude import from_quaternion, rotation_about
from conservative.references.model_files import readers
from conservative.references.model_files.scene_bodies import body_from_mjcf, body_from_urdf
from conservative.references.worker.calls import python_worker
from conservative.scene_files import scene_file

pytestmark = pytest.mark.usefixtures("shared_reader")

# One body of generic parameters, written in every way that a format has.
MASS, COM, ANCHOR = 2.5, np.array([0.1, -0.2, 0.3]), np.array([-0.05, 0.07, 0.02])
MOMENTS = np.array([0.5, 0.6, 0.7])
RPY = (0.3, -0.5, 0.7)
R_BI = rotation_about((0, 0, 1), RPY[2]) @ rotation_about((0, 1, 0), RPY[1]) @ rotation_about((1, 0, 0), RPY[0])
TENSOR_I = np.array([[0.5, 0.01, -0.02], [0.01, 0.6, 0.03], [-0.02, 0.03, 0.7]])
QUATERNION = np.array([0.8, 0.2, -0.4, 0.4])  # scalar first, of unit length


def about(com, inertia_com, mass=MASS):
    """Return the inertia about the origin of `com`: J + m (c.c 1 - c c')."""
    return inertia_com + mass * (com @ com * np.eye(3) - np.outer(com, com))


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


@pytest.fixture
def written(tmp_path):
    def write(text, name="robot.xml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def mjcf(inside, pose='pos="1 2 3" quat="0.5 0.5 -0.5 0.5"'):
    return f"""<mujoco><worldbody><body name="carrier"><freejoint/><geom type="sphere" size="0.1"/>
    <body name="arm" {pose}>{inside}</body></body></worldbody></mujoco>"""


JOINT = f'<joint type="ball" pos="{numbers(ANCHOR)}"/>'
HINGES = "".join(f'<joint type="hinge" axis="{axis}" pos="{numbers(ANCHOR)}"/>' for axis in ("1 0 0", "0 1 0.5"))
FULL = (
    f'<inertial mass="{MASS}" pos="{numbers(COM)}" fullinertia="0.5 0.6 0.7 0.01 -0.02 0.03"/>',
    TENSOR_I,
)
TURNED = (
    f'<inertial mass="{MASS}" pos="{numbers(COM)}" quat="{numbers(QUATERNION)}" diaginertia="{numbers(MOMENTS)}"/>',
    from_quaternion(QUATERNION) @ np.diag(MOMENTS) @ from_quaternion(QUATERNION).T,
)


@pytest.mark.parametrize("joints", [JOINT, HINGES], ids=["ball", "hinges through one point"])
@pytest.mark.parametrize(("inertial", "inertia_com"), [FULL, TURNED], ids=["fullinertia", "turned diaginertia"])
def test_an_mjcf_body_turns_about_its_joint(written, joints, inertial, inertia_com):
    body = body_from_mjcf(written(mjcf(joints + inertial)), "arm")
    assert body.mass == MASS
    np.testing.assert_allclose(body.com_B, COM - ANCHOR, atol=1e-14)  # measured 2e-16
    np.testing.assert_allclose(body.inertia, about(COM - ANCHOR, inertia_com), atol=1e-12)  # measured 7e-15


def test_a_free_mjcf_body_turns_about_its_centre(written):
    text = (
        f'<mujoco><worldbody><body name="arm" pos="1 2 3" euler="10 20 30"><freejoint/>{TURNED[0]}</body></worldbody></mujoco>'
    )
    body = body_from_mjcf(written(text), "arm")
    np.testing.assert_array_equal(body.com_B, np.zeros(3))
    np.testing.assert_allclose(body.inertia, TURNED[1], atol=1e-12)  # measured 4e-16


def test_an_mjcf_body_includes_welded_bodies_only(written):
    pose = f'pos="0.3 0.1 -0.2" quat="{numbers(QUATERNION)}"'
    welded = f'<body name="tip" {pose}><inertial mass="0.5" pos="0.01 0.02 0.03" diaginertia="0.05 0.06 0.07"/></body>'
    hanging = f'<body name="child" pos="1 1 1"><joint type="ball"/>{TURNED[0]}</body>'
    body = body_from_mjcf(written(mjcf(JOINT + FULL[0] + welded + hanging)), "arm")
    R = from_quaternion(QUATERNION)
    com_tip = np.array([0.3, 0.1, -0.2]) + R @ (0.01, 0.02, 0.03) - ANCHOR
    expected = about(COM - ANCHOR, TENSOR_I) + about(com_tip, R @ np.diag([0.05, 0.06, 0.07]) @ R.T, 0.5)
    assert body.mass == pytest.approx(3.0, rel=1e-15)
    np.testing.assert_allclose(body.com_B, (MASS * (COM - ANCHOR) + 0.5 * com_tip) / 3, atol=1e-14)  # measured 2e-16
    np.testing.assert_allclose(body.inertia, expected, atol=1e-12)  # measured 7e-15


SMALL = '<inertial><mass value="0.5"/><inertia ixx="0.05" iyy="0.06" izz="0.07" ixy="0" ixz="0" iyz="0"/></inertial>'


def urdf(joint="revolute", inertial=True):
    values = dict(zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (0.5, 0.6, 0.7, 0.01, -0.02, 0.03), strict=True))
    inertia = "<inertia " + " ".join(f'{name}="{value}"' for name, value in values.items()) + "/>"
    origin = f'<origin xyz="{numbers(COM)}" rpy="{numbers(RPY)}"/>'
    body = f'<inertial>{origin}<mass value="{MASS}"/>{inertia}</inertial>' if inertial else ""
    return f"""<robot name="r"><link name="base">{SMALL}</link><link name="arm">{body}</link><link name="tip"/>
    <joint name="j" type="{joint}"><parent link="base"/><child link="arm"/><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>
    <axis xyz="0.6 0 0.8"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
    <joint name="f" type="fixed"><parent link="arm"/><child link="tip"/></joint></robot>"""


@pytest.mark.parametrize("joint", ["revolute", "continuous"])
def test_a_urdf_link_turns_about_its_joint(written, joint):
    body = body_from_urdf(written(urdf(joint), "robot.urdf"), "arm")
    assert body.mass == MASS
    np.testing.assert_allclose(body.com_B, COM, atol=1e-15)  # measured 0
    np.testing.assert_allclose(body.inertia, about(COM, R_BI @ TENSOR_I @ R_BI.T), atol=1e-14)  # measured 6e-17


def test_the_root_of_a_urdf_is_free(written):
    body = body_from_urdf(written(urdf(), "robot.urdf"), "base")
    np.testing.assert_array_equal(body.com_B, np.zeros(3))
    np.testing.assert_allclose(body.inertia, np.diag([0.05, 0.06, 0.07]), atol=1e-16)


def test_a_urdf_link_includes_welded_links(written):
    text = urdf().replace(
        '<link name="tip"/>',
        f'<link name="tip">{SMALL}</link>',
    )
    weld = '<child link="tip"/><origin xyz="0.3 0.1 -0.2" rpy="0.3 -0.5 0.7"/></joint></robot>'
    body = body_from_urdf(written(text.replace('<child link="tip"/></joint></robot>', weld), "robot.urdf"), "arm")
    welded = about(np.array([0.3, 0.1, -0.2]), R_BI @ np.diag([0.05, 0.06, 0.07]) @ R_BI.T, 0.5)
    assert body.mass == pytest.approx(3.0, rel=1e-15)
    np.testing.assert_allclose(body.inertia, about(COM, R_BI @ TENSOR_I @ R_BI.T) + welded, atol=1e-14)  # measured 9e-16


SCENE = """t_end = 1.0
[body]
{kind} = "{file}"
name = "{name}"
{more}
[potential]
kind = "uniform_gravity"
g = 9.81
[start]
w_WB_B = [1, 2, 3]
"""


@pytest.mark.parametrize(("kind", "text", "lever"), [("mjcf", mjcf(JOINT + FULL[0]), COM - ANCHOR), ("urdf", urdf(), COM)])
def test_a_scene_file_takes_a_body_of_another_file_in_its_folder(written, tmp_path, kind, text, lever):
    written(text, f"robot.{kind}")
    scene = registry.scene(str(written(SCENE.format(kind=kind, file=f"robot.{kind}", name="arm", more=""), "my.toml")))
    tensor = TENSOR_I if kind == "mjcf" else R_BI @ TENSOR_I @ R_BI.T
    np.testing.assert_allclose(scene.body.inertia, about(lever, tensor), atol=1e-12)  # measured 7e-15
    np.testing.assert_allclose(scene.potential.moment_B, MASS * 9.81 * lever, rtol=1e-13)  # measured 2e-16
    path = written(SCENE.format(kind=kind, file=f"robot.{kind}", name="arm", more="com_B = [0, 0, 0.5]"), "my.toml")
    overridden = scene_file.load(path).body.inertia
    np.testing.assert_allclose(overridden, about(np.array([0, 0, 0.5]), tensor), atol=1e-12)  # measured 7e-15


def test_the_error_of_an_unknown_body_has_the_line_of_its_name(written):
    written(urdf(), "robot.urdf")
    path = written(SCENE.format(kind="urdf", file="robot.urdf", name="arn", more=""), "my.toml")
    with pytest.raises(cv.BadInput) as caught:
        scene_file.load(path)
    assert caught.value.argument == f"{path}, line 4: body.name"
    assert "'arn', which is not in" in caught.value.got
    assert "'arm' (nearest)" in caught.value.allowed


SLIDE = '<joint type="slide"/>'
APART = '<joint type="hinge"/><joint type="hinge" axis="1 0 0" pos="0 0 0.1"/>'
SDF = f"""<sdf version="1.11"><model name="m"><link name="base"/><link name="arm"><pose>1 2 3 0.1 0.2 0.3</pose><inertial>
<pose>{numbers(COM)} {numbers(RPY)}</pose><mass>{MASS}</mass><inertia><ixx>0.5</ixx><iyy>0.6</iyy><izz>0.7</izz><ixy>0.01</ixy>
<ixz>-0.02</ixz><iyz>0.03</iyz></inertia></inertial></link><joint name="j" type="ball"><pose>{numbers(ANCHOR)} 0 0 0</pose>
<parent>base</parent><child>arm</child></joint></model></sdf>"""
USD = f"""#usda 1.0
( metersPerUnit = 1 kilogramsPerUnit = 1 )
def Xform "arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
{{
    float physics:mass = {MASS}
    point3f physics:centerOfMass = ({", ".join(map(str, COM))})
    float3 physics:diagonalInertia = ({", ".join(map(str, MOMENTS))})
    quatf physics:principalAxes = ({", ".join(map(str, QUATERNION))})
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def PhysicsSphericalJoint "j"
{{
    rel physics:body1 = </arm>
    point3f physics:localPos1 = ({", ".join(map(str, ANCHOR))})
}}
""".replace("( metersPerUnit = 1 kilogramsPerUnit = 1 )", "(\n metersPerUnit = 1\n kilogramsPerUnit = 1\n)")


@pytest.mark.parametrize(("kind", "text", "name"), [("sdf", SDF, "arm"), ("usd", USD, "/arm")])
def test_sdf_and_usd_bodies_turn_about_their_joint(written, kind, text, name):
    """USD has single precision: measured 2e-8."""
    path = written(text, f"robot.{kind}{'a' * (kind == 'usd')}")
    scene = registry.scene(str(written(SCENE.format(kind=kind, file=path.name, name=name, more=""), "my.toml")))
    tensor = R_BI @ TENSOR_I @ R_BI.T if kind == "sdf" else TURNED[1]
    tolerance = 1e-14 if kind == "sdf" else 1e-6
    np.testing.assert_allclose(scene.potential.moment_B / (MASS * 9.81), COM - ANCHOR, atol=tolerance)
    np.testing.assert_allclose(scene.body.inertia, about(COM - ANCHOR, tensor), atol=tolerance)


def test_a_mesh_outside_the_folder_is_not_read(written, tmp_path):
    outside = tmp_path.parent / "outside.obj"
    outside.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    head = '<mujoco><asset><mesh name="m" file="{}outside.obj"/></asset>'
    text = mjcf(JOINT + '<geom type="mesh" mesh="m"/>').replace("<mujoco>", head)
    with pytest.raises(cv.BadInput, match=r"outside\.obj', which is outside"):
        body_from_mjcf(written(text.format("../")), "arm")
    (tmp_path / "outside.obj").write_text(outside.read_text())
    assert body_from_mjcf(written(text.format("")), "arm").mass == pytest.approx(1000 / 6)


BAD = {
    "mjcf: no file": (body_from_mjcf, None, "arm", "path", "No such file", "<mujoco>"),
    "mjcf: no XML": (body_from_mjcf, "hello", "arm", "path", "line 1", "<mujoco>"),
    "mjcf: a URDF": (body_from_mjcf, urdf(), "arm", "path", "root element <robot>", "<mujoco>"),
    "mjcf: not compiled": (body_from_mjcf, mjcf(JOINT), "arm", "name", "with a mass", "carrier"),
    "mjcf: unknown": (body_from_mjcf, mjcf(JOINT + FULL[0]), "amr", "name", "'amr', which is not in", "'arm' (nearest)"),
    "mjcf: world": (body_from_mjcf, mjcf(JOINT + FULL[0]), "world", "name", "'world'", "arm, carrier"),
    "mjcf: welded": (body_from_mjcf, mjcf(FULL[0]), "arm", "name", "which no joint turns", "a joint turns"),
    "mjcf: slides": (body_from_mjcf, mjcf(SLIDE + FULL[0]), "arm", "name", "which no joint turns", "a joint turns"),
    "mjcf: joints apart": (body_from_mjcf, mjcf(APART + FULL[0]), "arm", "name", "0.1 m apart", "through one point"),
    "urdf: no file": (body_from_urdf, None, "arm", "path", "No such file", "<robot>"),
    "urdf: no XML": (body_from_urdf, "<robot", "arm", "path", "line 1", "<robot>"),
    "urdf: an MJCF": (body_from_urdf, mjcf(JOINT), "arm", "path", "root element <mujoco>", "<robot>"),
    "urdf: unknown": (body_from_urdf, urdf(), "amr", "name", "'amr', which is not in", "'arm' (nearest)"),
    "urdf: welded": (body_from_urdf, urdf(), "tip", "name", "which no joint turns", "arm, base"),
    "urdf: slides": (body_from_urdf, urdf("prismatic"), "arm", "name", "which no joint turns", "a joint turns: base"),
    "urdf: no mass": (body_from_urdf, urdf(inertial=False), "arm", "name", "with a mass", "base"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input(written, tmp_path, case):
    read, text, name, argument, got, allowed = BAD[case]
    path = tmp_path / "no.xml" if text is None else written(text)
    with pytest.raises(cv.BadInput) as caught:
        read(path, name)
    assert caught.value.argument == argument
    assert got in caught.value.got
    assert allowed in caught.value.allowed


def test_loaders_are_registered():
    assert list(deferred_imports.list_entries(deferred_imports.BODY_FILES)) == ["mjcf", "sdf", "urdf", "usd"]
    assert deferred_imports.load_entry(deferred_imports.BODY_FILES, "kind of file", "mjcf") is body_from_mjcf
    with pytest.raises(cv.BadInput) as caught:
        deferred_imports.load_entry(deferred_imports.BODY_FILES, "kind of file", "urfd")
    assert (caught.value.argument, caught.value.got) == ("kind of file", "'urfd'")
    assert "'urdf' (nearest)" in caught.value.allowed


def test_reading_a_file_has_limits(written, monkeypatch):
    monkeypatch.setattr(readers, "python_worker", python_worker)
    monkeypatch.setattr(readers, "SECONDS", 1e-6)
    with pytest.raises(cv.BadInput, match="whose reading ended"):
        body_from_mjcf(written(mjcf(JOINT + FULL[0])), "arm")
