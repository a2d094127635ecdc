"""HELIC-DAQ as a real-time controller of vibench: an example of a driver for a third-party board.

HELIC-DAQ (D. A. W. Barton, MIT licence, https://github.com/dawbarton/helic-daq) is open firmware for RP2350
boards. At 1 to 8 kHz it plays a Fourier series and runs a control that is chosen when the firmware is built.
Both are set over TCP; samples return over UDP. This driver follows the firmware's documents (protocol 3,
release 0.3.0) and has never run on a board. The firmware must have the control `PidController`, fed by the
source that the option `m0` names, and a rig with the safety gate.

- The series of a program is written to ``forcing_coeffs`` and ``freq``, which the board changes without a
  jump of the phase. The board has no glides, so a glide is played as many small changes.
- A law is written to ``ctrl_kp``, ``ctrl_kd`` and ``ctrl_tau_d``. Only a proportional-derivative law of m0
  is accepted.
- Coefficients are computed here, from every sample and the board's own phase, under a Hann window.
- The gate is open while a program plays. The board closes it when the connection ends: at once if the host's
  program dies, within 10 s if a cable is pulled. The board does not notice a host that hangs with an open
  connection. A thread of this driver then silences the board, but nothing monitors that thread.
"""

import re
import threading
from dataclasses import replace
from typing import Self

import numpy as np
from helic_link import HelicLink, Packet
from helic_signals import READ, Coefficients, Glide, Signal, pd_gains

from vibench.acquisition import ConfigurationError, InstrumentError, InstrumentLost
from vibench.acquisition.instruments import Identity
from vibench.acquisition.rig import ControllerConfig, LoopInput
from vibench_fast_loop.protocol import LoopBlock, LoopFacts, LoopProgram, LoopReport, LoopState

GAINS = ("ctrl_kp", "ctrl_kd", "ctrl_tau_d")
GATE_OPEN, GATE_TRIPPED = 1, 2
ENDING_S = 0.05
"""Duration of a ramp down that the driver starts by itself [s]."""
LONGEST_AT_LIMIT_S = 0.05
LATEST_S = 0.02
"""Largest delay of the received samples behind the tick count that the board reports [s]."""
PATIENCE_S = 2.0
"""Longest wait for samples [s]."""
LISTENING_S = 0.02
MOST_BLOCKS = 2000
_AT_LIMIT = 0.999


