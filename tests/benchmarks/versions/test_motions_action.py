"""The scripts of the action that runs the one file of exact motions, with a made-up repository, test and `gh`.

The made-up test keeps the rules of the real ones: it writes its errors into ROTATION_RECORD, accepts those of ROTATION_KNOWN or
of known.txt beside it, refuses other settings, and prints the sentence if something changed.
"""

import os
import re
import shutil
import subprocess

import pytest
import yaml

from ...environments import PATIENCE, ROOT
from .test_versions import commit, git

ACTIONS = ROOT / ".github" / "actions"
TEST = """#!/bin/bash
error={error} step={step}
if [ -n "${{ROTATION_RECORD:-}}" ]; then
  printf '# Known errors\\nsettings,2,%s,double\\nmotions,slow,%s,0,\\n' "$step" "$error" > "$ROTATION_RECORD"
  exit 0
fi
known=${{ROTATION_KNOWN:-known.txt}}
if [ ! -e "$known" ]; then echo "no file of known errors"; exit {alone}; fi
was=$(sed -n 's/^motions,slow,\\([0-9]*\\),.*/\\1/p' "$known")
if [ "$(sed -n 's/^settings,2,\\(.*\\),double/\\1/p' "$known")" != "$step" ]; then echo "settings: record again"; exit 1; fi
if [ "$was" != "$error" ]; then
  printf 'ctest 1: \\033[32mfree rotation at your step: attitude error %s to %s rad\\033[0m\\r\\n' "$was" "$error"
fi
[ "$error" -le "$was" ]
"""


def write(folder, error, step="1", alone=0):
    """Write a version of the test."""
    texts = {"broken": "exit 7\n", "older": "exit 0\n"}  # which does not build, and which records nothing
    (folder / "test.sh").write_text(texts.get(error) or TEST.format(error=error, step=step, alone=alone))


class Done:
    """What the script left: exit status, output, comment, whether that only corrects an earlier one, and the summary."""

    def __init__(self, done, runner):
        def read(name):
            return (runner / name).read_text() if (runner / name).exists() else ""

        self.status, self.output = done.returncode, done.stdout + done.stderr
        self.comment, self.summary = read("out/comment.md"), read("summary")
        self.only_edit = (runner / "out" / "only-edit").exists()


