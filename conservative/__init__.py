"""Validation and conservative integration of rigid-body rotation.

    import conservative as cv

    trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)

Public names are listed in `__init__.pyi` and imported when first used: the pytest plugin is part of this package and must not
import NumPy in every run of pytest.
"""

from lazy_loader import attach_stub

from . import version

_load, __dir__, __all__ = attach_stub(__name__, __file__)
__version__ = version.VERSION
FORMER = {"Need": "Feature", "Card": "MethodInfo", "needs": "features", "card": "method_info"}
"""Former names, which an error connects with the new ones."""


def __getattr__(name: str) -> object:
    """Return a public name, or a module of this package, such as `conservative.registry`."""
    from importlib import import_module, util

    from .posix import unstoppable

    with unstoppable():
        if name in FORMER:
            message = f"{__name__}.{name} has another name now: {__name__}.{FORMER[name]}"
            raise ImportError(message, name=__name__)  # `from conservative import Need` would replace an AttributeError
        if name not in __all__ and not name.startswith("_") and util.find_spec(f"{__name__}.{name}"):
            return import_module(f"{__name__}.{name}")
        if name == "verification":  # it is in a package above the core, which the core cannot import
            from .deferred_imports import PACKAGES, load_entry

            value = load_entry(PACKAGES, PACKAGES, name)
        else:
            value = _load(name)
        globals()[name] = value  # found there from now on, without this function
        return value
