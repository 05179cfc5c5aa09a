import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative import presentation
from conservative.attitude import rotation_about
from conservative.errors import Diverged

R0 = rotation_about((0.3, -1.2, 0.7), 0.83)
TENSOR = [[3.1, 0.2, -0.1], [0.2, 2.7, 0.3], [-0.1, 0.3, 1.9]]


@pytest.fixture(scope="module")
def trajectory():
    scene = cv.Scene(
        "a <b>body</b>", cv.RigidBody(TENSOR), R0, (0.5, -1.5, 2.5), 3.0, cv.UniformGravity(12.5, (0.1, -0.2, 0.3))
    )
    return cv.integrate(scene, 0.001)


def test_a_table_has_every_sample_and_every_digit(trajectory):
    frame = trajectory.to_pandas()
    assert tuple(frame.columns) == presentation.COLUMNS
    assert len(frame) == len(trajectory) == 3001
    np.testing.assert_array_equal(frame["t"], trajectory.t)
    np.testing.assert_array_equal(frame["R_WB_23"], trajectory.R_WB[:, 1, 2])
    np.testing.assert_array_equal(frame["w_WB_B_3"], trajectory.w_WB_B[:, 2])
    np.testing.assert_array_equal(frame["energy"], trajectory.energy)
    np.testing.assert_array_equal(frame["momentum_W_1"], trajectory.momentum_W[:, 0])
    assert frame.attrs == {"scene": "a <b>body</b>", "method": trajectory.label, "outcome": "ok"}


def test_a_picture_draws_rates_and_drifts(trajectory):
    specification = json.loads(trajectory.plot().to_json())
    rates, drifts = (specification["datasets"][chart["data"]["name"]] for chart in specification["vconcat"])
    assert {row["of"] for row in rates} == {"about axis 1", "about axis 2", "about axis 3"}
    assert {row["of"] for row in drifts} == {"energy", "vertical momentum"}
    assert len(rates) == 3 * presentation.MOST_DRAWN
    last = [row["value"] for row in rates if row["t"] == trajectory.t[-1]]
    np.testing.assert_array_equal(last, trajectory.w_WB_B[-1])
    assert max(row["value"] for row in drifts) < 1e-13  # measured 8e-16


def test_a_notebook_shows_the_picture_without_a_network(trajectory, monkeypatch):
    """Altair's own HTML asks a server for its scripts; neither the specification nor the SVG has an address to ask."""
    chart = trajectory.plot().properties(title="renamed")
    shown = chart._repr_mimebundle_()
    assert sorted(shown) == ["application/vnd.vegalite.v6+json", "image/svg+xml", "text/plain"]
    assert "cdn" in trajectory.plot().to_html()  # what would be shown otherwise
    assert not re.search(r"(src|href)=", shown["image/svg+xml"])
    assert "renamed" in shown["image/svg+xml"]
    assert len(shown["application/vnd.vegalite.v6+json"]["vconcat"]) == 2
    monkeypatch.setitem(sys.modules, "vl_convert", None)
    assert "image/svg+xml" not in chart._repr_mimebundle_()


def test_a_drift_is_asked_for_by_name(trajectory):
    energy, _ = trajectory.scene.invariants
    np.testing.assert_array_equal(trajectory.drift("energy"), trajectory.drift(energy))
    with pytest.raises(cv.BadInput, match="'energy' \\(nearest\\), or one of energy, vertical momentum"):
        trajectory.drift("enrgy")


def test_a_scene_shows_its_start(trajectory):
    shown = repr(trajectory.scene)
    assert "w_WB_B0=[0.5, -1.5, 2.5]" in shown
    assert f"R_WB0={R0.tolist()}" in shown


def test_a_short_run_is_drawn_as_it_is(trajectory):
    few = replace(trajectory, t=trajectory.t[:2], R_WB=trajectory.R_WB[:2], w_WB_B=trajectory.w_WB_B[:2])
    specification = json.loads(few.plot().to_json())
    assert len(specification["datasets"][specification["vconcat"][0]["data"]["name"]]) == 6


def test_a_card_says_how_it_ended_and_escapes_what_a_user_wrote(trajectory):
    text = trajectory._repr_html_()
    assert "<table>" in text
    assert "a &lt;b&gt;body&lt;/b&gt;" in text
    for part in ("ok", "3001 to 3 s", "3000 steps", "drift of energy", "drift of vertical momentum", trajectory.label):
        assert part in text


def test_nothing_to_show(trajectory):
    empty = replace(
        trajectory, t=trajectory.t[:0], R_WB=trajectory.R_WB[:0], w_WB_B=trajectory.w_WB_B[:0], failure=Diverged(0.0)
    )
    assert "0 to nothing" in empty._repr_html_()
    assert "diverged" in empty._repr_html_()
    assert len(empty.to_pandas()) == 0
    with pytest.raises(cv.BadInput) as caught:
        empty.plot()
    assert caught.value.argument == "trajectory"
    assert "0 samples" in caught.value.got
    assert "a sample or more" in caught.value.allowed


@pytest.mark.parametrize(("package", "method"), [("pandas", "to_pandas"), ("altair", "plot"), ("pandas", "plot")])
def test_without_the_package_the_error_names_the_extra_that_brings_it(trajectory, monkeypatch, package, method):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(cv.MissingExtra, match=rf"Trajectory\.{method}.* {package}; .*conservative-rotation\[report\]"):
        getattr(trajectory, method)()


def test_showing_a_card_imports_no_table_library():
    code = (
        "import conservative as cv, numpy as np, sys; s = cv.scenes.brick_flip();"
        "t = cv.Trajectory(s, np.zeros(1), s.R_WB0[None], s.w_WB_B0[None], 'x'); repr(t), t._repr_html_();"
        "print([m for m in ('pandas', 'altair', 'numba') if m in sys.modules])"
    )
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_scipy_rotations_go_in_wherever_an_attitude_does():
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation.from_matrix(R0)
    scene = cv.Scene("x", cv.RigidBody(TENSOR), rotation, (0.5, -1.5, 2.5), 3.0)
    np.testing.assert_allclose(scene.R_WB0, R0, atol=1e-15)  # measured 1e-16
    np.testing.assert_allclose(scene.rename("y", R_WB0=rotation).R_WB0, R0, atol=1e-15)
    from conservative.references.exact.method import free_body

    given, same = free_body(scene.body, rotation, (0.5, -1.5, 2.5), [2.0]), free_body(scene.body, R0, (0.5, -1.5, 2.5), [2.0])
    np.testing.assert_allclose(given[0], same[0], atol=1e-14)  # measured 0
