"""Folders of environments, in the cache folder of this package that platformdirs returns."""

from __future__ import annotations

from pathlib import Path

from conservative.errors import require_extra


def folder_of_all() -> Path:
    """Return the folder of all environments, which may not exist. Raise `MissingExtra` if platformdirs is not installed."""
    require_extra("engines in environments", "environments", "platformdirs")
    from platformdirs import user_cache_path

    return user_cache_path("conservative-rotation") / "engines"


def folder_of_projects() -> Path:
    """Return the folder of the environments of projects (see `projects`), which may not exist."""
    return folder_of_all().parent / "projects"


def temporary_folder() -> Path:
    """Return the folder of temporary files, created if it does not exist."""
    folder = folder_of_all() / "temporary"
    folder.mkdir(parents=True, exist_ok=True)
    return folder
