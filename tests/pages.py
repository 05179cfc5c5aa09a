"""The Markdown pages of the project, and their code, links and commands."""

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
    """Return all pages: those at the top, and those in the packages; the links below `conservative` are not followed."""
    return sorted(ROOT.glob("*.md")) + sorted(page for place in PLACES for page in (ROOT / place).rglob("*.md"))


def blocks(text, language):
    """Return the code of each fenced block in a language."""
    return [code for name, code in FENCE.findall(text) if name == language]


def links(text):
    """Return the targets of the links and pictures of a page, without those in its code."""
    return LINK.findall(INDENTED.sub("", FENCE.sub("", text)))


def anchors(text):
    """Return the names under which GitHub knows the headings of a page."""
    headings = HEADING.findall(FENCE.sub("", text))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def dead_links(page):
    """Return the relative links of a page that lead to no file, or to no heading of one."""
    dead = []
    for link in links(page.read_text(encoding="utf-8")):
        name, _, anchor = link.partition("#")
        target = page.parent / name if name else page
        exists = target.exists() and (not anchor or anchor in anchors(target.read_text(encoding="utf-8")))
        if "://" not in link and not exists:
            dead.append(link)
    return dead


def shell_lines(text):
    """Return the commands in blocks of shell and YAML and in indented lines as lists of words, without redirections."""
    fenced = [line for _, code in FENCE.findall(text) for line in code.splitlines()]
    lines = [re.sub(r"^- run: ", "", line) for line in fenced] + INDENTED.findall(FENCE.sub("", text))
    starts = ("conservative ", "pip ", "pytest", "python -m ")
    commands = [part for line in lines if line.startswith(starts) for part in re.split(r" && | \| ", COMMENT.sub("", line))]
    return [shlex.split(command.partition(" > ")[0]) for command in commands]
