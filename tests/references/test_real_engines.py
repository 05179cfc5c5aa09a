"""Real engines in their environments, on the brick: their errors and orders are those of a plain script that calls them.

The figures were measured with such scripts, one for each engine, against 40 digits.
"""

import numpy as np
import pytest

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion
from conservative.references.environments.install import install
from conservative.references.environments.lock import Source

ENERGY_GROWS = (2.98, 0.22, 0.11, None)
"""Of semi-implicit Euler: attitude error, rad, relative changes of energy and momentum at dt = 0.01, and order."""
ENERGY_DECAYS = (2.9, -0.17, 0.09, None)
ROWS = {
    ("mujoco==3.6.0", "Euler"): ENERGY_GROWS,
    ("mujoco==3.6.0", "implicit"): ENERGY_DECAYS,
    ("mujoco==3.6.0", "implicitfast"): ENERGY_GROWS,
    ("mujoco==3.6.0", "RK4"): (1.6e-3, -2e-8, 1.6e-5, 2),
    ("mujoco==4.0.0", "RK4"): (1.3e-6, -2e-8, 7.7e-7, 4),
    ("mujoco==4.0.0", "implicitfast"): ENERGY_DECAYS,
    ("exudyn", "RK44"): (1.3e-6, -2e-8, 8e-7, 4),
    ("exudyn", "RK67"): (3e-10, None, None, 6),
    ("exudyn", "ExplicitMidpoint"): (None, None, None, 2),
    ("exudyn", "GeneralizedAlpha"): (2.1e-3, -1e-6, 5e-4, 2),
    ("bsk", "RK4"): (2.3e-6, -2e-8, 1e-6, 4),
    ("bsk", "RKF78"): (9e-13, None, None, None),
    ("drake", "discrete"): ENERGY_GROWS,
    ("drake", "runge_kutta3"): (3.0, 2e-4, 3e-4, None),
    ("drake", "runge_kutta5"): (1.1e-4, 7e-9, 1e-8, 5),
    ("drake", "runge_kutta3,1e-10"): (1e-6, None, None, None),
    ("diffrax", "Tsit5"): (2.8e-9, None, None, 5),
    ("orekit", ""): (2e-12, None, None, None),
    ("sapien", ""): (2.3e-2, 3e-4, 1e-2, None),
    ("sapien", "as_installed=true"): (None, -0.45, None, None),
    ("dart", ""): ENERGY_GROWS,
    ("pybullet", ""): ENERGY_GROWS,
    ("pybullet", "maximal"): ENERGY_DECAYS,
    ("pybullet", "as_installed=true"): (None, -0.94, None, None),
    ("mjx", "Euler"): ENERGY_GROWS,
    ("mjx", "RK4"): (1.6e-3, -2e-8, 2e-5, 2),
    ("mjx", "RK4,f32"): (None, None, None, None),
    ("rapier3d", ""): (3.8e-2, 4e-4, 6e-3, None),
    ("mjwarp", "Euler"): ENERGY_GROWS,
    ("mjwarp", "RK4"): (4.4e-4, None, None, None),
    ("mjwarp", "implicitfast"): ENERGY_DECAYS,
    ("newton", "SemiImplicit"): ENERGY_GROWS,
    ("newton", "SemiImplicit,as_installed=true"): (0.35, -0.35, 0.19, None),
    ("newton", "XPBD"): ENERGY_GROWS,
    ("newton", "Featherstone"): ENERGY_GROWS,
    ("newton", "VBD"): (2.8, -0.45, 0.26, None),
    ("newton", "Kamino"): (3.3e-2, -1.2e-5, 1.1e-2, None),
    ("newton", "MuJoCo_euler"): ENERGY_GROWS,
    ("newton", "MuJoCo_implicitfast"): ENERGY_DECAYS,
    ("newton", "MuJoCo_rk4"): (1.2e-2, 1.6e-4, 8.4e-5, None),
    ("brax", "generalized"): ENERGY_GROWS,
    ("brax", "generalized,f32"): ENERGY_GROWS,
    ("brax", "positional"): (0.84, -0.6, 0.37, None),
    ("brax", "spring"): (1.74, None, 5e-3, None),
    ("jaxsim", "SemiImplicitEuler"): ENERGY_GROWS,
    ("jaxsim", "RungeKutta4"): (3.5e-3, 2.7e-7, 6.6e-7, 5),
    ("jaxsim", "RungeKutta4,f32"): (1.4e-3, None, None, None),
    ("genesis", "Euler"): ENERGY_GROWS,
    ("genesis", "implicitfast"): (3.3e-3, None, 5.4e-4, 2),
    ("genesis", "approximate_implicitfast"): (3.3e-3, None, 5.4e-4, 2),
}
BUILT = Source(allow_build=True)
"""JaxSim and Genesis need a package each that has no wheel."""
END = from_quaternion(np.array([0.674588396035547, -0.00844525823572897, 0.02003759177423751, 0.7378737483224409]))
HEAVY = ("mjwarp", "newton", "jaxsim", "genesis")
SCENE = cv.Scene("brick", cv.RigidBody((13, 5, 10)), np.eye(3), (0, 0.05, 10), 6.0)


