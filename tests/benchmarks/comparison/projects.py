"""Projects in git repositories, which build a wheel of one module without a network."""

import os
import subprocess

PROJECT = """[build-system]
requires = []
build-backend = "backend"
backend-path = ["."]
[project]
name = "{name}"
version = "1.0"
"""
BACKEND = '''"""Builds a wheel of the one module that stands beside it."""
import pathlib, zipfile

NAME, MODULE, ENTRY = "{name}", "{module}", "{entry}"
INFO = f"{{NAME}}-1.0.dist-info"


def build_wheel(folder, settings=None, metadata=None):
    files = {{
        f"{{MODULE}}.py": pathlib.Path(f"{{MODULE}}.py").read_text(),
        f"{{INFO}}/METADATA": f"Metadata-Version: 2.1\\nName: {{NAME}}\\nVersion: 1.0\\n",
        f"{{INFO}}/WHEEL": "Wheel-Version: 1.0\\nGenerator: tests\\nRoot-Is-Purelib: true\\nTag: py3-none-any\\n",
        f"{{INFO}}/entry_points.txt": ENTRY,
    }}
    files[f"{{INFO}}/RECORD"] = "".join(f"{{name}},,\\n" for name in [*files, f"{{INFO}}/RECORD"])
    wheel = f"{{NAME}}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(folder) / wheel, "w") as archive:
        for name, text in files.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return wheel
'''


def write_project(folder, name, module, code, entry=""):
    """Write a project of one module."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "pyproject.toml").write_text(PROJECT.format(name=name))
    (folder / "backend.py").write_text(BACKEND.format(name=name.replace("-", "_"), module=module, entry=entry))
    (folder / f"{module}.py").write_text(code)


def commit(folder, message="change"):
    """Commit all files of a folder, in a repository that is made where there is none; return the commit."""
    if not (folder / ".git").exists():
        git(folder, "init", "--quiet", "--initial-branch=main")
    git(folder, "add", "--all")
    git(folder, "commit", "--quiet", "--message", message)
    return git(folder, "rev-parse", "HEAD")


def git(folder, *arguments):
    who = {f"GIT_{role}_{what}": "somebody@example.org" for role in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-C", str(folder), *arguments]
    return subprocess.run(command, env=kept | who, check=True, capture_output=True, text=True, timeout=60).stdout.strip()
