"""Small model files of the kinds that readers get wrong, with their bodies by formulas of tables.

A case is its name, the text of its file, and the body, or None where the format leaves it open. A body is summed up from second
moments C = integral of (x - c)(x - c)' dm, and an affine map takes C to A C A'. Nothing here uses a function of the package but
the class of the result.
"""

import math

import numpy as np

from conservative.references.model_files.pieces import Piece

I3 = np.eye(3)


class Solid:
    """Mass, centroid (3,) and second moments about it (3, 3) of a part."""

    def __init__(self, mass, centre, second):
        self.mass, self.centre, self.second = mass, np.array(centre, float), np.array(second, float)

    def mapped(self, A=I3, t=(0, 0, 0), mass=None):
        """The part after x -> A x + t, with the density after the map, or with a mass."""
        A = np.array(A, float)
        new = abs(np.linalg.det(A)) * self.mass if mass is None else mass
        return Solid(new, A @ self.centre + t, A @ self.second @ A.T * new / self.mass)

    def piece(self):
        return whole(self)


def whole(*parts):
    """The body of parts, as the class of the readers."""
    mass = sum(part.mass for part in parts)
    com = sum(part.mass * part.centre for part in parts) / mass
    second = sum(part.second + part.mass * np.outer(part.centre - com, part.centre - com) for part in parts)
    return Piece(float(mass), com, np.trace(second) * I3 - second)


def box(a, b, c, density=1.0):
    m = density * a * b * c
    return Solid(m, (0, 0, 0), m / 12 * np.diag([a * a, b * b, c * c]))


def sphere(r, density=1.0):
    m = density * 4 / 3 * math.pi * r**3
    return Solid(m, (0, 0, 0), m * r * r / 5 * I3)


def cylinder(r, h, density=1.0):
    m = density * math.pi * r * r * h
    return Solid(m, (0, 0, 0), m * np.diag([r * r / 4, r * r / 4, h * h / 12]))


def capsule(r, h, density=1.0):
    rod, ball = cylinder(r, h, density), sphere(r, density)
    ends = np.diag([0, 0, ball.mass * (h * h / 4 + 3 * h * r / 8)])
    return Solid(rod.mass + ball.mass, (0, 0, 0), rod.second + ball.second + ends)


def cone(r, h, density=1.0):
    m = density * math.pi * r * r * h / 3
    return Solid(m, (0, 0, -h / 4), m * np.diag([3 * r * r / 20, 3 * r * r / 20, 3 * h * h / 80]))


def tetrahedron(density=1.0):
    """The corner of the unit cube."""
    m = density / 6
    return Solid(m, (0.25, 0.25, 0.25), m / 80 * (4 * I3 - 1))


def plates(a, b, c, density=1.0):
    """The surface of a box, by its six faces."""
    faces = []
    for axis, sides in enumerate(((b, c), (a, c), (a, b))):
        m = density * sides[0] * sides[1]
        thin = np.insert(np.square(sides), axis, 0.0) / 12
        for sign in (-1, 1):
            faces.append(Solid(m, sign * I3[axis] * (a, b, c)[axis] / 2, m * np.diag(thin)))
    return faces


def turn(axis, degrees):
    """The rotation about an axis (3,), by the formula of Rodrigues."""
    x, y, z = np.array(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees)
    return I3 + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


X, Y, Z = I3
AXES = {"X": X, "Y": Y, "Z": Z}


def about(axis, degrees):
    """A quaternion, scalar first."""
    half = math.radians(degrees) / 2
    return [math.cos(half), *(math.sin(half) * np.array(axis, float) / np.linalg.norm(axis)).tolist()]


def words(values):
    return " ".join(repr(float(value)) for value in values)


def row(values):
    return "(" + ", ".join(repr(float(value)) for value in values) + ")"


# ------------------------------------------------------------------------------------------------------------------------- USD

HEAD = "#usda 1.0\n(\n metersPerUnit = {}\n kilogramsPerUnit = {}\n)\n"
BODY, MASS, COLLIDER = "PhysicsRigidBodyAPI", "PhysicsMassAPI", "PhysicsCollisionAPI"


