"""Summaries of a scene and of random bodies: sentence, classes of methods, picture of families."""

import math
import shlex
from dataclasses import replace
from types import SimpleNamespace

import pandas as pd
import pytest
from click.testing import CliRunner

from conservative import Gauss, Taylor, Torque, registry
from conservative.benchmarks.measures import measurement
from conservative.reports.cli.main import main
from conservative.reports.document.cells import grade_ratio
from conservative.reports.document.model import Grade
from conservative.reports.rows import points as families
from conservative.reports.rows.names import MethodClass, class_of, with_names
from conservative.reports.rows.points import points
from conservative.reports.run.plan import plan_report
from conservative.reports.sections import advice, random_bodies, summary

from .rows import frame, point
from .test_random_ratios import ENGINE_ALONE, TWICE

SOLUTION = point("lame", "ours", 1e-12, 1e-7)
OURS = [*point("gauss", "ours", 1e-3, 2e-6), *point("gauss", "ours", 1e-7, 4e-6, 0.01)]
SOLVER = [*point("scipy", "engine", 1e-3, 6e-6), *point("scipy", "engine", 1e-7, 8e-6, 0.01)]
ENGINE = point("mujoco:RK4", "engine", 1e-4, 5e-4)


def told(*lines, integrable=True):
    return summary.of_scene(points(frame([each for line in lines for each in line])), integrable)


@pytest.mark.parametrize(
    ("method", "role", "kind"),
    [
        ("taylor", "ours", MethodClass.GENERAL),
        ("reduced:order=4", "ours", MethodClass.GENERAL),
        ("moser_veselov", "ours", MethodClass.SOLUTION),
        ("moser_veselov:order=10", "ours", MethodClass.SOLUTION),
        ("lame", "ours", MethodClass.SOLUTION),
        ("heyoka:frame=lean", "engine", MethodClass.SOLVER),
        ("scipy", "engine", MethodClass.SOLVER),
        ("mujoco:RK4", "engine", MethodClass.ENGINE),
        ("pinocchio", "engine", MethodClass.ENGINE),
        ("nobody knows it", "ours", MethodClass.GENERAL),
        ("nobody@1.0:knows", "engine", MethodClass.ENGINE),
    ],
)
def test_a_method_for_integrable_motions_is_no_general_integrator(method, role, kind):
    assert class_of(role, method) is kind


@pytest.mark.parametrize(
    ("name", "integrable"),
    [
        *(("brick_flip", True), ("lagrange_top", True), ("kovalevskaya_top", True), ("spherical_body", True)),
        *(("asymmetric_top", False), ("turned_top", False), ("random_body", False), ("stable_satellite", False)),
    ],
)
def test_scenes_are_integrable_or_not(name, integrable):
    assert registry.scene(name).integrable is integrable


def test_a_sentence_compares_general_integrators_and_tells_of_a_solution_apart():
    between = 6e-6 * (8 / 6) ** 0.75 / (2e-6 * 2**0.75)  # three of four decades from 1e-3 to 1e-7
    sentence = told(OURS, SOLVER, SOLUTION).sentence
    assert sentence.startswith("made_up is integrable. Our fastest general integrator, gauss, reaches 1e-6 rad ")
    assert (
        f"{between:.1f} times as fast as the fastest engine or solver, scipy. lame, which solves integrable motions only, is"
        in sentence
    )
    assert sentence.endswith("74 times as fast as scipy.")  # 6 (8/6)^0.75 / 0.1
    slow = told(OURS, SOLVER, point("lame", "ours", 1e-12, 1e-5)).sentence
    assert slow.endswith("scipy is 1.3 times as fast as lame, which solves integrable motions only.")


def test_a_faster_engine_is_the_subject_of_the_sentence():
    slow = [*point("gauss", "ours", 1e-3, 2e-5), *point("gauss", "ours", 1e-7, 4e-5, 0.01)]
    sentence = told(slow, SOLVER, integrable=False).sentence
    assert sentence.startswith(
        "made_up has fewer than three known invariants. The fastest engine or solver, scipy, reaches 1e-6 rad 4.5 times as fast"
    )


SIDES = [  # none says "only": other methods of the same side can reach it as well
    ((OURS,), "Our fastest general integrator, gauss, reaches 1e-6 rad; no timed run of an engine or solver does."),
    ((SOLVER,), "The fastest engine or solver, scipy, reaches 1e-6 rad; no timed run of our general integrators does."),
    ((ENGINE,), "No timed run reaches 1e-6"),
]


@pytest.mark.parametrize(("lines", "words"), SIDES)
def test_a_side_that_does_not_get_there_has_no_ratio(lines, words):
    assert words in told(*lines).sentence


def test_a_scene_without_measured_times_says_so():
    none = points(with_names(frame([*OURS])).iloc[:0])
    assert summary.of_scene(none, False).sentence.endswith("No time was measured against an error.")


def test_the_best_of_a_family_is_its_front():
    bad = point("gauss:stages=2", "ours", 1e-2, 9e-6)
    picture = told(OURS, bad, SOLVER).points
    assert picture[picture["name"] == "gauss"]["error"].tolist() == [1e-3, 1e-7]


