"""README.md and the generated parts of other pages are current: of measurements, and of what the code declares."""

import csv
import importlib
import importlib.util
import re
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import conservative as cv
from conservative.benchmarks.measures import measurement
from conservative.features import Feature

from .pages import ROOT, pages
from .reports.rows import row

FOLDER = ROOT / ".ci" / "readme"
ENTRANTS = "conservative/entrants.md"


@pytest.fixture(autouse=True)
def _beside(monkeypatch):
    """The files of the program import each other by their names."""
    monkeypatch.syspath_prepend(FOLDER)


def load(name):
    """Return a file of the program, and `__main__` under another name."""
    if name != "__main__":
        return importlib.import_module(name)
    spec = importlib.util.spec_from_file_location("readme_main", FOLDER / "__main__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def copied(tmp_path):
    """Return a folder with a copy of all pages, and of the tests of motions."""
    tests = [ROOT / "references" / "motions" / name for name in load("declared").MOTION_TESTS]
    for page in [*pages(), *tests]:
        copy = tmp_path / "copy" / page.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(page, copy)
    return tmp_path / "copy"


@pytest.fixture
def check(monkeypatch):
    """Return a function that checks the pages of a folder and returns what is not current."""

    def ask(folder):
        monkeypatch.setattr(sys, "argv", ["readme", "--check"])
        try:
            load("__main__").main(folder)
        except SystemExit as ended:
            return ended.code
        return ""

    return ask


def parts(page):
    """Return the generated parts of a page by name."""
    return {match[2]: match[3] for match in load("pages").PART.finditer(page.read_text(encoding="utf-8"))}


def edit(page, old, new):
    text = page.read_text(encoding="utf-8")
    assert old in text
    page.write_text(text.replace(old, new, 1), encoding="utf-8")


def test_all_pages_are_current():
    done = subprocess.run([sys.executable, FOLDER, "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("page", "word"),
    [
        ("conservative/reference.md", "| `Gauss("),
        ("conservative/reference.md", "✓"),
        ("references/README.md", "| [`drake`]"),
        ("references/motions/README.md", "| rotor | `rotor`"),
        ("references/motions/rotation_test.c", '"inertia_B,13,'),
        ("references/model_files/measured.md", "| mujoco 4.0.0 | 71"),
        ("reports/documentation/mistakes.md", "| test files |"),
        ("benchmarks/published.md", "| all | 58"),
    ],
)
def test_a_page_that_differs_from_the_code_is_found(page, word, copied, check):
    assert check(copied) == ""
    edit(copied / page, word, "| `another")
    assert check(copied) == f"{page} is not current. Run: python .ci/readme"


def test_a_method_that_takes_more_makes_the_pages_stale(copied, check, monkeypatch):
    monkeypatch.setattr(
        cv.Gauss, "method_info", replace(cv.Gauss.method_info, supports=cv.Gauss.method_info.supports | {Feature.SPRING})
    )
    assert check(copied).startswith("conservative/reference.md is not current")


def test_a_part_that_no_page_has_is_found(copied, check):
    edit(copied / "conservative" / "reference.md", "<!-- generated support: ", "<!-- made of: ")
    assert check(copied) == "no page has the part 'support'. Run: python .ci/readme"


def test_a_changed_measurement_makes_it_stale(tmp_path, monkeypatch):
    program = load("measured")
    text = program.ROWS.read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith("brick_flip,MuJoCo,time,")]
    fields = line.split(",")
    fields[3] = str(3 * float(fields[3]))
    (tmp_path / "measured.csv").write_text(text.replace(line, ",".join(fields)), encoding="utf-8")
    monkeypatch.setattr(program, "ROWS", tmp_path / "measured.csv")
    assert program.render_page() != (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("value", "text"), [(4e-16, "< 1e-15"), (3.21e-12, "3.3e-12"), (1.69e-6, "1.7e-6"), (0.0547, "0.055"), (0.721, "0.73")]
)
def test_small_numbers(value, text):
    assert load("measured").small(value) == text


def test_the_fastest_setting_of_a_family_and_the_ratio_have_the_times_of_all_processes():
    rows = []
    for name, family, role, errors, times in (
        ("taylor:order=8", "taylor", "ours", (1e-4, 1e-8), (1e-6, 1e-4)),
        ("taylor:order=12", "taylor", "ours", (1e-5, 1e-7), (1e-7, 2e-5)),
        ("heyoka", "heyoka", "engine", (1e-5, 1e-7), (1e-5, 4e-5)),
        ("scipy", "scipy", "engine", (1e-3, 1e-5), (1e-6, 1e-5)),  # does not reach the error
    ):
        for dt, error, time in zip((0.2, 0.1), errors, times, strict=True):
            common = {"scene": "brick_flip", "role": role, "dt": dt, "family": family}
            rows.append(row("work_precision", name, "attitude error max", error, **common))
            for process, noise in enumerate((1.0, 1.21)):
                spent = time * (noise if role == "ours" else 1.0)
                rows.append(row("work_precision", name, "time per simulated second", spent, **common, process=process))
    measure = load("rows")
    timed = measure.points(measure.with_names(measurement.frame(rows)))
    found = {
        (readme_row["name"], readme_row["quantity"]): readme_row["value"]
        for readme_row in measure.readme_rows(timed, "brick_flip")
    }
    assert found["heyoka", "time"] == pytest.approx(20)
    assert found["ours", "time"] == pytest.approx(1.1 * 1e6 * (1e-7 * 2e-5) ** 0.5)  # between its points; the mean of processes
    assert found["SciPy", "time"] == float("inf")
    mean, low, high = (found["ours", f"heyoka's time over ours{end}"] for end in ("", ", low", ", high"))
    assert mean == pytest.approx(found["heyoka", "time"] / found["ours", "time"])
    assert low < mean < high


def test_the_picture_has_the_chosen_methods_of_the_top(tmp_path):
    rows = []
    for name, role in (("taylor:order=12", "ours"), ("mujoco", "engine"), ("gauss", "ours")):
        for dt, error in ((0.02, 1e-3), (0.01, 1e-6)):
            common = {"scene": "lagrange_top", "role": role, "dt": dt}
            rows.append(row("work_precision", name, "attitude error max", error, **common))
            rows.append(row("work_precision", name, "time per simulated second", 1e-6 / dt, **common))
    measurement.frame(rows).to_csv(tmp_path / "measurements.csv", index=False)
    load("rows").draw(tmp_path, tmp_path / "picture.svg")
    picture = (tmp_path / "picture.svg").read_text(encoding="utf-8")
    assert [name in picture for name in ("taylor", "mujoco", "gauss")] == [True, True, False]


DELIVERED = "time per simulated second, final attitude and rates delivered"


def study(bodies, processes=5):
    """Return the rows of a study on a spring; each body is a pair of times of both sides, s, or None for a side that misses."""
    rows = []
    for index, pair in enumerate(bodies):
        for name, role, time in zip(("gauss", "heyoka"), ("ours", "engine"), pair, strict=True):
            common = {"scene": f"random_body:field=spring,seed=1,index={index}", "field": "spring", "seed": 1, "body": index}
            common |= {"role": role}
            rows.append(row("random", name, "attitude error max", 1e-13 if time else 1.0, **common))
            for process in range(processes):
                spent = (time or 1.0) * (1 + 0.02 * (process if role == "ours" else 0))
                rows.append(row("random", name, DELIVERED, spent, **common, process=process))
    return measurement.frame(rows)


def test_random_bodies_have_ratios_intervals_and_counts_at_all_errors():
    table = study([(1e-6, 2e-6), (1e-6, 8e-6), (1e-6, 1.04e-6), (3e-6, 1e-6), (None, 1e-6)])
    found = {(row["scene"], row["quantity"]): row["value"] for row in load("rows").body_rows(table)}
    ratios = {scene: value for (scene, quantity), value in found.items() if quantity == "heyoka's time over ours"}
    assert len(ratios) == 11
    slower = np.prod([1 + 0.02 * process for process in range(5)]) ** 0.2
    assert ratios["spring 1e-06 rad"] == pytest.approx((2 * 8 * 1.04 / 3) ** 0.25 / slower)
    low, high = (found["spring 1e-06 rad", f"heyoka's time over ours, {end}"] for end in ("low", "high"))
    assert low < ratios["spring 1e-06 rad"] < high
    counts = [found["all fields", f"cases{which}"] for which in ("", " won", " open", " lost")]
    assert counts == [55, 22, 11, 22]  # of the five bodies two are won, one is open, one is slower and one alone reached


def study_of_times(study, scene, measures, factor=1):
    """Return rows of a study in which heyoka takes 1.5 * factor times as long as ours, and ours varies between processes."""
    rows = []
    for name, role, error, time in (("taylor:order=12", "ours", 1e-7, 2e-6), ("heyoka", "engine", 1e-7, 3e-6 * factor)):
        common = {"scene": scene, "role": role, "family": name.partition(":")[0]}
        rows.append(row(study, name, "attitude error max", error, **common))
        for process in range(5):
            noise = 1 + 0.01 * process * (role == "ours")
            times = {f"time per simulated second{measure}": time * noise for measure in measures}
            if study == "each_step" and role == "engine":
                times["time per simulated second, each step kept, engine's own loop"] = time / 2
            rows += [row(study, name, each, spent, **common, process=process) for each, spent in times.items()]
    return rows


def test_rows_of_studies_replace_earlier_ones(copied, tmp_path, monkeypatch):
    """The other rows stay; a row has the duration of its motion in its name.

    README's ratio is the mean over durations, with the processes of two runs.
    """
    measured = load("measured")
    short = study_of_times("work_precision", "brick_flip", ("",))
    longer = study_of_times("work_precision", "brick_flip:t_end=24", ("",), 4)
    each = study_of_times("each_step", "brick_flip:t_end=24", (", each step kept", ""))
    for name, found in {"times": short, "times_again": short, "longer": longer, "each_step": each}.items():
        (tmp_path / name).mkdir()
        measurement.frame(found).to_csv(tmp_path / name / "study.csv", index=False)
    shutil.copyfile(measured.ROWS, tmp_path / "measured.csv")
    monkeypatch.setattr(measured, "ROWS", tmp_path / "measured.csv")
    before, *_ = measured.read_values()
    monkeypatch.setattr(sys, "argv", ["readme", "--from", str(tmp_path)])
    load("__main__").main(copied)
    after, *_ = measured.read_values()
    rewritten = {key for key in after if after[key] != before.get(key)}
    assert all("brick_flip" in scene or "lagrange_top" in scene for scene, *_ in rewritten)
    other = ("random bodies", "typed tolerance", "price", "reduced")
    assert {key for key in before if key[1] in other and key[2] != "time"} <= set(after)  # times are rows of the same command
    general = lambda place: measured.interval(after, place, measured.GENERAL)  # noqa: E731
    assert general("brick_flip 6 s, 1e-3") == pytest.approx([1.47, 1.44, 1.5], rel=0.02)
    assert general("brick_flip 24 s, 1e-6")[0] == pytest.approx(4 * 1.4708, rel=1e-3)
    own = "brick_flip 24 s, 1e-6, without the conversion of an engine's states"
    assert general(own)[0] == pytest.approx(1.4708 / 2, rel=1e-3)
    mean, low, high = measured.interval(after, "brick_flip", "ours")
    assert mean == pytest.approx(2 * 1.4708, rel=1e-3)
    assert low < mean / 1.9 < mean * 1.9 < high  # two durations that differ by a factor of 4
    assert "| heyoka 7.13.2 | < 1e-15" in (copied / "README.md").read_text(encoding="utf-8")


def test_typed_tolerances_are_compared_on_all_bodies_of_a_study():
    """Each body has its fastest frame, and each of its errors is the error of that frame."""
    rows = []
    for body, ratio in ((0, 2.0), (1, 8.0), (10, 4.0)):
        place = {"scene": f"random_body:index={body}", "field": "spring", "seed": 1, "body": body}
        for name, role, time, error in (
            ("taylor:tolerance=1e-06", "ours", 1.0, 1e-7),
            ("heyoka:tol=1e-06,frame=lean", "engine", ratio, 2e-7),
            ("heyoka:tol=1e-06", "engine", 10.0, 1e-3),
        ):
            common = place | {"role": role}
            rows.append(row("random", name, "attitude error max", error * (1 + body), **common))
            times = (row("random", name, DELIVERED, time, **common, process=each) for each in range(3))
            rows.extend(times)
    found = {
        (typed_row["scene"], typed_row["quantity"]): typed_row["value"]
        for typed_row in load("rows").typed_rows(measurement.frame(rows))
    }
    for place in ("spring 1e-06", "all fields 1e-06"):
        assert found[place, "heyoka's time over ours"] == pytest.approx(4)
        assert [found[place, f"heyoka's time over ours, {end}"] for end in ("smallest", "largest")] == pytest.approx([2, 8])
    assert found["all fields 1e-06", "heyoka, largest error"] == pytest.approx(11 * 2e-7)
    assert found["all fields 1e-06", "ours, median error"] == pytest.approx(2e-7)
    for place in ("spring", "all fields"):
        assert found[place, "mean ratio"] == pytest.approx(4)
        assert [found[place, quantity] for quantity in ("bodies", "cases", "cases lost", "smallest ratio")] == pytest.approx(
            [3, 3, 0, 2]
        )


def test_a_call_has_the_time_of_its_loop_and_what_it_adds():
    place = {"scene": "random_body:field=spring,seed=1,index=0", "field": "spring", "seed": 1, "body": 0}
    t_end, rows = cv.scenes.random_body("spring", 1, 0).t_end, []
    lines = (
        ("taylor:order=12", "taylor:order=12", "ours", 3e-6, 1e-6),
        ("taylor:tolerance=1e-06", "taylor:tolerance", "ours", 5e-6, 2e-6),
        ("heyoka:tol=1e-06", "heyoka", "engine", 9e-6, 1.5e-6),
        ("gauss", "gauss", "ours", 9e-6, 1.5e-6),
    )
    for name, series, role, loop, added in lines:
        common = place | {"role": role, "series": series}
        rows.append(row("random", name, "attitude error max", 1e-7, **common))
        rows.append(row("random", name, "time per simulated second", loop / t_end, **common))
        rows.append(row("random", name, DELIVERED, (loop + added) / t_end, **common))
    found = {(each["name"], each["quantity"]): each["value"] for each in load("rows").call_rows(measurement.frame(rows))}
    expected = {"Taylor, fixed steps": (3, 1), "Taylor, tolerance": (5, 2), "heyoka": (9, 1.5)}
    assert found == {
        (f"time of a call, {kind}", quantity): pytest.approx(value)
        for kind, values in expected.items()
        for quantity, value in zip(("loop", "added"), values, strict=True)
    }


def test_rows_of_an_earlier_seed_are_replaced():
    rows = load("rows")
    common = {"scene": "spring 1e-05", "name": "typed tolerance", "quantity": "heyoka's time over ours"}
    of_seed = "conservative study random --bodies 20 --seed 7 --methods taylor,heyoka"
    old = [common | {"command": of_seed}, common | {"scene": "picture", "command": rows.COMMANDS["moving"]}]
    new = [common | {"scene": "spring 1e-06", "command": rows.COMMANDS["random"]}]
    assert [row["scene"] for row in rows.replaced(old, new)] == ["picture", "spring 1e-06"]


@pytest.fixture
def of_bodies(tmp_path, monkeypatch):
    """Return a function that replaces the rows of random bodies by those of a study, and returns the program."""
    program, measure = load("measured"), load("rows")

    def replace_rows(bodies):
        texts = dict.fromkeys(measure.COLUMNS, "")
        with program.ROWS.open(encoding="utf-8", newline="") as file:
            rows = [each for each in csv.DictReader(file) if each["name"] != "random bodies"]
        rows += [texts | body_row for body_row in measure.body_rows(study(bodies))]
        with (tmp_path / "measured.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, measure.COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        monkeypatch.setattr(program, "ROWS", tmp_path / "measured.csv")
        return program

    return replace_rows


@pytest.mark.parametrize(
    "bodies", [[(1e-6, 2e-6), (None, None)], [(1e-6, 2e-6), (1e-6, 1.04e-6)], [(1e-6, 2e-6), (3e-6, 1e-6)]]
)
def test_the_counts_of_cases_add_up(bodies, of_bodies):
    program = of_bodies(bodies)
    text = " ".join(program.render_page(ENTRANTS).split())
    assert f"heyoka was faster in {11 if bodies[1] == (3e-6, 1e-6) else 'none'} of 22 cases" in text
    assert ("In 11, neither reached the error." in text) == (bodies[1] == (None, None))
    assert ("11 are undecided." in text) == (bodies[1] == (1e-6, 1.04e-6))
    values, *_ = program.read_values()
    counts = [int(values["all fields", program.BODIES, f"cases {which}"]) for which in ("won", "lost", "open")]
    assert counts == {None: [11, 0, 0], 1e-6: [11, 0, 11], 3e-6: [11, 11, 0]}[bodies[1][0]]
    assert sum(counts) + program.count_unreached(values) == 22


def test_the_page_follows_the_counts_and_intervals(of_bodies):
    program = of_bodies([(1e-6, 2e-6), (1e-6, 1.04e-6)])
    text = " ".join(program.render_page(ENTRANTS).split())
    assert re.search(r"by factors between 1\.4 \([\d.]+ to [\d.]+\) and 1\.4 \(", text)
    assert "heyoka was faster in none of 22 cases (one body at one error)." in text
    assert "11 are undecided." in text
    assert program.render_bodies().startswith("| error, rad | spring |\n| --- | --- |\n| 1e-3 | 1.39")


@pytest.mark.parametrize("factor", [1, 0.25])
def test_readme_names_a_field_in_which_heyoka_is_faster(factor, tmp_path, monkeypatch):
    """The rows about compiled loops alone show that the others are about calls."""
    program = load("measured")
    rows = program.read_csv(program.ROWS)
    for each in rows:
        if each["name"] == program.TYPED and each["scene"].startswith("gradient "):
            each["value"] = str(factor * float(each["value"]))
    loops = [each | {"name": program.TYPED + program.LOOPS} for each in rows if each["name"] == program.TYPED]
    with (tmp_path / "measured.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows([*rows, *loops])
    monkeypatch.setattr(program, "ROWS", tmp_path / "measured.csv")
    text = " ".join(program.render_page().split())
    assert "both sides deliver attitude and rates" in text
    lost = re.findall(r"\* In ([^*]*), heyoka is ([\d.]+) to ([\d.]+) times as fast as `Taylor`", text)
    values, *_ = program.read_values()
    means = [
        value for (place, *key), value in values.items() if key == [program.TYPED, program.RATIO] and place[:9] == "gradient "
    ]
    ends = [pytest.approx(1 / max(means), rel=0.06), pytest.approx(1 / min(means), rel=0.06)]
    assert [(field, float(low), float(high)) for field, low, high in lost] == (
        [] if factor == 1 else [(program.FIELDS["gradient"], *ends)]
    )
