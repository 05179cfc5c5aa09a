"""The list of publications of the paper, from paper.bib beside it."""

from __future__ import annotations

import re

from code_map import ROOT

FILE = ROOT / "reports" / "documentation" / "paper.bib"
ENTRY = re.compile(r"^@(\w+)\{(\w+),\n(.*?)^\}$", re.MULTILINE | re.DOTALL)
FIELD = re.compile(r"^  (\w+) *= \{(.*)\},$", re.MULTILINE)


def read_entries() -> dict[str, dict[str, str]]:
    """Return the fields of each entry by its key. Each field is a line."""
    text = FILE.read_text(encoding="utf-8").replace(r"{\o}", "ø")
    return {key: dict(FIELD.findall(body)) for _, key, body in ENTRY.findall(text)}


def render_list() -> str:
    """Return the entries as a list, each with its key."""
    lines = []
    for key, entry in read_entries().items():
        people = entry["author"].replace(" and others", " et al.").split(" and ")
        people = [re.sub(r"^(.*), (.*?)( et al\.)?$", r"\2 \1\3", person).strip("{}") for person in people]
        names = " and ".join(filter(None, (", ".join(people[:-1]), people[-1])))
        place = ", ".join(entry[name] for name in ("journal", "booktitle", "publisher", "volume", "year") if name in entry)
        link = f"https://doi.org/{entry['doi']}" if "doi" in entry else entry.get("url")
        title = f"[{entry['title']}]({link})" if link else entry["title"]
        lines.append(f"* `{key}`: {', '.join(filter(None, (names, title, place)))}.\n")
    return "".join(lines)


TABLES = {"bibliography": render_list}
