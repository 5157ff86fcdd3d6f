"""What happens to a run at a time: parameters that change, ports that are overridden or fail."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .bias import Bias
    from .drop_out import DropOut
    from .fault import FaultBlock
    from .freeze import Freeze
    from .override import Override
    from .scenario import Scenario
    from .set_delay import SetDelay
    from .set_parameter import SetParameter

_HOME = {
    "Bias": "bias",
    "DropOut": "drop_out",
    "FaultBlock": "fault",
    "Freeze": "freeze",
    "Override": "override",
    "Scenario": "scenario",
    "SetDelay": "set_delay",
    "SetParameter": "set_parameter",
}

__all__ = [
    "Bias",
    "DropOut",
    "FaultBlock",
    "Freeze",
    "Override",
    "Scenario",
    "SetDelay",
    "SetParameter",
]

__getattr__, __dir__ = lazy(__name__, _HOME)
