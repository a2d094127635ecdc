"""A bench that can be opened again in the middle of a campaign, after a cable or a server was lost."""

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from ..bench.bench import Bench, RigPower, open_bench
from ..bench.result import CheckResult
from ..errors import AcquisitionError, CheckFailed
from ..instruments import Knob
from ..rig import Confirm, KnobSheet, Rig, load_rig

LOOK_AGAIN_S = 1.0
"""Rig time that passes on a virtual rig before its bench is opened again: cables are put back in it."""


class ReconnectingBench:
    """Opens a rig's bench, and opens it again without asking anybody anything. Use it in a ``with``."""

    def __init__(self, config: Rig | Path, confirm: Confirm | None = None) -> None:
        self._rig = config if isinstance(config, Rig) else load_rig(config)
        self._confirm = confirm
        self._power = RigPower(self._rig)
        self._bench: Bench | None = None
        self._last_check: CheckResult | None = None

    @property
    def bench(self) -> Bench:
        """The open bench."""
        if self._bench is None:
            raise AcquisitionError("the bench is not open: enter it with 'with KeptBench(...) as kept'")
        return self._bench

    @property
    def played_faults(self) -> tuple[str, ...]:
        """What a script of faults has done to a virtual rig so far, in order."""
        return tuple(each.fault for each in self._power.played_faults)

    def reopen(self) -> Bench:
        """Close the bench and open it again; knobs count as they were confirmed, for nobody has turned them.

        Raises
        ------
        AcquisitionError
            When an instrument is still not there. The bench is closed then; reopen again.

        """
        before, self._bench = self._bench, None
        if before is not None:
            self._last_check = before.last_check
            sheet = before.confirmations
            self._confirm = lambda knobs: _as_before(sheet, knobs)
            with suppress(AcquisitionError):  # what is lost cannot be silenced; the others were
                before.close()
        self._power.let_pass(LOOK_AGAIN_S)
        self._bench = open_bench(self._rig, self._confirm, power=self._power)
        self._bench.last_check = self._last_check
        return self._bench

    def close(self) -> None:
        """Silence and close everything. Legal at any time."""
        bench, self._bench = self._bench, None
        try:
            if bench is not None:
                bench.close()
        finally:
            self._power.__exit__(None, None, None)

    def __enter__(self) -> Self:
        self._power.__enter__()
        try:
            self._bench = open_bench(self._rig, self._confirm, power=self._power)
        except BaseException as error:
            self._power.__exit__(type(error), error, error.__traceback__)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        bench, self._bench = self._bench, None
        try:
            if bench is not None:
                bench.__exit__(kind, error, trace)
        finally:
            self._power.__exit__(kind, error, trace)


def _as_before(sheet: KnobSheet, knobs: tuple[Knob, ...]) -> KnobSheet:
    missing = [f"{knob.instrument} {knob.setting}" for knob in knobs if knob not in sheet.knobs]
    if missing:
        raise CheckFailed(
            f"the bench came back with settings that nobody has confirmed: {', '.join(missing)}. Nothing was "
            "energised; look at them and resume the campaign"
        )
    return sheet
