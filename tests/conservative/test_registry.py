import pytest

import conservative as cv
from conservative import registry


@pytest.mark.parametrize("name", registry.registered(registry.SCENES))
def test_every_scene_builds_under_its_name(name):
    scene = registry.scene(name)
    assert scene.name == name
    assert scene.source
    assert scene.group != "your own"


@pytest.mark.parametrize("name", registry.registered(registry.METHODS))
def test_every_method_is_a_frozen_value_that_is_read_back_from_its_name(name):
    family = registry.registered(registry.METHODS)[name].load()
    assert family.family == name
    for method in family.variants():
        assert registry.method(method.name) == method
        assert hash(method) == hash(registry.method(method.name))
        assert "==" in method.label


@pytest.mark.parametrize(
    ("text", "hint"), [("brickflip", "'brick_flip' (nearest)"), ("lagrange", "'lagrange_top' (nearest)"), ("zzz", "one of ")]
)
def test_an_unknown_scene_is_answered_with_the_nearest(text, hint):
    with pytest.raises(cv.BadInput) as caught:
        registry.scene(text)
    assert caught.value.argument == "scene"
    assert text in str(caught.value)
    assert hint in str(caught.value)


def test_an_unknown_setting_is_answered_with_the_nearest():
    with pytest.raises(cv.BadInput, match=r"allowed: settings 'tol' \(nearest\)"):
        registry.method("reduced:toll=1")