def prim(kind, name, apis, *lines):
    used = f" (prepend apiSchemas = [{', '.join(map(repr, apis))}])".replace("'", '"') if apis else ""
    inside = "\n".join(lines)
    return f'def {kind} "{name}"{used}\n{{\n{inside}\n}}\n'


def placed(*ops):
    """The operations of a prim, as (type and name, type of USD, value)."""
    order = ", ".join(f'"{name}"' if name.startswith("!") else f'"xformOp:{name}"' for name, *_ in ops)
    lines = [f"{kind} xformOp:{name} = {value}" for name, kind, value in (op for op in ops if len(op) == 3)]
    return "\n".join([*lines, f"uniform token[] xformOpOrder = [{order}]"])


def move(*t):
    return ("translate", "double3", row(t))


def size(*s):
    return ("scale", "double3", row(s))


def usd(*inside, apis=(BODY, MASS), units=(1, 1), around=("", "")):
    return HEAD.format(*units) + around[0] + prim("Xform", "b", apis, *inside) + around[1]


def cube(*lines, name="c", apis=(COLLIDER, MASS), kind="Cube"):
    sizes = {"Cube": "double size = 1", "Sphere": "double radius = 1"}
    return prim(kind, name, apis, sizes.get(kind, 'double radius = 0.4\ndouble height = 1.2\nuniform token axis = "Z"'), *lines)


DENSE = "float physics:density = 500"
S, T = (0.2, 0.3, 0.5), (0.1, -0.2, 0.3)
POINTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def prism(outline, height):
    """The points and faces of a prism over an outline that turns left, from z = 0 on."""
    n = len(outline)
    points = [(x, y, z) for z in (0, height) for x, y in outline]
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return points, sides


ELL = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
"""The outline of an L of three unit squares. Its lid is two rectangles."""
ELL_POINTS, ELL_SIDES = prism(ELL, 1)
ELL_FACES = [*ELL_SIDES, (3, 2, 1, 0), (5, 4, 3, 0), (6, 7, 8, 9), (6, 9, 10, 11)]
ELL_PARTS = [box(1, 1, 1).mapped(t=(x + 0.5, y + 0.5, 0.5)) for x, y in ((0, 0), (1, 0), (0, 1))]


def mesh(points, faces, *lines):
    return prim(
        "Mesh",
        "c",
        (COLLIDER, MASS, "PhysicsMeshCollisionAPI"),
        f"point3f[] points = [{', '.join(map(row, points))}]",
        f"int[] faceVertexCounts = [{', '.join(str(len(face)) for face in faces)}]",
        f"int[] faceVertexIndices = [{', '.join(str(corner) for face in faces for corner in face)}]",
        *lines,
    )


HEAVY = 500.0
PLAIN = box(1, 1, 1, HEAVY)
STRETCH = placed(move(*T), size(*S))
R = turn((1, 2, -1), 40)
QUATERNION = np.array(about((1, 2, -1), 40))
GIVEN = (
    "float physics:mass = 2",
    f"point3f physics:centerOfMass = {row(T)}",
    "float3 physics:diagonalInertia = (1, 2, 2.5)",
)
"""Mass, centre and moments of a body."""


def inside(*ops):
    """What is before and after a body within another prim."""
    return prim("Xform", "p", (), placed(*ops), "%s").split("%s")


def usd_turns():
    for order in ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"):  # the first axis turns first
        angles = dict(zip("XYZ", (20, -50, 70), strict=True))
        turned = I3
        for axis in order:
            turned = turn(AXES[axis], angles[axis]) @ turned
        ops = placed(move(*T), (f"rotate{order}", "float3", row(angles.values())), size(*S))
        yield f"rotate{order}", usd(cube(DENSE, ops)), PLAIN.mapped(turned * S, T)
    for axis, direction in AXES.items():
        ops = placed(move(*T), (f"rotate{axis}", "float", "35"), size(*S))
        yield f"rotate{axis}", usd(cube(DENSE, ops)), PLAIN.mapped(turn(direction, 35) * S, T)
    for kind in ("quatf", "quatd"):
        ops = placed(move(*T), ("orient", kind, row(QUATERNION)), size(*S))
        yield f"orient {kind}", usd(cube(DENSE, ops)), PLAIN.mapped(R * S, T)
    ops = placed(move(*T), ("orient", "quatd", row(2 * QUATERNION)), size(*S))
    yield "orient of norm 2", usd(cube(DENSE, ops)), None
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = (R * S).T, T
    ops = placed(("transform", "matrix4d", "(" + ", ".join(map(row, matrix)) + ")"))
    yield "transform", usd(cube(DENSE, ops)), PLAIN.mapped(R * S, T)


