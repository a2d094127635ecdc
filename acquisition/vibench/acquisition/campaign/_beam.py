"""Move the vibrometer's beam to the points of a scan: by the virtual rig, a command or the operator."""

from collections.abc import Iterator
from contextlib import contextmanager

from ..bench.bench import Bench
from ..errors import AcquisitionError
from ..plan import Measurement, ScanPoint
from ..rig import Rig
from ..run.acquisition_loop import BLOCK_S
from ..stopping.stop import StopSwitch
from ._log import CampaignEvent, CampaignEventKind, CampaignListener, CommandMessenger

MOVE_LONGEST_S = 120.0
"""Time after which a command that moves the beam is terminated [s]."""


def rig_at(rig: Rig, measurement: Measurement) -> Rig:
    """Return the rig with the beam at the point that a measurement needs.

    Raises ConfigurationError when the vibrometer of the rig cannot measure at this point.
    """
    return rig if measurement.point is None else rig.with_beam_on(measurement.point.role)


class BeamMover:
    """Movement of the beam between recordings at different points, while the generator is off."""

    def __init__(self, command: CommandMessenger | None, switch: StopSwitch, say: CampaignListener) -> None:
        """``command`` moves the beam of a real rig; without a command, the operator moves it."""
        self._command = command
        self._switch = switch
        self._say = say
        self._at: ScanPoint | None = None

    def ask(self, bench: Bench, measurement: Measurement) -> None:
        """If the operator must move the beam, hold the campaign until it is released or stopped."""
        point = measurement.point
        moves_itself = bench.rig.virtual is not None or bench.rig.plays_back or self._command is not None
        if point is None or point == self._at or moves_itself:
            return
        self._switch.hold()
        text = f"move the beam to {point.text}, then run 'vibench release' or press 'Go on'"
        self._say(CampaignEvent(CampaignEventKind.MOVE_BEAM, text, {"point": point.name}))
        while self._switch.is_holding:
            bench.idle(BLOCK_S)
        self._at = point

    @contextmanager
    def beam_at(self, bench: Bench, name: str, measurement: Measurement) -> Iterator[Bench]:
        """Yield the bench with the beam at the point of the measurement that is recorded as ``name``.

        Raises AcquisitionError when the command fails, because the beam may then be anywhere.
        """
        point = measurement.point
        if point is None:
            yield bench
            return
        with bench.beam_on(point.role) as aimed:
            if self._command is not None and point != self._at:
                self._at = None
                failure = self._command.run({"recording": name, **point.model_dump()}, MOVE_LONGEST_S)
                if failure:
                    raise AcquisitionError(
                        f"the beam was not moved to {point.text}: {failure}. Nothing was played there; "
                        "correct the command, and resume the campaign"
                    )
                self._at = point
            yield aimed
