"""Sensors of the rig's motion: bandwidth, resonance, noise, drop-outs, full scale."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.random import Generator, Philox, SeedSequence
from numpy.typing import NDArray

from vibench.acquisition import ConfigurationError
from vibench.acquisition.rig import Role, SensorConfig
from vibench.sim.engine.library import Structure
from vibench.sim.engine.run import native_engine

from .time_grid import USUAL_GRID, FloatArray, RecursiveFilter, TimeGrid

PAGE = 16_384
"""Number of random numbers per page: short pages need more generator calls, long pages waste more numbers."""


class NoiseStream:
    """White Gaussian noise of unit variance, for one source of noise in the rig.

    A counter-based generator (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC11) gives any
    page of the stream directly, so that runs agree bit for bit for all block sizes.
    """

    def __init__(self, seed: int, place: str) -> None:
        """Create the stream named ``place``; streams with different names are independent."""
        self._key = SeedSequence([seed, crc32(place.encode())]).generate_state(2, np.uint64)
        self._page_number = -1
        self._page = np.empty(0)

    def draw(self, first: int, count: int) -> NDArray[np.float64]:
        """Return samples ``first`` to ``first + count - 1`` of the stream, shape (count,)."""
        pages = range(first // PAGE, (first + count - 1) // PAGE + 1)
        if not pages:
            return np.empty(0)
        parts = [self._samples_of(page) for page in pages]
        drawn = parts[0] if len(parts) == 1 else np.concatenate(parts)
        offset = first % PAGE
        return np.asarray(drawn[offset : offset + count])

    def generator(self, page_number: int) -> Generator:
        """Return a random number generator for the events of one page."""
        # With the page number as the third word of the counter, pages never share random numbers.
        return Generator(Philox(key=self._key, counter=np.array([0, 0, page_number, 0], dtype=np.uint64)))

    def _samples_of(self, page_number: int) -> NDArray[np.float64]:
        if page_number != self._page_number:
            self._page = self.generator(page_number).standard_normal(PAGE)
            self._page_number = page_number
        return self._page


@dataclass(frozen=True)
class Disturbance:
    """A constant output level that replaces the signal during several steps."""

    first_step: int
    stop_step: int
    """Number of the first step after the disturbance."""
    level: float
    """Level as a fraction of full scale, -1 to 1."""


class RandomDropouts:
    """Times at which speckle interrupts the laser signal: a Poisson process.

    The decoder then follows noise instead of the carrier. During a drop-out, the output has a random,
    constant level; the durations are exponentially distributed.
    """

    MEAN_S = 30.0 / 102_400
    """Mean duration of a drop-out [s]; about 0.3 ms is assumed."""

    def __init__(self, per_s: float, stream: NoiseStream, grid: TimeGrid = USUAL_GRID) -> None:
        """Create drop-outs, on average ``per_s`` per second."""
        self._per_page = per_s * grid.step_s * PAGE
        self._mean_steps = self.MEAN_S * grid.rate_hz
        self._stream = stream

    def between(self, first: int, stop: int) -> list[Disturbance]:
        """Return every drop-out that overlaps the steps from ``first`` to before ``stop``."""
        if self._per_page == 0.0:
            return []
        # No drop-out is longer than a page, so include one page before the first.
        pages = range(max(first // PAGE - 1, 0), stop // PAGE + 1)
        found = [dropout for page in pages for dropout in self._page_dropouts(page)]
        return [dropout for dropout in found if dropout.stop_step > first and dropout.first_step < stop]

    def _page_dropouts(self, page: int) -> list[Disturbance]:
        random = self._stream.generator(page)
        count = int(random.poisson(self._per_page))
        begins = page * PAGE + random.integers(0, PAGE, count)
        lengths = np.minimum(np.ceil(random.exponential(self._mean_steps, count)), PAGE).astype(np.int64)
        levels = random.uniform(-1.0, 1.0, count)
        return [
            Disturbance(int(begin), int(begin + length), float(level))
            for begin, length, level in zip(begins, lengths, levels, strict=True)
        ]


_FIT_BAND = 0.2
"""Upper end of the fit [grid rates]: the pass band of a converter that samples at half the grid's rate."""
_FIT_FLOOR = 1e-2
"""Lower end of the fit; below it, the exact gain at zero frequency determines the response."""
_FIT_POINTS = 64
_ZEROS = 6
"""Number of numerator weights that are fitted."""


def low_pass_poles(
    bandwidth_hz: float | None = None, resonance_hz: float | None = None, damping_ratio: float = 0.02
) -> tuple[complex, ...]:
    """Return the poles of a sensor [rad/s]: one for the bandwidth (-3 dB), two for the mounted resonance.

    The default damping ratio is assumed; it is typical of piezoelectric sensors.
    """
    poles = () if bandwidth_hz is None else (complex(-2 * np.pi * bandwidth_hz),)
    if resonance_hz is None:
        return poles
    omega = 2 * np.pi * resonance_hz
    pole = complex(-damping_ratio * omega, omega * np.sqrt(1 - damping_ratio**2))
    return (*poles, pole, pole.conjugate())


def low_pass_gain(poles: tuple[complex, ...], frequency_hz: FloatArray) -> NDArray[np.complex128]:
    """Return the complex gain of an analogue low-pass, with the shape of ``frequency_hz``."""
    s = 2j * np.pi * np.asarray(frequency_hz)
    return np.asarray(np.prod([pole / (pole - s) for pole in poles], axis=0), dtype=np.complex128)


