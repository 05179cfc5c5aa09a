"""Needs of scenes, and their comparison with the parts that methods, engines and closed forms take.

Each part of a scene declares its members of `Need` in its attribute `needs`, and `Scene.needs` collects them. A method declares
in `Card.takes` what it takes. `lacking` compares the two: nothing is computed with a part left out.
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


class Need(StrEnum):
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


Needs = frozenset[Need]
MOST_NAMED = 12
"""Number of methods and engines that a message names, methods first."""
FIELDS: Needs = frozenset({Need.GRAVITY, Need.SPRING, Need.ATTRACTION, Need.GRADIENT, Need.FIELD, Need.FUNCTION})
"""All potentials that depend on the attitude only."""
IN_TIME: Needs = frozenset({Need.TURNING, Need.TIME})
LOADS: Needs = frozenset({Need.TORQUE, Need.DAMPING, Need.MOTOR})
"""Parts that act beside the potential and may depend on time."""
ROTATION: Needs = FIELDS | {Need.FLIGHT}
"""Parts taken by methods that integrate the rotation in any field: in free flight the position follows from it."""


def read_needs(argument: str, value: Any) -> Needs:
    """Return a set of members of `Need`. Raise `BadInput` for anything else, such as texts: nothing would ever need them."""
    wrong = [each for each in value if not isinstance(each, Need)] if isinstance(value, set | frozenset) else [value]
    if wrong:
        allowed = f"a set of members of conservative.Need: {', '.join(f'Need.{each.name}' for each in Need)}"
        raise BadInput(argument, describe(wrong[0]), allowed)
    return frozenset(value)


def needs_of(part: Any) -> Needs:
    """Return the needs of a part of a scene; a user's potential without the attribute `needs` is of Python functions."""
    if part is None:
        return frozenset()
    own = read_needs("needs", getattr(part, "needs", frozenset({Need.FUNCTION})))
    return own | {Need.TIME} if getattr(part, "time_dependent", False) and Need.TURNING not in own else own


@lru_cache(maxsize=256)
def lacking(takes: Needs, needs: Needs, why: str = "") -> str:
    """Return the reason why a scene with these needs is not supported, and the methods and engines that support it.

    `why` is what the method itself says about it.
    """
    missing = [each.value for each in Need if each in needs - takes]
    return f"it does not take {join(missing)}{why and f' ({why})'}; {_advise(needs)}"


def _advise(needs: Needs) -> str:
    able = []
    for group in (METHODS, ENGINES):
        for name in list_entries(group):
            with suppress(MissingEngine, NotLoadable):
                card = getattr(load_entry(group, "method", name), "card", None)
                able += [name] if card and needs <= card.takes and name not in able else []
    if not able:
        return "no method or engine takes the whole scene"
    more = [f"{len(able) - MOST_NAMED} others"] if len(able) > MOST_NAMED else []
    return f"these take the whole scene: {join(able[:MOST_NAMED] + more)}"


def join(names: Iterable[str]) -> str:
    """Return names as a list in a sentence."""
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last
