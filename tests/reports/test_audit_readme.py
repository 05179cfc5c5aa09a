"""README has no number that the evidence does not support; and what breaks that is found."""

import json
import math

import pandas as pd
import pytest

from conservative import BadInput
from conservative.benchmarks.measures import measurement
from conservative.reports.documentation.audit import measured, readme
from conservative.reports.documentation.audit.text import NUMBER, Number, Page
from conservative.reports.documentation.evidence import store
from conservative.reports.documentation.evidence.store import Evidence
from conservative.reports.labels import with_names

from .rows import point, row
from .test_random_ratios import SLOWER, TWICE

TEXT = readme.README.read_text(encoding="utf-8")
CLAIMS = readme.CLAIMS.read_text(encoding="utf-8")
FREE = "10,000 starts of a free body, 100 s each, the end alone"
PLACE = "## Many bodies\n\n"
"""Where sentences are planted."""


@pytest.fixture(scope="module")
def evidence():
    return Evidence()


def changed(evidence, **parts):
    """The same evidence with other parts, of which entries and tables are made anew if they are rows."""
    other = Evidence(evidence.folder)
    made = ("entries", "tables") if "rows" in parts else ()
    vars(other).update({name: part for name, part in vars(evidence).items() if name not in made} | parts)
    return other


def test_every_number_of_the_readme_is_supported(evidence):
    assert readme.audit(TEXT, evidence, CLAIMS) == []


@pytest.mark.parametrize(
    ("sentence", "number"),
    [
        ("On the brick heyoka takes 17.3 times as long.", "17.3"),
        ("On the brick heyoka takes `17.3` times as long.", "17.3"),
        ("Ours is twice as fast as heyoka.", "twice"),
        ("Ours is tenfold faster.", "tenfold"),
        ("MuJoCo needs 3x the time.", "3"),
        ("![Ours is 12 times as fast](reports/pictures/polhodes.svg)", "12"),
        ("It takes 0.2 ms on 1,000 bodies.", "0.2"),
    ],
)
def test_a_planted_sentence_fails(sentence, number, evidence):
    found = readme.audit(TEXT.replace(PLACE, f"{PLACE}{sentence}\n\n"), evidence, CLAIMS)
    line = TEXT[: TEXT.index(PLACE)].count("\n") + 3
    assert found[0].startswith(f'README.md:{line}: "{number}" in ')
    assert found[0].endswith(": no row of the evidence supports it")


@pytest.mark.parametrize("name", ["with `reduced`", "both Euler methods", "at the 95th percentile", "are far off at some time"])
def test_another_digit_in_a_sentence_fails(name, evidence):
    *_, last = (found for found in NUMBER.finditer(TEXT[: TEXT.index(name)]))
    other = {"twice": "half"}.get(last[0], last[0].replace(last[0][0], "7", 1))
    found = readme.audit(TEXT[: last.start()] + other + TEXT[last.end() :], evidence, CLAIMS)
    assert len(found) == 1
    assert f'"{other}"' in found[0]
    assert "the rows give" in found[0]


@pytest.mark.parametrize("header", ["| scene | ", "| field | "])
def test_another_digit_in_a_table_fails(header, evidence):
    row = TEXT[TEXT.index(header) :].splitlines()[2]
    value = next(found for found in NUMBER.finditer(row) if "." in found[0])[0]
    found = readme.audit(TEXT.replace(row, row.replace(value, f"9{value}", 1)), evidence, CLAIMS)
    assert len(found) == 1
    assert found[0].endswith(f": the evidence gives {row}")


def test_tables_are_written_anew(evidence, tmp_path):
    page = tmp_path / "README.md"
    page.write_text(TEXT.replace("| gravity | 3", "| gravity | 9").replace("| brick_flip | 1e-9 |", "| brick_flop | 1e-9 |"))
    readme.write_tables(page, evidence)
    assert page.read_text() == TEXT
    with pytest.raises(BadInput, match="no table whose header begins with"):
        readme.write_tables(tmp_path / "README.md", changed(evidence, tables=(("| else | 1 |",),)))


def test_another_value_in_the_evidence_fails(evidence):
    rows = evidence.rows
    other = rows.assign(value=rows["value"].where(rows["method"] != "reduced", 3 * rows["value"]))
    (by_hand,) = [name for name in evidence.by_hand if "mujoco.rollout" in name]
    for parts, number in (
        ({"rows": other}, '"5e-16"'),
        ({"by_hand": {**evidence.by_hand, by_hand: (309.0,)}}, '"308"'),
        ({"by_hand": {}}, "by_hand.csv has no row"),
    ):
        found = readme.audit(TEXT, changed(evidence, **parts), CLAIMS)
        assert found
        assert number in " ".join(found)


