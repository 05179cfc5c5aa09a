#!/usr/bin/env bash
# Runs the test of exact motions at a base and at HEAD, and writes the sentence about what changed. The exit status is that of HEAD's run.
#
# COMMAND    builds and runs the test in DIRECTORY, from a fresh checkout
# AGAINST    the base; empty or zero for the parent of HEAD
# PUSHED     the commit that its author pushed, if HEAD is GitHub's merge of it with the base; may be empty
# OUT        folder of the results: comment.md for the pull request, and `only-edit` if it may only correct an earlier comment
#
# The test writes its errors into the file ROTATION_RECORD, and accepts those in the file ROTATION_KNOWN.
set -u -o pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "$OUT" && OUT=$(cd "$OUT" && pwd) || exit
cd "${DIRECTORY:-.}" || exit
inside=$(git rev-parse --show-prefix) && cd "$(git rev-parse --show-toplevel)" || exit
top=$PWD
rm -f "$OUT"/comment.md "$OUT"/only-edit
# Runners that keep the output of a test to themselves would hide the sentence.
export RUST_TEST_NOCAPTURE=1 PYTEST_ADDOPTS="${PYTEST_ADDOPTS:-} -s"

# Runs the command in a checkout, with options and variables of `env`.
run() {
  local checkout=$1
  shift
  (cd "$checkout/$inside" && env "$@" GITHUB_WORKSPACE="$checkout" bash -e -o pipefail -c "$COMMAND")
}

# Records the errors of a checkout in a file; fails without such a file.
record() {
  rm -f "$2"
  run "$1" -u ROTATION_KNOWN ROTATION_RECORD="$2" && [ -s "$2" ]
}

# Runs the test of HEAD, shows its output and keeps it.
test_head() {
  run "$top" -u ROTATION_RECORD "$@" 2>&1 | tee "$OUT/output"
  status=${PIPESTATUS[0]}
}

# Prints a short hash and a subject, as code: it may contain mentions and tags.
commit() {
  local subject
  git cat-file -e "$1^{commit}" 2>/dev/null || git fetch --quiet --no-tags --depth=1 origin "$1" 2>/dev/null || true
  subject=$(git log -1 --format=%s "$1" 2>/dev/null | tr -d '`\r')
  printf '%s' "${1:0:9}${subject:+ \`$subject\`}"
}

settings() {
  grep '^settings,' "$1" | tr -d '\r'
}

why=""
if ! base=$(bash "$here/../base.sh" "${AGAINST:-}"); then
  why="The base ${AGAINST:0:9} cannot be fetched"
elif [ -z "$base" ]; then
  why="The first commit has no base"
else
  checkout="$OUT/base"
  trap 'git -C "$top" worktree remove --force "$checkout" 2>/dev/null; git -C "$top" worktree prune' EXIT
  echo "::group::The base $base"
  git worktree prune
  git worktree add --quiet --force --detach "$checkout" "$base" || exit
  if [ -e "$checkout/.gitmodules" ] && git submodule status | grep -q '^[^-]'; then  # the job has checked out submodules
    git -C "$checkout" submodule --quiet update --init --recursive --depth=1
  fi
  record "$checkout" "$OUT/known.txt" || why="The base ${base:0:9} has no such test, or its command fails"
  echo "::endgroup::"
fi

if [ -z "$why" ]; then
  test_head ROTATION_KNOWN="$OUT/known.txt"
  if [ "$status" != 0 ]; then  # the test refuses errors at other steps: they are no comparison
    record "$top" "$OUT/now.txt" >/dev/null 2>&1
    if [ -s "$OUT/now.txt" ] && [ "$(settings "$OUT/known.txt")" != "$(settings "$OUT/now.txt")" ]; then
      why="The settings of the test are not those of the base ${base:0:9}"
    fi
  fi
fi
if [ -n "$why" ]; then
  echo "::notice::$why. The file of known errors in the repository decides, if there is one."
  test_head
fi

# Some runners put a mark or colours before the lines of a test.
sentence=$(sed -e $'s/\x1b\\[[0-9;]*m//g' -e $'s/\r$//' "$OUT/output" | sed -n 's/.*\(free rotation at your step.*\)/\1/p' | tail -n 1)
of="$(commit "${PUSHED:-$(git rev-parse HEAD)}")"
if [ -z "$why" ]; then
  of+=" against $(commit "$base")"
else
  of+=". $why. The file of known errors in the repository decides, if there is one"
fi
if [ -n "$sentence" ]; then
  printf '%s\n\n%s.\n' "$sentence" "$of"
elif [ "$status" != 0 ]; then
  printf 'Free rotation: no comparison, the command ends with exit status %s.\n\n%s.\n' "$status" "$of"
elif [ -n "$why" ]; then
  printf 'Free rotation: no comparison with the base.\n\n%s.\n' "$of"
else
  printf 'Free rotation: no change.\n\n%s.\n' "$of"
fi > "$OUT/comment.md"
[ -n "$sentence" ] || touch "$OUT/only-edit"  # a comment on an earlier push must not stay wrong
if [ -n "$sentence$why" ] || [ "$status" != 0 ]; then
  cat "$OUT/comment.md" >> "${GITHUB_STEP_SUMMARY:-/dev/null}"
fi
exit "$status"
