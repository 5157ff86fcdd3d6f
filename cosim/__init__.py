"""The engine: blocks, diagrams, their schedule and runs. Knows no trains and no CasADi."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .block import Block
    from .blocks.constant import Constant
    from .blocks.delay import Delay
    from .blocks.fmu import Fmu
    from .blocks.gain import Gain
    from .blocks.hold import Hold
    from .blocks.noise import Noise
    from .blocks.profile import Profile
    from .blocks.pulse import Pulse
    from .blocks.ramp import Ramp
    from .blocks.saturation import Saturation
    from .blocks.step import Step
    from .blocks.sum import Sum
    from .diagram import Diagram
    from .result import Run, SimulationError

_HOME = {
    "Block": "block",
    "Constant": "blocks.constant",
    "Delay": "blocks.delay",
    "Diagram": "diagram",
    "Fmu": "blocks.fmu",
    "Gain": "blocks.gain",
    "Hold": "blocks.hold",
    "Noise": "blocks.noise",
    "Profile": "blocks.profile",
    "Pulse": "blocks.pulse",
    "Ramp": "blocks.ramp",
    "Run": "result",
    "Saturation": "blocks.saturation",
    "SimulationError": "result",
    "Step": "blocks.step",
    "Sum": "blocks.sum",
}

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
    "Ramp",
    "Run",
    "Saturation",
    "SimulationError",
    "Step",
    "Sum",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
