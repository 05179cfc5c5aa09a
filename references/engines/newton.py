from dataclasses import dataclass
from typing import ClassVar
from ..environments.catalogue import Distribution
from ..environments.engine_method import EngineMethod

@dataclass(frozen=True)
class Newton(EngineMethod):
    """Newton."""
    family: ClassVar[str] = "newton"
    distribution: ClassVar[Distribution] = Distribution("newton[sim]", "newton", oldest="1.8")
