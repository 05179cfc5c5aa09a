"""Formats and numbers that others depend on: .github/ARCHITECTURE.md, "What must never change"."""

import re

import pytest

from conservative.benchmarks.gate import baseline
from conservative.benchmarks.suite import points
from conservative.integration import store
from conservative.references.worker import program
from conservative.reports.run import checkpoint, measure
from conservative.scenes.random_body import random_body

from .pages import ROOT


def test_every_program_has_the_protocol_of_the_page():
    worker = ROOT / "references" / "worker"
    (page,) = re.findall(r"^# The engine protocol, version (\d+)$", (worker.parent / "PROTOCOL.md").read_text(), re.MULTILINE)
    others = [re.search(r'"?protocol"?[,:] (\d+)', (worker / f"program.{end}").read_text())[1] for end in ("mjs", "hpp")]
    assert [program.PROTOCOL, *map(int, [page, *others])] == [1, 1, 1, 1]


def test_formats_of_files():
    assert (store.FORMAT_VERSION, measure.SCHEMA, baseline.FORMAT, checkpoint.FORMAT) == (1, 3, 2, 5)


def test_the_baseline_has_the_definitions_of_the_suite():
    stored = {id: row.definition for id, row in baseline.read(ROOT / baseline.PATH).rows.items()}
    found = {f"test_speed.py::test_speed[{point.id}]": point.definition for point in points.points()}
    assert stored
    assert stored == {id: found.get(id) for id in stored}


def test_a_seed_gives_the_same_bodies_for_ever():
    scene = random_body("spring", 1003, 5)
    assert scene.w_WB_B0 == pytest.approx([-0.3924054431230512, 0.16571278314144716, -0.4748148552881624], rel=1e-12)
    assert scene.body.moments == pytest.approx([0.874147687344444, 0.8960339021843717, 1.690198594238825], rel=1e-12)
