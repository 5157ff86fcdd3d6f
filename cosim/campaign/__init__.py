"""Campaigns: many runs, drawn or swept, on any executor, that survive being killed."""

from typing import TYPE_CHECKING

from ...base.lazy import lazy

if TYPE_CHECKING:
    from .definition import Campaign
    from .errors import CampaignError
    from .pools import Processes, WhenLong
    from .simulate import Simulate
    from .work import Drawn, Rows, Work

_HOME = {
    "Campaign": "definition",
    "CampaignError": "errors",
    "Drawn": "work",
    "Processes": "pools",
    "Rows": "work",
    "Simulate": "simulate",
    "WhenLong": "pools",
    "Work": "work",
}

__all__ = [
    "Campaign",
    "CampaignError",
    "Drawn",
    "Processes",
    "Rows",
    "Simulate",
    "WhenLong",
    "Work",
]


__getattr__, __dir__ = lazy(__name__, _HOME)
