"""The heavy-haul train: a plant of any consist, each vehicle a mass, each joint a draft gear."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .couplers import Hysteresis
    from .train import heavy_haul_train

_HOME = {"Hysteresis": "couplers", "heavy_haul_train": "train"}
__all__ = ["Hysteresis", "heavy_haul_train"]

__getattr__, __dir__ = lazy(__name__, _HOME)
