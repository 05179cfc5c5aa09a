import numpy as np

from conservative.benchmarks.verification import exact_solutions as study


def test_the_study_passes_on_a_few_cases(capsys):
    assert study.main(["--free", "3", "--tops", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.endswith("us a sample") for line in lines] == [True, True, False, False, False, False]
    assert [line.split("  ")[0] for line in lines[2:]] == [
        "free, near the separatrix",
        "free",
        "top, within 1e-5 of a pole",
        "top",
    ]


def test_the_study_fails_on_an_error_above_its_bound(monkeypatch, capsys):
    monkeypatch.setattr(study.Trial, "errors", lambda case: (2e-13, 0.0))
    assert study.main(["--free", "2", "--tops", "0"]) == 1
    assert "2.0e-13" in capsys.readouterr().out


def test_its_near_cases_are_near():
    for number in range(0, 100, 20):
        case = study.draw_top(np.random.default_rng(number), 1e-6)
        assert study.pole_distance(case, case.t[-1]) < 1e-5
        body, w = (
            study.draw_free(np.random.default_rng(number), 1e-6).body,
            study.draw_free(np.random.default_rng(number), 1e-6).w_WB_B0,
        )
        L = body.momentum(w)
        middle = np.sort(body.moments)[1]
        assert abs(L @ L / (w @ L) / middle - 1) < 2e-6
