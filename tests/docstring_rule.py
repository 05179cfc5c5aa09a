"""What a public docstring has to say: shapes and units of what goes in and comes out, what is raised, where numbers come from.

The rule reads signatures and source, not intentions. It asks

* of every function, method and property that takes or returns an array: a shape such as (3,) or (n, 3), one for what goes in
  and one for what comes out;
* of every one with a float or an array: a unit, or a word that says why there is none; of parameters such as dt or inertia the
  unit that goes with the name;
* of everything whose code raises an exception of `conservative.errors`, itself or through a check or a private function: the
  exception's name after "Raises" or "Raise";
* of every module with formulas: a source, be it an equation, an author, or a word that it is our own.

What a class says holds for its methods, what a base class says for those that override it.
"""

from __future__ import annotations

import ast
import inspect
import pkgutil
import re
import textwrap
from functools import cache

import conservative
from conservative import check, errors

SHAPE = re.compile(r"\((?:\.\.\.\)|[a-z]+,\)|(?:\.\.\.|[nm]|\d+),(?: (?:[nm]|\d+),?)*\))")
QUANTITIES = r"rad/s|rad|kg m\^2/s|kg m\^2|1/\(kg m\^2\)|kg/m\^3|kg|N m|N/m|N|J|m\^3/s\^2|m/s\^2|m|1/s|s"
UNIT = re.compile(rf"(?:, |\bin |\(|\d |\bof )({QUANTITIES})(?![\w^/'*])", re.ASCII)
PLAIN = re.compile(
    r"rotation|attitude|quaternion|relative|unit vector|skew|factors?\b|number of|dimensionless|any unit", re.IGNORECASE
)
"""Words for what has no unit."""
BY_NAME = {
    **dict.fromkeys(("dt", "t", "t_end"), "s"),
    **dict.fromkeys(("w_WB_B", "w_WB_B0", "precession"), "rad/s"),
    **dict.fromkeys(("inertia", "moments"), "kg m^2"),
    **dict.fromkeys(("error", "angle"), "rad"),
    **dict.fromkeys(("com_B", "radius", "height"), "m"),
    **{"mass": "kg", "density": "kg/m^3", "weight": "N"},
}
"""Units that the names of parameters ask for."""
AUTHOR = r"\b[A-Z][a-z]\w+"
SOURCE = re.compile(
    rf"\bSource|\bpaper\b|{AUTHOR} (?:&|and) (?:[A-Z]\. )*{AUTHOR}|{AUTHOR}[^.\n]{{0,80}}\b(?:17|18|19|20)\d\d\b"
)
"""Said so, the paper, two authors, or one with a year."""
RAISED = {name for name, found in vars(errors).items() if inspect.isclass(found) and issubclass(found, Exception)}


# ---------------------------------------------------------------------------------------------------------------- the rule


def complaints(function, words, around=""):
    """Return what the documentation `words` of a function lacks; `around` is what its class says."""
    signature = inspect.signature(function)
    taken = [str(parameter.annotation) for parameter in signature.parameters.values()]
    given = str(signature.return_annotation)
    found = [] if words else ["no docstring"]
    found += _shapes(taken, given, words + around)
    if any(map(_physical, [*taken, given])) and not (UNIT.search(words + around) or PLAIN.search(words + around)):
        found.append("no unit")
    units = set(UNIT.findall(words + around))
    found += [f"no {unit} for {name}" for name in signature.parameters if (unit := BY_NAME.get(name)) and unit not in units]
    promised = re.search(r"\bRaises?\b[\s\S]*", words + around)
    found += [f"raises {name}" for name in sorted(raised_by(function)) if not (promised and name in promised[0])]
    return found


def _shapes(taken, given, words):
    wanted = any(map(_is_array, taken)) + _is_array(given)
    got = len(SHAPE.findall(words))
    return [f"{got} of {wanted} shapes"] if got < wanted else []


def _is_array(annotation):
    return bool(re.search(r"\bArray(?:Like)?\b", annotation)) and "Callable" not in annotation


def _physical(annotation):
    return _is_array(annotation) or (bool(re.search(r"\bfloat\b", annotation)) and "Callable" not in annotation)


@cache
def raised_by(function):
    """Return the names of our exceptions that a function raises, by itself or through a check or a private neighbour."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    caught = {name.id for node in ast.walk(tree) if isinstance(node, ast.ExceptHandler) for name in _names(node.type)}
    found = {name.id for node in ast.walk(tree) if isinstance(node, ast.Raise) for name in _names(node.exc)} & RAISED
    for called in (node.func.id for node in ast.walk(tree) if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)):
        neighbour = function.__globals__.get(called)
        if inspect.isfunction(neighbour) and neighbour is not function and _looked_into(called, neighbour, function):
            found |= raised_by(neighbour)
    return frozenset(found - caught)


def _names(node):
    return [] if node is None else [name for name in ast.walk(node) if isinstance(name, ast.Name)]


def _looked_into(name, neighbour, function):
    if neighbour.__module__ == check.__name__:
        return True
    return name.startswith("_") and neighbour.__module__ == function.__module__


# ------------------------------------------------------------------------------------------------------------ what is public


NOT_FOR_USERS = tuple(f"conservative.{name}" for name in ("kernels", "benchmarks", "reports", "references.exact."))
FOR_USERS = {"conservative.references.exact.method"}


def public_modules():
    for found in pkgutil.walk_packages(conservative.__path__, "conservative."):
        if not found.name.startswith(NOT_FOR_USERS) or found.name in FOR_USERS:
            yield found.name


def members(module):
    """Yield name, function and the words of its class for all that is public in a module."""
    for name, found in vars(module).items():
        if name.startswith("_") or getattr(found, "__module__", None) != module.__name__:
            continue
        if inspect.isclass(found):
            yield from _of_class(name, found)
        elif inspect.isfunction(inspect.unwrap(found)):
            yield name, inspect.unwrap(found), inspect.getdoc(found) or "", ""


def _of_class(name, found):
    around = "\n".join(["", *(base.__doc__ or "" for base in found.__mro__ if base.__module__.startswith("conservative."))])
    for attribute, member in vars(found).items():
        function = _function(member)
        if function is None or function.__code__.co_filename.startswith("<"):
            continue  # what dataclasses write themselves
        if attribute in ("__init__", "__post_init__"):
            yield f"{name}.{attribute}", function, around, ""
        elif not attribute.startswith("_"):
            yield f"{name}.{attribute}", function, _inherited(found, attribute), around


def _function(member):
    for way in ("fget", "func", "__func__"):
        member = getattr(member, way, member)
    return member if inspect.isfunction(member) else None


def _inherited(found, attribute):
    words = (inspect.getdoc(vars(base)[attribute]) for base in found.__mro__ if attribute in vars(base))
    return "\n".join(filter(None, words))
