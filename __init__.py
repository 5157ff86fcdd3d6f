"""Train plants in CasADi, FMI 2.0 FMUs, and a co-simulation master with transport delays.

The public face: diagrams and the basic blocks. Plants are in `railcosim.models`, controllers in
`railcosim.controllers`, the FMU exporter in `railcosim.fmus`, the papers in `railcosim.studies`.
"""

from typing import TYPE_CHECKING

from .base.lazy import lazy

if TYPE_CHECKING:
    from .base.errors import RailcosimError
    from .cosim import (
        Bias,
        Block,
        Checkpoint,
        Constant,
        Delay,
        Diagram,
        DropOut,
        FixedPoint,
        Fmu,
        Freeze,
        Gain,
        GaussSeidel,
        Hold,
        Iterated,
        Jacobi,
        Lag,
        Newton,
        Noise,
        Observer,
        Override,
        Pace,
        Profile,
        Pulse,
        Quantiser,
        Ramp,
        Recording,
        Run,
        Runner,
        Saturation,
        Scenario,
        SetDelay,
        SetParameter,
        Simulation,
        SimulationError,
        Step,
        StepDoubling,
        Sum,
        TwoPhase,
        VariableDelay,
    )

__all__ = [
    "Bias",
    "Block",
    "Checkpoint",
    "Constant",
    "Delay",
    "Diagram",
    "DropOut",
    "FixedPoint",
    "Fmu",
    "Freeze",
    "Gain",
    "GaussSeidel",
    "Hold",
    "Iterated",
    "Jacobi",
    "Lag",
    "Newton",
    "Noise",
    "Observer",
    "Override",
    "Pace",
    "Profile",
    "Pulse",
    "Quantiser",
    "RailcosimError",
    "Ramp",
    "Recording",
    "Run",
    "Runner",
    "Saturation",
    "Scenario",
    "SetDelay",
    "SetParameter",
    "Simulation",
    "SimulationError",
    "Step",
    "StepDoubling",
    "Sum",
    "TwoPhase",
    "VariableDelay",
]


_HOME = {name: "base.errors" if name == "RailcosimError" else "cosim" for name in __all__}
__getattr__, __dir__ = lazy(__name__, _HOME)
