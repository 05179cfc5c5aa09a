"""Names of methods and scenes: read back, nearest names, entry points, labels."""

from importlib.metadata import EntryPoint

import pytest

import conservative as cv
from conservative import deferred_imports, registry
from conservative.errors import BadInput, NotLoadable


@pytest.mark.parametrize("name", registry.list_methods())
def test_every_method_is_a_frozen_value_that_is_read_back_from_its_name(name):
    family = deferred_imports.list_entries(deferred_imports.METHODS)[name].load()
    assert family.family == name
    for method in family.settings_for("variants"):
        assert registry.method(method.name) == method
        assert hash(method) == hash(registry.method(method.name))
        assert "==" in method.label


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("lagrange", "'lagrange_top' (nearest)"),
        ("zzz", "one of 39 names; list them with: conservative list"),
    ],
)
def test_the_nearest_names_of_an_unknown_scene_are_listed(text, hint):
    with pytest.raises(cv.BadInput) as caught:
        registry.scene(text)
    assert hint in str(caught.value)


def with_entry(monkeypatch, name, value):
    """Register another method, as an installed package would."""
    group, list_entries = deferred_imports.METHODS, deferred_imports.list_entries
    more = {group: list_entries(group) | {name: EntryPoint(name, value, group)}}
    for module in (deferred_imports, registry):
        monkeypatch.setattr(module, "list_entries", lambda group: more.get(group) or list_entries(group))


@pytest.mark.parametrize("value", ["conservative.body:Phantom", "conservative.nowhere:Phantom"])
def test_an_entry_point_that_cannot_be_loaded_is_named(monkeypatch, value):
    with_entry(monkeypatch, "phantom", value)
    with pytest.raises(NotLoadable, match=f"'phantom', registered as '{value}', which cannot be loaded"):
        registry.method("phantom")


def test_a_method_is_registered_under_its_own_name(monkeypatch):
    with_entry(monkeypatch, "shorter", "conservative.methods.reduced:Reduced")
    with pytest.raises(BadInput, match="class Reduced has family = 'reduced'; expected family = 'shorter'"):
        registry.method("shorter")


@pytest.mark.parametrize("text", ["heyoka:tol=small", "gauss:stages=two", "gauss:many"])
def test_words_instead_of_numbers_are_refused(text):
    with pytest.raises(BadInput, match="a number, such as"):
        registry.method(text)
    with pytest.raises(BadInput, match="disturbance=a number, such as"):
        registry.scene("brick_flip:disturbance=little")


def test_the_label_has_the_package_of_a_method():
    class Own(type(registry.method("reduced"))):
        __module__ = "pytest.somewhere"

    class Local(type(registry.method("reduced"))):
        __module__ = "my_script"

    assert Own().label == f"pytest=={pytest.__version__}/reduced"
    assert Local().label == "my_script/reduced"
