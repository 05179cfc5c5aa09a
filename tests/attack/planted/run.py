"""Verify planted files, and compare the answers with what was decided."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
import signal
import tempfile
import time
import traceback
from collections.abc import Iterable, Iterator, Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from .files import Planted, plant

BARE = " without normalisation"
LONGEST = 60.0
"""Processor time, s, after which a verification is ended."""
ALIASES: dict[str, tuple[str, ...]] = {
    "without the rotor": ("size of the rotor",),
    "without the torque": ("size of the torque",),
    "without the damping": ("size of the damping",),
    "without the field": ("size of the field",),
    "sign of the rotor": ("size of the rotor",),
    "sign of the torque": ("size of the torque",),
    "sign of the damping": ("size of the damping",),
    "sign of the field": ("size of the field",),
    "factor one half": ("speed of attitudes",),
    "speed of attitudes": ("factor one half",),
    "rates in degrees": ("size of the rates",),
    "rates in radians": ("size of the rates",),
    "reversed rates": ("size of the rates", "rates in mirrored axes"),
    "held rows": ("held samples",),
    "held samples": ("held rows",),
    "interpolated quaternions and interpolated rates": ("interpolated matrices and interpolated rates",),
    "dropped rows": ("jittered times",),
    "time shift": ("phase drift",),
    "time scale": ("phase drift",),
    "time in ms": ("phase drift", "time scale"),
    "other moments": ("another body",),
    "another body": ("other moments",),
    "rate limit per component": ("rate limit",),
}
"""Other names that are as true: a part that is missing is one of size 0."""
LOOSE: dict[str, tuple[str, ...]] = {
    "no products of inertia": ("another body", "other moments"),
    "sign of the products of inertia": ("another body", "other moments"),
    "inverted inertia": ("another body", "other moments"),
    "first row": ("single rows",),
    "transposed in some rows": ("some rows", "single rows"),
    "held rows": ("some rows", "jittered times"),
    "held samples": ("some rows", "jittered times"),
    "drift in body axes": ("bias of the rates",),
    "drift of a bias": ("bias of the rates",),
}
"""True statements that do not name the mistake."""


def command(made: Planted) -> str:
    """Return the command that repeats a verification."""
    words = ["conservative", "verify", f"run{made.ending}", "--body", "scene.toml"]
    for name, value in made.options.items():
        words += [f"--{name}", str(value)]
    return shlex.join(words)


class TooLong(KeyboardInterrupt):
    """Not an `Exception`, so that nothing on the way takes it for a fault of the file."""


def _stop(number: int, frame: object) -> None:
    raise TooLong


def digest(made: Planted) -> str:
    """Return a digest of a file and its scene."""
    return hashlib.sha256((made.scene + made.text).encode()).hexdigest()[:12]


def outcome(seed: int, folder: Path) -> dict[str, Any]:
    """Return the row of a seed: the file, the answer, and the complaint about it."""
    from conservative.benchmarks.verification.verify import verify
    from conservative.errors import BadInput

    began = time.process_time()
    made = plant(seed)
    path, scene = folder / f"run{made.ending}", folder / "scene.toml"
    path.write_text(made.text, encoding="utf-8")
    scene.write_text(made.scene, encoding="utf-8")
    begun = time.process_time()
    row: dict[str, Any] = {
        "seed": seed, "kind": made.kind, "mistake": made.mistake, "layout": made.layout, "noise": made.noise,
        "expected": made.expected, "identifiable": made.identifiable, "reason": made.reason, "same": sorted(made.same),
        "size": made.size, "scene": made.about["parts of the scene"], "command": command(made),
        **{key: made.about.get(key, 0) for key in ("turns", "rows", "shape", "special", "gaps", "nan", "duplicated", "cut")},
        "grain": made.about["grain"], "per turn": round(made.about["per turn"], 2), "parts": made.about["parts"],
        "text": digest(made),
    }  # fmt: skip
    limited = hasattr(signal, "setitimer")
    before = signal.signal(signal.SIGPROF, _stop) if limited else None
    try:
        if limited:
            signal.setitimer(signal.ITIMER_PROF, LONGEST)
        (found,) = verify([path], scene, **made.options)
        finding = found.findings[0]
        row |= {
            "verdict": str(found.verdict), "reason given": found.reason,
            "named": [list(cause.keys) for cause in finding.causes], "notes": [*found.notes],
        }  # fmt: skip
    except BadInput as error:
        row |= {"verdict": "refused", "reason given": str(error), "named": [], "notes": []}
    except TooLong:
        row |= {"verdict": "no answer", "reason given": f"no answer in {LONGEST:g} s", "named": [], "notes": []}
    except Exception:  # a fault of the verification, which is a complaint
        row |= {"verdict": "crashed", "reason given": traceback.format_exc(limit=-3), "named": [], "notes": []}
    finally:
        if limited:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, before)
    row["seconds"] = [round(begun - began, 2), round(time.process_time() - begun, 2)]
    return row | {"complaint": complaint(row)}


def bare(key: str) -> str:
    return key.removesuffix(BARE)


def true_names(row: dict[str, Any]) -> set[str]:
    """Return the names that are true for a file."""
    own = {row["mistake"], *ALIASES.get(row["mistake"], ()), *LOOSE.get(row["mistake"], ())}
    others = {name for same in row["same"] for name in (same, *ALIASES.get(same, ()))}
    return own | others


def is_named(row: dict[str, Any]) -> bool:
    """Return whether the answer names the mistake."""
    names = {row["mistake"], *ALIASES.get(row["mistake"], ())}
    return any({bare(key) for key in keys} <= names for keys in row["named"])


def complaint(row: dict[str, Any]) -> str:
    """Return the complaint about the answer to a file, or ""."""
    if row["verdict"] in ("refused", "no answer", "crashed"):
        return str(row["verdict"])
    if row["expected"] == "right" and row["verdict"] == "wrong":
        return "right called wrong"
    if row["expected"] == "wrong" and row["verdict"] == "right":
        return "wrong called right"
    true = true_names(row)
    if row["named"] and not any({bare(key) for key in keys} <= true for keys in row["named"]):
        return "false name"
    if row["verdict"] == "undecided" and (row["expected"] == "right" or row["identifiable"]):
        return "undecided"
    if row["identifiable"] and not is_named(row):
        return "not named"
    return ""


def load(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a file; the last one of a seed counts."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []
    return [*{row["seed"]: row for row in rows}.values()]


def run(path: Path, seeds: Iterable[int], tell: Any = print) -> Iterator[dict[str, Any]]:
    """Yield the rows of seeds that `path` does not have, which are verified and appended."""
    done = {row["seed"] for row in load(path)}
    with tempfile.TemporaryDirectory() as folder, path.open("a", encoding="utf-8") as stream:
        for seed in seeds:
            if seed in done:
                continue
            row = outcome(seed, Path(folder))
            stream.write(json.dumps(row) + "\n")
            stream.flush()
            if row["complaint"]:
                tell(line_of(row))
            yield row


FACTS = {
    "parts": "steps a row", "gaps": "rows missing", "nan": "rows of nan", "duplicated": "rows twice", "cut": "rows cut off",
}  # fmt: skip
"""Facts of a row that a complaint shows."""


def line_of(row: dict[str, Any]) -> str:
    """Return a complaint as a line: seed, scene, mistake, expected, answer, seconds."""
    expected = row["expected"] or "either"
    names = " or ".join(" + ".join(keys) for keys in row["named"])
    answer = f"{row['verdict']}: {names or 'no name'}"
    facts = f"{row['layout']}, {row['noise']}, {row['turns']} turns, {row['rows']} rows"
    facts += "".join(f", {row[name]} {what}" for name, what in FACTS.items() if row.get(name))
    same = f" (or {', '.join(row['same'])})" if row["same"] else ""
    return (
        f"{row['seed']} | {row['complaint']} | {row['scene']}; {facts} | {row['mistake']}{same}, {row['size']:.3g} grains | "
        f"expected {expected}{', named' * row['identifiable']} | said {answer} | {row['seconds'][1]} s"
    )


def _work(path: Path, seeds: list[int], parent: int) -> None:
    for _ in run(path, seeds, lambda text: print(text, flush=True)):
        if os.getppid() != parent:  # a run that is killed leaves no process behind
            return


def run_all(path: Path, seeds: Sequence[int], count: int = 2) -> list[dict[str, Any]]:
    """Return the rows of seeds, verified in some processes. Each appends to a file of its own; `path` gets all at the end."""
    parts = [path.with_suffix(f".{i}.jsonl") for i in range(count)]
    others = [part for part in path.parent.glob(f"{path.stem}.*.jsonl") if part not in parts]
    done = {row["seed"] for part in (path, *parts, *others) for row in load(part)}
    left = [seed for seed in seeds if seed not in done]
    start = get_context("spawn").Process  # compiled code and its threads do not survive a fork everywhere
    shares = [(part, left[i::count], os.getpid()) for i, part in enumerate(parts) if left[i::count]]
    workers = [start(target=_work, args=share) for share in shares]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    if any(worker.exitcode for worker in workers):
        raise RuntimeError(f"a process ended with {[worker.exitcode for worker in workers]}; its rows are kept")
    rows = {row["seed"]: row for part in (path, *parts, *others) for row in load(part)}
    path.write_text("".join(json.dumps(rows[seed]) + "\n" for seed in sorted(rows)), encoding="utf-8")
    for part in (*parts, *others):
        part.unlink(missing_ok=True)
    return [rows[seed] for seed in seeds]
