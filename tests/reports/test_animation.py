"""Animations: the frames on one clock, and the page that plays them."""

import json
import re
from dataclasses import replace
from html import escape

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image, ImageSequence

import conservative as cv
from conservative import registry
from conservative.attitude import angle_between, from_quaternion, rotation_about
from conservative.benchmarks.studies.motion import MOST_FRAMES
from conservative.errors import BadInput, Diverged
from conservative.references.exact.method import Exact
from conservative.reports.animation import MARK, Animation, element, script, video
from conservative.reports.animation.frames import COLOURS, ERROR, FACES, THINNEST, make_panels
from conservative.reports.cli.main import main
from conservative.reports.cli.options import HEAD
from conservative.reports.numbers import angle, bound
from conservative.shapes import MassDistribution

from ..bodies import impossible_body
from ..pages import ROOT

R0 = rotation_about((0.3, -1.2, 0.7), 0.83)
BODY = cv.RigidBody([[3.1, 0.2, -0.1], [0.2, 2.7, 0.3], [-0.1, 0.3, 1.9]])
SCENE = cv.Scene("a <b>body</b>", BODY, R0, (0.5, -1.5, 2.5), 3.0)


def read(text):
    """Return the data of an element."""
    return json.loads(re.search(r'class="data">(.*?)</script>', text, re.DOTALL)[1])


@pytest.fixture(scope="module")
def motions():
    return [cv.integrate(SCENE, dt, method) for dt, method in ((0.01, cv.Reduced()), (0.003, Exact()), (0.0125, Exact()))]


def exact(times):
    """Return the exact attitudes at evenly spaced times."""
    return Exact().solve(SCENE, cv.Grid(times[1], len(times) - 1)).R_WB


def test_frames_of_different_steps_are_the_motion_at_the_times_of_one_clock(motions):
    times, panels = make_panels(motions, ["a", "b", "c"], None)
    for panel, most in zip(panels, (7e-4, 1e-6, 2e-5), strict=True):  # measured 6.5e-4 (the method's error), 8e-7, 1.3e-5 rad
        assert angle_between(exact(times) @ BODY.R_BP, panel.R_WP).max() < most
        np.testing.assert_allclose(np.linalg.norm(panel.L_W, axis=1), 1, atol=1e-14)  # measured 7e-16
    sides = panels[0].solid.size
    moments = (sides**2).sum() - sides**2  # of a box: m/12 (b^2 + c^2)
    np.testing.assert_allclose(moments / moments[0], BODY.moments / BODY.moments[0], rtol=1e-13)  # measured 2e-16


@pytest.mark.parametrize("truth", [1, 2])
def test_attitude_errors_do_not_depend_on_the_steps_of_the_truth(motions, truth):
    _, panels = make_panels(motions, ["a", "b", "c"], truth)
    error = angle_between(exact(motions[0].t), motions[0].R_WB).max()
    assert panels[0].sizes[ERROR][-1] == pytest.approx(error, abs=3e-8)  # measured 1e-8 at 0.0125 s
    assert ERROR not in panels[truth].sizes
    for values in panels[0].sizes.values():  # the largest so far
        assert (np.diff(values) >= 0).all()


def test_a_number_of_a_panel_is_never_below_its_value(motions):
    _, (panel, *_) = make_panels(motions, ["a", "b", "c"], 1)
    turned = replace(panel, sizes={ERROR: np.append(panel.sizes[ERROR], [3.12, 3.1415])})  # at most π, in the digits it takes
    for each in (panel, turned):
        for name, values in each.sizes.items():
            for frame, value in enumerate(values[values >= 1e-15]):
                shown = float(each.number(name, frame + np.sum(values < 1e-15))[1].replace("π", str(np.pi)))
                assert value * (1 - 1e-14) <= shown <= min(value * 1.1, np.pi if name == ERROR else np.inf)
    assert len(panel.sizes) == 3


def test_the_data_of_a_page_is_the_motion(motions):
    data = read(element(motions, ["<i>", "b", "c"], truth=1))
    q = np.reshape(data["panels"][1]["q"], (-1, 4))
    q = np.roll(q, 1, axis=1)  # the player has the scalar last
    times = np.linspace(0, data["duration"], data["frames"])
    R_WP = from_quaternion(q / np.linalg.norm(q, axis=1, keepdims=True))
    assert angle_between(exact(times) @ BODY.R_BP, R_WP).max() < 3e-4  # measured 1.6e-4: four digits
    assert angle_between(exact(times), R_WP).max() > 0.1  # of the principal axes, which are not the body's


