"""What an engine is to carry out, and how."""

from pathlib import Path

from ..campaign import AfterFailure, ChangedBench, ExistingRecordings
from ..check import CheckRule
from ..host import FrozenModel
from ..plan import Campaign
from ._live_twin import TwinSwitch


class CampaignRequest(FrozenModel):
    """A campaign, and how it is to be carried out."""

    campaign: Campaign
    folder: Path
    """Where its recordings go."""
    twin: TwinSwitch = TwinSwitch.OFF
    """Whether the live twin runs beside it; it does where a plan's ``on_changed_specimen`` needs it."""
    existing: ExistingRecordings = ExistingRecordings.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH
