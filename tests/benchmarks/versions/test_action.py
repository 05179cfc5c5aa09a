"""The shell of the GitHub action, in a clone of depth 1 as a workflow has it. The command in it records its arguments."""

import os
import subprocess

import pytest
import yaml

from ...environments import PATIENCE, ROOT
from .test_versions import commit

FOLDER = ROOT / ".github" / "actions" / "gate"
ACTION = yaml.safe_load((FOLDER / "action.yml").read_text())
COMPARE = next(step["run"] for step in ACTION["runs"]["steps"] if step.get("id") == "compare")
NOTHING = "0" * 40


@pytest.fixture
def act(tmp_path):
    """Return a function that runs the step in a clone of a repository with `count` commits, and its exit code and base."""

    def run(against, count=3, ends=0, track=""):
        origin, clone, runner = (tmp_path / name for name in ("origin", "clone", "runner"))
        origin.mkdir()
        commits = []
        for number in range(count):
            (origin / "file").write_text(str(number))
            commits.append(commit(origin))
        subprocess.run(["git", "clone", "--quiet", "--depth=1", origin.as_uri(), clone], check=True, timeout=PATIENCE)
        command = runner / "gate" / "bin" / "conservative"
        command.parent.mkdir(parents=True)
        command.write_text(f'#!/bin/sh\necho "$@" > "{runner}/arguments"\necho table > "{runner}/gate.md"\nexit {ends}\n')
        command.chmod(0o755)
        files = {name: str(runner / name) for name in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
        given = {"AGAINST": commits[against] if isinstance(against, int) else against, "PROJECT": ".", "ARGUMENTS": "--a b"}
        given |= {"TRACK": track, "PUSHED": "", "GITHUB_ACTION_PATH": str(FOLDER)}
        environment = {**os.environ, **files, **given, "RUNNER_TEMP": str(runner)}
        shell = ["bash", "-e", "-o", "pipefail", "-c", COMPARE]
        done = subprocess.run(shell, cwd=clone, env=environment, timeout=PATIENCE, check=False)
        called = (runner / "arguments").read_text().split() if (runner / "arguments").exists() else []
        summary = (runner / "GITHUB_STEP_SUMMARY").read_text() if (runner / "GITHUB_STEP_SUMMARY").exists() else ""
        base = called[2 + bool(track)] if called else ""
        if called:  # then the base is in the clone
            subprocess.run(["git", "cat-file", "-e", f"{base}^{{commit}}"], cwd=clone, check=True, timeout=PATIENCE)
        return done.returncode, commits.index(base) - count if called else None, summary, called

    return run


def test_a_pull_request_or_push_is_compared_with_its_base(act):
    code, base, summary, called = act(0)
    assert (code, base, summary) == (0, -3, "table\n")
    assert called[:2] == ["gate", "--against"]
    assert called[-2:] == ["--a", "b"]


@pytest.mark.parametrize("against", ["", NOTHING], ids=["schedule or dispatch", "first push of a branch"])
def test_without_a_base_the_parent_is_it(act, against):
    assert act(against)[:2] == (0, -2)


def test_the_first_commit_of_all_has_nothing_to_compare_with(act):
    assert act(NOTHING, count=1)[:2] == (0, None)


def test_a_gate_that_fails_fails_the_job_and_shows_its_table(act):
    code, _, summary, _ = act(0, ends=1)
    assert (code, summary) == (1, "table\n")


def test_engines_are_tracked_instead_of_methods(act):
    code, base, summary, called = act(0, track="mujoco")
    assert (code, base, summary) == (0, -3, "table\n")
    assert called[:3] == ["track", "mujoco", "--bump"]
    assert called[-2:] == ["--a", "b"]


COMMENT = ACTION["runs"]["steps"][-1]["run"]


@pytest.mark.parametrize(
    ("text", "track", "name", "only_edit"),
    [
        ("sentence\n\ntable\n", "", "gate", False),
        ("**gate: passed, nothing changed**\n", "", "gate", True),
        (None, "", "gate", True),  # the comparison failed: an earlier comment must not stay
        ("# Versions\n\ntable\n", "mujoco", "track gate", False),
        (None, "mujoco", "track gate", True),  # no other version any more
    ],
)
def test_a_comment_is_created_only_if_something_changed(tmp_path, text, track, name, only_edit):
    (tmp_path / "gate").mkdir()
    (tmp_path / "comment.sh").write_text(f'printf "%s\\n" "$@" > "{tmp_path}/said"; cat "$2" >> "{tmp_path}/said"\n')
    if text is not None:
        (tmp_path / "gate.md").write_text(text)
    given = {"GITHUB_ACTION_PATH": str(tmp_path / "gate"), "RUNNER_TEMP": str(tmp_path), "TRACK": track, "PUSHED": "a" * 40}
    shell = ["bash", "-e", "-o", "pipefail", "-c", COMMENT]
    subprocess.run(shell, env={**os.environ, **given}, check=True, timeout=PATIENCE)
    said = (tmp_path / "said").read_text()
    assert said.startswith(f"{name}\n{tmp_path}/gate.md\n")
    assert ("--only-edit" in said) == only_edit
    assert said.endswith(text or f"No comparison of {'a' * 9}.\n")