def usd_parents():
    pivot = np.array((0.3, 0.1, -0.2))
    ops = placed(
        move(*T),
        ("translate:pivot", "double3", row(pivot)),
        ("rotateXYZ", "float3", "(0, 0, 90)"),
        size(*S),
        ("!invert!xformOp:translate:pivot",),
    )
    A = turn(Z, 90) * S
    yield "pivot", usd(cube(DENSE, ops)), PLAIN.mapped(A, T + pivot - A @ pivot)
    ops = placed(("!resetXformStack!",), move(*T), size(*S))
    yield "reset", usd(placed(move(1, 2, 3)), cube(DENSE, ops)), PLAIN.mapped(np.diag(S), np.array(T) - (1, 2, 3))
    ops = placed(move(*T), ("rotateX", "float", "30"), size(*S))
    inner = PLAIN.mapped(turn(X, 30) * S, T)
    parent = inside(move(7, 8, 9), ("rotateZ", "float", "80"))
    own = placed(move(1, 2, 3), ("rotateXYZ", "float3", "(10, 20, 30)"))
    yield "placed body and parent", usd(own, cube(DENSE, ops), around=parent), inner
    parent = inside(("rotateZ", "float", "80"), size(2, 2, 2))
    yield "parent twice as large", usd(own, cube(DENSE, ops), around=parent), inner.mapped(2 * I3)
    parent = inside(size(1, 2, 3))
    ops = placed(move(*T), size(*S))
    stretched = PLAIN.mapped(np.diag(S), T).mapped(np.diag((1, 2, 3)))
    yield "parent stretched", usd(cube(DENSE, ops), around=parent), stretched
    yield "centre of a stretched body", usd(*GIVEN, around=parent), Piece(2.0, np.multiply(T, (1, 2, 3)), np.diag([1, 2, 2.5]))
    groups = prim("Scope", "s", (), prim("Xform", "x", (), placed(move(*T)), prim("Scope", "t", (), cube(DENSE))))
    yield "scopes", usd(groups), PLAIN.mapped(t=T)


def usd_mirrors():
    for s in ((-1, 2, 3), (1, -2, 3), (1, 2, -3), (-1, -2, 3), (-1, -2, -3)):
        for what, solid, made in (
            ("box", PLAIN, cube(DENSE, placed(move(*T), ("rotateX", "float", "30"), size(*s)))),
            (
                "mesh",
                tetrahedron(HEAVY),
                mesh(POINTS, FACES, DENSE, placed(move(*T), ("rotateX", "float", "30"), size(*s))),
            ),
        ):
            yield f"{what} mirrored {words(s)}", usd(made), solid.mapped(turn(X, 30) * s, T)
    for kind, solid in (
        ("Sphere", sphere(1, HEAVY)),
        ("Cylinder", cylinder(0.4, 1.2, HEAVY)),
        ("Capsule", capsule(0.4, 1.2, HEAVY)),
        ("Cone", cone(0.4, 1.2, HEAVY)),
    ):
        for s in ((-2, 2, 2), (2, 2, -2)):
            drawn = None if kind == "Cone" else solid.mapped(np.diag(s), T)  # usd-core turns a mirrored cone upside down
            made = cube(DENSE, placed(move(*T), size(*s)), kind=kind)
            yield f"{kind} mirrored {words(s)}", usd(made), drawn
        if kind != "Sphere":
            made = cube(DENSE, placed(move(*T)), kind=kind).replace('"Z"', '"X"')
            onto_x = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]])
            yield f"{kind} along X", usd(made), solid.mapped(onto_x, T)
        yield f"{kind} stretched across its axis", usd(cube(DENSE, placed(size(1, 2, 1)), kind=kind)), None
    yield "mirrored body", usd(placed(size(-1, 1, 1)), *GIVEN), None
    mirror = inside(("rotateX", "float", "30"), size(1, 1, -1))
    yield "mirrored parent", usd(cube(DENSE, STRETCH), around=mirror), None
    shear = prim("Xform", "s", (), placed(size(1, 2, 3)), cube(DENSE, placed(("rotateX", "float", "30"))))
    yield "sheared collider", usd(shear), None


