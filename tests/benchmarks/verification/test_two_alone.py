"""Two recordings without a description of their body: the fit of a free rotation, and which of two is wrong."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import conservative as cv
from conservative.benchmarks.verification.recordings import two_alone
from conservative.benchmarks.verification.recordings.free_body import Freedom, fit_free_body
from conservative.benchmarks.verification.recordings.kinematics import find_contradiction
from conservative.benchmarks.verification.recordings.table import Recording
from conservative.benchmarks.verification.recordings.two_alone import verify_two_alone
from conservative.errors import BadInput
from conservative.number_text import number
from conservative.reports.run.single_run import csv_text

from ...sampling import sampled
from .made import BODY, FREE, HEAVY, START, T, exact, late, noisy, reordered, stepped, turned, without

R, W = exact(FREE)
OTHER = cv.Scene("other", cv.RigidBody(BODY.inertia + np.diag([0.2, 0.0, 0.1])), *START, 6.0)
SPIN = FREE.rename("spin", body=cv.RigidBody([1.0, 1.2, 1.5]), w_WB_B0=[0.0, 0.0, 1.0])
BALL = FREE.rename("ball", body=cv.RigidBody([1.0, 1.0, 1.0]))
TOP = FREE.rename("top", body=cv.RigidBody([1.0, 1.0, 1.5]))


def of(R, w, t=T):
    return Recording(t, (R, w), rows=len(t))


def in_world(R, w):
    return (R @ w[..., None])[..., 0]


@pytest.mark.parametrize(
    ("name", "recording"),
    [("both", of(R, W)), ("attitudes", of(R, None)), ("rates", of(None, W)), ("noise", of(*noisy(FREE, 1e-3)))],
)
def test_the_body_of_a_free_rotation_is_found_up_to_a_factor(name, recording):
    fit = fit_free_body(recording)
    assert (fit.freedom, fit.determined) == (Freedom.FREE, True)
    off = np.abs(fit.scene.body.inertia - BODY.inertia / np.trace(BODY.inertia)).max()
    assert off < (1e-4 if name == "noise" else 1e-9)  # measured: 2e-5 and up to 1e-11
    assert off < 5 * max(fit.sizes.max(), 1e-11)  # the intervals are not too small


@pytest.mark.parametrize(
    "recording",
    [
        of(*without(FREE, 0.01, gyroscopic=True)),
        of(*late(FREE, 0.02)),
        of(*reordered(FREE)),
        of(np.swapaxes(R, 1, 2), W),
        of(np.swapaxes(R, 1, 2), None),
        of(R, in_world(R, W)),
        of(R, -W),
        of(*exact(HEAVY)),
        of(None, exact(HEAVY)[1]),
        of(*stepped(FREE, "RK4", 1)),
    ],
)
def test_a_recording_that_no_body_explains_is_not_free(recording):
    fit = fit_free_body(recording)
    assert (fit.freedom, fit.determined) == (Freedom.NOT_FREE, False)


@pytest.mark.parametrize("scene", [SPIN, BALL])
def test_rows_that_do_not_determine_a_body(scene):
    fit = fit_free_body(of(*exact(scene)))
    assert (fit.freedom, fit.determined) == (Freedom.FREE, False)


def test_a_symmetric_body_that_nutates_is_determined():
    fit = fit_free_body(of(*exact(TOP)))
    assert fit.determined
    np.testing.assert_allclose(np.sort(fit.scene.body.moments) * 3.5, [1, 1, 1.5], atol=1e-8)  # measured: 1e-12


@pytest.mark.parametrize("rows", [2, 3, 5])
def test_few_rows_accuse_nobody(rows):
    wrong = of(R[:rows], in_world(R, W)[:rows], T[:rows])
    assert fit_free_body(wrong).freedom is not Freedom.NOT_FREE
    found = verify_two_alone(("a", of(R[:rows], W[:rows], T[:rows])), ("b", wrong))
    assert found.findings[0].verdict != "wrong"


WRONG = {
    "world rates": lambda: of(R, in_world(R, W)),
    "order xyzw": lambda: of(*reordered(FREE)),
    "transposed": lambda: of(np.swapaxes(R, 1, 2), None),
    "RK4": lambda: of(*stepped(FREE, "RK4", 1)),
}


@pytest.mark.parametrize(("key", "order"), sampled([(key, order) for key in WRONG for order in (1, -1)], 4))
def test_the_wrong_one_is_named_with_its_mistake(key, order):
    pair = [("a", of(R, W)), ("b", WRONG[key]())][::order]
    found = verify_two_alone(*pair)
    finding = {finding.subject: finding for finding in found.findings}
    assert found.verdict == "wrong"
    assert (finding["a"].verdict, finding["b"].verdict) == ("right", "wrong")
    assert finding["b"].mistake == key
    assert finding["b"].causes[0].left < 1e-9  # measured: up to 1e-14
    assert found.notes[0].startswith(two_alone.ASSUMED)


@pytest.mark.parametrize(
    ("keys", "second"),
    [
        (("", "no gyroscopic term"), lambda: of(*without(FREE))),
        (("body axes", "body axes"), lambda: of(*turned(FREE, 0.2, 0.5, 0.1))),
        pytest.param(("another body", "another body"), lambda: of(*exact(OTHER)), marks=pytest.mark.slow),
    ],
)
def test_the_files_cannot_tell_which_of_two_free_rotations_is_wrong(keys, second):
    found = verify_two_alone(("a", of(R, W)), ("b", second()))
    assert [finding.verdict for finding in found.findings] == ["undecided"] * 3
    assert tuple(finding.mistake for finding in found.findings[:2]) == keys


OTHER_T = np.linspace(0.3, 5.9, 87)


@pytest.mark.parametrize(
    ("second", "verdicts"),
    [
        (of(*exact(FREE, OTHER_T), OTHER_T), ["right"] * 3),
        (of(*exact(FREE, OTHER_T), OTHER_T + 0.3), ["right"] * 3),
        (of(Rotation.from_rotvec([0.3, 0.2, 0.7]).as_matrix() @ R, W), ["right"] * 3),
        (of(None, W), ["right"] * 3),
        (of(R, None), ["right"] * 3),
        (of(R[:6], W[:6], T[:6]), ["right"] * 3),
        (of(*noisy(FREE, 1e-3)), ["right"] * 3),
    ],
)
def test_two_right_ones_are_right_whatever_their_columns_times_and_axes(second, verdicts):
    for pair in ([("a", of(R, W)), ("b", second)], [("b", second), ("a", of(R, W))]):
        assert [finding.verdict for finding in verify_two_alone(*pair).findings] == verdicts


def test_neither_is_accused_if_none_rotates_freely_or_shows_its_body():
    heavy, spinning = of(*exact(HEAVY)), of(*exact(SPIN))
    for first, second, verdict in (
        (heavy, of(*without(FREE, 0.01, True)), "undecided"),
        (heavy, heavy, "right"),
        (spinning, of(*without(SPIN, 0.01, True)), "undecided"),
    ):
        found = verify_two_alone(("a", first), ("b", second))
        assert [finding.verdict for finding in found.findings] == ["undecided", "undecided", verdict]
        assert found.verdict == "undecided"


def write(folder, name, scene):
    path = folder / name
    path.write_text(csv_text(cv.integrate(scene, 0.05, cv.Taylor())))
    return path


def test_files_without_a_body(tmp_path):
    a, b = write(tmp_path, "a.csv", FREE), write(tmp_path, "b.csv", FREE.rename("longer", t_end=7.0))
    (found,) = cv.verification.verify([a, b])
    assert (found.verdict, found.kind, found.subject) == ("right", "recordings", "a.csv and b.csv")
    cv.verification.verify([a, b], record=tmp_path / "known.txt")
    (again,) = cv.verification.verify([a, b], known=tmp_path / "known.txt")
    assert again.exit_code == 0


def test_bad_input_without_a_body(tmp_path):
    a, b = write(tmp_path, "a.csv", FREE), write(tmp_path, "b.csv", OTHER)
    for subjects, options, argument in (
        ([a], {}, "body"),
        ([a, b, a], {}, "body"),
        ([tmp_path], {}, "body"),
        ([a, a], {}, "subjects"),
        ([a, tmp_path / "." / "a.csv"], {"body": FREE}, "subjects"),
        ([a, b], {"start": "scene"}, "start"),
    ):
        with pytest.raises(BadInput) as refused:
            cv.verification.verify(subjects, **options)
        assert refused.value.argument == argument


def spin(*changes, t=T):
    """A steady spin, whose body is not determined, after changes of its rates."""
    R, w = exact(SPIN, t)
    for change in changes:
        w = change(R, w)
    return of(R, w, t)


TOP_IN_FIELD = exact(HEAVY)


@pytest.mark.parametrize(
    ("first", "second", "key", "agree"),
    [
        (spin(), spin(in_world), "world rates", True),
        (spin(), spin(lambda R, w: 0.5 * w), "size of the rates", True),
        (of(*TOP_IN_FIELD), of(TOP_IN_FIELD[0], in_world(*TOP_IN_FIELD)), "world rates", True),
        (of(*TOP_IN_FIELD), of(np.swapaxes(TOP_IN_FIELD[0], 1, 2), TOP_IN_FIELD[1]), "transposed", True),
        (of(*TOP_IN_FIELD), of(TOP_IN_FIELD[0], TOP_IN_FIELD[1][:, [1, 2, 0]]), "rates in turned axes", False),
        (of(*without(FREE)), of(R, in_world(R, W)), "world rates", False),
    ],
)
def test_a_recording_that_contradicts_itself_is_wrong_with_any_body(first, second, key, agree):
    for order in (1, -1):
        found = verify_two_alone(*[("a", first), ("b", second)][::order])
        finding = {finding.subject: finding for finding in found.findings}
        assert found.verdict == "wrong"
        assert (finding["a"].verdict, finding["b"].verdict) == ("undecided", "wrong")
        assert finding["b"].mistake == key
        assert finding["b"].causes[0].left < 1e-4  # measured: up to 4e-6, by the interpolation between rows
        assert ("Without the mistake they agree" in found.reason) == agree


@pytest.mark.parametrize("scene", [FREE, HEAVY, SPIN])
@pytest.mark.parametrize("method", ["explicit Euler", "RK4", "Heun's method"])
def test_errors_of_integrators_and_noise_are_no_contradiction(scene, method):
    assert find_contradiction(of(*stepped(scene, method, 1))) is None
    assert find_contradiction(of(*noisy(FREE, 0.01))) is None


def test_a_contradiction_by_another_unit():
    found = find_contradiction(spin(lambda R, w: w * 180 / np.pi))
    assert [cause.key for cause in found.causes] == ["rates in degrees"]


def test_a_contradiction_without_a_known_mistake_has_no_name():
    found = find_contradiction(of(R, np.roll(W, 40, axis=0)))
    assert (found.proven, found.causes) == (True, ())
    found = verify_two_alone(("a", spin()), ("b", of(R, np.roll(W, 40, axis=0))))
    assert [finding.verdict for finding in found.findings[:2]] == ["undecided", "wrong"]


def test_the_error_of_an_integrator_does_not_make_both_wrong():
    steps = of(*stepped(SPIN, "RK4", 1)), of(*stepped(SPIN, "Heun's method", 1))
    found = verify_two_alone(("a", steps[0]), ("b", steps[1]))
    assert [finding.verdict for finding in found.findings[:2]] == ["undecided"] * 2
    fit = fit_free_body(steps[0])
    assert fit.freedom is Freedom.NOT_FREE
    assert 1e-9 < fit.left < 1e-6
    assert f"{number(fit.left)} rad of a" in found.reason
    assert "both are wrong" not in found.reason
