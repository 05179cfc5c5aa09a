"""`conservative judge` against files with a planted mistake, or none, whose answers are decided before it runs.

No right file is called wrong, no wrong file right, and no diagnosis that is called proven is false. Of the mistakes that are
identifiable 99 of 100 are named. `pytest` judges 60 files, `pytest --attack` 1,000. The matrix is a page of the documentation:

    python -m tests.attack.test_recordings results.jsonl 0 1000
"""

import json
import sys
import tempfile
import time
from pathlib import Path

from conservative.benchmarks.judge.table import read
from conservative.benchmarks.judge.verdict import judge

from .recordings import plant

BARE = " without normalisation"


def outcome(seed, folder):
    """Return what was planted in the file of a seed, what the judge says, and its complaints."""
    began = time.process_time()
    made = plant(seed)
    path = Path(folder) / "run.csv"
    path.write_text(made.text, encoding="utf-8")
    begun = time.process_time()
    found = judge(made.case.scene(), read(path, made.options))[0]
    named = [each.name.removesuffix(BARE) for each in filter(None, [found["diagnosis"], *found["equally good"]])]
    row = {
        "seed": seed, "mistake": made.mistake, "layout": made.layout, "noise": "single" if made.single else made.noise,
        "turns": round(made.turns, 2), "expected": made.expected, "identifiable": made.identifiable, "size": made.size,
        "same": sorted(made.same), "verdict": found["verdict"], "named": named,
        "candidates": [each.name for each in found["candidates"]], "undecided": found["undecided"],
        "error": found["error"], "allowed": found["allowed"], "grain": made.about["grain"],
        "about": {k: v for k, v in made.about.items() if isinstance(v, (int, float, str))},
        "seconds": [round(begun - began, 2), round(time.process_time() - begun, 2)],
    }  # fmt: skip
    return row | {"complaint": complaint(row)}


def complaint(row):
    """Return what is wrong about the answer to a file, or ""."""
    true = {row["mistake"], *row["same"]}
    if row["expected"] == "right" and row["verdict"] == "wrong":
        return "right called wrong"
    if row["expected"] == "wrong" and row["verdict"] == "right":
        return "wrong called right"
    if row["named"] and not true & set(row["named"]):
        return "false proof"
    if row["identifiable"] and row["mistake"] not in row["named"]:
        return "not named"
    return ""


def run(path, start, end):
    """Judge the files of seeds from start to end that are not in `path` yet, and append their rows to it."""
    path = Path(path)
    done = {json.loads(line)["seed"] for line in path.read_text().splitlines()} if path.exists() else set()
    with tempfile.TemporaryDirectory() as folder, path.open("a") as stream:
        for seed in range(start, end):
            if seed in done:
                continue
            try:
                row = outcome(seed, folder)
            except Exception as error:
                row = {"seed": seed, "complaint": f"{type(error).__name__}: {error}"}
            stream.write(json.dumps(row) + "\n")
            stream.flush()
            print(seed, row.get("mistake"), row.get("seconds"), row["complaint"], flush=True)


if __name__ == "__main__":
    run(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