def test_a_claim_or_an_allowed_text_that_is_not_on_the_page_fails(evidence):
    for entry in (
        '[[allowed]]\ntext = "17 engines"\nreason = ""\n',
        '[[claim]]\ntext = "{count} engines of ours"\nfrom = "origin"\n',
    ):
        (found,) = readme.audit(TEXT, evidence, f"{CLAIMS}\n{entry}")
        assert found.endswith("stands 0 times in README.md, and has to stand there once")


def test_a_claim_covers_no_number_that_it_does_not_name(evidence):
    was, other = (f'of = "{name}"' for name in ("1000 heavy tops: mujoco.rollout over ours at 1e-3 rad", FREE))
    claims = CLAIMS.replace(was, other)
    assert '"1e-3"' in " ".join(readme.audit(TEXT, evidence, claims))


@pytest.mark.parametrize(
    ("text", "value", "agrees"),
    [
        ("3.10", 3.104, True),
        ("3.10", 3.106, False),
        ("220", 224.0, True),
        ("220", 226.0, False),
        ("1,200", 1249.0, True),
        ("40", 40, True),
        ("40", 41, False),
        ("100", 104, False),
        ("1e-7", 1.04e-7, True),
        ("1e-7", 1.6e-7, False),
        ("half", 0.51, True),
        ("half", 0.6, False),
        ("eighteen", 18, True),
        ("7.13.2", 7.13, False),
        ("2026-11-22", "2026-11-22", True),
    ],
)
def test_a_number_says_what_people_round_to_it(text, value, agrees):
    assert Number(0, len(text), text).agrees(value) is agrees


def test_numbers_are_found_in_prose_alone():
    page = Page("page", "RK4 of 2 [3](4.md) `x = 5` `6`\n\n    7\n\n```\n8\n```\nhttps://x.y/9 10th 1e-3, 1,000.\n")
    assert [number.text for number in page.numbers] == ["2", "3", "6", "10", "1e-3", "1,000"]


def test_bounds_hold_on_their_side():
    assert Number(0, 4, "1e-9").lies_above(3.8e-10)
    assert not Number(0, 4, "1e-9").lies_above(1.6e-9)
    assert Number(0, 4, "4e-4").lies_below(0.00044)
    assert not Number(0, 4, "4e-4").lies_below(0.00034)


COSTS = [
    *(each for dt, error in ((2, 1e-2), (1, 1e-10)) for each in point("gauss", "ours", error, 1e-6 / dt, dt=dt)),
    *point("reduced", "ours", 1e-12, 1.0),
    *point("mujoco", "engine", 1e-12, 1e-4, version="4.0.0", setting="RK4"),
    row("paper", "reduced", "energy drift max", 4e-16),
    row("speed", "reduced", "first call time", 0.25),
]


def written(folder, name, rows, told):
    measurement.frame(rows).to_csv(folder / f"{name}.csv", index=False)
    (folder / f"{name.replace('study', 'study')}.json").write_text(json.dumps(told))
    return folder


def test_the_evidence_is_what_decides(tmp_path):
    told = {"command": "conservative report --out x", "date": "2026-01-01T00:00:00", "commit": "abc", "machine": {"cores": "2"}}
    (tmp_path / "kept").mkdir()
    path = store.keep(written(tmp_path, "measurements", COSTS, told), tmp_path / "kept")
    kept = pd.read_csv(path)
    assert set(kept["study"]) == {"work_precision", "paper"}
    assert set(kept["method"]) == {"gauss", "mujoco", "reduced"}
    assert len(kept[kept["method"] == "reduced"]) == 1  # its line is nowhere the cheapest
    study = tmp_path / "study"
    study.mkdir()
    bodies = [each for rows in (*TWICE, *SLOWER) for each in rows]
    store.keep(written(study, "study", bodies, {**told, "command": "conservative study random"}), tmp_path / "kept")
    found = Evidence(tmp_path / "kept")
    assert found.origin["costs"] == {"command": "conservative report", "date": told["date"], "commit": "abc", "cores": "2"}
    assert found.origin["random"]["command"] == "conservative study random"
    assert measured.random_bodies(found)["field"] == 2
    assert measured.random_bodies(found, 1e-6)["most"] == pytest.approx(2.0)


def test_rows_that_decide_nothing_are_no_evidence(tmp_path):
    with pytest.raises(BadInput, match="rows that README's tables follow from"):
        store.keep(written(tmp_path, "study", [row("speed", "reduced", "first call time", 0.25)], {}), tmp_path)


def test_drifts_and_ratios_need_their_rows(evidence):
    without = changed(evidence, rows=with_names(measurement.frame(COSTS)))
    with pytest.raises(measured.NoSupportError, match="0 rows of mujoco"):
        measured.drift(without, "brick_flip", ["mujoco"])
    assert measured.ratios(without, "our general integrators", ["mujoco"])["high"] == pytest.approx(200, rel=0.2)
    with pytest.raises(measured.NoSupportError, match="no row is about it"):
        measured.ratios(without, "our general integrators", ["heyoka"])
    assert math.isnan(measured._ratio({}, "a", "b", 1e-3))