def test_the_first_eight_families_are_of_both_sides():
    lines = [point(f"ours{k}", "ours", 10.0**-k, 1e-6) for k in range(1, 8)]
    lines += [point(f"engine{k}", "engine", 10.0**-k, 1e-6) for k in range(1, 8)]
    shown = families.names_in_turn(told(*lines).points)[:8]
    assert sorted(name[:4] for name in shown) == ["engi"] * 4 + ["ours"] * 4
    assert families.names_in_turn(told(OURS, SOLVER).points) == ("gauss", "scipy")


def random(*lines):
    table = with_names(measurement.frame([row for rows in lines for row in rows]))
    return random_bodies.summary(table, random_bodies.ratios(table))


def test_random_bodies_have_points_where_most_of_them_get_there():
    picture = random(*TWICE, *ENGINE_ALONE).points
    ours = picture[picture["name"] == "gauss"]
    assert ours["error"].min() == pytest.approx(1e-4)
    assert set(ours["within"]) == {"2 of 2"}
    assert math.isclose(ours["time"].iloc[0], 1.0)


def test_hidden_lines_are_named():
    one, other = (pd.DataFrame({"x": [1.0, 2.0], "y": [y, 4.0]}) for y in (1e-16, 1.1e-16))
    lines = [("a", one), ("b", one), ("c", other), ("d", one)]  # drawn in this order, the last on top
    assert list(families.under(lines, "x", "y")) == ["Exactly under d: a, b."]


def test_the_sentence_has_the_interval_over_processes():
    def times(name, role, *values):
        error, time = point(name, role, 1e-7, values[0])
        return [error, *(replace(time, value=value, process=n) for n, value in enumerate(values))]

    sentence = told(times("gauss", "ours", 1.0, 1.1, 1.0), times("scipy", "engine", 2.0, 2.2, 2.2)).sentence
    assert "reaches 1e-6 rad 2.1 (2.0 to 2.2) times as fast as the fastest engine or solver, scipy." in sentence


@pytest.mark.parametrize(("time", "used"), [(1e-7, {"gauss", "lame"}), (1e-4, {"gauss"})])
def test_a_closed_form_is_advised_only_if_it_is_faster(time, used):
    """At 1e-9 rad, which `gauss` reaches in 8e-6 s."""
    lines = (OURS, point("gauss", "ours", 1e-10, 8e-6, 0.001), SOLVER, point("lame", "ours", 1e-12, time))
    table = points(frame([each for line in lines for each in line]))
    plan = SimpleNamespace(scenes=[SimpleNamespace(name="made_up")], methods=(), arguments={"made_up": "made_up"})
    found = advice.section(SimpleNamespace(plan=plan, points=table, ratios=()))
    rows = found.blocks[-1].rows
    assert {str(row[2]) for row in rows} == used
    assert ("lame" in found.blocks[0].text) == ("lame" in used)


def test_commands_of_a_report_make_the_scenes_again(tmp_path):
    path = tmp_path / "my body.toml"
    path.write_text("t_end = 1.0\nbody.inertia = [1.0, 2.0, 2.5]\nstart.w_WB_B = [0.5, 3.0, 0.2]\n")
    arguments = [str(path), "brick_flip:disturbance=1e-6", "lagrange_top"]
    plan = plan_report(arguments, ["taylor"], quick=True)
    assert [scene.name for scene in plan.scenes] == ["my body", "brick_flip_1e-06", "lagrange_top"]
    lines = [line for scene in plan.scenes for line in point("taylor:order=12", "ours", 1e-10, 1e-6, scene=scene.name)]
    found = advice.section(SimpleNamespace(plan=plan, points=points(frame(lines)), ratios=()))
    commands = [shlex.split(str(row[-1])) for row in found.blocks[-1].rows]
    assert {words[2] for words in commands} == set(arguments)
    for words in commands[:: len(commands) // len(arguments)]:
        done = CliRunner().invoke(main, [*words[1:], "--t-end", "0.5", "--no-truth"])
        assert done.exit_code == 0, done.output


def test_an_advised_method_is_not_said_to_take_a_scene_that_it_refuses():
    lines = [*point("taylor", "ours", 1e-10, 1e-6, scene="brick_flip"), *point("gauss", "ours", 1e-4, 1e-6, scene="thruster")]
    brick = registry.scene("brick_flip")
    loaded = brick.rename("thruster", torque=Torque((0, 0, 1)))
    for scenes, refused in (((brick,), False), ((brick, loaded), True)):
        plan = SimpleNamespace(
            scenes=scenes, methods=(Taylor(), Gauss()), arguments={scene.name: scene.name for scene in scenes}
        )
        lead = advice.section(SimpleNamespace(plan=plan, points=points(frame(lines)), ratios=())).blocks[0].text
        assert "`taylor`" in lead
        assert ("thruster" in lead) is refused


@pytest.mark.parametrize(("ratio", "grade"), [(0.94, Grade.BAD), (0.97, Grade.FAIR), (1.03, Grade.FAIR), (1.07, Grade.GOOD)])
def test_a_ratio_of_one_process_is_open_close_to_one(ratio, grade):
    assert grade_ratio(ratio).grade is grade
    assert grade_ratio(ratio, interval=(ratio, ratio)).grade is (Grade.GOOD if ratio > 1 else Grade.BAD)