def running_filter(analogue_poles: tuple[complex, ...], step_s: float) -> RecursiveFilter:
    """Return a low-pass filter for a grid of ``step_s``, initially at rest.

    The poles are mapped exactly (z = exp(s T)), so a resonance keeps its frequency even close to the grid's
    Nyquist frequency. A resonance above Nyquist is omitted, as it would appear at another frequency. The
    zeros are a least-squares fit to the complex analogue response, with exact gain at zero frequency.
    """
    poles = np.array([pole for pole in analogue_poles if abs(pole.imag) * step_s < np.pi])
    denominator = np.atleast_1d(np.asarray(np.poly(np.exp(poles * step_s)).real, dtype=np.float64))
    return RecursiveFilter(_fit_zeros(analogue_poles, denominator, step_s), denominator)


def _fit_zeros(poles: tuple[complex, ...], denominator: FloatArray, step_s: float) -> FloatArray:
    frequency_hz = np.geomspace(_FIT_FLOOR, _FIT_BAND, _FIT_POINTS) / step_s
    z = np.exp(-2j * np.pi * frequency_hz * step_s)
    target = low_pass_gain(poles, frequency_hz) * np.polynomial.polynomial.polyval(z, denominator)
    powers = z[:, np.newaxis] ** np.arange(_ZEROS)
    # The gain at zero frequency is 1, so numerator and denominator have equal sums: eliminate one weight.
    total = denominator.sum()
    reduced = powers[:, 1:] - powers[:, :1]
    remainder = target - total * powers[:, 0]
    weight = (1 / frequency_hz)[:, np.newaxis]  # an equal delay has an equal weight at all frequencies
    matrix = np.concatenate([reduced.real * weight, reduced.imag * weight])
    aim = np.concatenate([remainder.real * weight[:, 0], remainder.imag * weight[:, 0]])
    weights, *_ = np.linalg.lstsq(matrix, aim)
    return np.concatenate([[total - weights.sum()], weights])


IEPE_BIAS_V = 10.0
"""Constant voltage of a powered IEPE sensor [V]; 8 to 12 V is usual."""
LONGEST_DELAY_S = 5e-3
"""Largest sensor delay [s], limited by the history kept for a conversion at its lowest rate."""


@dataclass(frozen=True, eq=False)
class SensorParts:
    """Data needed to convert the motion during several steps to sensor volts."""

    filter: RecursiveFilter
    noise: FloatArray
    """Noise of the sensor in units of the motion, shape (steps,)."""
    instead: FloatArray
    """Values that replace the motion, where not NaN, in units of the motion; empty if nothing is replaced."""
    full_scale: float
    """Full scale of the sensor in units of the motion."""
    full_scale_v: float

    def showing(self, motion: FloatArray, volts: FloatArray) -> Structure:
        """Return the native engine's structure for the conversion of this motion to volts."""
        return native_engine().new(
            "Sensor",
            filter=self.filter.parts,
            noise=self.noise,
            instead=self.instead,
            full_scale=self.full_scale,
            full_scale_voltage=self.full_scale_v,
            motion=motion,
            volts=volts,
        )


class MotionSensor:
    """A sensor in front of an input: vibrometer, accelerometer, displacement probe or force cell.

    The effects occur in this order: bandwidth or resonance, white noise, drop-outs, conversion to volts,
    clipping at full scale. The converter's filter applies the rest of the sensor's delay (``delay_steps``).
    """

    def __init__(
        self,
        config: SensorConfig,
        role: Role,
        noise_rms: float,
        noise: NoiseStream,
        grid: TimeGrid = USUAL_GRID,
        dropouts: RandomDropouts | None = None,
    ) -> None:
        """Create a sensor; ``noise_rms`` is the rms noise of means over a step, in the channel's SI unit."""
        if config.delay_s > LONGEST_DELAY_S:
            raise ConfigurationError(
                f"delay_s = {config.delay_s} s of the {config.model} ({role.value}): the virtual rig can "
                f"delay by at most {LONGEST_DELAY_S} s; give a smaller delay"
            )
        bandwidth_s = 1 / (2 * np.pi * config.bandwidth_hz) if config.bandwidth_hz else 0.0
        self.delay_steps = (config.delay_s - bandwidth_s) * grid.rate_hz
        self._filter = running_filter(low_pass_poles(config.bandwidth_hz, config.resonance_hz), grid.step_s)
        self._noise_rms = noise_rms
        self._full_scale = config.full_scale_v * config.units_per_volt(role.unit)
        self._full_scale_v = config.full_scale_v
        self._noise = noise
        self._dropouts = dropouts
        self._demanded: list[Disturbance] = []

    def disturb(self, disturbance: Disturbance) -> None:
        """Output a constant level for some steps instead of the motion: drop-out or over-range on demand."""
        self._demanded.append(disturbance)

    def parts(self, first_step: int, count: int) -> SensorParts:
        """Return the data needed to convert the motion over the next steps, without the IEPE bias."""
        self._demanded = [one for one in self._demanded if one.stop_step > first_step]
        dropouts = [] if self._dropouts is None else self._dropouts.between(first_step, first_step + count)
        disturbed = dropouts + self._demanded
        instead = np.full(count if disturbed else 0, np.nan)
        # The first entry of ``instead`` belongs to ``first_step``.
        for disturbance in disturbed:
            begin = max(disturbance.first_step - first_step, 0)
            stop = max(disturbance.stop_step - first_step, 0)
            instead[begin:stop] = disturbance.level * self._full_scale
        noise = self._noise_rms * self._noise.draw(first_step, count)
        return SensorParts(self._filter, noise, instead, self._full_scale, self._full_scale_v)

    def volts(self, values: FloatArray, first_step: int) -> FloatArray:
        """Return the output [V], given the mean motion in each of the next steps, shape (steps,)."""
        volts = np.empty(len(values))
        parts = self.parts(first_step, len(values))
        native_engine().call("show", parts.showing(np.ascontiguousarray(values), volts))
        return volts
