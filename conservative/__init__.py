"""Conservative integration of rigid-body rotation.

    import conservative as cv

    trajectory = cv.integrate(cv.scenes.brick_flip(), dt=0.01)

Public names are listed in `__init__.pyi` and imported when first used: the pytest plugin is part of this package and must not
import NumPy in every run of pytest.
"""

from lazy_loader import attach_stub

from . import version

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
__version__ = version.VERSION
