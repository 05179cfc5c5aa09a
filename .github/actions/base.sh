#!/usr/bin/env bash
# Prints the commit to compare HEAD with, and fetches it if the checkout does not have it: the given one, or the parent of HEAD if it
# is empty or zero (schedule, workflow_dispatch, or the first push of a branch). Prints nothing for the first commit of a repository.
set -eu -o pipefail
against=${1:-}
if [ -z "${against//0/}" ]; then
  git rev-parse --quiet --verify HEAD~1 >/dev/null || git fetch --quiet --no-tags --deepen=1 origin || true
  git rev-parse --quiet --verify HEAD~1 || true
  exit 0
fi
git cat-file -e "$against^{commit}" 2>/dev/null || git fetch --quiet --no-tags --depth=1 origin "$against"
git rev-parse --verify --end-of-options "$against^{commit}"
