"""Knobs of a real bench are confirmed one by one by a named operator."""

from pathlib import Path

from vibench.acquisition.rig import load_rig
from vibench.gui.pages.rig import KnobSheetForm

CONFIGS = Path(__file__).resolve().parents[4] / "hardware_configs"


def test_the_knob_sheet_requires_every_tick_and_an_operator_name(closing):
    rig = load_rig(CONFIGS / "lab_rig.toml")
    form = closing(KnobSheetForm())
    form.show_rig(rig)
    assert len(form.ticks) == len(rig.knobs)
    for tick in form.ticks:
        assert form.sheet() is None
        tick.setChecked(True)
    assert form.sheet() is None
    form.operator_field.setText("C. Gong")
    sheet = form.sheet()
    assert sheet.knobs == rig.knobs
    assert sheet.operator == "C. Gong"
    form.show_rig(rig)
    assert form.sheet() is None


def test_a_simulated_rig_needs_no_knob_sheet(closing):
    form = closing(KnobSheetForm())
    form.show_rig(load_rig(CONFIGS / "virtual_rig.toml"))
    assert form.ticks == ()
    assert form.isHidden()