def usd_values():
    for metre, kilogram in ((0.01, 1), (1, 0.001), (0.01, 0.001), (0.0254, 0.4536)):
        made = usd(cube(DENSE, placed(move(*T), size(*S))), units=(metre, kilogram))
        solid = PLAIN.mapped(np.diag(S), T)
        yield (
            f"units {metre} {kilogram}",
            made,
            Solid(solid.mass * kilogram, solid.centre * metre, solid.second * kilogram * metre**2),
        )
        made = usd(cube(placed(move(*T), size(*S))), units=(metre, kilogram))
        yield (
            f"default density, units {metre} {kilogram}",
            made,
            box(1, 1, 1, 1000).mapped(metre * np.diag(S), metre * np.array(T)),
        )
    ops = STRETCH
    seen = PLAIN.mapped(np.diag(S), T)
    mass, density = "float physics:mass = {}", "float physics:density = {}"
    for value in ("-1", "0", "-0.0"):
        yield f"mass {value} of the body", usd(mass.format(value), DENSE, cube(ops)), seen
        yield f"mass {value} of the collider", usd(cube(mass.format(value), DENSE, ops)), seen
        yield f"density {value} of the collider", usd(DENSE, cube(density.format(value), ops)), seen
    yield "mass and density", usd(mass.format(3), DENSE, cube(ops)), seen.mapped(mass=3.0)
    yield "mass and density of the collider", usd(cube(mass.format(3), DENSE, ops)), seen.mapped(mass=3.0)
    yield "density of both", usd(density.format(9), cube(DENSE, ops)), seen
    yield "no moments", usd("float3 physics:diagonalInertia = (0, 0, 0)", cube(DENSE, ops)), seen
    yield "no centre", usd("point3f physics:centerOfMass = (-inf, -inf, -inf)", cube(DENSE, ops)), seen
    axes = "quatf physics:principalAxes = {}"
    moments = np.diag([1, 2, 2.5])
    yield "no axes", usd(*GIVEN, axes.format("(0, 0, 0, 0)")), Piece(2.0, np.array(T), moments)
    turned = Piece(2.0, np.array(T), R @ moments @ R.T)
    yield "axes", usd(*GIVEN, axes.format(row(QUATERNION))), turned
    yield "axes of norm 2", usd(*GIVEN, axes.format(row(2 * QUATERNION))), turned
    off = cube("bool physics:collisionEnabled = 0", mass.format(9), name="d")
    yield "a collider that is off", usd(cube(DENSE, ops), off), seen
    below = prim("Xform", "e", (BODY,), "bool physics:rigidBodyEnabled = 0", placed(move(2, 0, 0)), cube(DENSE))
    yield "a body below that is off", usd(cube(DENSE, ops), below), whole(seen, PLAIN.mapped(t=(2, 0, 0)))
    deep = prim(
        "Xform", "e", (BODY,), "bool physics:rigidBodyEnabled = 0", prim("Xform", "f", (), placed(move(2, 0, 0)), cube(DENSE))
    )
    yield "deep below a body that is off", usd(cube(DENSE, ops), deep), whole(seen, PLAIN.mapped(t=(2, 0, 0)))
    # Attributes of schemas that the prim does not have.
    bare = cube(mass.format(9), ops, apis=(COLLIDER,))
    yield "mass without its schema", usd(DENSE, bare), seen
    yield "mass of the body without its schema", usd(mass.format(9), cube(DENSE, ops), apis=(BODY,)), seen
    bound = "rel material:binding = </b/m>"
    for name, apis, value, rho in (
        ("of the material", ("PhysicsMaterialAPI",), 500, 500),
        ("-500 of the material", ("PhysicsMaterialAPI",), -500, 1000),
        ("without the schema of the material", (), 500, 1000),
    ):
        material = prim("Material", "m", apis, density.format(value))
        made = cube(bound, ops, apis=(COLLIDER, MASS, "MaterialBindingAPI"))
        yield f"density {name}", usd(material, made), box(1, 1, 1, rho).mapped(np.diag(S), T)
    # Two bodies on a fixed joint.
    arm = prim("Xform", "arm", (BODY, MASS), DENSE, placed(move(2, 0, 0), ("rotateZ", "float", "90")), cube(ops))
    ends = "rel physics:body0 = </b>\nrel physics:body1 = </arm>\npoint3f physics:localPos0 = {}"
    turned = f"quatf physics:localRot0 = {row(about(Z, 90))}"
    both = whole(seen, seen.mapped(turn(Z, 90), (2, 0, 0)))
    for name, place, lines, body in (
        ("fixed joint", "(2, 0, 0)", (turned, "point3f physics:localPos1 = (0, 0, 0)"), both),
        ("fixed joint with frames apart", "(2, 0.1, 0)", (turned, "point3f physics:localPos1 = (0, 0, 0)"), None),
        ("fixed joint with axes apart", "(2, 0, 0)", ("point3f physics:localPos1 = (0, 0, 0)",), None),
    ):
        joint = prim("PhysicsFixedJoint", "j", (), ends.format(place), *lines)
        yield name, usd(DENSE, cube(ops), around=("", arm + joint)), body