def test_a_page_has_no_markup_of_names_and_asks_for_nothing(motions):
    page = Animation(motions, ["<i>", "b", "c"]).render(".html").decode()
    assert "<b>body</b>" not in page
    assert "<i>" not in page
    assert not re.search(r"""(src|href)="(?!data:)""", page.replace(script(), ""))
    assert len(page) < 330e3  # measured 280 kB, of which the library is 191 kB


def test_a_run_that_ended_early_has_fewer_frames(motions):
    cut = replace(
        motions[0], t=motions[0].t[:100], R_WB=motions[0].R_WB[:100], w_WB_B=motions[0].w_WB_B[:100], failure=Diverged(0.99)
    )
    times, panels = make_panels([cut, motions[1]], ["a", "b"], 1)
    assert len(panels[0].R_WP) == np.count_nonzero(times < 0.99) + 1 < len(panels[1].R_WP) == len(times)
    assert angle_between(panels[0].R_WP[-1], cut.R_WB[-1] @ BODY.R_BP) < 1e-7  # its last sample; angles of round-off are 1e-8
    assert panels[0].outcome == str(cut.outcome)


def test_the_inertia_box_of_a_planar_body_and_of_moments_without_a_box_is_thin():
    for moments in ((1.0, 2.0, 3.0), (1.0, 2.0, 3.5)):
        scene = cv.Scene("planar", impossible_body(moments), R0, (0.1, 0.2, 0.3), 1.0)
        _, (panel,) = make_panels([cv.integrate(scene, 0.01)], ["a"], None)
        assert panel.solid.size.min() / panel.solid.size.max() == pytest.approx(THINNEST)


def test_mistakes_name_the_argument(motions):
    fast = SCENE.rename("fast", t_end=3000.0)
    cases = {
        "labels": lambda: element(motions, ["a"]),
        "t_end": lambda: element([cv.integrate(fast, 0.1)], ["a"]),
        "truth": lambda: element([motions[0], cv.integrate(SCENE, 0.003, Exact(), 1.0)], ["a", "b"], truth=1),
        "path": lambda: Animation(motions, ["a", "b", "c"]).save("a.avi"),
        "trajectories": lambda: element([], []),
    }
    for argument, call in cases.items():
        with pytest.raises(BadInput) as caught:
            call()
        assert caught.value.argument == argument


def test_a_trajectory_is_animated_beside_others_and_the_truth(motions, tmp_path):
    reduced, truth, _ = motions
    shown = reduced.animate(truth=truth)
    assert (shown.labels, shown.truth) == ([reduced.label, truth.label], 1)
    assert reduced.animate(truth, truth=truth).truth == 1
    assert reduced.animate().truth is None
    shown.save(tmp_path / "brick.html")
    page = (tmp_path / "brick.html").read_text()
    assert read(page)["frames"] == read(page.replace(script(), ""))["frames"] == 200
    assert escape(page) in shown._repr_html_()


def watch(*words):
    return CliRunner().invoke(main, ["watch", *map(str, words)])


def test_watch_writes_a_page_at_the_steps_of_users_and_replaces_its_own_files_only(tmp_path):
    out = tmp_path / "brick.html"
    done = watch("brick_flip", "-m", "mujoco:Euler,reduced", "-m", "exact", "--t-end", "2", "--out", out, "--json")
    assert done.exit_code == 0, done.output
    steps = [(run["method"], run["dt"]) for run in json.loads(done.stdout)["runs"]]
    assert steps == [("mujoco:integrator=Euler", 0.002), ("reduced", 0.01), ("exact", 0.01)]
    data = read(out.read_text())
    assert data["truth"] == 2
    run = cv.integrate(registry.scene("brick_flip"), 0.002, registry.method("mujoco:Euler"), 2.0)
    wanted = [abs(run.drift("energy")).max(), run.error(cv.integrate(run.scene, 0.002, Exact(), 2.0)).max()]  # 0.019, 0.06 rad
    energy, _, error = (values[-1] for values in data["panels"][0]["sizes"])
    assert energy[1:] == [f"✗ {bound(wanted[0])}", "bad"]
    assert error[1:] == [f"≈ {angle(wanted[1])}", "fair"]
    assert watch("brick_flip", "--t-end", "1", "--out", out).exit_code == 0  # its own file
    foreign = tmp_path / "foreign.html"
    foreign.write_text("<p>of a user</p>")
    assert watch("brick_flip", "--out", foreign).exit_code == 2
    assert foreign.read_text() == "<p>of a user</p>"


