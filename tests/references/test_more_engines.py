"""More real engines on the brick, and engines as they are installed; figures as in `test_real_engines`."""

import pytest

from conservative import registry
from conservative.references.environments.install import install

from .test_real_engines import ENERGY_GROWS
from .test_real_engines import test_an_adapter_finds_what_a_plain_script_finds as check_row

ROWS = {
    ("opensim", "RungeKuttaMerson"): (4.4e-2, -2.2e-6, 5.1e-6, None),
    ("opensim", "RungeKuttaFeldberg"): (1.2e-3, None, 1.0e-6, None),
    ("opensim", "accuracy=1e-10"): (6e-7, None, None, None),
    ("jsbsim", "RectEuler"): ENERGY_GROWS,
    ("jsbsim", "Trapezoidal"): (0.71, 0.53, 0.24, None),  # as Euler's method at twice the step
    ("jsbsim", "AB2"): (8.4e-2, 2.3e-4, 2.0e-3, 2),
    ("jsbsim", "AB2,LocalLinearization"): (1.9e-2, None, None, 2),
    ("jsbsim", "AB5"): (4.5e-5, 2.0e-6, 5.5e-6, 2),
    ("nimble", ""): ENERGY_GROWS,
}
DEFAULTS = {
    "drake": ("default", (1.85, 4.5e-5, 8e-5, None)),
    "exudyn": ("default", (1.66e-2, -9.2e-6, 7e-4, 2)),
    "bsk": ("RK4", (2.3e-6, -2e-8, 8e-7, 4)),
    "dart": ("semi-implicit Euler", ENERGY_GROWS),
    "mjx": ("Euler,f32", ENERGY_GROWS),
    "mujoco==4.0.0": ("Euler", ENERGY_GROWS),
    "opensim": ("RungeKuttaMerson,accuracy=0.001", (4.4e-2, -2.2e-6, 5.1e-6, None)),
    "jsbsim": ("RectEuler", ENERGY_GROWS),
    "nimble": ("semi-implicit Euler", ENERGY_GROWS),
    "sapien": ("PhysX,as installed,f32", (1.9, -0.45, 0.26, None)),
    "pybullet": ("multibody,as installed", (3.1, -0.94, 0.75, None)),
}


@pytest.mark.parametrize(
    ("engine", "setting", "figures"),
    [
        pytest.param(engine, setting, figures, marks=pytest.mark.engine(engine), id=f"{engine}:{setting}")
        for (engine, setting), figures in ROWS.items()
    ],
)
def test_more_adapters_find_what_plain_scripts_find(engine, setting, figures):
    check_row(engine, setting, figures)


@pytest.mark.parametrize("engine", [pytest.param(engine, marks=pytest.mark.engine(engine)) for engine in DEFAULTS])
def test_an_engine_as_installed_says_so_and_does_it(engine):
    environment = install(engine).environment
    label, figures = DEFAULTS[engine]
    method = registry.engine(environment.engine).at_version(environment.version).user_defaults()
    assert method.label == f"{environment.engine}=={environment.version}/{label}"
    check_row(engine, method.name.partition(":")[2], figures)


@pytest.mark.parametrize("engine", [pytest.param(each, marks=pytest.mark.engine(each)) for each in ("diffrax", "orekit")])
def test_an_engine_without_a_default_has_none(engine):
    install(engine)
    assert registry.engine(engine).user_defaults() is None


@pytest.mark.engine("jsbsim")
def test_a_row_of_another_integrator_is_found_out():
    with pytest.raises(AssertionError):
        check_row("jsbsim", "RectEuler", ROWS["jsbsim", "Trapezoidal"])
