"""Train plants in CasADi: `Plant`, the declarative layer, and one plant a file.

Imported from here: `Plant`, the solvers, `catalogue`, and every plant by its name. CasADi is
loaded with the first plant, not with the package.
"""

from typing import TYPE_CHECKING

from ..base.lazy import lazy
from .catalogue import PLANTS, catalogue

if TYPE_CHECKING:
    from .dc_drive import dc_drive_train
    from .heavy_haul import heavy_haul_train
    from .metro_coarse import coarse_metro_train
    from .metro_precise import metro_train
    from .plant import Plant
    from .second_order import second_order_train
    from .second_order_on_line import second_order_train_on_line
    from .solver import DormandPrince, Rodas, RungeKutta4, SemiImplicitEuler
    from .stopping import stopping_train

__all__ = [
    "DormandPrince",
    "Plant",
    "Rodas",
    "RungeKutta4",
    "SemiImplicitEuler",
    "catalogue",
    "coarse_metro_train",
    "dc_drive_train",
    "heavy_haul_train",
    "metro_train",
    "second_order_train",
    "second_order_train_on_line",
    "stopping_train",
]

_SOLVERS = ("DormandPrince", "Rodas", "RungeKutta4", "SemiImplicitEuler")


__getattr__, __dir__ = lazy(
    __name__,
    {
        "Plant": "plant",
        **dict.fromkeys(_SOLVERS, "solver"),
        **{name: module for name, (module, _) in PLANTS.items()},
    },
)
