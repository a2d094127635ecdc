"""What an engine is to carry out, and how."""

from pathlib import Path

from ..campaign.item import AfterFailure, ChangedBench, Existing
from ..check.rule import CheckRule
from ..plan.campaign import Campaign
from ..toml_file import FrozenModel


class Orders(FrozenModel):
    """A campaign, and how it is to be carried out."""

    campaign: Campaign
    folder: Path
    """Where its recordings go."""
    existing: Existing = Existing.REFUSE
    after_failure: AfterFailure = AfterFailure.STOP
    changed_bench: ChangedBench = ChangedBench.REFUSE
    check: CheckRule = CheckRule.FRESH
