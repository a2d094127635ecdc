"""A simulated PortAudio library with one sound card, used by the real sounddevice package.

The real Python package makes every call and receives its C callbacks; only the shared library is simulated
(PortAudio has no loopback device).
"""

import ctypes.util
import sys
import threading
from functools import cache
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from tests.changed import changed
from vibench.acquisition.rig import OutputConfig
from vibench.virtual_rig.world.conversion import Coupling, Input

FRAMES = 512
CARD = "Simulated card"
RATE_HZ = 48_000.0
CALIBRATION = {
    "calibrated": "2026-02-10",
    "input_full_scale_v": 2.0,
    "output_full_scale_v": 1.5,
    "low_cut_hz": 0.5,
}
WIRES = ("drive_voltage", 2.0), ("amplifier_voltage", 10.0), ("base_acceleration", 1.0), ("m0_velocity", 1.0)


class Silent:
    """The terminal of a missing generator."""

    def render(self, start_s, interval_s, count):
        return np.zeros(count)


def card_rig(rig, **options):
    """Return the virtual rig with a sound card as converter and output, and without generator."""
    by_role = {channel.role.value: channel for channel in rig.daq.channels}
    channels = tuple(
        by_role[role].model_copy(
            update={
                "physical": f"in{number}", "range_v": 2.0, "coupling": "AC",
                "iepe_current_a": 0.0, "attenuation": attenuation,
            }
        )
        for number, (role, attenuation) in enumerate(WIRES)
    )  # fmt: skip
    output = OutputConfig(
        physical="ao0", plays="tones_and_streams", limit_v=1.5, sample_rate_hz=RATE_HZ, source="test"
    )
    given = {key: value for key, value in {**CALIBRATION, **options}.items() if value is not None}
    daq = {
        "driver": "soundcard", "device": CARD, "product": "sound card", "sample_rate_hz": RATE_HZ,
        "channels": channels, "output": output, "options": given,
    }  # fmt: skip
    return changed(rig, generator={"driver": "none", "resource": ""}, accelerometer={"iepe": "no"}, daq=daq)


