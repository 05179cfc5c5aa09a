"""Functions that several adapters share. They run in the environments of engines and import nothing of this package."""

import copy
import math
from functools import lru_cache, partial

import numpy as np

FIELDS = ("UniformGravity", "LinearSpring", "PointAttraction", "GravityGradient", "Turning")
"""All fields that the numbers of a run describe."""

FAR_PLACE, FAR_MASS = (1000.0, 200.0, 30.0), 3.0
"""Position, m, and mass, kg, of the far body in the description "world"."""

LATER = 1000.0
"""Initial time, s, in the description "time"."""

OTHER_MASS, OTHER_SIZE = 2.0, 2.0
"""Factors of the mass before it is set, in the description "mass", and of the size to which a body is scaled, in "scaled"."""

PER_BODY = ("body_mass", "body_subtreemass", "body_inertia", "body_ipos", "body_iquat", "body_invweight0", "dof_invweight0")
"""Arrays of a MuJoCo model that depend on the body."""


def sample(given, step, read):
    """Return the samples of an engine that is stepped from Python, by name: `read` returns them, `step` makes one step."""
    samples = []
    for n_steps in np.diff(given.steps, prepend=0).tolist():
        for _ in range(n_steps):
            step()
        samples.append({name: np.array(values, float) for name, values in read().items()})  # copies of an engine's own arrays
    return {name: np.array([values[name] for values in samples]) for name in samples[0]}


def stepped(given, start, step, read, convert=None):
    """Return the run of an engine that is stepped from Python, and its loop; `start` sets the initial state.

    For `read` see `sample`, whose samples `convert` maps to others.
    """

    def loop():
        start()
        for _ in range(given.n_steps):
            step()

    def run():
        start()
        samples = sample(given, step, read)
        return convert(samples) if convert else samples

    if len(given.steps) == 2:  # otherwise reading samples is a part of the loop
        run.loop = loop
    return run


def pack_field(given, moment=0.0):
    """Return the numbers of a field (22,) for `field_torque`; all are 0 if there is none.

    Uniform gravity is not included, unless its moment (3,), weight times centre of mass, N m, axes F, is given.
    """
    # A field has an anchor or a direction; the other one is 0.
    vector, point, stiffness = given.anchor + given.direction, given.point, given.stiffness
    if np.any(moment):
        vector, point, stiffness = np.array([0.0, 0.0, 1.0]), moment, -1.0
    rate = np.linalg.norm(given.turn)
    normal = given.turn / rate if rate else given.turn
    law = stiffness, given.stiffness * given.rest_length, given.strength
    return np.concatenate([vector, normal, [rate], point, law, given.gradient.ravel()])


def field_torque(field, R, t):
    """Return the torque of a field other than gravity about the fixed point, N m, axes F. Numba can compile it.

    `field` is from `pack_field`, R are the entries (9) of the attitude by rows, F to W, and t is the time, s.

        T = (stiffness - stiffness rest_length / d + strength / d^3) b x u + u x G u        u = R' a(t), d = |b - u|
    """
    a1, a2, a3, rate = field[0], field[1], field[2], field[6]
    if rate != 0.0:
        n1, n2, n3, c, s = field[3], field[4], field[5], math.cos(rate * t), math.sin(rate * t)
        along = (1.0 - c) * (n1 * a1 + n2 * a2 + n3 * a3)
        a1, a2, a3 = (
            c * a1 + s * (n2 * a3 - n3 * a2) + along * n1,
            c * a2 + s * (n3 * a1 - n1 * a3) + along * n2,
            c * a3 + s * (n1 * a2 - n2 * a1) + along * n3,
        )
    u1, u2, u3 = R[0] * a1 + R[3] * a2 + R[6] * a3, R[1] * a1 + R[4] * a2 + R[7] * a3, R[2] * a1 + R[5] * a2 + R[8] * a3
    b1, b2, b3, factor = field[7], field[8], field[9], field[10]
    if field[11] != 0.0 or field[12] != 0.0:
        over = 1.0 / math.sqrt((b1 - u1) ** 2 + (b2 - u2) ** 2 + (b3 - u3) ** 2)
        factor += (field[12] * over * over - field[11]) * over
    g1 = field[13] * u1 + field[14] * u2 + field[15] * u3
    g2 = field[16] * u1 + field[17] * u2 + field[18] * u3
    g3 = field[19] * u1 + field[20] * u2 + field[21] * u3
    return (
        factor * (b2 * u3 - b3 * u2) + u2 * g3 - u3 * g2,
        factor * (b3 * u1 - b1 * u3) + u3 * g1 - u1 * g3,
        factor * (b1 * u2 - b2 * u1) + u1 * g2 - u2 * g1,
    )


