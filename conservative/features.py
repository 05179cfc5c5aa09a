"""Features of scenes, compared with the features that methods, engines and closed forms support.

Each part of a scene declares its members of `Feature` in its attribute `features`, and `Scene.features` collects them. A method
declares its own in `MethodInfo.supports`. `lacking` compares the two: nothing is computed with a part left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from enum import StrEnum
from functools import lru_cache
from typing import Any

from .check import describe
from .deferred_imports import ENGINES, METHODS, list_entries, load_entry
from .errors import BadInput, MissingEngine, NotLoadable


class Feature(StrEnum):
    """A part of a scene that changes its equations of motion; its value names it in messages."""

    GRAVITY = "uniform gravity"
    SPRING = "a spring"
    ATTRACTION = "a point attraction"
    GRADIENT = "a gravity gradient"
    FIELD = "a compiled field of a user"
    FUNCTION = "a potential of Python functions"
    TURNING = "a turning field"
    TIME = "a potential that depends on time"
    ROTOR = "a rotor"
    MOTOR = "a rotor with a motor"
    TORQUE = "a torque"
    DAMPING = "damping"
    ATTITUDE = "a load that depends on the attitude"
    FLIGHT = "free flight"


Features = frozenset[Feature]
MOST_NAMED = 12
"""Number of methods and engines that a message names, methods first."""
FIELDS: Features = frozenset(
    {Feature.GRAVITY, Feature.SPRING, Feature.ATTRACTION, Feature.GRADIENT, Feature.FIELD, Feature.FUNCTION}
)
"""All potentials that depend on the attitude only."""
IN_TIME: Features = frozenset({Feature.TURNING, Feature.TIME})
LOADS: Features = frozenset({Feature.TORQUE, Feature.DAMPING, Feature.MOTOR})
"""Parts that act beside the potential and may depend on time."""
ROTATION: Features = FIELDS | {Feature.FLIGHT}
"""Features supported by methods that integrate the rotation in any field: in free flight the position follows from it."""


def read_features(argument: str, value: Any) -> Features:
    """Return a set of members of `Feature`. Raise `BadInput` for anything else, such as texts, which no method supports."""
    wrong = [member for member in value if not isinstance(member, Feature)] if isinstance(value, set | frozenset) else [value]
    if wrong:
        allowed = f"a set of members of conservative.Feature: {', '.join(f'Feature.{feature.name}' for feature in Feature)}"
        raise BadInput(argument, describe(wrong[0]), allowed)
    return frozenset(value)


def features_of(part: Any) -> Features:
    """Return the features of a part of a scene; a user's potential without the attribute `features` is of Python functions."""
    if part is None:
        return frozenset()
    if hasattr(part, "needs"):
        raise BadInput(f"{type(part).__name__}.needs", "the former name of an attribute", "its name, `features`")
    own = read_features("features", getattr(part, "features", frozenset({Feature.FUNCTION})))
    return own | {Feature.TIME} if getattr(part, "time_dependent", False) and Feature.TURNING not in own else own


@lru_cache(maxsize=256)
def lacking(supports: Features, features: Features, why: str = "") -> str:
    """Return the reason why a scene with these features is not supported, and the methods and engines that support it.

    `why` is what the method itself says about it.
    """
    missing = [feature.value for feature in Feature if feature in features - supports]
    return f"it does not support {join(missing)}{why and f' ({why})'}; {_advise(features)}"


def _advise(features: Features) -> str:
    able = []
    for group in (METHODS, ENGINES):
        for name in list_entries(group):
            with suppress(MissingEngine, NotLoadable):
                method_info = getattr(load_entry(group, "method", name), "method_info", None)
                able += [name] if method_info and features <= method_info.supports and name not in able else []
    if not able:
        return "no method or engine supports the whole scene"
    more = [f"{len(able) - MOST_NAMED} others"] if len(able) > MOST_NAMED else []
    return f"these support the whole scene: {join(able[:MOST_NAMED] + more)}"


def join(names: Iterable[str]) -> str:
    """Return names as a list in a sentence."""
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
