"""The form of one test, judged by the plan at every change."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QGroupBox

from vibench.acquisition import ConfigurationError, all_shipped, load_campaign, load_toml
from vibench.acquisition.plan import EXCITATION_KINDS, Family, Measurement, rows_by_kind

from ...forms.model_form import GroupEditor, JudgedForm

USUAL = {
    "amplitude_vpp": 1.0,
    "duration_s": 10.0,
    "frequency_hz": 260.0,
    "start_hz": 150.0,
    "stop_hz": 350.0,
    "low_hz": 80.0,
    "high_hz": 350.0,
    "band_start_hz": 40.0,
    "band_stop_hz": 600.0,
    "lowest_vpp": 0.2,
    "step_vpp": 0.2,
    "base_level": {"displacement_m": 5e-6},
    "response_m": 5e-6,
    "frequencies_hz": [240.0, 260.0, 280.0],
    "spectrum": [{"frequency_hz": 40.0, "density": 1e-3}, {"frequency_hz": 600.0, "density": 1e-3}],
    "accelerations_m_per_s2": [0.3, 0.6],
}
"""What a kind of test that needs a value, and was given none, begins with."""

FRESH: Mapping[str, Mapping[str, float]] = rows_by_kind(
    {
        Family.NOISE: {"duration_s": 60.0},
        Family.SWEEP: {"duration_s": 60.0},
        Family.DWELL: {"duration_s": 10.0},
        Family.STEPPED: {},
    },
    {},
)
"""What a kind begins with, whatever the one before it had."""


class TestForm(JudgedForm[Measurement]):
    """Every value of a measurement; `value` is None while one of them is not allowed."""

    def __init__(self) -> None:
        super().__init__(Measurement, "test", frozenset({"repeats"}))
        limits = self.form.editors["limits"].widget
        assert isinstance(limits, QGroupBox)
        limits.setTitle("Limits  (1 = the rig's own)")
        excitation = self.form.editors["excitation"]
        assert isinstance(excitation, GroupEditor)
        lines = {word: (each.group, each.about) for word, each in EXCITATION_KINDS.items()}
        excitation.know(USUAL, FRESH, lines)
        choice = excitation.kind_choice
        assert choice is not None
        choice.activated.connect(lambda _place: self._rename(str(choice.currentData())))

    def _rename(self, kind: str) -> None:
        """Give a test of a new kind its name: the old one would say something else."""
        self.form.editors["name"].show_content(kind)
        self.form.changed.emit()


FIRST = "quick"
"""The campaign whose tests are listed before all others."""
MOST_OF_ONE = 12
"""Tests listed of one campaign; sweeps make hundreds."""


@dataclass(frozen=True)
class NamedTest:
    """A test and where it is from."""

    label: str
    measurement: Measurement


def shipped_tests() -> tuple[NamedTest, ...]:
    """Every measurement of the campaigns that come with vibench and need no package that is missing."""
    campaigns = [campaign for _, campaign in _readable(all_shipped("campaigns"), load_campaign)]
    return tuple(
        NamedTest(f"{campaign.name} / {each.name}", each)
        for campaign in sorted(campaigns, key=lambda each: (each.name != FIRST, each.name))
        for each in sorted(campaign.measurements[:MOST_OF_ONE], key=lambda each: each.name)
    )


def own_tests(folder: Path) -> tuple[NamedTest, ...]:
    """Every test that was saved in a folder; a file that cannot be read is left out."""
    found = _readable(sorted(folder.glob("*.toml")), load_test)
    return tuple(NamedTest(f"own / {path.stem}", test) for path, test in found)


def _readable(paths: Iterable[Path], load: Callable[[Path], Any]) -> Iterator[tuple[Path, Any]]:
    for path in paths:
        with suppress(ConfigurationError):
            yield path, load(path)


def load_test(path: Path) -> Measurement:
    """Read a test; raises ConfigurationError with file, key and what is allowed."""
    return load_toml(path, Measurement)
