"""The engine: blocks, diagrams, their schedule and runs. Knows no trains and no CasADi."""

from typing import TYPE_CHECKING

from ..base.lazy import lazy

if TYPE_CHECKING:
    from .algorithms import (
        FixedPoint,
        GaussSeidel,
        Iterated,
        Jacobi,
        Newton,
        StepDoubling,
        TwoPhase,
    )
    from .block import Block
    from .blocks.constant import Constant
    from .blocks.delay import Delay
    from .blocks.fmu import Fmu
    from .blocks.gain import Gain
    from .blocks.hold import Hold
    from .blocks.lag import Lag
    from .blocks.noise import Noise
    from .blocks.profile import Profile
    from .blocks.pulse import Pulse
    from .blocks.quantiser import Quantiser
    from .blocks.ramp import Ramp
    from .blocks.saturation import Saturation
    from .blocks.step import Step
    from .blocks.sum import Sum
    from .blocks.variable_delay import VariableDelay
    from .checkpoint import Checkpoint
    from .diagram import Diagram
    from .results.observer import Observer
    from .results.pacing import Pace
    from .results.recording import Recording
    from .results.result import Run, SimulationError
    from .runner import Runner
    from .scenario import Bias, DropOut, Freeze, Override, Scenario, SetDelay, SetParameter
    from .simulation import Simulation

_HOME = {
    "Bias": "scenario",
    "Block": "block",
    "Checkpoint": "checkpoint",
    "Constant": "blocks.constant",
    "Delay": "blocks.delay",
    "Diagram": "diagram",
    "DropOut": "scenario",
    "FixedPoint": "algorithms",
    "Fmu": "blocks.fmu",
    "Freeze": "scenario",
    "Gain": "blocks.gain",
    "GaussSeidel": "algorithms",
    "Hold": "blocks.hold",
    "Lag": "blocks.lag",
    "Iterated": "algorithms",
    "Jacobi": "algorithms",
    "Newton": "algorithms",
    "Noise": "blocks.noise",
    "Observer": "results.observer",
    "Override": "scenario",
    "Pace": "results.pacing",
    "Profile": "blocks.profile",
    "Pulse": "blocks.pulse",
    "Quantiser": "blocks.quantiser",
    "Ramp": "blocks.ramp",
    "Recording": "results.recording",
    "Run": "results.result",
    "Runner": "runner",
    "Saturation": "blocks.saturation",
    "Scenario": "scenario",
    "SetDelay": "scenario",
    "SetParameter": "scenario",
    "Simulation": "simulation",
    "SimulationError": "results.result",
    "Step": "blocks.step",
    "StepDoubling": "algorithms",
    "Sum": "blocks.sum",
    "TwoPhase": "algorithms",
    "VariableDelay": "blocks.variable_delay",
}

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


__getattr__, __dir__ = lazy(__name__, _HOME)