def rows():
    for (engine, setting), figures in ROWS.items():
        yield pytest.param(engine, setting, figures, marks=pytest.mark.engine(engine), id=f"{engine}:{setting}")


@pytest.mark.parametrize(("engine", "setting", "figures"), list(rows()))
def test_an_adapter_finds_what_a_plain_script_finds(engine, setting, figures):
    found = install(engine, BUILT).environment
    method = registry.method(f"{found.engine}@{found.version}:{setting}")
    coarse, fine = (cv.integrate(SCENE, dt, method=method) for dt in (0.01, 0.005))
    error, energy, momentum, order = figures
    wrong = [float(angle_between(each.R_WB[-1], END)) for each in (coarse, fine)]
    momenta = np.linalg.norm(coarse.momentum_W[-1] - coarse.momentum_W[0]) / np.linalg.norm(coarse.momentum_W[0])
    for got, wanted in ((wrong[0], error), (coarse.energy[-1] / coarse.energy[0] - 1, energy), (momenta, momentum)):
        assert wanted is None or 0.5 < got / wanted < 2
    assert order is None or abs(np.log2(wrong[0] / wrong[1]) - order) < 0.3


@pytest.mark.parametrize(
    "engine", [pytest.param(each, marks=pytest.mark.engine(each)) for each in ("exudyn", "bsk", "drake", "mjx", *HEAVY)]
)
def test_samples_and_a_turned_start_are_those_of_the_grid(engine):
    scene = cv.scenes.turned_brick(t_end=0.5)
    install(engine, BUILT)
    method = registry.method(engine)
    every, some = (cv.integrate(scene, 0.01, method=method, sample_every=count) for count in (1, 7))
    truth = cv.integrate(scene, 0.01, method=registry.method("exact"))
    assert np.abs(every.R_WB - truth.R_WB).max() < 1e-4
    assert np.abs(every.w_WB_B - truth.w_WB_B).max() < 1e-3
    assert np.abs(some.R_WB - every.R_WB[[0, 7, 14, 21, 28, 35, 42, 49, 50]]).max() < 1e-12


@pytest.mark.engine("mujoco==4.0.0")
@pytest.mark.parametrize("name", ["brick_flip", "asymmetric_top"])
@pytest.mark.parametrize("every", [1, 50])
def test_mujoco_is_the_same_bit_for_bit_in_its_environment(name, every):
    inside = registry.method("mujoco")
    if inside.label != "mujoco==4.0.0/RK4":
        pytest.skip(f"in this process it is {inside.label}")
    install("mujoco==4.0.0")
    scene = registry.scene(name)
    here, there = (
        cv.integrate(scene, 0.01, method=registry.method(f"{each}:implicit"), sample_every=every)
        for each in ("mujoco", "mujoco@4.0.0")
    )
    assert np.array_equal(here.R_WB, there.R_WB)
    assert np.array_equal(here.w_WB_B, there.w_WB_B)
