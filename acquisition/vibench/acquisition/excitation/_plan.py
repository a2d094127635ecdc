"""What every excitation is: a frozen plan with an amplitude setting that lists the steps of the generator."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, PositiveFloat

from ..host import FrozenModel
from ._preview import SignalPreview
from ._steps import Step

LOWEST_AMPLITUDE_VPP = 2e-3
"""Smallest setting of an AFG1022 into an open output, peak to peak [V] (Tektronix data sheet)."""
HIGHEST_AMPLITUDE_VPP = 20.0
"""Largest setting of an AFG1022 into an open output, peak to peak [V] (Tektronix data sheet)."""

AmplitudeVpp = Annotated[float, Field(ge=LOWEST_AMPLITUDE_VPP, le=HIGHEST_AMPLITUDE_VPP)]
FrequencyHz = PositiveFloat


class AbstractExcitation(FrozenModel, ABC):
    """What the generator plays, from the first waveform to the last, at one amplitude setting."""

    amplitude_vpp: AmplitudeVpp
    """Setting of the generator, peak to peak [V], as its panel shows it."""

    @abstractmethod
    def steps(self) -> Iterator[Step]:
        """List what the generator does, in the order of time."""

    def loudest_steps(self) -> Iterator[Step]:
        """List what limits are checked against: the steps themselves, unless feedback may be louder."""
        return self.steps()

    @property
    def highest_amplitude_vpp(self) -> float:
        """The highest setting there is on the way, peak to peak [V]."""
        return self.amplitude_vpp

    def held_accelerations(self) -> Iterator[tuple[float, float]]:
        """List frequencies [Hz] and amplitudes of the base's acceleration [m/s2] that feedback will hold."""
        return iter(())

    @property
    @abstractmethod
    def playing_s(self) -> float:
        """Time of all steps, settling included, ramps not [s]; with feedback the longest it may take."""

    @property
    @abstractmethod
    def highest_frequency_hz(self) -> float:
        """The highest frequency that is meant to be there; what a converter must be able to follow [Hz]."""

    @abstractmethod
    def preview(self, sample_rate_hz: float) -> SignalPreview:
        """Show what will be played, before anything moves.

        Raises
        ------
        ConfigurationError
            When ``sample_rate_hz`` is too low to show the highest frequency.

        """


class AbstractFeedback(AbstractExcitation):
    """An excitation whose next step depends on what was measured: `vibench.acquisition.control` conducts it.

    Its ``steps`` are what it is expected to play, waits left out: for previews and for whoever lists
    what will be recorded. ``amplitude_vpp`` is the largest setting that it may use.
    """