@lru_cache(maxsize=1)
def compile_torque():
    """Return `field_torque`, compiled where numba is installed."""
    try:
        from numba import njit
    except ImportError:
        return field_torque
    return njit(error_model="numpy")(field_torque)


@lru_cache(maxsize=1)
def compile_derivative():
    """Return a function derivative(out, t, y, body) for ODE solvers, compiled by numba.

    y is a quaternion (4), scalar first, and rates (3), axes F; body is the field (22) of `pack_field` and the moments (3).
    """
    from numba import njit

    torque = compile_torque()

    @njit(error_model="numpy")
    def derivative(out, t, y, body):
        q0, q1, q2, q3, w1, w2, w3 = y[0], y[1], y[2], y[3], y[4], y[5], y[6]
        # Of length 1: fields take roots, and the quaternion drifts with loose tolerances.
        s = 2.0 / (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
        R = (
            1.0 - s * (q2 * q2 + q3 * q3), s * (q1 * q2 - q0 * q3), s * (q1 * q3 + q0 * q2),
            s * (q1 * q2 + q0 * q3), 1.0 - s * (q1 * q1 + q3 * q3), s * (q2 * q3 - q0 * q1),
            s * (q1 * q3 - q0 * q2), s * (q2 * q3 + q0 * q1), 1.0 - s * (q1 * q1 + q2 * q2),
        )  # fmt: skip
        T1, T2, T3 = torque(body, R, t)
        J1, J2, J3 = body[22], body[23], body[24]
        out[0] = -0.5 * (q1 * w1 + q2 * w2 + q3 * w3)
        out[1] = 0.5 * (q0 * w1 + q2 * w3 - q3 * w2)
        out[2] = 0.5 * (q0 * w2 + q3 * w1 - q1 * w3)
        out[3] = 0.5 * (q0 * w3 + q1 * w2 - q2 * w1)
        out[4] = ((J2 - J3) * w2 * w3 + T1) / J1
        out[5] = ((J3 - J1) * w3 * w1 + T2) / J2
        out[6] = ((J1 - J2) * w1 * w2 + T3) / J3

    return derivative


def mujoco_moments(given):
    """Return the moments (3,). MuJoCo refuses a planar body if a moment exceeds the sum of the others by a rounding unit."""
    moments = given.moments_com
    return np.minimum(moments, np.roll(moments, 1) + np.roll(moments, 2))


def description_of(given):
    """Return the name of the description of the body, one of the adapter's `descriptions`; "" for the usual one."""
    return getattr(given, "description", "")


def rescaled(given, mass=1.0, length=1.0, inertia=1.0):
    """Return the numbers of the body with its mass, its centre of mass and its inertia multiplied by factors."""
    other = copy.copy(given)
    other.mass, other.com = given.mass * mass, given.com * length
    other.inertia_com, other.moments_com = given.inertia_com * inertia, given.moments_com * inertia
    return other


def halves(given):
    """Return the mass and the inertia (3, 3), kg m^2, of each part of the body: two if it has a fixed child."""
    share = (0.25, 0.75) if description_of(given) == "child" else (1.0,)
    return [(part * given.mass, part * given.inertia_com) for part in share]


def write_urdf(given):
    """Return the body as a URDF file, which has no joint to the world."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = given.inertia_com.tolist()
    place = " ".join(map(repr, given.com.tolist()))
    inertia = f'ixx="{xx!r}" ixy="{xy!r}" ixz="{xz!r}" iyy="{yy!r}" iyz="{yz!r}" izz="{zz!r}"'
    inertial = f'<origin xyz="{place}"/><mass value="{float(given.mass)!r}"/><inertia {inertia}/>'
    return f'<robot name="body"><link name="body"><inertial>{inertial}</inertial></link></robot>'


def _write_cube(given):
    """Return the body as a mesh, a cube of 2 m that is scaled along its axes, with a density, and the geom of the mesh.

    The inertia of a mesh is a product of the density and five lengths.
    """
    moments, vector = mujoco_moments(given), lambda values: " ".join(map(repr, values.tolist()))
    sides = np.sqrt(1.5 * (moments.sum() - 2 * moments) / given.mass)
    corners = " ".join(f"{x} {y} {z}" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1))
    density = float(given.mass / (8 * sides.prod()))
    mesh = f'<asset><mesh name="cube" vertex="{corners}" scale="{vector(sides)}"/></asset>'
    place = f'pos="{vector(given.com)}" quat="{vector(given.q_com)}"'
    return mesh, f'<geom type="mesh" mesh="cube" density="{density!r}" {place}/>'


def write_mjcf(given, option="", shape=""):
    """Return the body as an MJCF file, on a free joint or on a ball joint at the fixed point."""
    if description_of(given) == "mass":
        given = rescaled(given, mass=OTHER_MASS, inertia=OTHER_MASS)
    inertial = {"mass": np.array([given.mass]), "pos": given.com, "quat": given.q_com, "diaginertia": mujoco_moments(given)}
    attributes = " ".join(f'{name}="{" ".join(map(repr, values.tolist()))}"' for name, values in inertial.items())
    description, kind, asset = description_of(given), "free" if given.free else "ball", ""
    zero = 'damping="0" armature="0" frictionloss="0"' if description == "damping" else ""
    joint = f'<joint type="{kind}" {zero}/>'
    if description == "joints" and given.free:
        joint = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1")) + '<joint type="ball"/>'
    inertia = f"<inertial {attributes}/>"
    if description == "scaled":
        (asset, shape), inertia = _write_cube(given), ""
    inertia = f"<body>{inertia}</body>" if description == "child" else inertia
    x, y, z = FAR_PLACE
    inertial = f'<inertial pos="0 0 0" mass="{FAR_MASS:g}" diaginertia="3 4 5"/>'
    far = f'<body pos="{x:g} {y:g} {z:g}"><freejoint/>{inertial}</body>' if description == "world" else ""
    return f"""
        <mujoco>
          {option}{asset}
          <worldbody>
            {far}<body name="body">{joint}{inertia}{shape}</body>
          </worldbody>
        </mujoco>"""


def compile_models(bodies):
    """Return MuJoCo's models of the bodies, without contacts and constraints, and their gravities and arrays `PER_BODY`."""
    import mujoco

    flags = '<flag contact="disable" constraint="disable"/>'
    models = []
    for body in bodies:
        attributes = f'gravity="0 0 {-body.gravity!r}" integrator="{body.integrator}" timestep="{body.dt!r}"'
        models.append(mujoco.MjModel.from_xml_string(write_mjcf(body, f"<option {attributes}>{flags}</option>")))
    gravity = np.array([model.opt.gravity for model in models])
    return models, gravity, {name: np.array([getattr(model, name) for model in models]) for name in PER_BODY}


@lru_cache(maxsize=8)
def compile_jax(step, read):
    """Return a function of a model, a state and numbers of steps that JAX compiles: it returns the samples after the first.

    `step` maps a model and a state to the next state, and `read` maps a state to a sample. The function is compiled once for
    each number of samples, because the model and the numbers of steps are data.
    """
    import jax

    def march(model, state, counts):
        def advance(state, n_steps):
            state = jax.lax.fori_loop(0, n_steps, lambda _, state: step(model, state), state)
            return state, read(state)

        return jax.lax.scan(advance, state, counts)[1]

    return jax.jit(march)


def run_jax(given, step, read, model, start, first):
    """Return a run by `compile_jax` from a state, compiled. `first` has the arrays of the sample at the start, by name."""
    import jax

    march, counts = compile_jax(step, read), np.diff(given.steps).astype(np.int32)
    jax.block_until_ready(march(model, start, counts))

    def run():
        rest = march(model, start, counts)
        return {name: np.vstack([x, np.asarray(y, float)]) for (name, x), y in zip(first.items(), rest, strict=True)}

    return run


def record_warp(step):
    """Return a function that replays a step; the step itself if this version of Warp does not record on the CPU."""
    import warp

    try:
        with warp.ScopedCapture() as capture:
            step()
    except RuntimeError:
        return step
    return partial(warp.capture_launch, capture.graph)
