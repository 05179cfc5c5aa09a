"""Names of methods and scenes: read back, nearest names, entry points, labels."""

import pytest

import conservative as cv
from conservative import deferred_imports, registry
from conservative.errors import BadInput


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
        ("zzz", f"one of {len(registry.list_scenes())} names; list them with: conservative list"),
    ],
)
def test_the_nearest_names_of_an_unknown_scene_are_listed(text, hint):
    with pytest.raises(cv.BadInput) as caught:
        registry.scene(text)
    assert hint in str(caught.value)


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
