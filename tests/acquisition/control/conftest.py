"""A hardening oscillator on a vibrating base, simulated in slow time: fast, bistable, with a closed form."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from vibench.acquisition.control.control_action import ControlAction, PhaseSamples
from vibench.acquisition.control.controllers import feedback_controller
from vibench.acquisition.excitation.steps import Tone
from vibench.acquisition.plan import Measurement, RunState, needed_vpp
from vibench.acquisition.rig import Rig, Role, channels_of

RATE_HZ = 5120.0
SLOW_STEP_S = 1e-3
CLOCK_PPM = 20.0


@dataclass
class Oscillator:
    """x'' + 2 z w0 x' + w0^2 x + g x^3 = -a(t), averaged over a period; x = Re X exp(i w t)."""

    natural_hz: float = 120.0
    damping: float = 0.004
    hardening: float = 0.0
    motion: complex = 0j

    def advance(self, frequency_hz: float, base: complex, duration_s: float) -> None:
        """Integrate one slow step under the acceleration phasor of the base."""
        omega, natural = 2 * np.pi * frequency_hz, 2 * np.pi * self.natural_hz

        def rate(x: complex) -> complex:
            stiffness = natural**2 - omega**2 + 0.75 * self.hardening * abs(x) ** 2
            return (-base - (stiffness + 2j * self.damping * natural * omega) * x) / (2j * omega)

        x, h = self.motion, duration_s
        k1 = rate(x)
        k2 = rate(x + h / 2 * k1)
        k3 = rate(x + h / 2 * k2)
        self.motion = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(x + h * k3))

    def highest_seen_m(self, frequency_hz: float, acceleration: float) -> float:
        """Return the largest amplitude of m0 in space [m]: base plus x on the highest branch."""
        omega, natural = 2 * np.pi * frequency_hz, 2 * np.pi * self.natural_hz
        x = max(self.steady_amplitudes(frequency_hz, acceleration))
        stiffness = natural**2 - omega**2 + 0.75 * self.hardening * x**2
        moved = -acceleration / (stiffness + 2j * self.damping * natural * omega)
        return abs(moved - acceleration / omega**2)

    def steady_amplitudes(self, frequency_hz: float, acceleration: float) -> list[float]:
        """Return all steady amplitudes of x, also unstable ones, from the cubic of harmonic balance."""
        omega, natural = 2 * np.pi * frequency_hz, 2 * np.pi * self.natural_hz
        detuning, loss = natural**2 - omega**2, 2 * self.damping * natural * omega
        g = 0.75 * self.hardening
        roots = np.roots([g**2, 2 * g * detuning, detuning**2 + loss**2, -(acceleration**2)])
        return sorted(float(np.sqrt(r.real)) for r in roots if abs(r.imag) < 1e-9 * abs(r) and r.real > 0)


@dataclass
class Bench:
    """Generator, shaker and oscillator; the base follows the rig's model times `shaker_factor`."""

    rig: Rig
    oscillator: Oscillator
    shaker_factor: Callable[[float], float] = lambda frequency_hz: 1.0
    velocity_noise: float = 1e-7
    sample: int = 0
    cycles: float = 0.0
    notes: list[tuple[float, str, str]] = field(default_factory=list)
    segments: list[tuple[str, dict, float, float]] = field(default_factory=list)
    settings: list[tuple[float, float, float]] = field(default_factory=list)

    def carry_out(self, measurement: Measurement) -> None:
        """Run the feedback controller of a measurement until its end, as a run would."""
        controller = feedback_controller(measurement, self.rig, channels_of(self.rig), RATE_HZ)
        noise = np.random.default_rng(5)
        level = 0.0
        most_vpp = measurement.excitation.amplitude_vpp
        try:
            action: ControlAction = next(controller)
            while True:
                self.notes += [(self.sample / RATE_HZ, note.kind, note.text) for note in action.notes]
                phase = action.phase
                if phase is None:
                    action = controller.send(PhaseSamples(0, np.empty((0, 0))))
                    continue
                begin, level = level, phase.end_level
                first = self.sample
                volts = self._play(phase.play, phase.duration_s, (begin, level), most_vpp, noise)
                if phase.segment is not None and phase.state is RunState.RECORDING:
                    span = (first / RATE_HZ, self.sample / RATE_HZ)
                    self.segments.append((phase.segment.label, dict(phase.segment.numbers), *span))
                action = controller.send(PhaseSamples(first, volts))
        except StopIteration:
            pass

    def _play(self, play, duration_s, levels, most_vpp, noise):
        count = round(duration_s * RATE_HZ)
        tone = play if isinstance(play, Tone) else Tone(100.0, 0.0)
        frequency_hz = tone.frequency_hz * (1 + CLOCK_PPM * 1e-6)
        self.settings.append((self.sample / RATE_HZ, tone.frequency_hz, tone.level * most_vpp))
        per_vpp = self.shaker_factor(tone.frequency_hz) / needed_vpp(self.rig, 1.0, tone.frequency_hz)
        amplitude = tone.level * most_vpp * np.linspace(*levels, count, endpoint=False)
        base = amplitude * per_vpp
        slow = max(1, round(SLOW_STEP_S * RATE_HZ))
        motion = np.empty(count, np.complex128)
        for start in range(0, count, slow):
            part = slice(start, min(start + slow, count))
            motion[part] = self.oscillator.motion
            # The drive is a sine: its phasor for Re exp(i w t) is -i.
            self.oscillator.advance(frequency_hz, -1j * complex(base[start]), (part.stop - start) / RATE_HZ)
        cycles = self.cycles + frequency_hz * np.arange(count + 1) / RATE_HZ
        self.cycles = float(cycles[-1] % 1.0)
        turning = np.exp(2j * np.pi * cycles[:-1])
        omega = 2 * np.pi * frequency_hz
        # The vibrometer measures base plus x: acceleration a sin(w t) is the displacement i a / w^2.
        velocity = np.real(1j * omega * (motion + 1j * base / omega**2) * turning)
        physical = {
            Role.DRIVE_VOLTAGE: 0.5 * amplitude * turning.imag,
            Role.AMPLIFIER_VOLTAGE: amplitude * turning.imag,
            Role.BASE_ACCELERATION: base * turning.imag,
            Role.M0_VELOCITY: velocity + self.velocity_noise * noise.standard_normal(count),
        }
        self.sample += count
        return np.stack([physical[each.role] / each.units_per_volt for each in channels_of(self.rig)])


@pytest.fixture
def new_control_bench(rig: Rig) -> Callable[..., Bench]:
    """Return a function that makes benches around an oscillator; their vibrometer has no delay."""
    prompt = rig.model_copy(update={"vibrometer": rig.vibrometer.model_copy(update={"delay_s": 0.0})})

    def make(**habits) -> Bench:
        factor = habits.pop("shaker_factor", lambda frequency_hz: 1.0)
        return Bench(prompt, Oscillator(**habits), factor)

    return make
