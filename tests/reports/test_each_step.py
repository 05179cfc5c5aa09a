"""What a sample costs where each step of a scene is kept: in the first table, against the engines, and in words."""

import pytest

from conservative.reports.tables import each_step, headline, scene_contests, summary
from conservative.reports.tables.work_precision import points

from .rows import frame, point, row

POINTS = [*point("gauss", "ours", 1e-7, 4e-6), *point("heyoka", "engine", 1e-7, 2e-6)]
DT = 0.1


def each(line, role, kept, alone, **fields):
    """A method that keeps each step of the made-up scene: its time per sample, s, where all are kept and where the end is."""
    times = ("time per simulated second, each step kept", kept / DT), ("time per simulated second", alone / DT)
    values = (("attitude error max", 1e-7), *times)
    return [row("each_step", line, measure, value, DT, role=role, **fields) for measure, value in values]


TABLE = frame(
    [
        *POINTS,
        *each("gauss", "ours", 3e-7, 2e-7),
        *each("reduced", "ours", 5e-7, 1e-7),
        *each("lame", "ours", 1e-7, 1e-8),
        *each("heyoka", "engine", 6e-7, 5e-8),
        row("each_step", "mujoco", "attitude error max", 1e-3, DT, role="engine"),
    ]
)
FOUND = each_step.of_scene(TABLE, "made_up")


def test_the_first_table_has_the_cheapest_of_each_class_and_who_it_is():
    told = summary.of_scene(points(TABLE), frame([]), frame([]), integrable=True, each=FOUND)
    position = told.classes[0].index("µs a sample, each step kept")
    assert [line[position] for line in told.classes[1]] == [
        "0.30 gauss; the end alone: 0.10 reduced",
        "0.10 lame; the end alone: 0.010",
        "0.60 heyoka; the end alone: 0.050",
        "–",  # its only error is too large
    ]


def test_contests_have_both_at_last_in_the_units_of_their_columns():
    header, body = scene_contests.contests(points(TABLE), 0.5, FOUND)
    assert header[1:4] == ("cheapest general integrator of ours", "µs per s", "µs a sample")
    kept, alone = body[-2:]
    assert kept[:8] == ["1e-6, each 0.1 s kept", "gauss", "3.00", "0.300", "heyoka", "6.00", "0.600", "2.00"]
    assert kept[8:] == ["lame", "1.00", "0.100", "6.00"]
    assert alone[:8] == ["1e-6, each 0.1 s, the end kept", "reduced", "1.00", "0.100", "heyoka", "0.500", "0.0500", "0.500"]
    assert len(scene_contests.contests(points(TABLE), 0.5)[1]) == len(body) - 2


def test_what_is_lost_with_the_end_alone_is_said():
    found = list(headline.of_each_step("made_up", FOUND))
    assert [each.lost for each in found] == [False, False, True, False]
    assert found[0].text.startswith(
        "gauss (our general integrators) is 2.0 times as fast as heyoka, with a sample at each 0.1 s"
    )
    assert found[0].text.endswith("at 1e-6 rad.")
    assert found[2].text.startswith(
        "heyoka is 2.0 times as fast as reduced (our general integrators), where the end alone is kept of steps of 0.1 s"
    )


@pytest.mark.parametrize("table", [frame(POINTS), frame([*POINTS, *each("gauss", "ours", 1e-7, 1e-7, outcome="diverged")])])
def test_without_the_study_or_a_run_that_ends_there_is_nothing(table):
    found = each_step.of_scene(table, "made_up")
    assert list(headline.of_each_step("made_up", found)) == []
    assert len(found.kept) == len(found.alone) == 0


@pytest.mark.parametrize("ratio", [0.92, 1.0, 1.09])
def test_times_within_a_tenth_are_the_same(ratio):
    assert headline._faster(("ours", "heyoka"), ratio) == "ours and heyoka take the same time to 10 %"


@pytest.mark.parametrize(
    ("ratio", "told"), [(1.2, "ours is 1.2 times as fast as heyoka"), (0.5, "heyoka is 2.0 times as fast as ours")]
)
def test_times_further_apart_are_told(ratio, told):
    assert headline._faster(("ours", "heyoka"), ratio) == told
