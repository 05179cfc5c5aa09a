#!/usr/bin/env bash
# Keeps one comment of an action in a pull request up to date: comment.sh NAME FILE [--only-edit]
# The comment is found by a marker, not as the last one of its author: other actions write with the same token. With --only-edit, it
# corrects a comment that exists, and writes none otherwise. Without the permission to write pull requests it says so, and succeeds.
# NUMBER is the pull request, REPOSITORY is owner/name, GH_TOKEN the token.
set -eu -o pipefail
name=$1 file=$2
body=$(mktemp)
printf '<!-- conservative: %s -->\n' "$name" > "$body"
cat "$file" >> "$body"

write() {
  local number
  number=$(gh api --paginate "repos/$REPOSITORY/issues/$NUMBER/comments" \
    --jq ".[] | select(.user.type == \"Bot\" and (.body | startswith(\"<!-- conservative: $name -->\"))) | .id") || return 1
  number=${number%%$'\n'*}
  if [ -n "$number" ]; then
    gh api --silent --method PATCH "repos/$REPOSITORY/issues/comments/$number" --field "body=@$body"
  elif [ "${3:-}" != --only-edit ]; then
    gh pr comment "$NUMBER" --repo "$REPOSITORY" --body-file "$body"
  fi
}

if ! write "$@" && [ "${3:-}" != --only-edit ]; then
  echo "::notice::No comment: the job needs the permission pull-requests: write, which forks do not get."
fi
rm -f "$body"