class PortAudio:
    """The PortAudio 19 calls of sounddevice for one card; time advances while samples are requested.

    A test may change `codes` (results of opening, starting and aborting), `reported_hz`, `most_inputs`,
    `name`, `text`, and `heard`, which receives each block of samples and returns it with its flags, or None.
    """

    def __init__(self, ffi, name=CARD):
        self.ffi = ffi
        self.constants = ffi.dlopen(None)
        self.name = ffi.new("char[]", name.encode())
        self.text = ffi.new("char[]", b"simulated")
        self.kept = {}
        self.codes = {"open": 0, "start": 0, "abort": 0}
        self.reported_hz = None
        self.most_inputs = 8
        self.heard = lambda block, flags: (block, flags)
        self.plugged = True
        self.thread = None

    def wire(self, world, wanted):
        """Connect the jacks of `card_rig` to a world; samples flow while ``wanted`` returns true."""
        self.world, self.wanted = world, wanted
        self.inputs, self.output = [f"{CARD}/in{number}" for number in range(len(WIRES))], f"{CARD}/ao0"
        self.in_v, self.out_v = CALIBRATION["input_full_scale_v"], CALIBRATION["output_full_scale_v"]

    def __getattr__(self, name):
        return getattr(self.constants, name)

    def Pa_Initialize(self):
        return 0

    Pa_Terminate = Pa_Initialize

    def Pa_GetVersion(self):
        return 1899

    def Pa_GetVersionText(self):
        return self.text

    def Pa_GetErrorText(self, error):
        return self.text

    def Pa_GetLastHostErrorInfo(self):
        fields = {"hostApiType": 1, "errorCode": -5, "errorText": self.text}
        return self.kept.setdefault("error", self.ffi.new("PaHostErrorInfo*", fields))

    def Pa_GetDeviceCount(self):
        return int(self.plugged)

    Pa_GetHostApiCount = Pa_GetDeviceCount

    def Pa_GetHostApiInfo(self, index):
        fields = {"structVersion": 1, "name": self.name, "deviceCount": 1}
        return self.kept.setdefault("api", self.ffi.new("PaHostApiInfo*", fields))

    def Pa_HostApiDeviceIndexToDeviceIndex(self, api, index):
        return 0

    def Pa_HostApiTypeIdToHostApiIndex(self, kind):
        return -1

    def Pa_GetDeviceInfo(self, index):
        fields = {
            "structVersion": 2, "name": self.name, "hostApi": 0, "maxInputChannels": self.most_inputs,
            "maxOutputChannels": 2, "defaultHighInputLatency": 0.01, "defaultHighOutputLatency": 0.01,
            "defaultSampleRate": 48000.0,
        }  # fmt: skip
        return self.kept.setdefault("device", self.ffi.new("PaDeviceInfo*", fields))

    def Pa_GetSampleSize(self, kind):
        return 4

    def Pa_OpenStream(self, stream, heard, played, rate_hz, frames, flags, callback, user):
        self.rate_hz, self.callback, self.user = rate_hz, callback, user
        self.channels = heard.channelCount, played.channelCount if played else 0
        stream[0] = self.ffi.cast("void*", 1)
        return self.codes["open"]

    def Pa_GetStreamInfo(self, stream):
        fields = {
            "structVersion": 1,
            "sampleRate": self.rate_hz if self.reported_hz is None else self.reported_hz,
        }
        return self.kept.setdefault("stream", self.ffi.new("PaStreamInfo*", fields))

    def Pa_StartStream(self, stream):
        if self.codes["start"]:
            return self.codes["start"]
        self.ends = threading.Event()
        self.thread = threading.Thread(target=self.turn, daemon=True)
        self.thread.start()
        return 0

    def Pa_AbortStream(self, stream):
        if self.thread is not None:
            self.ends.set()
            self.thread.join()
            self.thread = None
            self.world.silence(self.output)
        return self.codes["abort"]

    Pa_StopStream = Pa_CloseStream = Pa_AbortStream

    def turn(self):
        """Call back block by block, as a sound card does."""
        taken = tuple(Input(name, self.in_v, Coupling.AC) for name in self.inputs)
        sampler = self.world.sample(taken, self.rate_hz)
        heard = np.zeros((FRAMES, self.channels[0]), dtype=np.float32)
        played = np.zeros((FRAMES, max(1, self.channels[1])), dtype=np.float32)
        time = self.ffi.new("PaStreamCallbackTimeInfo*")
        while not self.ends.is_set():
            if not self.wanted():
                self.ends.wait(1e-4)
                continue
            heard[:, : len(taken)] = sampler.read(FRAMES).T / self.in_v
            given = self.heard(heard, 0)
            if given is None:
                continue
            block, flags = given
            pointers = [self.ffi.cast("void*", each.ctypes.data) for each in (block, played)]
            self.callback(*pointers, len(block), time, flags, self.user)
            if self.channels[1]:
                self.world.play(self.output, played[:, 0].astype(float) * self.out_v, self.rate_hz)
        sampler.close()


@cache
def simulated():
    """Load the real sounddevice on a simulated PortAudio once; return the simulation."""
    from _sounddevice import ffi

    audio = PortAudio(ffi)

    class Loading:
        dlopen = staticmethod(lambda name: audio)

        def __getattr__(self, name):
            return getattr(ffi, name)

    real = ctypes.util.find_library
    found = patch("ctypes.util.find_library", lambda name: "it" if name == "portaudio" else real(name))
    with found, patch.dict(sys.modules, {"_sounddevice": SimpleNamespace(ffi=Loading())}):
        import sounddevice
    sys.modules["sounddevice"] = sounddevice  # the patch has removed the module
    return audio
