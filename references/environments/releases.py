"""Several releases of one engine: which there are, and an environment for each."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from conservative.errors import BadInput

from .catalogue import distribution_of
from .environment import Environment, find_environment
from .failures import MissingEnvironment
from .install import check, install
from .lock import Source, list_versions
from .versions import version_key


def newest_releases(engine: str, count: int, source: Source) -> tuple[str, ...]:
    """Return the newest versions of an engine that there are wheels for and that its adapter is meant for, oldest first.

    Raises
    ------
    BadInput
        The engine is unknown, or where packages come from does not say which versions there are.
    """
    distribution = distribution_of(engine)
    known = list_versions(distribution.package, source)
    if not known:
        got = f"no list of versions of {distribution.package} from where packages come from"
        raise BadInput("last", got, "a network, --find-links FOLDER, or versions that are installed")
    meant = [each for each in known if version_key(each) >= version_key(distribution.oldest)]
    return tuple(sorted(meant, key=version_key)[-count:])


def install_releases(
    engine: str, versions: Iterable[str], source: Source, tell: Callable[[str], None]
) -> tuple[Environment, ...]:
    """Return the environment of each version, in this order; what is not there is installed, and `tell` is told before.

    Raises
    ------
    BadInput
        The engine or a version is unknown, or cannot be had here and now.
    """
    names = [f"{engine}=={version}" for version in versions]
    for name in names:
        check(name)  # all of them, before the first takes minutes
    return tuple(_find_or_install(name, source, tell) for name in names)


def _find_or_install(name: str, source: Source, tell: Callable[[str], None]) -> Environment:
    engine, _, version = name.partition("==")
    try:
        return find_environment(engine, version)
    except MissingEnvironment:
        tell(f"installing {name}")
        return install(name, source).environment
