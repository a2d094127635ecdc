"""A simulated PortAudio with one sound card, behind the real sounddevice: the analogue world on its jacks.

The real Python library makes every call and is called back through its own C callback; what stands in is the
shared library underneath (PortAudio has no device of its own that could be looped back).
"""

import ctypes.util
import sys
import threading
from functools import cache
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np

from vibench.virtual_rig.world.wiring import Coupling, Input

FRAMES = 512


class PortAudio:
    """The calls of PortAudio 19 that sounddevice makes of one card; time passes while samples are wanted."""

    def __init__(self, ffi, name="Simulated card"):
        self.ffi = ffi
        self.constants = ffi.dlopen(None)
        self.name = ffi.new("char[]", name.encode())
        self.text = ffi.new("char[]", b"simulated")
        self.kept = {}
        self.plugged = True
        self.thread = None

    def wire(self, world, inputs, output, full_scale_v, wanted):
        """Plug the jacks in: names of the world's inputs in the order of the card's, and of its output."""
        self.world, self.inputs, self.output = world, inputs, output
        self.in_v, self.out_v = full_scale_v
        self.wanted = wanted

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
            "structVersion": 2, "name": self.name, "hostApi": 0, "maxInputChannels": 8,
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
        return 0

    def Pa_GetStreamInfo(self, stream):
        fields = {"structVersion": 1, "sampleRate": self.rate_hz}
        return self.kept.setdefault("stream", self.ffi.new("PaStreamInfo*", fields))

    def Pa_StartStream(self, stream):
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
        return 0

    Pa_StopStream = Pa_CloseStream = Pa_AbortStream

    def turn(self):
        """Call back, block after block, as a sound card does."""
        taken = tuple(Input(name, self.in_v, Coupling.AC) for name in self.inputs)
        sampler = self.world.sample(taken, self.rate_hz)
        heard = np.zeros((FRAMES, self.channels[0]), dtype=np.float32)
        played = np.zeros((FRAMES, max(1, self.channels[1])), dtype=np.float32)
        time = self.ffi.new("PaStreamCallbackTimeInfo*")
        pointers = [self.ffi.cast("void*", each.ctypes.data) for each in (heard, played)]
        while not self.ends.is_set():
            if not self.wanted():
                self.ends.wait(1e-4)
                continue
            heard[:, : len(taken)] = sampler.read(FRAMES).T / self.in_v
            self.callback(*pointers, FRAMES, time, 0, self.user)
            if self.channels[1]:
                self.world.play(self.output, played[:, 0].astype(float) * self.out_v, self.rate_hz)
        sampler.close()


@cache
def simulated():
    """Load the real sounddevice on a simulated PortAudio, once; give it."""
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
    sys.modules["sounddevice"] = sounddevice  # which the patch has taken out again
    return audio
