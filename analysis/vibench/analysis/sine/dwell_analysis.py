"""From a recorded dwell to its responses over the last seconds."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vibench.acquisition.plan import Dwell, HeldDwell
from vibench.acquisition.recording import SegmentLabel

from ..errors import NotEnoughData
from ..recordings.channels import Channels, only_stretch, read_whole
from ..recordings.checks import AbstractAnalysis
from ..recordings.facts import RecordingFacts, specimen_of
from ..signals.arrays import Reals
from ..signals.envelope import Envelope, envelope
from ..spectra.spectra import spectral_density
from .background import silence_before
from .dwell import DwellResponse, dwell_response
from .dwell_motion import DwellMotion, IrregularMotion

_SEGMENT_S = 0.5
"""Segments of the density: 3 Hz wide, some twenty averages in 5 s."""
_REACH = 0.1
"""The band reaches so far to either side, as a fraction of its middle."""


@dataclass(frozen=True)
class TerminalLevel:
    """Displacement within a band around a frequency."""

    DOCUMENT: ClassVar = "towards_hz low_hz high_hz peak_hz rms_m relative_sd decibel_re_drive_line=decibel"

    towards_hz: float
    low_hz: float
    high_hz: float
    peak_hz: float
    """Where the displacement's density is largest in the band; a rising or falling edge puts it at an end."""
    rms_m: float
    relative_sd: float
    decibel: float
    """Band's rms re the rms of the line at the drive frequency."""


def terminal_levels(response: DwellResponse, towards_hz: tuple[float, ...]) -> tuple[TerminalLevel, ...]:
    """Measure the bands around the given frequencies; one that holds the drive's own line is left out."""
    motion = response.displacement
    window = round(response.window_s * motion.sample_rate_hz)
    segment = min(round(_SEGMENT_S * motion.sample_rate_hz), window // 4)
    density = spectral_density(motion.settled[-window:], motion.sample_rate_hz, segment_samples=segment)
    line_m = float(abs(response.order_displacement[response.orders.index(1.0)])) / np.sqrt(2)
    found = []
    for target in towards_hz:
        low, high = target * (1 - _REACH), target * (1 + _REACH)
        margin = 2 * density.noise_bandwidth_hz
        if low - margin < response.drive.frequency_hz < high + margin:
            continue
        inside = np.flatnonzero((density.frequency_hz >= low) & (density.frequency_hz <= high))
        rms = density.rms(low, high)
        lines = max(1.0, (high - low) / density.noise_bandwidth_hz)
        found.append(
            TerminalLevel(
                towards_hz=target,
                low_hz=low,
                high_hz=high,
                peak_hz=float(density.frequency_hz[inside[np.argmax(density.density[inside])]]),
                rms_m=rms,
                relative_sd=float(0.5 / np.sqrt(density.n_eff * lines)),
                decibel=float(20 * np.log10(max(rms, np.finfo(float).tiny) / line_m)),
            )
        )
    return tuple(found)


DwellPlan = Dwell | HeldDwell
WINDOW_S = 5.0
"""The paper's window: the last 5 s of a dwell."""
_DWELL_EDGE_PERIODS = 121
"""Drive periods that integration disturbs, both ends together."""
_SHORTEST_WINDOW_PERIODS = 50
_TIME_BINS = 1200


@dataclass(frozen=True, eq=False)
class DwellAnalysis(AbstractAnalysis[DwellPlan, DwellResponse]):
    """A dwell: time signal, spectrum, responses and lines."""

    OWN_UNITS: ClassVar = {"displacement": "m"}
    DOCUMENT: ClassVar = "*response terminal_bands=terminal motion=motion.verdict"

    displacement: Envelope
    """x over the dwell [m], without the ends that integration disturbs."""
    terminal: tuple[TerminalLevel, ...]
    """How much of the motion went to the bands of the bound modes."""
    motion: DwellMotion
    """How it repeats."""
    irregular: IrregularMotion | None
    """How long it did not repeat; None where all of it does."""


def bound_frequencies_hz(facts: RecordingFacts) -> tuple[float, ...]:
    """Frequencies of the specimen with m1 stuck to m2: where strong collisions move the motion to."""
    return tuple(float(each) for each in specimen_of(facts.bench).bound_frequencies_hz)


def measured_dwell(channels: Channels, dwell: DwellPlan, towards_hz: tuple[float, ...]) -> DwellResponse:
    """Analyse the last 5 s of a dwell, or what there is of them."""
    stretch = only_stretch(channels, SegmentLabel.DWELL)
    drive, base, response = read_whole(channels, stretch)
    rate = channels.sample_rate_hz
    clear_s = stretch.samples / rate - _DWELL_EDGE_PERIODS / dwell.frequency_hz
    if clear_s < _SHORTEST_WINDOW_PERIODS / dwell.frequency_hz:
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of the dwell were recorded; without the ends that integration "
            f"disturbs too little is left at {dwell.frequency_hz:g} Hz: measure longer"
        )
    return dwell_response(
        drive,
        base,
        response,
        rate,
        near_hz=dwell.frequency_hz,
        window_s=min(WINDOW_S, clear_s),
        towards_hz=towards_hz,
        delay_s=channels.response_delay_s,
        sensors=complex(channels.response_gain(np.array([dwell.frequency_hz]))[0]),
        silence=silence_before(channels),
        bridged=channels.bridged(stretch.start, stretch.stop),
    )


def settled_envelope(response: DwellResponse) -> Envelope:
    """Give x over the dwell as a plot shows it."""
    motion = response.displacement
    start_s = motion.edge_samples / motion.sample_rate_hz
    return envelope(motion.settled, motion.sample_rate_hz, bins=_TIME_BINS, start_s=start_s)


_HIGHEST_ORDER = 2.4
"""A spectrum is shown up to this multiple of the drive frequency."""
COLUMN_HZ = 1.0
"""A spectrum is drawn as its largest line in each column of this width: a figure has no more pixels."""


def spectrum_columns(response: DwellResponse) -> tuple[Reals, Reals]:
    """Middle [Hz] and largest amplitude over A0 of each column of the spectrum."""
    spectrum = response.spectrum
    width = max(1, round(COLUMN_HZ / spectrum.spacing_hz))
    first = max(1, round(5.0 / spectrum.spacing_hz))
    last = round(_HIGHEST_ORDER * response.drive.frequency_hz / spectrum.spacing_hz)
    starts = np.arange(first, last, width)
    largest = np.maximum.reduceat(spectrum.amplitude[:last], starts)
    middle: Reals = np.asarray((starts + 0.5 * (width - 1)) * spectrum.spacing_hz, dtype=np.float64)
    return middle, largest / response.drive.amplitude_m
