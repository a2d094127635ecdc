"""Arming: a campaign is refused with reasons, or put into words that an experimenter can check."""

from datetime import timedelta

from ..bench import Bench
from ..campaign import planned_recordings
from ..check import CheckRule, require_on_record
from ..plan import LimitCheck, require_within_limits
from ..run import drive_for
from ._campaign_request import Orders
from ._status import ArmedPlan

ARMED_S = 60.0
"""An armed engine disarms itself after this long [s]."""


def armed_plan(bench: Bench, orders: Orders) -> ArmedPlan:
    """Hold a campaign against bench and folder; nothing is played and nothing written.

    Raises
    ------
    AcquisitionError
        With every reason why it cannot be carried out.

    """
    if orders.check is CheckRule.FRESH:
        require_on_record(bench)
    checks: list[tuple[str, LimitCheck]] = []
    campaign, folder = orders.campaign, orders.folder
    points = campaign.points()
    for name, measurement in ((point.name, point.measurement) for point in points):
        checks += [(name, check) for check in require_within_limits(measurement, bench.rig)]
        drive_for(bench, measurement)  # refuses what nothing on this bench can play
    planned = planned_recordings(campaign, folder, orders.existing)
    missing = [each for each in planned if not each.is_complete]
    tightest, closest = max(checks, key=lambda named: named[1].use)
    loudest = max(point.measurement.excitation.highest_amplitude_vpp for point in points)
    kinds = ", ".join(dict.fromkeys(point.measurement.excitation.kind for point in points))
    size_mb = campaign.size_bytes(bench.digitizer.sample_rate_hz, len(bench.channels)) / 1e6
    length = timedelta(seconds=round(campaign.duration_s))
    bound = f"{closest.limit:.4g} {closest.unit}"
    kept = len(planned) - len(missing)
    return ArmedPlan(
        campaign=campaign.name,
        folder=str(folder),
        lines=(
            f"What: {len(missing)} recordings ({kinds})" + (f", {kept} kept from before" if kept else ""),
            f"Level: at most {loudest:g} Vpp at the generator",
            f"Limits: {closest.what} comes closest, {closest.use:.0%} of {bound} in {tightest}",
            f"How long: {length} (h:min:s), ramps and checks included",
            f"Saved in: {folder}, at most {size_mb:.0f} MB while recording",
        ),
        expires_in_s=ARMED_S,
    )