def usd_meshes():
    ops = STRETCH
    yield "mesh", usd(mesh(POINTS, FACES, DENSE, ops)), tetrahedron(HEAVY).mapped(np.diag(S), T)
    yield (
        "mesh inside out",
        usd(mesh(POINTS, [face[::-1] for face in FACES], DENSE, ops)),
        tetrahedron(HEAVY).mapped(np.diag(S), T),
    )
    yield "mesh of squares", usd(mesh(CUBE, QUADS, DENSE)), PLAIN.mapped(t=(0.5, 0.5, 0.5))
    apart = [POINTS[corner] for face in FACES for corner in face]
    loose = [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(4)]
    yield "mesh of loose triangles", usd(mesh(apart, loose, DENSE)), tetrahedron(HEAVY)
    yield (
        "mesh and its convex hull",
        usd(mesh(POINTS, FACES, DENSE, 'uniform token physics:approximation = "convexHull"')),
        tetrahedron(HEAVY),
    )
    yield "open mesh", usd(mesh(POINTS, FACES[1:], DENSE)), None
    yield "mesh that is not convex", usd(mesh(ELL_POINTS, ELL_FACES, DENSE)), None
    yield (
        "hull of a mesh that is not convex",
        usd(mesh(ELL_POINTS, ELL_FACES, DENSE, 'uniform token physics:approximation = "convexHull"')),
        None,
    )
    yield "box around a mesh", usd(mesh(POINTS, FACES, DENSE, 'uniform token physics:approximation = "boundingCube"')), None


# ------------------------------------------------------------------------------------------------------------------------ MJCF


def mjcf(*inside, head=""):
    return f'<mujoco model="m">{head}<worldbody><body name="b"><freejoint/>{"".join(inside)}</body></worldbody></mujoco>'


POS = f'pos="{words(T)}"'
GEOM = f'<geom type="box" size="{words(np.divide(S, 2))}" density="500" {POS} {{}}/>'
BRICK = box(*S, 500)
"""A geometry with places for further attributes, and its part in its own axes."""


