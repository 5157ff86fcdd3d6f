"""Train plants in CasADi, FMI 2.0 FMUs, and a co-simulation master with transport delays.

The public face: diagrams and the basic blocks. Plants are in `railcosim.models`, controllers in
`railcosim.controllers`, the FMU exporter in `railcosim.fmus`, the papers in `railcosim.studies`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .base.errors import RailcosimError
    from .cosim import (
        Block,
        Constant,
        Delay,
        Diagram,
        Fmu,
        Gain,
        Hold,
        Noise,
        Profile,
        Pulse,
        Ramp,
        Run,
        Saturation,
        SimulationError,
        Step,
        Sum,
    )

__all__ = [
    "Block",
    "Constant",
    "Delay",
    "Diagram",
    "Fmu",
    "Gain",
    "Hold",
    "Noise",
    "Profile",
    "Pulse",
    "RailcosimError",
    "Ramp",
    "Run",
    "Saturation",
    "SimulationError",
    "Step",
    "Sum",
]


def __getattr__(name: str) -> Any:
    """Load each name when it is first asked for, so that `import railcosim` stays light."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = ".base.errors" if name == "RailcosimError" else ".cosim"
    return getattr(import_module(home, __name__), name)
