"""A scene file as JSON: its keys with their meanings, what else there is, and a whole file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from functools import reduce
from typing import Any

from conservative.scene_files.scene_file import choices, template
from conservative.scene_files.toml_reader import key_lines


def json_text() -> str:
    """Return as JSON: `keys` of the file that `conservative new` writes, the `choices` of others, and its `text`."""
    text = template()
    return json.dumps({"keys": list(_keys(text)), "choices": choices(), "text": text}, indent=2, ensure_ascii=False)


def _keys(text: str) -> Iterator[dict[str, Any]]:
    """Yield every key that has a value, in the order of the file; what it means is the comment behind it."""
    values, lines = tomllib.loads(text), text.splitlines()
    for key, line in key_lines(text).items():
        value: Any = reduce(lambda table, name: table[name], key, values)
        if not isinstance(value, dict):
            meaning = lines[line - 1].partition("#")[2].strip()
            yield {"key": ".".join(key), "value": value, "line": line, "meaning": meaning}
