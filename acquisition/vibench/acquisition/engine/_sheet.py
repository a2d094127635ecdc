"""Confirming knobs with a sheet that was filled in before, in a window or a file."""

from ..errors import CheckFailed
from ..rig import Confirm, Knob, KnobSheet


def confirmed_by(sheet: KnobSheet | None) -> Confirm:
    """Accept what is on the sheet, and nothing else."""

    def confirm(knobs: tuple[Knob, ...]) -> KnobSheet:
        seen = () if sheet is None else sheet.knobs
        missing = [f"{knob.instrument}: {knob.setting} at {knob.value}" for knob in knobs if knob not in seen]
        if sheet is None or missing:
            raise CheckFailed(
                f"settings made by hand are not confirmed ({'; '.join(missing)}). Nothing was energised; "
                "look at each knob, confirm it, and open the bench again"
            )
        return sheet

    return confirm
