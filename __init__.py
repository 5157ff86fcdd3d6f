"""Train plants in CasADi, FMI 2.0 FMUs, and a co-simulation master with transport delays.

The public face: diagrams and the basic blocks. Plants are in `railcosim.models`, controllers in
`railcosim.controllers`, the FMU exporter in `railcosim.fmus`, the papers in `railcosim.studies`.
"""

from typing import TYPE_CHECKING

from .base.lazy import lazy

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


_HOME = {name: "base.errors" if name == "RailcosimError" else "cosim" for name in __all__}
__getattr__, __dir__ = lazy(__name__, _HOME)
