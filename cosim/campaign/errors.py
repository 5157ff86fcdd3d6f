"""What goes wrong with a campaign as a whole. A run that fails is a row, and none of this."""

from ...base.errors import RailcosimError


class CampaignError(RailcosimError):
    """A campaign cannot be started or go on: its folder, its draws, its workers."""
