"""The Markdown pages of the project, and what stands in them: code, links, commands."""

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parent.parent
PLACES = ("conservative", "references", "benchmarks", "reports", ".github")
FENCE = re.compile(r"^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"^    (.*)$", re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
COMMENT = re.compile(r"\s+#.*$")


def pages():
    """Return all pages: those at the top, and those in the rooms; the links below `conservative` are not followed."""
    return sorted(ROOT.glob("*.md")) + sorted(page for place in PLACES for page in (ROOT / place).rglob("*.md"))


def blocks(text, language):
    """Return the code of each fenced block in a language."""
    return [code for name, code in FENCE.findall(text) if name == language]


def links(text):
    """Return where the links and pictures of a page lead, without those in its code."""
    return LINK.findall(INDENTED.sub("", FENCE.sub("", text)))


def anchors(text):
    """Return the names under which GitHub knows the headings of a page."""
    headings = HEADING.findall(FENCE.sub("", text))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links(page):
    """Return the relative links of a page that lead to no file, or to no heading of one."""
    return [link for link in links(page.read_text(encoding="utf-8")) if "://" not in link and not alive(page, link)]


def alive(page, link):
    name, _, anchor = link.partition("#")
    target = page.parent / name if name else page
    if not target.exists():
        return False
    return not anchor or anchor in anchors(target.read_text(encoding="utf-8"))


def shell_lines(text):
    """Return the commands in blocks of shell and YAML, and in indented lines, each as a list of words."""
    fenced = [line for _, code in FENCE.findall(text) for line in code.splitlines()]
    lines = [re.sub(r"^- run: ", "", line) for line in fenced] + INDENTED.findall(FENCE.sub("", text))
    starts = ("conservative ", "pip ", "pytest", "python -m ")
    return [part for line in lines if line.startswith(starts) for part in parts(COMMENT.sub("", line))]


def parts(line):
    """Return the commands of a line, without what it redirects."""
    return [shlex.split(part.partition(" > ")[0]) for part in re.split(r" && | \| ", line)]