@pytest.fixture
def act(tmp_path):
    """Return a function that runs the action in a clone of depth 1, of a repository whose two commits have a test each."""

    def run(was, now, known="", against=None, inside=".", command="bash test.sh", **changed):
        origin, clone, runner = (tmp_path / name for name in ("origin", "clone", "runner"))
        place = origin / inside
        place.mkdir(parents=True)
        runner.mkdir()
        (place / "code").write_text("1")
        if was is not None:
            write(place, **was)
        if known:
            (place / "known.txt").write_text(f"settings,2,1,double\nmotions,slow,{known},0,\n")
        run.base = commit(origin, "First @somebody <b>`x`")
        write(place, **now)
        (place / "code").write_text("2")
        run.head = commit(origin, "Turn slowly")
        subprocess.run(["git", "clone", "--quiet", "--depth=1", origin.as_uri(), clone], check=True, timeout=PATIENCE)
        environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("ROTATION_")},
            **{"COMMAND": command, "DIRECTORY": inside, "AGAINST": run.base if against is None else against, "PUSHED": ""},
            **{"OUT": str(runner / "out"), "GITHUB_STEP_SUMMARY": str(runner / "summary")},
            **changed,
        }
        script = ["bash", ACTIONS / "motions" / "compare.sh"]
        done = subprocess.run(script, cwd=clone, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
        assert git(clone, "worktree", "list").count("\n") == 0  # nothing stays
        assert git(clone, "status", "--porcelain") == ""
        return Done(done, runner)

    return run


SENTENCE = "free rotation at your step: attitude error 20 to {} rad"


def test_nothing_changed_is_not_said(act):
    done = act({"error": 20}, {"error": 20})
    assert (done.status, done.summary, done.only_edit) == (0, "", True)
    assert "no change" in done.comment  # for a comment on an earlier push


@pytest.mark.parametrize(("error", "status"), [(23, 1), (19, 0)], ids=["worse", "better"])
@pytest.mark.parametrize("inside", [".", "a b/tests"])
def test_a_change_is_the_first_line_of_comment_and_summary(act, error, status, inside):
    done = act({"error": 20}, {"error": error}, inside=inside)
    assert (done.status, done.only_edit) == (status, False)
    assert done.comment.splitlines()[0] == SENTENCE.format(error)
    assert done.summary == done.comment
    assert f"{act.head[:9]} `Turn slowly` against {act.base[:9]} `First @somebody <b>x`." in done.comment


def test_without_a_base_its_parent_is_compared(act):
    assert act({"error": 20}, {"error": 23}, against="0" * 40).comment.startswith(SENTENCE.format(23))


BASES = {"no test": None, "broken": {"error": "broken"}, "older": {"error": "older"}}


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize(("known", "alone", "status"), [("20", 1, 1), ("23", 1, 0), ("", 0, 0), ("", 1, 1)])
def test_without_errors_of_the_base_the_repository_decides(act, base, known, alone, status):
    done = act(BASES[base], {"error": 23, "alone": alone}, known)
    assert done.status == status
    assert f"The base {act.base[:9]} has no such test, or its command fails" in done.summary
    assert done.only_edit == (known != "20")
    assert done.comment.startswith(SENTENCE.format(23)) == (known == "20")


def test_a_base_that_cannot_be_fetched_is_said(act):
    done = act({"error": 20}, {"error": 23}, "23", against="1" * 40)
    assert (done.status, done.only_edit) == (0, True)
    assert "cannot be fetched" in done.summary


def test_a_head_that_does_not_build_fails_and_only_corrects(act):
    done = act({"error": 20}, {"error": "broken"})
    assert (done.status, done.only_edit) == (7, True)
    assert "ends with exit status 7" in done.summary


def test_errors_at_other_steps_are_not_compared(act):
    done = act({"error": 20}, {"error": 23, "step": "2"})
    assert (done.status, done.only_edit) == (0, True)
    assert "settings of the test are not those of the base" in done.summary
    assert "no change" not in done.comment


def test_the_workspace_of_the_base_is_the_base(act):
    """A command with an absolute path would otherwise test one commit twice."""
    assert act({"error": 20}, {"error": 23}, command='bash "$GITHUB_WORKSPACE/test.sh"').status == 1


def test_the_commit_of_a_pull_request_is_the_one_that_was_pushed(act):
    done = act({"error": 20}, {"error": 23}, PUSHED="2" * 40)  # not in the clone: without its subject
    assert f"{'2' * 9} against" in done.comment


# ---------------------------------------------------------------------------------------------------------------- the comment

GH = """#!/bin/bash
echo "$@" >> "{folder}/calls"
case "$*" in
  *--paginate*) [ -z "{denied}" ] || exit 1; printf '{numbers}' ;;
  *) [ -z "{denied}" ] || exit 1; file=$(echo "$@" | sed 's/.*body[=-][@f]*\\(ile \\)*//'); cat "$file" > "{folder}/body" ;;
esac
"""


@pytest.fixture
def say(tmp_path):
    """Return a function that runs the script of the comment, and its exit status, output, calls of `gh` and the body."""

    def run(*options, numbers="", denied=""):
        folder = tmp_path / "gh"
        folder.mkdir()
        (folder / "gh").write_text(GH.format(folder=folder, numbers=numbers, denied=denied))
        (folder / "gh").chmod(0o755)
        (folder / "file").write_text("free rotation\n\nmore\n")
        path = f"{folder}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path, "NUMBER": "7", "REPOSITORY": "a/b", "GH_TOKEN": "t"}
        command = ["bash", ACTIONS / "comment.sh", "motions", folder / "file", *options]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
        body = (folder / "body").read_text() if (folder / "body").exists() else ""
        return done.returncode, done.stdout, (folder / "calls").read_text().splitlines(), body

    return run


BODY = "<!-- conservative: motions -->\nfree rotation\n\nmore\n"


def test_a_first_comment_is_created(say):
    status, _, (found, written), body = say()
    assert (status, body) == (0, BODY)
    assert "repos/a/b/issues/7/comments" in found
    assert "conservative: motions" in found
    assert written.startswith("pr comment 7 --repo a/b")


@pytest.mark.parametrize("options", [(), ("--only-edit",)])
def test_a_comment_of_an_earlier_push_is_replaced(say, options):
    status, _, (_, written), body = say(*options, numbers="41\\n42\\n")
    assert (status, body) == (0, BODY)
    assert "--method PATCH repos/a/b/issues/comments/41 " in written


def test_nothing_is_written_if_nothing_changed(say):
    status, said, calls, body = say("--only-edit")
    assert (status, said, len(calls), body) == (0, "", 1, "")


def test_a_fork_without_the_permission_is_told(say):
    status, said, _, _ = say(denied="yes")
    assert status == 0
    assert "pull-requests: write" in said


def test_a_fork_without_a_change_is_not_told(say):
    assert say("--only-edit", denied="yes")[:2] == (0, "")


# ----------------------------------------------------------------------------------------------------------------- its workflow


def test_the_workflow_uses_inputs_that_there_are():
    inputs = yaml.safe_load((ACTIONS / "motions" / "action.yml").read_text())["inputs"]
    text = (ROOT / "tests" / "example_package" / "motions.yml").read_text()
    used = yaml.safe_load(text)["jobs"]["motions"]["steps"][-1]["with"]
    assert set(used) <= set(inputs)
    assert {name for name, each in inputs.items() if each.get("required")} <= set(used)


@pytest.mark.parametrize("name", ["base.sh", "comment.sh", "motions/compare.sh"])
def test_scripts_run_with_the_bash_of_macos(name):
    """Bash 3.2 and BSD tools have neither associative arrays, `${x,,}`, `mapfile`, nor escapes in `sed`."""
    text = (ACTIONS / name).read_text()
    assert not re.search(r"declare -A|\$\{\w+(,,|\^\^)|mapfile|readarray|sed -[iErz]|grep -P|readlink -f|realpath", text)
    assert subprocess.run(["bash", "-n", ACTIONS / name], timeout=PATIENCE, check=False).returncode == 0
    assert shutil.which("bash")