def mjcf_turns():
    yield "quaternion", mjcf(GEOM.format(f'quat="{words(QUATERNION)}"')), BRICK.mapped(R, T)
    yield "quaternion of norm 3", mjcf(GEOM.format(f'quat="{words(3 * QUATERNION)}"')), BRICK.mapped(R, T)
    yield "axis of norm 3", mjcf(GEOM.format('axisangle="3 6 -3 40"')), BRICK.mapped(R, T)
    yield (
        "radians",
        mjcf(GEOM.format(f'axisangle="1 2 -1 {math.radians(40)!r}"'), head='<compiler angle="radian"/>'),
        BRICK.mapped(R, T),
    )
    skewed = R[:, 1] + 0.3 * R[:, 0]
    yield (
        "axes that are not at right angles",
        mjcf(GEOM.format(f'xyaxes="{words([*(2 * R[:, 0]), *skewed])}"')),
        BRICK.mapped(R, T),
    )
    yield "z axis", mjcf(GEOM.format('zaxis="0 3 0"')), BRICK.mapped(turn(X, -90), T)
    yield "z axis down", mjcf(GEOM.format('zaxis="0 0 -1"')), BRICK.mapped(turn(X, 180), T)
    for sequence in ("xyz", "XYZ", "zyx", "ZYX", "xzX"):
        turned = I3
        for letter, angle in zip(sequence, (20, -50, 70), strict=True):
            step = turn(AXES[letter.upper()], angle)
            turned = turned @ step if letter.islower() else step @ turned
        head = f'<compiler eulerseq="{sequence}"/>'
        yield f"euler {sequence}", mjcf(GEOM.format('euler="20 -50 70"'), head=head), BRICK.mapped(turned, T)
    frame = f'<frame pos="1 2 3" axisangle="0 0 1 90"><frame euler="30 0 0">{GEOM.format("")}</frame></frame>'
    yield "frames", mjcf(frame), BRICK.mapped(t=T).mapped(turn(X, 30)).mapped(turn(Z, 90), (1, 2, 3))
    lower = f'<body name="c" pos="1 2 3" axisangle="0 0 1 90">{GEOM.format("")}</body>'
    yield (
        "fixed body",
        mjcf(GEOM.format(""), lower),
        whole(BRICK.mapped(t=T), BRICK.mapped(t=T).mapped(turn(Z, 90), (1, 2, 3))),
    )
    framed = f'<frame euler="30 0 0">{lower}</frame>'
    both = whole(BRICK.mapped(t=T), BRICK.mapped(t=T).mapped(turn(Z, 90), (1, 2, 3)).mapped(turn(X, 30)))
    yield "fixed body in a frame", mjcf(GEOM.format(""), framed), both


def mjcf_classes():
    classes = f'<default><geom density="500"/><default class="p"><geom type="box" size="{words(np.divide(S, 2))}"/>'
    classes += '<default class="q"><geom size="0.3" mass="2"/></default></default></default>'
    yield "class", mjcf(f'<geom class="p" {POS}/>', head=classes), BRICK.mapped(t=T)
    part = box(0.6, S[1], S[2]).mapped(t=T, mass=2.0)
    yield "class within a class", mjcf(f'<geom class="q" {POS}/>', head=classes), part
    inside = f'<frame childclass="p"><geom {POS}/><geom class="q" {POS}/></frame>'
    yield "class of a frame", mjcf(inside, head=classes), whole(BRICK.mapped(t=T), part)


def mjcf_shapes():
    ends = np.array((0.1, -0.2, 0.3)), np.array((0.4, 0.2, 0.3))
    length = float(np.linalg.norm(ends[1] - ends[0]))
    to_x = np.column_stack([(0, 0, 1), (0.8, -0.6, 0), (0.6, 0.8, 0)])  # z becomes the direction of the ends
    middle = (ends[0] + ends[1]) / 2
    for kind, solid in (
        ("capsule", capsule(0.1, length, 1000)),
        ("cylinder", cylinder(0.1, length, 1000)),
        ("ellipsoid", sphere(1, 1000).mapped(np.diag((0.1, 0.1, length / 2)))),
    ):
        geom = f'<geom type="{kind}" size="0.1" fromto="{words([*ends[0], *ends[1]])}"/>'
        yield f"{kind} from to", mjcf(geom), solid.mapped(to_x, middle)


