"""The view of made-up measurements: what belongs to which scene, and values that are frozen and compared as objects."""

import dataclasses

import numpy as np
import pytest

from conservative import Gauss, Reduced, registry
from conservative.benchmarks.measures import samples
from conservative.benchmarks.measures.samples import Samples
from conservative.method import Role
from conservative.reports import view
from conservative.reports.run.measure import Measurements
from conservative.reports.run.plan import plan_report
from conservative.reports.run.provenance import provenance
from conservative.reports.tables import lines, scene_views, work_precision

from .made_up import convergence, row
from .rows import frame, parts, point

SCENES = ("brick_flip", "lagrange_top")


def line(study, scene, quantity, method="reduced"):
    t = np.linspace(0.5, 60, 120)
    who = {"method": method, "label": method, "series": method, **parts(method)}
    return Samples(study=study, scene=scene, role=Role.OURS, dt=0.1, quantity=quantity, t=t, value=1e-15 * t, **who)


@pytest.fixture(scope="module")
def built():
    plan = dataclasses.replace(
        plan_report([], ["reduced"], quick=True), scenes=tuple(map(registry.scene, SCENES)), methods=(Reduced(), Gauss(2))
    )
    found = [row("long_runs", "reduced", "energy drift max", 2e-15, scene=scene) for scene in SCENES]
    for scene, order in zip(SCENES, (2, 4), strict=True):
        found += convergence("reduced", order, scene)
        found += point("reduced", "ours", 1e-2, 1e-6, scene=scene) + point("scipy:DOP853", "engine", 1e-3, 1e-4, scene=scene)
    found += convergence("gauss:stages=2", 4, "lagrange_top")
    drifts = [line("long_runs", scene, "energy") for scene in SCENES]
    table = frame(found).drop(columns=["name", "line"])
    return view.build(plan, Measurements(table, samples.frame(drifts)), provenance(["report"])), plan, table


def test_scenes_are_those_of_the_plan_in_its_order(built):
    found, plan, table = built
    assert [scene.name for scene in found.scenes] == list(SCENES)
    assert found.table.equals(table)
    assert found.quick is plan.quick is True
    for scene, value in zip(found.scenes, plan.scenes, strict=True):
        assert (scene.source, scene.free) == (value.source, value.free)
        assert (scene.t_end, scene.dt) == (f"{value.t_end:g}", f"{value.dt:g}")
    assert [scene.free for scene in found.scenes] == [True, False]


def test_each_scene_has_its_rows_and_no_others(built):
    for scene, order in zip(built[0].scenes, (2, 4), strict=True):
        for rows in (scene.points, scene.drifts, scene.errors):
            assert set(rows["scene"]) == {scene.name}
            assert list(rows.index) == list(range(len(rows)))
            assert "index" not in rows
        assert scene.line_count == 2
        assert len(scene.contests[1]) == len(built[0].scenes[0].contests[1])  # as many points, all of them its own
        assert scene.front.equals(work_precision.front(scene.points))
        assert scene.thin_drifts.equals(lines.thin(scene.drifts))
        header, body = scene.order
        slope = next(cells for cells in body if cells[0].startswith("reduced"))
        assert any(str(cell).startswith(f"{order}.0") for cell in slope[1:]), (header, slope)


def test_curves_that_are_missing_are_named(built):
    """Both methods should have one, and none has."""
    assert all("reduced" in scene.without_curve for scene in built[0].scenes)
    drawn = dataclasses.replace(built[1], scenes=built[1].scenes[:1])
    curve = samples.frame([line("sphere_curves", "brick_flip", quantity) for quantity in ("x", "y", "z")])
    table = built[2]
    found = view.build(drawn, Measurements(table, curve), provenance(["report"]))
    assert "reduced" not in found.scenes[0].without_curve


def test_views_are_frozen_and_compared_as_objects(built):
    found = built[0]
    for value in (found, found.paper, found.scenes[0]):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(value, dataclasses.fields(value)[0].name, None)
        assert dataclasses.replace(value) != value
        assert isinstance(hash(value), int)
    assert scene_views.SceneViews.__dataclass_params__.frozen
    assert not scene_views.SceneViews.__dataclass_params__.eq
