"""Values are frozen, wherever they are: every data class of the rooms below, found by importing all their files."""

import dataclasses
import importlib
import inspect
import pkgutil

import pytest

ROOMS = {
    "measures": "conservative.benchmarks.measures",
    "gate": "conservative.benchmarks.gate",
    "methods": "conservative.methods",
    "coefficients": "conservative.methods.coefficients",
}


def classes(module):
    """Return the classes that a module defines."""
    return [value for _, value in inspect.getmembers(module, inspect.isclass) if value.__module__ == module.__name__]


def data_classes(package):
    names = [module.name for module in pkgutil.iter_modules(importlib.import_module(package).__path__, f"{package}.")]
    return [each for name in names for each in classes(importlib.import_module(name)) if dataclasses.is_dataclass(each)]


@pytest.mark.parametrize("room", ROOMS)
def test_values_are_frozen(room):
    found = data_classes(ROOMS[room])
    assert found
    for each in found:
        assert "__dataclass_params__" in vars(each), f"{each.__name__} is no data class of its own"
        assert each.__dataclass_params__.frozen, each.__name__


@dataclasses.dataclass
class Loose:
    """What the rule must find."""

    value: int


def test_a_value_that_is_not_frozen_would_be_found():
    assert not Loose.__dataclass_params__.frozen
    assert Loose in classes(inspect.getmodule(Loose))