class HelicController:
    """The host's end of a connection to a HELIC-DAQ board."""

    def __init__(self, link: HelicLink, config: ControllerConfig, read: tuple[str, ...]) -> None:
        self._link = link
        self._config = config
        experiment, firmware = (
            bytes(each).rstrip(b"\0").decode() for each in link.get("experiment", "firmware")
        )
        self._identity = Identity(
            "", f"HELIC-DAQ {experiment}", "", firmware, f"{link.where} {experiment} {firmware}"
        )
        self._facts = LoopFacts(
            name=self._identity.model,
            serial=link.where,
            rate_hz=link.rate_hz,
            latency_s=config.latency_s,
            limit_v=config.limit_v,
            watchdog_s=config.watchdog_s,
            pd_of=LoopInput.M0,
        )
        self._harmonics = (link.parameters["forcing_coeffs"].count - 1) // 2
        self._turn = threading.Condition()
        self._state, self._reason = LoopState.SILENT, ""
        self._error: InstrumentError | None = None
        """Error after which no further request is possible; None without one."""
        self._gains: tuple[float, ...] = ()
        self._now = Signal(0.0, np.zeros(self._harmonics, dtype=np.complex128))
        self._glide: Glide | None = None
        self._coefficients: Coefficients | None = None
        self._blocks: list[LoopBlock] = []
        self._following, self._number = -1, 0
        """Numbers of the next sample and packet; -1 before the first sample."""
        self._talked = self._at_limit = self._late = 0
        """Sample number of the last request; samples at the output limit; late ticks when the gate opened."""
        (self._ticks,) = link.get("ticks")
        """Tick count of the board minus number of the next sample; before any sample, the tick count."""
        self._close_gate()
        link.stream(read)
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._listen, name="helic", daemon=True)
        self._thread.start()

    @classmethod
    def open(cls, config: ControllerConfig) -> Self:
        """Connect, silence the output, and check the board against its configuration."""
        host, port = session(config.resource)
        link = HelicLink(host, port, int(config.options.get("stream_port", port + 1)))
        try:
            read = check_board(link, config)
            return cls(link, config, read)
        except BaseException:
            link.close()  # this closes the board's gate
            raise

    @property
    def identity(self) -> Identity:
        """Identity of the board."""
        return self._identity

    @property
    def facts(self) -> LoopFacts:
        """Sample rate, latency, output limit and watchdog time."""
        return self._facts

    def play(self, program: LoopProgram) -> LoopReport:
        """Change to a program over its glide time; return the report."""
        if len(program.reference_v) > self._harmonics:
            raise InstrumentError(
                f"{len(program.reference_v)} harmonics were requested, but the board at {self._link.where} "
                f"plays at most {self._harmonics}. Nothing was changed; request fewer"
            )
        gains = pd_gains(program.feedback, 1 / self._facts.rate_hz)
        wanted = np.zeros(self._harmonics, dtype=np.complex128)
        wanted[: len(program.reference_v)] = [complex(*each) for each in program.reference_v]
        with self._turn:
            report = self._new_report()
            try:
                self._go_over(Signal(program.frequency_hz, wanted), gains, program.glide_s)
            except InstrumentError as error:
                self._give_up(error)
                raise
            self._coefficients = Coefficients(program, self._facts.rate_hz)
            self._state, self._reason = LoopState.PLAYING, ""
            return report.model_copy(update={"state": self._state, "reason": ""})

    def report(self) -> LoopReport:
        """Return the state and the blocks measured since the last report."""
        with self._turn:
            self._require_there()
            try:
                self._look_at_board()
            except InstrumentError as error:
                self._give_up(error)
                raise
            return self._new_report()

    def silence(self, ramp_s: float) -> LoopReport:
        """Ramp down, and close the board's gate."""
        with self._turn:
            report = self._new_report()
            if self._state is not LoopState.SILENT:
                if ramp_s == 0.0:
                    self._close_gate()
                elif self._state is LoopState.PLAYING:
                    self._end("", ramp_s)
            return report.model_copy(update={"state": self._state})

    def close(self) -> None:
        """Silence the output, and close the connection."""
        with self._turn:
            if self._leaving.is_set():
                return
            try:
                if self._error is None:
                    self.silence(ENDING_S)
                    self._turn.wait_for(lambda: self._state is LoopState.SILENT, 10 * ENDING_S)
                    self._close_gate()
            finally:
                self._error = self._error or InstrumentError(
                    f"the connection to the board at {self._link.where} was closed. Its output is off; "
                    "open the bench again"
                )
                self._leaving.set()
                self._link.close()
        self._thread.join()

    def _require_there(self) -> None:
        if self._error is not None:
            raise self._error

    def _new_report(self) -> LoopReport:
        """Return the report, and restart the watchdog."""
        self._require_there()
        self._talked = self._following
        blocks, self._blocks = tuple(self._blocks), []
        time_s = max(self._following, 0) / self._facts.rate_hz
        return LoopReport(state=self._state, reason=self._reason, time_s=time_s, blocks=blocks)

    def _go_over(self, wanted: Signal, gains: tuple[float, ...], glide_s: float) -> None:
        if gains != self._gains:
            for name, gain in zip(GAINS, gains, strict=True):
                self._link.set(name, gain)
            self._gains = gains
        if self._state is LoopState.SILENT:
            self._send(Signal(wanted.frequency_hz, np.zeros_like(wanted.volts)))
            open_gate(self._link)
            self._late, self._at_limit = self._ticks_late(), 0
        samples = max(glide_s * self._facts.rate_hz, 1.0)
        self._glide = Glide(self._following, samples, self._now, wanted, is_last=False)

    def _send(self, played: Signal) -> None:
        if played.frequency_hz != self._now.frequency_hz:
            self._link.set("freq", played.frequency_hz)
        if np.any(played.volts != self._now.volts):
            # v = mean + sum a cos + b sin: the real part of (a - i b) exp(i k theta).
            self._link.set("forcing_coeffs", 0.0, *played.volts.real, *-played.volts.imag)
        self._now = played

    def _end(self, reason: str, ramp_s: float) -> None:
        self._state, self._reason = LoopState.ENDING, reason
        nothing = replace(self._now, volts=np.zeros_like(self._now.volts))
        samples = max(ramp_s * self._facts.rate_hz, 1.0)
        self._glide = Glide(self._following, samples, self._now, nothing, is_last=True)

    def _close_gate(self) -> None:
        self._link.set("arm", 0)
        self._state, self._glide, self._coefficients = LoopState.SILENT, None, None
        self._send(replace(self._now, volts=np.zeros_like(self._now.volts)))

    def _give_up(self, error: InstrumentError) -> None:
        """Silence the board after an error: by command or, if that fails, by closing the connection."""
        if self._state is not LoopState.SILENT:
            self._reason = str(error)
        self._state, self._glide = LoopState.SILENT, None
        try:
            self._link.set("arm", 0)
        except InstrumentError as lost:
            self._error = error if isinstance(error, InstrumentLost) else lost
            self._link.close()

    def _ticks_late(self) -> int:
        return int(sum(self._link.get("overruns", "tick_timeouts")))

    def _look_at_board(self) -> None:
        ticks, safety, arm = self._link.get("ticks", "safety", "arm")
        late = LATEST_S * self._facts.rate_hz
        if not self._turn.wait_for(
            lambda: self._error is not None or ticks - self._ticks - self._following <= late, PATIENCE_S
        ):
            raise InstrumentError(
                f"the board at {self._link.where} answers, but its samples no longer arrive. The board was "
                "silenced; let the UDP datagrams of its stream pass the firewall, and check the network"
            )
        self._require_there()
        if self._state is not LoopState.SILENT and not (safety & GATE_OPEN and arm):
            self._state, self._glide = LoopState.SILENT, None
            self._reason = (
                "its safety gate tripped" if safety & GATE_TRIPPED else "its gate was closed by somebody else"
            )
        if self._state is LoopState.PLAYING and self._ticks_late() > self._late:
            self._end(f"{self._ticks_late() - self._late} of its ticks came late", ENDING_S)

    def _listen(self) -> None:
        """Receive samples and continue a glide or a ramp, in a separate thread."""
        while not self._leaving.is_set():
            try:
                packets = self._link.read_packets(LISTENING_S)
                with self._turn:
                    if packets and self._error is None:
                        for each in packets:
                            self._take(each)
                        self._go_on()
                        self._turn.notify_all()
            except InstrumentError as error:
                with self._turn:
                    self._give_up(error)
                    self._turn.notify_all()
            except OSError:  # another thread has closed the connection
                return

    def _take(self, packet: Packet) -> None:
        if self._following < 0:
            (ticks,) = self._link.get("ticks")
            self._ticks, self._talked = ticks - packet.following, packet.first
            if self._glide is not None:
                self._glide = replace(self._glide, start=packet.first)
        is_whole = (packet.number, packet.first) == (self._number, self._following)
        self._number, self._following = packet.number + 1, packet.following
        if self._coefficients is None:
            return
        if not is_whole:
            self._coefficients.begin_anew()
        self._blocks += self._coefficients.take(packet.values, self._following, self._glide is not None)
        del self._blocks[:-MOST_BLOCKS]
        below = np.abs(packet.values[READ.index("out")]) < _AT_LIMIT * self._facts.limit_v
        run = int(np.argmax(below[::-1])) if below.any() else below.size + self._at_limit
        self._at_limit = run

    def _go_on(self) -> None:
        rate_hz, limit_v, watchdog_s = self._facts.rate_hz, self._facts.limit_v, self._facts.watchdog_s
        if self._state is LoopState.PLAYING and self._following - self._talked > watchdog_s * rate_hz:
            self._end(f"its host sent no request for {watchdog_s:g} s", ENDING_S)
        elif self._state is LoopState.PLAYING and self._at_limit > LONGEST_AT_LIMIT_S * rate_hz:
            self._end(f"its output stayed at its limit of {limit_v:g} V", ENDING_S)
        glide = self._glide
        if glide is None:
            return
        share = (self._following - glide.start) / glide.samples
        self._send(glide.begin.blend(glide.end, share) if share < 1.0 else glide.end)
        if share >= 1.0:
            self._glide = None
            if glide.is_last:
                self._close_gate()