@pytest.mark.parametrize("words", [("--out", "a.avi"), ("--dt", "0"), ("-m", "lame"), ("--dt", "nan")])
def test_watch_refuses_before_a_file_exists(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = watch("brick_flip", *words)
    assert done.exit_code == 2, done.output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", [["-m", "taylor,exact,lame"], []])
def test_watch_shows_the_beginning_of_a_motion_that_turns_too_often(words, tmp_path):
    done = watch("brick_flip", *words, "--t-end", "200", "--out", tmp_path / "a.html", "--json")  # 2,000 rad
    assert done.exit_code == 0, done.output
    data, runs = read((tmp_path / "a.html").read_text()), [run for run in json.loads(done.stdout)["runs"] if "dt" in run]
    assert 0.95 * MOST_FRAMES < data["frames"] <= MOST_FRAMES + 1  # measured 0.99
    assert all(data["duration"] <= run["t_end"] < data["duration"] + run["dt"] for run in runs)
    assert runs[0]["error"]["attitude"] < 1e-6
    done = watch("brick_flip", *words, "--t-end", "200", "--out", tmp_path / "a.html")
    assert f"Only the first {data['duration']:.3g} s are drawn" in done.stdout


def test_watch_prints_its_numbers_if_it_cannot_draw(tmp_path, monkeypatch):
    def fault(*_):
        raise ZeroDivisionError("planted")

    monkeypatch.setattr(Animation, "render", fault)
    done = watch("brick_flip", "-m", "reduced,exact", "--t-end", "1", "--out", tmp_path / "a.html", "--json")
    assert done.exit_code == 1
    assert "ZeroDivisionError: planted" in done.stderr
    assert json.loads(done.stdout)["runs"][0]["error"]["attitude"] > 1e-6
    assert list(tmp_path.iterdir()) == []


def counts(image):
    """Return the number of pixels of each colour of an image (height, width, 3), as #rrggbb."""
    colours, numbers = np.unique(image.reshape(-1, 3), axis=0, return_counts=True)
    return {f"#{r:02x}{g:02x}{b:02x}": int(n) for (r, g, b), n in zip(colours, numbers, strict=True)}


def read_frames(file):
    """Return the images of a GIF (n, height, width, 3)."""
    with Image.open(file) as images:
        return np.stack([np.asarray(each.convert("RGB")) for each in ImageSequence.Iterator(images)])


def faces_to_the_eye(panel, R):
    """Return the projected area of each face of a box at an attitude (3, 3), negative for those turned away, by colour."""
    towards = np.repeat(R.T @ video.EYE, 2) * np.tile([1, -1], 3)
    return dict(zip(FACES, towards * np.repeat(panel.solid.size.prod() / panel.solid.size, 2), strict=True))


def test_a_gif_shows_the_faces_that_the_exact_attitude_turns_to_the_eye(motions, tmp_path, monkeypatch):
    monkeypatch.setattr(video, "RATE", 1.0)
    motions[0].animate(labels=["a", "b"], truth=motions[1]).save(tmp_path / "a.gif")
    images = read_frames(tmp_path / "a.gif")
    times, panels = make_panels(motions[1:2], ["b"], None)
    assert len(images) == 15  # 3 s at 0.2 simulated s per s
    chosen = np.linspace(0, len(times) - 1, len(images)).round().astype(int)
    for image, R in zip(images, panels[0].R_WP[chosen], strict=True):
        found = counts(image[: video.SIDE, video.SIDE :])
        for colour, area in faces_to_the_eye(panels[0], R).items():
            if abs(area) > 0.15:  # an edge on its own has pixels of blended colours
                assert (found.get(colour, 0) > 30) == (area > 0)
        assert found[COLOURS["arrow"]] > 30  # measured 51


def test_watch_writes_a_gif_that_pauses_at_its_end_and_replaces_its_own(tmp_path, monkeypatch):
    monkeypatch.setattr(video, "RATE", 1.0)
    out = tmp_path / "brick.gif"
    for _ in range(2):
        done = watch("brick_flip", "-m", "reduced,exact", "--t-end", "1", "--out", out)
        assert done.exit_code == 0, done.output
    images = read_frames(out)
    assert images.shape[0] == 10
    assert np.abs(images[0].astype(float) - images[-1]).mean() > 1  # measured 10: it moves
    with Image.open(out) as gif:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(gif)]
    assert durations == [1000] * 9 + [video.PAUSE]
    assert list(tmp_path.iterdir()) == [out]


