"""Cases of readers by formulas of tables: rotated, mirrored, scaled, nested, units, shells, values that do not count."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from conservative.benchmarks.verification.bodies.loaded import decide_body, decide_refusal
from conservative.benchmarks.verification.finding import Verdict
from conservative.references.model_files.pieces import distance
from conservative.references.model_files.readers import read_here
from conservative.references.model_files.usd import Stage

from ..sampling import sampled
from .made_models import T, all_cases

pytest.importorskip("lxml")
pytest.importorskip("pxr")
pytest.importorskip("pinocchio")

CASES = all_cases()
KNOWN = {name: body for name, (_, body) in CASES.items() if body is not None}
OPEN = [name for name in CASES if name not in KNOWN]


def read(name, tmp_path):
    path, copies = tmp_path / name, tmp_path / "copies"
    path.write_text(CASES[name][0])
    copies.mkdir()
    (model,) = read_here(path, name, copies)
    return model


@pytest.mark.parametrize("name", sampled(list(KNOWN), 40))
def test_both_readings_have_the_body_of_the_formulas(name, tmp_path):
    """Measured: 3e-7 for USD, which has single precision, and 3e-11 for the others."""
    wanted, model = KNOWN[name], read(name, tmp_path)
    readings = [part for part in (model.own, model.reference) if part]
    assert len(readings) == 1 + (model.kind != "sdf")
    assert all(distance(wanted, part) < (1e-6 if model.kind == "usd" else 1e-9) for part in readings)
    assert not model.disagree
    assert not model.doubts
    assert decide_body(model, "engine", wanted, 1e-4).verdict is Verdict.RIGHT
    other = replace(wanted, inertia=wanted.inertia + 0.1 * np.diag(wanted.inertia).max() * np.eye(3))
    assert decide_body(model, "engine", other, 1e-4).verdict is (Verdict.WRONG if model.kind != "sdf" else Verdict.UNDECIDED)


@pytest.mark.parametrize("name", OPEN)
def test_what_a_format_leaves_open_is_undecided(name, tmp_path):
    model = read(name, tmp_path)
    for factor in (0.5, 2.0):  # whatever an engine has, or if it refuses the file
        other = replace(model.truth, inertia=factor * model.truth.inertia)
        assert decide_body(model, "engine", other, 1e-4).verdict is Verdict.UNDECIDED
    for part in filter(None, (model.own, model.reference)):
        assert decide_body(model, "engine", part, 1e-4).verdict in (Verdict.RIGHT, Verdict.UNDECIDED)
    assert decide_refusal(model, "engine", "no").verdict is Verdict.UNDECIDED


@pytest.mark.parametrize("name", ["mirrored_body.usda", "mirrored_parent.usda"])
def test_the_axes_of_a_mirrored_body_are_those_of_the_parser_of_usd_core(name, tmp_path):
    """A rotation, the negative of the nearest orthogonal matrix: measured 1e-7. The axes stay open for engines."""
    model = read(name, tmp_path)
    assert distance(model.reference, model.own) < 1e-6
    if name == "mirrored_body.usda":  # mirrored along x, so that the axes are turned by half a turn about x
        np.testing.assert_allclose(model.own.com, np.negative(T), atol=1e-7)


def test_there_are_cases_of_every_kind():
    """146 files, 18 of them open."""
    kinds = {name.rsplit(".", 1)[1] for name in CASES}
    assert kinds == {"usda", "xml", "urdf", "sdf"}
    assert len(CASES) >= 130
    assert len(OPEN) >= 15
    words = ("rotate", "mirrored", "stretched", "units", "below", "shell", "norm", "mass_-1", "mesh", "euler", "class", "frame")
    assert all(any(word in name for name in CASES) for word in words)


def test_poses_of_usd_are_those_of_usdgeom(tmp_path):
    """200 random chains of all operations, inverted ones and resets: measured 1.4e-15."""
    from pxr import Gf, Usd, UsdGeom

    rng = np.random.default_rng(55)
    types = UsdGeom.XformOp
    kinds = [getattr(types, name) for name in dir(types) if name.startswith("Type") and name not in ("Type", "TypeInvalid")]
    assert len(kinds) >= 15
    path = str(tmp_path / "a.usda")
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    used, prims = set(), []
    for number in range(50):
        name = f"/p{number}"
        for depth in range(4):
            xform = UsdGeom.Xform.Define(stage, name)
            for place, kind in enumerate(rng.choice(len(kinds), size=3)):
                inverse = bool(rng.integers(4) == 0)
                op = xform.AddXformOp(kinds[kind], types.PrecisionDouble, f"s{place}")
                used.add(kinds[kind])
                if kinds[kind] == types.TypeTransform:
                    matrix = np.eye(4)
                    matrix[:, :3] += 0.3 * rng.normal(size=(4, 3))
                    op.Set(Gf.Matrix4d(*matrix.ravel().tolist()))
                elif kinds[kind] == types.TypeOrient:
                    q = rng.normal(size=4)
                    op.Set(Gf.Quatd(*(q / np.linalg.norm(q)).tolist()))
                else:
                    wide = "3" in str(op.GetAttr().GetTypeName())
                    values = rng.normal(size=3) + (1.5 if "cale" in op.GetOpName() else 0)
                    op.Set(Gf.Vec3d(*values.tolist()) if wide else float(values[0]))
                if inverse:
                    xform.AddXformOp(kinds[kind], types.PrecisionDouble, f"s{place}", True)
            if depth == 2 and rng.integers(3) == 0:
                xform.SetResetXformStack(True)
            prims.append(name)
            name += f"/q{depth}"
    stage.GetRootLayer().Save()
    ours, cache = Stage(Path(path)), UsdGeom.XformCache()
    worst = 0.0
    for name in prims:
        prim = ours.stage.GetPrimAtPath(name)
        theirs = np.array(cache.GetLocalToWorldTransform(prim)).T
        worst = max(worst, np.abs(ours.map_of(prim) - theirs).max() / np.abs(theirs).max())
    assert used == set(kinds)
    assert worst < 1e-12
