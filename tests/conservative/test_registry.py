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
    old = {deferred_imports.PACKAGES: {}, deferred_imports.METHODS: {"moved": moved}, deferred_imports.ENGINES: {}}
    for module in (deferred_imports, registry):
        monkeypatch.setattr(module, "list_entries", old.get)
    with pytest.raises(BadInput, match=r"no entry point 'animation'; expected .*pip install -e \. again"):
        trajectory.animate()
    with pytest.raises(BadInput, match=r"'moved', registered as .*pip install -e \. again"):
        registry.method("moved")


def test_the_core_names_no_room_above_it():
    """Contracts see imports only, and an import by a text is none."""
    core = Path(deferred_imports.__file__).parent
    packages = ("references", "benchmarks", "reports")
    files = [path for path in core.rglob("*.py") if path.relative_to(core).parts[0] not in packages]
    texts = [
        (path.name, node.value)
        for path in files
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    assert len(files) > 80
    assert [text for text in texts if re.match(rf"(conservative)?\.({'|'.join(packages)})\b", text[1])] == []


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("mujoco", ("mujoco", "", None)),
        ("mujoco:", ("mujoco", "", "")),
        ("mujoco@3.6.0", ("mujoco", "3.6.0", None)),
        ("mujoco@3.6.0RC1:RK4,threads=2", ("mujoco", "3.6.0rc1", "RK4,threads=2")),
        ("my_engine@4.0.1+build.1a2b3c4d", ("my_engine", "4.0.1+build.1a2b3c4d", None)),
        ("größe_@1", ("größe_", "1", None)),
        ("nested:mujoco@3.6.0", ("nested", "", "mujoco@3.6.0")),
        ("mujoco:RK4@3.6.0", ("mujoco", "", "RK4@3.6.0")),
    ],
)
def test_a_name_has_a_version_in_two_spellings(text, parts):
    read = registry.read_name(text)
    assert read == registry.read_name(text.replace("@", "==")) == registry.read_name(str(read)) == parts


OTHER_FORMS = ["", "@3", "mujoco@", "mujoco@:RK4", "mujoco=3.6.0", "mujoco@3@4", "mujoco@x", "mujoco@v3", "mujoco@3 ", ":RK4"]


@pytest.mark.parametrize("text", OTHER_FORMS)
def test_a_name_of_another_form_is_refused(text):
    for each in {text, text.replace("@", "==")}:
        expected = f"got {re.escape(repr(each))}; expected NAME, NAME@VERSION or NAME==VERSION"
        with pytest.raises(BadInput, match=f"^engines: {expected}"):
            registry.read_name(each, "engines")
        with pytest.raises(BadInput, match=f"^method: {expected}"):
            registry.method(each)
    with pytest.raises(BadInput, match="without settings"):
        registry.read_name("mujoco:RK4", settings=False)


@pytest.mark.parametrize("text", ["mujoco:RK4@3.6.0", "reduced@1.0", "MuJoCo@1", "substepped:mujoco@0.1", "gauss:stages@2"])
def test_both_spellings_are_refused_alike(text):
    def refusal(name):
        with pytest.raises((BadInput, cv.MissingEngine)) as caught:
            registry.method(name)
        return str(caught.value)

    assert refusal(text) == refusal(text.replace("@", "=="))
    assert re.search("mujoco|reduced|gauss|RK4@", refusal(text))


def test_an_unknown_name_in_capitals_has_the_nearest():
    with pytest.raises(BadInput, match=r"'mujoco' \(nearest\)"):
        registry.method("MuJoCo:RK4")