def test_watch_writes_the_last_frame_and_replaces_its_own(tmp_path):
    out = tmp_path / "brick.png"
    for _ in range(2):
        done = watch("brick_flip", "-m", "moser_veselov,exact", "--t-end", "1", "--out", out)
        assert done.exit_code == 0, done.output
    with Image.open(out) as image:
        assert (image.width, image.text) == (1152, {"Comment": MARK})  # 2 panels at 300 pixels per inch
        found = counts(np.asarray(image.convert("RGB"))[: video.SIDE * video.FINE])
    _, (panel,) = make_panels([Exact().solve(cv.scenes.brick_flip(), cv.Grid(0.005, 200))], ["a"], None)
    areas = faces_to_the_eye(panel, panel.R_WP[-1])
    assert [found.get(colour, 0) > 1000 for colour, area in areas.items() if abs(area) > 0.15] == [
        area > 0 for area in areas.values() if abs(area) > 0.15
    ]
    out.write_bytes(b"of a user")
    assert watch("brick_flip", "--out", out).exit_code == 2


def test_the_picture_of_the_readme_is_below_a_megabyte_and_shows_four_motions():
    file = ROOT / "reports" / "pictures" / "brick_flip.gif"
    assert MARK.encode() in file.read_bytes()[:HEAD]
    assert file.stat().st_size < 1e6  # 796 kB
    images = read_frames(file)
    last = [counts(part) for part in np.split(images[-1][: video.SIDE], 4, axis=1)]
    shown = [[each.get(colour, 0) for colour in FACES] for each in last]
    euler, rk4, paper_map = (np.abs(np.subtract(each, shown[3])).sum() / sum(shown[3]) for each in shown[:3])
    assert euler > 0.5  # measured 0.62
    assert rk4 < paper_map < 0.3  # measured 0.04 and 0.07: of the outline


def test_all_numbers_are_in_the_picture_of_a_free_flight(tmp_path):
    """Six lines, one of them longer than a panel: none runs into another panel or below the picture."""
    body = MassDistribution(2.0, (0.1, 0.05, 0.2), (0.5, 0.7, 0.9))
    scene = cv.Scene("flight", body, np.eye(3), (3, -2, 1), 0.2, body.gravity(9.81), p_WB0=(0, 0, 1), dt=0.02)
    motions = [cv.integrate(scene, method=method) for method in (cv.Reduced(), Exact())]
    picture = Animation(motions, ["heyoka:tol=1e-9,frame=non_spinning, dt = 0.002 s", "exact"], 1)
    assert max(map(len, make_panels(motions, picture.labels, 1)[1][0].sizes)) > 25
    picture.save(tmp_path / "flight.png")
    pixels = np.asarray(Image.open(tmp_path / "flight.png"))
    height, width = pixels.shape[:2]
    assert (pixels[-5:] == 255).all()
    numbers = pixels[video.SIDE * video.FINE : height - 4 * video.LINE * video.FINE]  # without the legend
    assert (numbers[:, width // 2 - 2 : width // 2 + 2] == 255).all()


def test_a_top_on_its_tip_is_the_cone_of_its_moments_and_other_bodies_are_boxes():
    _, (panel,) = make_panels([cv.integrate(cv.scenes.lagrange_top(t_end=0.1), 0.01)], ["a"], None)
    assert panel.solid.shape == "cone"
    assert panel.solid.size[0] / panel.solid.size[1] == pytest.approx(0.5, rel=1e-12)  # the paper's: half its height
    np.testing.assert_allclose(panel.solid.axis, [0, 0, 1])
    radius, height = panel.solid.size
    tetrahedra = [np.linalg.det(face.corners - panel.solid.centre) / 6 for face in panel.solid.faces]
    assert min(tetrahedra) > 0  # corners are counter-clockwise from outside
    assert sum(tetrahedra) == pytest.approx(np.pi / 3 * radius**2 * height, rel=0.01)  # the surface is closed; measured 0.003
    offset = cv.Scene("offset", BODY, R0, (0.1, 0.2, 0.3), 0.1, cv.UniformGravity(1.0, (0.1, 0.2, 0.3)))
    _, (panel,) = make_panels([cv.integrate(offset, 0.01)], ["a"], None)
    assert (panel.solid.shape, panel.solid.share_inside(np.array([0.0, 0.0, 9.0]))) == ("box", panel.solid.size[2] / 18)


@pytest.mark.parametrize(("truth", "entries"), [(None, 3), (1, 4)])
def test_the_legend_has_what_is_drawn(truth, entries, motions):
    page = element(motions, ["a", "b", "c"], truth=truth)
    legend = re.search(r'<ul class="legend">(.*)</ul>', page)[1]
    assert legend.count("<li>") == entries
    assert all((COLOURS[name] in legend) for name in ("arrow", "trace"))
    assert (COLOURS["outline"] in legend) is (truth is not None)
