"""Fuzzy inference: sets, min-max Mamdani, zero-order Takagi-Sugeno, and relations over levels.

The same rule base runs on floats and on CasADi symbols. On floats only the sets that apply are
looked at, on symbols all of them; those that do not apply contribute zeros.
"""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .levels import Levels
    from .mamdani import Mamdani
    from .outline import bisector, mean_of_maxima, outline_centroid
    from .relation import Relation
    from .sampled import sampled_centroid
    from .sets import Gaussians, Triangles
    from .sugeno import Sugeno
    from .table_file import write_table
    from .tables import rule_table
    from .triangle_centroid import centroid

_HOME = {
    "Gaussians": "sets",
    "Levels": "levels",
    "Mamdani": "mamdani",
    "Relation": "relation",
    "Sugeno": "sugeno",
    "Triangles": "sets",
    "bisector": "outline",
    "centroid": "triangle_centroid",
    "mean_of_maxima": "outline",
    "outline_centroid": "outline",
    "rule_table": "tables",
    "sampled_centroid": "sampled",
    "write_table": "table_file",
}

__all__ = [
    "Gaussians",
    "Levels",
    "Mamdani",
    "Relation",
    "Sugeno",
    "Triangles",
    "bisector",
    "centroid",
    "mean_of_maxima",
    "outline_centroid",
    "rule_table",
    "sampled_centroid",
    "write_table",
]

__getattr__, __dir__ = lazy(__name__, _HOME)
