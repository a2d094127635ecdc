"""The base's displacement from its recorded acceleration: what the simulated specimen is shaken by."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import Recording

from ..errors import UnusableData
from ..recordings import BASE
from ..signals import Quantity, Reals, converted_signal

LOWEST_PART = 0.25
"""The displacement is kept down to this part of the lowest frequency played: below it there is no drive,
and double integration would turn a microvolt of drift into micrometres."""
HIGHEST_PART = 0.33
"""... and up to this part of the sample rate, above all motion that matters and within the converter's
pass band, its cosine edge included."""


@dataclass(frozen=True, eq=False)
class RecordedBaseMotion:
    """Displacement of the base over a whole recording, on its sample grid."""

    displacement_m: Reals
    """Shape (samples,) [m]; zero mean, free of drift."""
    sample_rate_hz: float
    low_hz: float
    high_hz: float
    """The band that was kept."""
    delay_s: float
    """Delay of the accelerometer channel that was taken out: sample k is the motion at k / sample_rate_hz."""


def recorded_base_motion(recording: Recording, measurement: Measurement) -> RecordedBaseMotion:
    """Integrate the recorded acceleration twice, in the frequency domain, over the whole recording.

    Whole, because it begins and ends in silence: there the missing past and future disturb nothing.

    Raises
    ------
    UnusableData
        When samples were lost: a displacement cannot be followed across a hole.

    """
    acceleration = recording.read(BASE)
    lost = int(np.count_nonzero(np.isnan(acceleration)))
    if lost:
        raise UnusableData(
            f"{lost} samples of the base's acceleration were lost, and a displacement cannot be followed "
            "across a hole; the measured result stands without a simulation of it"
        )
    rate = recording.sample_rate_hz
    low_hz, high_hz = LOWEST_PART * lowest_frequency_hz(measurement), HIGHEST_PART * rate
    displacement = converted_signal(
        acceleration,
        rate,
        given=Quantity.ACCELERATION,
        wanted=Quantity.DISPLACEMENT,
        low_hz=low_hz,
        high_hz=high_hz,
    )
    delay_s = recording.channel(BASE).delay_s
    return RecordedBaseMotion(advanced(displacement.samples, delay_s * rate), rate, low_hz, high_hz, delay_s)


def lowest_frequency_hz(measurement: Measurement) -> float:
    """Lowest frequency that a plan plays, its bench check not counted [Hz]."""
    plan = measurement.excitation.model_dump()
    named = [plan[key] for key in ("band_start_hz", "start_hz", "stop_hz", "frequency_hz") if key in plan]
    grid = plan.get("grid") or {}
    named += [grid["start_hz"]] if grid else []
    return float(min([*named, *(plan.get("frequencies_hz") or ())]))


def advanced(samples: Reals, by_samples: float) -> Reals:
    """Shift a signal forward in time by a fraction of a sample or more, by the phase of its spectrum."""
    if by_samples == 0.0:
        return samples
    spectrum = np.fft.rfft(samples)
    spectrum *= np.exp(2j * np.pi * np.fft.rfftfreq(samples.size) * by_samples)
    return np.asarray(np.fft.irfft(spectrum, samples.size))
