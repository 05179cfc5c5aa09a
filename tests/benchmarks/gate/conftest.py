import pytest

from conservative.benchmarks.gate import baseline, yardstick
from conservative.benchmarks.gate.results import Results

from .gate_rows import MACHINE, METHODS, STEP, TURN, row_of


@pytest.fixture(scope="module", autouse=True)
def clock():
    """Time as the gate sees it, without the machine: each step takes as long as all others."""

    def wall_time(run, calls=1):
        done = run()
        return calls * (done * TURN if isinstance(done, int) else done.counters.steps * STEP)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(yardstick, "wall_time", wall_time)
        patch.setattr(yardstick, "compile_reference", lambda: lambda n_steps, h: n_steps)
        yield


@pytest.fixture(scope="module")
def untouched():
    rows = [row_of(name) for name in METHODS]
    return Results(MACHINE, {row.id: row for row in rows}, "abc")


@pytest.fixture(scope="module")
def kept(untouched):
    return baseline.update_baseline(None, [untouched], "the first one")
