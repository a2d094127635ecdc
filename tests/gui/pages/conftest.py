"""Small real recordings of known motions."""

import time

import numpy as np
import pytest
from PySide6.QtCore import QEventLoop, QTimer

from vibench.acquisition import Block, Overload
from vibench.acquisition.plan import Dwell, Measurement, StreamedNoise
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.gui.page.app_context import AppContext, Settings

RATE_HZ = 6400.0
SAMPLES = 64_000
IMPACT_SAMPLE = 40_001
ROLES = (
    ("drive_voltage", "voltage", "V"),
    ("base_acceleration", "acceleration", "m s-2"),
    ("m0_velocity", "velocity", "m s-1"),
)


def _header(name, plan):
    channels = tuple(
        ChannelHeader(role, f"dev/{role}", quantity, unit, 1.0, 10.0) for role, quantity, unit in ROLES
    )
    return RecordingHeader(
        channels=channels,
        sample_rate_hz=RATE_HZ,
        expected_samples=SAMPLES,
        origin=Origin.SIMULATED,
        plan_json=Measurement(name=name, excitation=plan).model_dump_json(),
        bench_json='{"name": "a bench"}',
    )


@pytest.fixture(scope="session")
def wait_for():
    """Process events until a condition holds."""

    def wait(is_so, within_s=90.0):
        until = time.monotonic() + within_s
        while not is_so():
            assert time.monotonic() < until, "it did not come true in time"
            # Polling without a pause would take processor time from the worker processes.
            pause = QEventLoop()
            QTimer.singleShot(10, pause.quit)
            pause.exec()

    return wait


@pytest.fixture(scope="session")
def shared_context(qapp, tmp_path_factory):
    """A context whose worker processes are shared by all tests: starting takes seconds."""
    context = AppContext(Settings(tmp_path_factory.mktemp("settings") / "window.ini"))
    yield context
    context.background.close()


@pytest.fixture(scope="session")
def record():
    """Write a dwell of ten seconds with one impact of three samples in its velocity."""

    def write(folder, name, frequency_hz=260.0, state=RecordingState.COMPLETE):
        plan = Dwell(amplitude_vpp=1.0, frequency_hz=frequency_hz, settle_s=1.0, duration_s=8.0)
        phase = 2 * np.pi * frequency_hz * np.arange(SAMPLES) / RATE_HZ
        base = -3e-6 * (2 * np.pi * frequency_hz) ** 2 * np.cos(phase)
        velocity = -9e-6 * 2 * np.pi * frequency_hz * np.sin(phase)
        velocity[IMPACT_SAMPLE : IMPACT_SAMPLE + 3] = (0.4, -0.5, 0.4)
        volts = np.stack((0.5 * np.cos(phase), base, velocity))
        writer = create_recording(folder / f"{name}.h5", _header(name, plan))
        writer.append(Block(0, volts[:, :6400], ()))
        writer.begin_segment("dwell", frequency_hz=frequency_hz)
        writer.append(Block(6400, volts[:, 6400:57_600], (Overload("m0_velocity", 40_000, 40_010),)))
        writer.end_segment()
        writer.append(Block(57_600, volts[:, 57_600:], ()))
        writer.finish(state, "the plan was carried out")
        return folder / f"{name}.h5"

    return write


@pytest.fixture(scope="session")
def begin_recording():
    """Begin a growing recording; return its writer and temporary path."""

    def begin(folder, name, samples=6400):
        plan = Dwell(amplitude_vpp=1.0, frequency_hz=260.0, settle_s=1.0, duration_s=8.0)
        writer = create_recording(folder / f"{name}.h5", _header(name, plan))
        if samples:
            writer.append(Block(0, np.ones((len(ROLES), samples)), ()))
        return writer, folder / f"{name}.h5.part"

    return begin


@pytest.fixture(scope="session")
def record_noise():
    """Write ten seconds of streamed noise with a known displacement ratio of the mass."""

    def write(folder, name, factor):
        omega = 2j * np.pi * np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)
        inside = (np.abs(omega) >= 2 * np.pi * 20) & (np.abs(omega) <= 2 * np.pi * 700)
        rng = np.random.default_rng(5)
        spectrum = np.where(inside, rng.standard_normal(omega.size) + 1j * rng.standard_normal(omega.size), 0)
        base = 3e-7 * spectrum / np.std(np.fft.irfft(spectrum, SAMPLES))
        rows = (1e4 * base, omega**2 * base, factor * omega * base)
        volts = np.stack([np.fft.irfft(each, SAMPLES) for each in rows])
        plan = StreamedNoise(
            amplitude_vpp=0.1, band_start_hz=40.0, band_stop_hz=600.0, settle_s=0.0, duration_s=10.0, seed=1
        )
        writer = create_recording(folder / f"{name}.h5", _header(name, plan))
        writer.begin_segment("noise")
        writer.append(Block(0, volts, ()))
        writer.end_segment()
        return writer.finish(RecordingState.COMPLETE, "the plan was carried out")

    return write