def mjcf_shells():
    geom = '<geom type="{}" size="{}" {} shellinertia="true" pos="0.1 0 0" axisangle="0 0 1 90"/>'
    a, b, c = 0.2, 0.4, 0.6
    shells = {
        "box": ("0.1 0.2 0.3", plates(a, b, c)),
        "sphere": ("0.1", [Solid(4 * math.pi * 0.01, (0, 0, 0), 4 * math.pi * 0.01 * 0.01 / 3 * I3)]),
    }
    side, end = 2 * math.pi * 0.1 * 0.4, math.pi * 0.01
    discs = [Solid(end, (0, 0, z), end * 0.01 / 4 * np.diag([1, 1, 0])) for z in (-0.2, 0.2)]
    tube = Solid(side, (0, 0, 0), side * np.diag([0.005, 0.005, 0.16 / 12]))
    # A half of a spherical surface: the centroid at r/2, second moments r^2/3 about the centre.
    caps = [Solid(2 * end, (0, 0, sign * 0.25), 2 * end * (0.01 / 3 * I3 - np.diag([0, 0, 0.0025]))) for sign in (-1, 1)]
    shells |= {"cylinder": ("0.1 0.2", [tube, *discs]), "capsule": ("0.1 0.2", [tube, *caps])}
    for kind, (sizes, parts) in shells.items():
        moved = [part.mapped(turn(Z, 90), (0.1, 0, 0)) for part in parts]
        area = sum(part.mass for part in parts)
        yield (
            f"shell of a {kind}",
            mjcf(geom.format(kind, sizes, 'density="7"')),
            whole(*[Solid(7 * p.mass, p.centre, 7 * p.second) for p in moved]),
        )
        scale = 2 / area
        yield (
            f"shell of a {kind} with a mass",
            mjcf(geom.format(kind, sizes, 'mass="2"')),
            whole(*[Solid(scale * p.mass, p.centre, scale * p.second) for p in moved]),
        )
    yield "shell of an ellipsoid", mjcf(geom.format("ellipsoid", "0.1 0.2 0.3", 'density="7"')), None


def mjcf_meshes():
    corners = words(np.ravel(POINTS))
    asset = '<asset><mesh name="t" vertex="{}" {}/></asset>'
    use = f'<geom type="mesh" mesh="t" density="500" {POS}/>'
    tetra = tetrahedron(500)
    yield "mesh without faces", mjcf(use, head=asset.format(corners, "")), tetra.mapped(t=T)
    faces = 'face="' + " ".join(str(corner) for face in FACES for corner in face) + '" '
    yield "mesh", mjcf(use, head=asset.format(corners, faces)), tetra.mapped(t=T)
    yield "mesh stretched", mjcf(use, head=asset.format(corners, faces + 'scale="1 2 3"')), tetra.mapped(np.diag((1, 2, 3)), T)
    yield "mesh mirrored", mjcf(use, head=asset.format(corners, faces + 'scale="-1 2 3"')), tetra.mapped(np.diag((-1, 2, 3)), T)
    triangles = [(f[0], f[k], f[k + 1]) for f in ELL_FACES for k in range(1, len(f) - 1)]
    ell = 'face="' + " ".join(str(corner) for face in triangles for corner in face) + '" inertia="exact"'
    exact = [Solid(500 * p.mass, p.centre + T, 500 * p.second) for p in ELL_PARTS]
    yield "mesh that is not convex", mjcf(use, head=asset.format(words(np.ravel(ELL_POINTS)), ell)), whole(*exact)
    legacy = ell.replace("exact", "legacy")
    yield "mesh by the old rule", mjcf(use, head=asset.format(words(np.ravel(ELL_POINTS)), legacy)), None
    squares = [(f[0], f[k], f[k + 1]) for f in QUADS for k in (1, 2)]
    skin = 'face="' + " ".join(str(corner) for face in squares for corner in face) + '" inertia="shell"'
    surface = [Solid(500 * p.mass, p.centre + 0.5 + T, 500 * p.second) for p in plates(1, 1, 1)]
    yield "mesh as a shell", mjcf(use, head=asset.format(words(np.ravel(CUBE)), skin)), whole(*surface)


def mjcf_options():
    other = f'<geom size="0.3" {POS} {{}}/>'
    yield "mass 0", mjcf(GEOM.format(""), other.format('mass="0"')), BRICK.mapped(t=T)
    yield "density 0", mjcf(GEOM.format(""), other.format('density="0"')), BRICK.mapped(t=T)
    yield "mass before density", mjcf(GEOM.format('mass="3"')), BRICK.mapped(t=T, mass=3.0)
    yield (
        "group",
        mjcf(GEOM.format(""), other.format('group="4"'), head='<compiler inertiagrouprange="0 3"/>'),
        BRICK.mapped(t=T),
    )
    yield "total mass", mjcf(GEOM.format(""), head='<compiler settotalmass="3"/>'), BRICK.mapped(t=T, mass=3.0)
    full = '<inertial mass="2" pos="0.1 -0.2 0.3" fullinertia="1 2 2.5 0.1 -0.2 0.3"/>'
    tensor = np.array([[1, 0.1, -0.2], [0.1, 2, 0.3], [-0.2, 0.3, 2.5]])
    yield "full inertia before shapes", mjcf(full, GEOM.format("")), Piece(2.0, np.array(T), tensor)
    yield "shapes before inertia", mjcf(full, GEOM.format(""), head='<compiler inertiafromgeom="true"/>'), BRICK.mapped(t=T)
    turned = f'<inertial mass="2" {POS} quat="{words(2 * QUATERNION)}" diaginertia="1 2 2.5"/>'
    yield "inertial quaternion of norm 2", mjcf(turned), Piece(2.0, np.array(T), R @ np.diag([1, 2, 2.5]) @ R.T)


