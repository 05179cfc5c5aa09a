"""Engines that can have environments: what is registered of them, and what has to be installed for them.

They register as methods do, in the group `conservative.engines`, with a class derived from `EngineMethod`.
"""

from __future__ import annotations

from dataclasses import dataclass

from conservative import registry


@dataclass(frozen=True)
class Distribution:
    """What is installed for an engine.

    Attributes
    ----------
    package
        Its name where packages come from, with extras where it needs some.
    module
        What is imported of it.
    requirements
        What it needs beside NumPy, such as `numpy<2`.
    oldest
        Oldest version that its adapter is meant for; where no version is asked for, none below it is taken.
    """

    package: str
    module: str
    requirements: tuple[str, ...] = ()
    oldest: str = ""


def distribution_of(engine: str) -> Distribution:
    """Return what is installed for an engine.

    Raises
    ------
    BadInput
        The engine is unknown.
    NotLoadable
        It is registered, but importing what is registered fails.
    """
    found: Distribution = registry.engine(engine).distribution
    return found
