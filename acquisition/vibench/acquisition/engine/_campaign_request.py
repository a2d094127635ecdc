"""What an engine is to carry out, and how."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from ..campaign import AfterFailure, ChangedBench, ExistingRecordings
from ..check.admission import CheckRule
from ..host.toml_file import FrozenModel
from ..plan import Campaign
from ._live_twin import TwinSwitch
from ._status import LONGEST_PATIENCE_S, VIEWER_PATIENCE_S, Supervision


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
    attendance: Supervision | None = None
    """Whether somebody must look while it runs; what the engine was started for, if not given."""
    longest_patience_s: Annotated[float, Field(ge=VIEWER_PATIENCE_S, le=LONGEST_PATIENCE_S)] = (
        VIEWER_PATIENCE_S
    )
    """How long an attended drive far from every limit goes on while nobody looks [s]; see `patience_s`."""