def session(resource: str) -> tuple[str, int]:
    """Return host and port of ``TCPIP0::<host>::<port>::SOCKET``."""
    found = re.fullmatch(r"TCPIP\d*::(.+)::(\d+)::SOCKET", resource)
    if found is None:
        raise ConfigurationError(
            f"controller.resource = {resource!r} is not a board's address; give TCPIP0::<host>::2350::SOCKET"
        )
    return found[1], int(found[2])


def check_board(link: HelicLink, config: ControllerConfig) -> tuple[str, ...]:
    """Check a board against its configuration, clear its program, and return the sources to be read."""
    missing = [each for each in (*GAINS, "ctrl_ki") if each not in link.parameters]
    if missing:
        raise ConfigurationError(
            f"the firmware at {link.where} has no {', '.join(missing)}. Nothing was played; build the "
            "firmware's standard program with the control PidController"
        )
    options = config.options
    read = tuple(str(options.get(name, name)) for name in READ)
    wrong = [each for each in read if each not in link.sources]
    wrong += [each for each in read[2:] if link.sources.get(each, "V") != "V"]
    if wrong:
        raise ConfigurationError(
            f"{', '.join(wrong)}: no source in volts at {link.where}, which has {', '.join(link.sources)}. "
            "Nothing was played; name the sources of base and m0 in controller.options"
        )
    if config.pd_of is not LoopInput.M0 or abs(link.rate_hz / config.rate_hz - 1) > 0.01:
        raise ConfigurationError(
            f"the board at {link.where} takes {link.rate_hz:g} samples a second and only laws of m0's "
            f"velocity; the configuration has {config.rate_hz:g} Hz, pd_of = {config.pd_of or 'nothing'}. "
            'Nothing was played; make them agree (pd_of = "m0_velocity")'
        )
    link.set("arm", 0)
    for name in ("target_coeffs", "forcing_coeffs"):
        link.set(name, *[0.0] * link.parameters[name].count)
    for name in (*GAINS, "ctrl_ki", "table_mode", "freq"):
        link.set(name, 0)
    open_gate(link)  # a test of the gate; no signal is set
    return read


def open_gate(link: HelicLink) -> None:
    """Open the board's safety gate; raise InstrumentError if it stays closed, as nothing else silences it."""
    link.set("arm", 1)
    safety, _ = link.get("safety", "arm")
    if safety & (GATE_OPEN | GATE_TRIPPED) != GATE_OPEN:
        link.set("arm", 0)
        why = "has tripped" if safety & GATE_TRIPPED else "does not open"
        raise InstrumentError(
            f"the safety gate of the board at {link.where} {why}. Its output is off; check its sensors, or "
            "build its rig with SAFETY_GATED: without a gate, nothing silences the board if its host is lost"
        )
