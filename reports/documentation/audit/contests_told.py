"""Sentences of a report about who is faster, each with what its numbers have to be by the rows; see `sentences`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
import pandas as pd

from conservative.benchmarks.studies.each_step import ERROR
from conservative.benchmarks.studies.throughput_extent import MEDIAN

from ...tables.cells import tolerance
from ...tables.classes import OF_ENGINES, MethodClass
from ...tables.headline import TIE
from ...tables.random_contests import Contest, Pair
from ...tables.summary import MIDDLE
from .rows import OURS, SOLUTIONS, Duel, Rows, cheapest, extent, told
from .sentences import NoSupportError, Values

MANY = ", the cheapest of "
"""Stands in front of what is said of many bodies, between the kind of bodies and our class."""
Tellers = Iterator[tuple[str, Callable[..., Values]]]
"""Sentences, and what they have to say."""


def of_scene(rows: Rows, scene: str) -> Tellers:
    """Yield the sentence in front of a scene's tables: who gets to an error faster."""

    def contest(classes: Iterable[MethodClass], error: float, ours: str, engine: str) -> float:
        one, other = rows.cheapest(scene, classes, error), rows.cheapest(scene, OF_ENGINES, error)
        if one is None or other is None or (one[0], other[0]) != (ours, engine):
            raise NoSupportError(f"at {error:g} rad on {scene} the cheapest are {one} and {other}")
        return other[1] / one[1]

    def solution(name: str, engine: str) -> Values:
        return {"ratio": contest(SOLUTIONS, MIDDLE, name, engine)}

    def alone(error: float, name: str) -> Values:
        found = [rows.cheapest(scene, classes, error) for classes in (OURS, OF_ENGINES)]
        if [each[0] for each in found if each] != [name][: len(name)]:
            raise NoSupportError(f"at {error:g} rad on {scene} the cheapest are {found[0]} and {found[1]}")
        return {}

    yield (
        "Our cheapest general integrator, {ours:words}, gets to {error:given} rad {ratio} times as fast as "
        "the cheapest engine, {engine:words}.",
        lambda error, ours, engine: {"ratio": contest(OURS, error, ours, engine)},
    )
    yield (
        "The cheapest engine, {engine:words}, gets to {error:given} rad {ratio} times as fast as "
        "our cheapest general integrator, {ours:words}.",
        lambda error, ours, engine: {"ratio": 1 / contest(OURS, error, ours, engine)},
    )
    yield "{name:words}, which solves integrable motions only, is {ratio} times as fast as {engine:words} there.", solution
    yield "Only {name:words} gets to {error:given} rad.", alone
    yield "Nothing measured gets to {error:given} rad.", lambda error: alone(error, "")


def of_decades(rows: Rows, scene: str) -> Tellers:
    """Yield what is said of all decades on a scene: lost first, then won, then solutions of integrable motions."""
    duels, solutions = (rows.duels[scene, kind] for kind in (MethodClass.GENERAL, MethodClass.SOLUTION))

    def lost(engine: str) -> Values:
        slower = [duel for duel in duels if duel.ratio < 1 and duel.engine and duel.engine[0] == engine]
        alone = [duel for duel in duels if not duel.ours and duel.engine and duel.engine[0] == engine]
        return {"range": extent(1 / duel.ratio for duel in slower), "errors": _all(slower), "alone": _all(alone)}

    def won(of: list[Duel], which: Callable[[Duel], bool]) -> Values:
        return {"range": extent(duel.ratio for duel in of if which(duel)), "errors": told(of, which)}

    fast = "{engine:words} is {range:text} times as fast as our general integrators, at {errors:text} rad"
    only = "{alone:text} rad"
    yield fast, lost
    yield f"{fast}, and reaches {only}, which none", lost
    yield f"{{engine:words}} reaches {only}, which none", lost
    yield (
        "our general integrators are {range:text} times as fast as the cheapest engine, at {errors:text} rad.",
        lambda: won(duels, lambda d: d.ratio >= 1),
    )
    yield "only our general integrators reach {errors:text} rad.", lambda: won(duels, lambda d: bool(d.ours and not d.engine))
    yield (
        "{names:words}, which solves integrable motions only, is {range:text} times as fast as the cheapest engine, "
        "at {errors:text} rad.",
        lambda names: won(solutions, lambda d: not math.isnan(d.ratio)),
    )


def _all(duels: list[Duel]) -> str:
    return told(duels, lambda duel: True)


def of_each_step(rows: Rows, scene: str) -> Tellers:
    """Yield who is faster where each of a scene's own steps is kept, and where the end alone is."""
    each = rows.each_step(scene)
    said = {"interval": f"{each.interval:.3g}", "error": tolerance(ERROR)}

    def contest(points: pd.DataFrame, kind: MethodClass, ours: str, engine: str) -> Values:
        one, other = (cheapest(points, classes, ERROR) for classes in ((kind,), OF_ENGINES))
        if one is None or other is None or (one[0], other[0]) != (ours, engine):
            raise NoSupportError(f"where each step of {scene} is run the cheapest are {one} and {other}")
        ratio = other[1] / one[1]
        same = {"same": round(100 * (TIE - 1))} if 1 / TIE < ratio < TIE else {}
        return {**said, **same, "won": ratio, "lost": 1 / ratio}

    kept = "with a sample at each {interval:text} s (our conversion of an engine's state included), at {error:text} rad."
    alone = "where the end alone is kept of steps of {interval:text} s, at which a solver need not stop, at {error:text} rad."
    for points, where in ((each.kept, kept), (each.alone, alone)):
        for kind in (MethodClass.GENERAL, MethodClass.SOLUTION):
            values = partial(contest, points, kind)
            yield f"{{ours:words}} ({kind}) is {{won}} times as fast as {{engine:words}}, {where}", values
            yield f"{{engine:words}} is {{lost}} times as fast as {{ours:words}} ({kind}), {where}", values
            yield f"{{ours:words}} ({kind}) and {{engine:words}} take the same time to {{same}} %, {where}", values


