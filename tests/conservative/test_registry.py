"""Names of methods and scenes: read back, nearest names, entry points, labels."""

import ast
import re
from importlib.metadata import EntryPoint
from pathlib import Path

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


def test_a_scene_with_parameters_has_them_in_its_name():
    assert registry.scene("brick_flip").name == "brick_flip"
    assert registry.scene("brick_flip:t_end=24").name == "brick_flip:t_end=24"
    drawn = "random_body:field=spring,seed=7,index=12"
    assert registry.scene(drawn).name == drawn


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


def test_an_installation_that_is_older_than_the_files_is_named(monkeypatch):
    """Entry points are copied when a package is installed: a name may be missing, or a module may have moved since."""
    trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01, t_end=0.1)
    moved = EntryPoint("moved", "conservative.references.gone:Moved", deferred_imports.METHODS)
    old = {deferred_imports.ROOMS: {}, deferred_imports.METHODS: {"moved": moved}, deferred_imports.ENGINES: {}}
    for module in (deferred_imports, registry):
        monkeypatch.setattr(module, "list_entries", old.get)
    with pytest.raises(BadInput, match=r"no entry point 'animation'; expected .*pip install -e \. again"):
        trajectory.animate()
    with pytest.raises(BadInput, match=r"'moved', registered as .*pip install -e \. again"):
        registry.method("moved")


def test_the_core_names_no_room_above_it():
    """Contracts see imports only, and an import by a text is none."""
    core = Path(deferred_imports.__file__).parent
    rooms = ("references", "benchmarks", "reports")
    files = [path for path in core.rglob("*.py") if path.relative_to(core).parts[0] not in rooms]
    texts = [
        (path.name, node.value)
        for path in files
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    assert len(files) > 80
    assert [each for each in texts if re.match(rf"(conservative)?\.({'|'.join(rooms)})\b", each[1])] == []