# ---------------------------------------------------------------------------------------------------------------- URDF and SDF


def urdf(origin, version="", child=""):
    inertia = '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="-0.2" iyz="0.3"/>'
    link = '<link name="{}"><inertial>' + origin + f'<mass value="2"/>{inertia}</inertial></link>'
    return f'<robot name="r"{version}>{link.format("a")}{link.format("c") + child if child else ""}</robot>'


def sdf(pose, link=""):
    values = zip(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (1, 2, 2.5, 0.1, -0.2, 0.3), strict=True)
    inertia = "".join(f"<{name}>{value}</{name}>" for name, value in values)
    inertial = f"<inertial>{pose}<mass>2</mass><inertia>{inertia}</inertia></inertial>"
    return f'<sdf version="1.11"><model name="m"><link name="a">{link}{inertial}</link></model></sdf>'


def xml_cases():
    tensor = np.array([[1, 0.1, -0.2], [0.1, 2, 0.3], [-0.2, 0.3, 2.5]])
    second = np.trace(tensor) / 2 * I3 - tensor
    part = Solid(2.0, (0, 0, 0), second)
    fixed = turn(Z, 70) @ turn(Y, -50) @ turn(X, 20)
    rpy = words(np.radians((20, -50, 70)))
    origin = f'<origin xyz="{words(T)}" rpy="{rpy}"/>'
    turned = part.mapped(fixed, T)
    yield "rpy.urdf", urdf(origin), turned
    joint = f'<joint name="j" type="fixed"><origin xyz="1 2 3" rpy="{rpy}"/><parent link="a"/><child link="c"/></joint>'
    yield "fixed.urdf", urdf(origin, child=joint), whole(turned, turned.mapped(fixed, (1, 2, 3)))
    last = words(np.roll(3 * QUATERNION, -1))
    yield (
        "quaternion of norm 3.urdf",
        urdf(f'<origin xyz="{words(T)}" quat_xyzw="{last}"/>', ' version="1.1"'),
        part.mapped(R, T),
    )
    yield (
        "half turns.urdf",
        urdf(f'<origin xyz="{words(T)}" rpy="{words((math.pi, 0, math.pi))}"/>'),
        part.mapped(np.diag([-1, 1, -1]), T),
    )
    yield "rpy.sdf", sdf(f"<pose>{words(T)} {rpy}</pose>"), turned
    yield "degrees.sdf", sdf(f'<pose degrees="true">{words(T)} 20 -50 70</pose>'), turned
    yield "quaternion of norm 3.sdf", sdf(f'<pose rotation_format="quat_xyzw">{words(T)} {last}</pose>'), part.mapped(R, T)
    yield "placed.sdf", sdf(f"<pose>{words(T)} {rpy}</pose>", "<pose>4 5 6 1 2 3</pose>"), turned


def all_cases():
    """All cases by the name of the file: the text, and the body or None."""
    of_usd = usd_turns, usd_parents, usd_mirrors, usd_values, usd_meshes
    of_mjcf = mjcf_turns, mjcf_classes, mjcf_shapes, mjcf_shells, mjcf_meshes, mjcf_options
    cases = {f"{name}.usda": case for made in of_usd for name, *case in made()}
    cases |= {f"{name}.xml": case for made in of_mjcf for name, *case in made()}
    cases |= {name: case for name, *case in xml_cases()}
    return {
        name.replace(" ", "_"): (text, body.piece() if isinstance(body, Solid) else body)
        for name, (text, body) in cases.items()
    }
