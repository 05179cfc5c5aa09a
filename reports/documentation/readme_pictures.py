"""The pictures of the READMEs, drawn anew into reports/pictures/.

    python -m conservative.reports.documentation.readme_pictures

They are those of a report, of fewer methods: time against error, drift of the energy, and the polhode on the momentum sphere.
Times mean something on a quiet machine only.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import altair as alt
import pandas as pd

from conservative import registry
from conservative.benchmarks.measures import measurement, samples
from conservative.benchmarks.measures.samples import Samples
from conservative.benchmarks.studies import long_runs, studies
from conservative.benchmarks.studies.study import Study
from conservative.files import make_folder
from conservative.method import Method
from conservative.scene import Scene

from .. import document
from ..charts import figures, spheres
from ..charts.style import apply_style
from ..labels import with_names
from ..tables import lines, work_precision
from ..tables.classes import without_solutions
from ..terminal.progress import Step, progress

FOLDER = Path(__file__).parents[1] / "pictures"
TIMED_SCENE, TIMED = (
    "asymmetric_top",
    (
        "reduced",
        "reduced:order=6",
        "gauss",
        "projected",
        "taylor",
        "heyoka:frame=base_vectors",
        "mujoco:Euler",
        "mujoco:RK4",
        "pinocchio:RK4",
        "scipy",
    ),
)
DRIFT_SCENE = "brick_flip"
DRIFTING = (
    "reduced",
    "moser_veselov",
    "heyoka:1e-9",
    "heyoka:1e-16",
    "mujoco:RK4",
    "mujoco:implicitfast",
    "pinocchio:RK4",
    "scipy:rtol=1e-9",
)
SEEN = ("exact", "reduced", "mujoco:RK4", "mujoco:implicit")


def pictures(quick: bool, step: Step) -> Iterator[tuple[str, Any]]:
    """Yield name and chart of each picture as it is measured; `quick` takes fewer points and rounds."""
    step(0.0, "time against error")
    yield "time_against_error", time_against_error(registry.scene(TIMED_SCENE), _methods(TIMED), quick)
    scene = registry.scene(DRIFT_SCENE)
    step(0.8, "drift of the energy")
    yield "drift_of_energy", drift_of_energy(scene, _methods(DRIFTING))
    step(0.9, "polhodes")
    yield "polhodes", polhodes(scene, _methods(SEEN))


def _methods(names: Sequence[str]) -> tuple[Method, ...]:
    """Return one method a name, where `selection.methods` takes a bare name for all variants."""
    return tuple(registry.method(name) for name in names)


def _samples(study: str, scene: Scene, methods: tuple[Method, ...]) -> pd.DataFrame:
    findings = studies.findings(Study(study, (scene,), methods))
    return with_names(samples.frame(finding for finding in findings if isinstance(finding, Samples)))


def time_against_error(scene: Scene, methods: tuple[Method, ...], quick: bool) -> Any:
    """Return the report's chart of time against error."""
    study = Study("work_precision", (scene,), methods, quick)
    points = work_precision.points(with_names(measurement.frame(list(studies.rows(study)))))
    return figures.work_precision(points, work_precision.front(without_solutions(points)), scene.name)


def drift_of_energy(scene: Scene, methods: tuple[Method, ...]) -> Any:
    """Return the report's chart of drifts, of the energy alone."""
    drifts = lines.drifts(_samples("long_runs", scene, methods))
    return figures.drift(drifts[drifts["quantity"] == "energy"], scene.name)


def polhodes(scene: Scene, methods: tuple[Method, ...]) -> Any:
    """Return the page's spheres side by side, each under the name of its method."""
    curves = lines.curves(_samples("sphere_curves", scene, methods))
    charts = {str(name): spheres.chart(curve) for name, curve in curves.groupby("name", sort=False)}
    titles = [{key: chart[key] for key in ("width", "height", "layer")} | {"title": name} for name, chart in charts.items()]
    parameters = next(iter(charts.values()))["params"]
    end = scene.t_end * long_runs.DURATIONS
    title = {
        "text": f"{scene.name}: angular momentum in body axes, on its sphere",
        "subtitle": f"over {end:g} s in steps of {scene.dt:g} s; what loses momentum leaves the curve",
    }
    return apply_style(alt.HConcatChart.from_dict({"title": title, "params": parameters, "hconcat": titles}))


def write(folder: Path, quick: bool, step: Step) -> list[Path]:
    """Measure, draw and write the pictures into a folder; return their files."""
    make_folder(folder, "folder")
    return [folder / document.draw(chart, folder / name, False) for name, chart in pictures(quick, step)]


def main() -> None:
    """Write the pictures, and print where they are."""
    parser = argparse.ArgumentParser(prog="python -m conservative.reports.documentation.readme_pictures", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer points, fewer rounds of timing")
    parser.add_argument("folder", nargs="?", type=Path, default=FOLDER, help="[default: reports/pictures]")
    options = parser.parse_args()
    with progress() as step:
        for path in write(options.folder, options.quick, step):
            print(path)


if __name__ == "__main__":
    main()