def of_random_bodies(rows: Rows) -> Tellers:
    """Yield the verdict on random bodies, and what it says of single ones."""

    def pairs() -> tuple[list[Pair], int]:
        found = [pair for contest in rows.contests if math.isclose(contest.error, MIDDLE) for pair in contest.pairs]
        return [pair for pair in found if pair.ours and pair.engine], len(found)

    def verdict(error: float) -> Values:
        both, _ = pairs()
        if not both or not math.isclose(error, MIDDLE):
            raise NoSupportError("no random body is about it")
        mean = float(np.exp(np.mean(np.log([pair.ratio for pair in both]))))
        return {"bodies": _count(len(both), "random body", "random bodies"), "won": mean, "lost": 1 / mean}

    def single() -> Values:
        both, every = pairs()
        lost = [1 / pair.ratio for pair in both if pair.ratio < 1]
        ratios = [pair.ratio for pair in both]
        return {
            **({"low": min(ratios), "high": max(ratios)} if ratios else {"low": [], "high": []}),
            **{"lost": len(lost), "most": max(lost, default=0.0), "more": every - len(both)},
        }

    where, rest = "On {bodies:text} in fields, not integrable,", "(geometric mean;"
    ours, engine = "our cheapest general integrator", "the cheapest engine"
    yield f"{where} {ours} gets to {{error:given}} rad {{won}} times as fast as {engine} {rest}", verdict
    yield f"{where} {engine} gets to {{error:given}} rad {{lost}} times as fast as {ours} {rest}", verdict
    yield "on single ones {low} to {high})", single
    yield "on {lost} of them an engine is faster, by up to {most} times", single
    yield "on {more} more, not both get there", single


def of_field(rows: Rows, field: str) -> Tellers:
    """Yield what is said of random bodies in a field: what is lost, and the range of means."""

    def lost() -> Values:
        found = rows.field(field)
        single = [(1 / pair.ratio, contest.error) for contest in found for pair in contest.both if pair.ratio < 1]
        most, error = max(single, default=(0.0, 1.0))
        decades = f"{tolerance(found[0].error)} to {tolerance(found[-1].error)}"
        counts = {"lost": len(single), "cases": sum(len(c.pairs) for c in found), "alone": sum(c.only_engine for c in found)}
        return {
            **counts,
            "most": most,
            "error": tolerance(error),
            "decades": decades,
            "bodies": _count(len(found[0].pairs), "body", "bodies"),
        }

    def means() -> Values:
        found = [contest for contest in rows.field(field) if contest.both]
        low, high = min(found, key=_mean), max(found, key=_mean)
        worst = min(found, key=lambda contest: contest.both[0].ratio)
        return {
            "bodies": _count(len(worst.pairs), "body", "bodies"),
            **{"low": _mean(low), "at_low": tolerance(low.error)},
            **{"high": _mean(high), "at_high": tolerance(high.error)},
            **{"worst": worst.both[0].ratio, "at_worst": tolerance(worst.error), "body": worst.both[0].scene},
        }

    yield "no engine is faster than our general integrators on any of {bodies:text}, at {decades:text} rad.", lost
    yield (
        "an engine is faster than our general integrators in {lost} of {cases} cases (a body and a decade), "
        "by up to {most} times, at {error:text} rad",
        lost,
    )
    yield "only an engine gets there in {alone} of {cases} cases", lost
    yield "Only an engine reaches the error in {alone} of {cases} cases.", lost
    yield (
        "over {bodies:text} the cheapest engine takes, in the geometric mean, {low} (at {at_low:text} rad) to {high} "
        "(at {at_high:text} rad) times as long as our cheapest general integrator; "
        "on the worst body {worst} times (at {at_worst:text} rad, {body:text}).",
        means,
    )


def _count(number: int, one: str, several: str) -> str:
    return f"one {one}" if number == 1 else f"{number} {several}"


def _mean(contest: Contest) -> float:
    """Return the geometric mean of the ratios, to as many digits as do not depend on the order of sums."""
    return round(float(np.exp(np.mean(np.log([pair.ratio for pair in contest.both])))), 12)


def of_many_bodies(rows: Rows, lead: str) -> Tellers:
    """Yield what is said of many bodies of a kind: of a class of ours against an engine."""
    kind, _, ours = lead.partition(MANY)
    group, _, engine = ours.partition(" against ")

    def ratio(error: float) -> Values:
        for contest in rows.many:
            told_of = (contest.kind.replace("_", " "), contest.engine, contest.group, contest.which)
            here = told_of == (kind, engine, group, MEDIAN) and math.isclose(contest.error, error)
            if here and contest.ratio > 0:
                return {"slower": contest.ratio, "faster": 1 / contest.ratio, "among": f"{contest.size:,}"}
        raise NoSupportError(f"no contest on {lead} at {error:g} rad")

    yield f"at {{error:given}} rad {engine} takes {{slower}} times as long (among {{among:text}})", ratio
    yield f"at {{error:given}} rad {engine} is {{faster}} times as fast as ours (among {{among:text}})", ratio
    yield "at {error:given} rad there is no time of", lambda error: {}
