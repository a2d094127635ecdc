"""Status of an engine, as its viewers receive it: state, running measurement, events."""

import os
import subprocess
import sys
from collections.abc import Mapping
from enum import StrEnum

from ..bench import BenchReport
from ..host.toml_file import FrozenModel
from ..plan import RunState
from ..recording import UntilNote


class EngineState(StrEnum):
    """State of an engine.

    ::

        closed -> opening -> ready -> armed -> running -> ready
                    |        |  ^               |    ^
                    |        v  |               v    |
                    |       checking           held -+     (and ramping_down, on every way out)
                    +-> fault <- an instrument was lost: open again
    """

    CLOSED = "closed"
    OPENING = "opening"
    READY = "ready"
    CHECKING = "checking"
    ARMED = "armed"
    RUNNING = "running"
    HELD = "held"
    RAMPING_DOWN = "ramping_down"
    FAULT = "fault"


DRIVING = frozenset({EngineState.RUNNING, EngineState.HELD, EngineState.RAMPING_DOWN})
"""States in which the drive may be on for a recording."""
SOUNDING = DRIVING | {EngineState.CHECKING}
"""States in which the drive may be on, including the small sine of a check."""


class Supervision(StrEnum):
    """Whether a run needs the presence of a viewer."""

    ATTENDED = "attended"
    """The run is aborted when no request comes for longer than `patience_s`."""
    UNATTENDED = "unattended"
    """The run continues without any viewer; viewers may connect and leave."""


class ConnectionRole(StrEnum):
    """Purpose of a client's connection."""

    ATTENDING = "attending"
    """The client in charge of the run: if it sends no more requests, the run stops."""
    VISITING = "visiting"
    """A viewer whose requests do not keep the run going."""


VIEWER_PATIENCE_S = 0.5
"""Time for which an attended run at a limit of the rig continues without requests [s]."""
LONGEST_PATIENCE_S = 10.0
"""Longest time for which an attended run can be allowed to continue without requests [s]."""
HUNG_FACTOR = 4.0
"""Factor that multiplies the allowed time without requests if a viewer reports a blocked window."""


def hung_patience_s(granted_s: float) -> float:
    """Return how long a drive may continue with a blocked window [s]; ``granted_s`` is from `patience_s`."""
    return min(HUNG_FACTOR * granted_s, LONGEST_PATIENCE_S)


def patience_s(longest_s: float, use: float) -> float:
    """Return how long [s] a drive may continue without requests; close to a limit, the time is shorter.

    ``use`` is the used fraction of the tightest limit; ``longest_s`` [s] is the patience far from all limits.
    """
    return max(VIEWER_PATIENCE_S, min(longest_s, VIEWER_PATIENCE_S / max(use, 1e-9)))


class ChannelFacts(FrozenModel):
    """One channel, with the values needed to display its samples."""

    role: str
    unit: str
    units_per_volt: float
    full_scale_v: float


class BenchFacts(FrozenModel):
    """Description of the open bench."""

    rig_name: str
    is_simulated: bool
    identities: Mapping[str, str]
    """Identification reported by each instrument, keyed by the instrument's role, such as ``"generator"``."""
    channels: tuple[ChannelFacts, ...]
    sample_rate_hz: float


class ArmedPlan(FrozenModel):
    """Description of an armed campaign for the experimenter."""

    campaign: str
    folder: str
    lines: tuple[str, ...]
    """Lines of text about signal, level, limits, duration and folder of the campaign."""
    expires_in_s: float
    """Time after which the engine disarms itself [s]."""
    attendance: Supervision
    """Whether the run needs the presence of a viewer."""
    patience_s: float
    """Time for which the run continues without requests, if it needs a viewer [s]."""


class RunStatus(FrozenModel):
    """Status of the running measurement."""

    name: str
    number: int
    """Number of this recording in the campaign, from 1."""
    count: int
    file: str
    run_state: RunState
    segment: str
    numbers: Mapping[str, int | float | str]
    elapsed_s: float
    total_s: float
    campaign_elapsed_s: float
    campaign_total_s: float
    amplitude_vpp: float
    frequency_hz: float | None
    plan: str = ""
    """Description of the excitation: kind and highest level."""
    until: UntilNote | None = None
    """Present error bounds of the results, for a measurement with `until`."""


class ChannelLevel(FrozenModel):
    """Peak and rms of a channel during the last block, relative to its full scale."""

    role: str
    peak_share: float
    rms_share: float


class RowStatus(FrozenModel):
    """One recording of the armed or running campaign."""

    name: str
    state: str
    """State of the recording: ``"queued"``, ``"running"``, or how the recording ended."""
    reason: str
    file: str


class MessageKind(StrEnum):
    """How severe a message to the operator is."""

    INFO = "info"
    WARNING = "warning"
    FAULT = "fault"


class EngineMessage(FrozenModel):
    """A message on an event: what happened, what was done about the event, and what to do next."""

    number: int
    """Number of the message; each engine counts its messages from 1."""
    utc: str
    kind: MessageKind
    what: str
    done: str = ""
    next_step: str = ""
    code: str = ""
    """Class name of the error, with which users can look up the error."""


class TwinStatus(FrozenModel):
    """Last report of the live twin: motion of m1 between the stops, estimated parameters, and delay."""

    pid: int = 0
    """Process number of the twin; 0 until its first report."""
    state: str = "starting"
    """State of the twin: ``"starting"``, ``"waiting"``, ``"tracked"`` or ``"lost"``."""
    sentence: str = ""
    run_id: int = 0
    end_sample: int = 0
    """Number of the sample after the newest sample that the twin has used."""
    step_s: float = 0.0
    """Time step of ``p_m`` [s]; the last value of ``p_m`` is for the newest sample."""
    p_m: tuple[float | None, ...] = ()
    """Relative displacement of m1 [m]; None where the twin had lost track of the motion."""
    forecast_m: tuple[float, ...] = ()
    """Forecast of ``p_m`` from the newest sample on, as far as it is reliable [m]."""
    forecast_error_m: tuple[float, ...] = ()
    """Error that 68 % of earlier forecasts did not exceed, for each lead time [m]."""
    stops_m: tuple[float, float] = (0.0, 0.0)
    """Positions of the lower and the upper stop of m1 [m]."""
    numbers: tuple[tuple[str, str], ...] = ()
    """Parameters estimated from this run's collisions: name, and value with 95 % bounds."""
    level: float | None = None
    """Normalised innovation over the last 0.1 s: 1 for noise alone; None if the twin lost the motion."""
    limit: float | None = None
    """Innovation above which a specimen change is suspected; None while the usual level is being learnt."""
    busy_share: float = 0.0
    """Processor time of the twin divided by the time since the run began."""
    missed_s: float = 0.0
    """Duration of motion that the twin was too slow to track [s]; the motion is in the recording."""
    behind_s: float = 0.0
    """Delay of the twin behind the newest sample, at its last report [s]."""


class EngineStatus(FrozenModel):
    """Everything that a viewer shows, except the samples."""

    state: EngineState
    attendance: Supervision
    bench: BenchFacts | None = None
    check: BenchReport | None = None
    checked_utc: str = ""
    armed: ArmedPlan | None = None
    run: RunStatus | None = None
    levels: tuple[ChannelLevel, ...] = ()
    rows: tuple[RowStatus, ...] = ()
    rows_number: int = 0
    """Number that changes with every change in ``rows``; viewers need not fetch unchanged rows again."""
    overloads: int = 0
    """Number of ranges of samples beyond a channel's full scale in this run."""
    lost_blocks: int = 0
    """Number of gaps in the samples of this run."""
    disk_free_bytes: int = 0
    samples: int = 0
    """Number of samples per channel in this run so far."""
    run_id: int = 0
    """Number of the recording, counted by this engine; data with another number are out of date."""
    twin: TwinStatus | None = None
    """The live twin's last report; None if there is no twin."""
    is_left_alone: bool = False
    """Whether the parent program has ended, the campaign continues, and nobody attends the engine."""
    messages: tuple[EngineMessage, ...] = ()
    """Newest messages to the operator, from oldest to newest."""


# Process of the live twin (decision 0044). The engine starts and ends this process, but never waits for it.
# The process is a viewer like any other (`vibench twin`): it requests samples and reports results, but
# attends no run. If the process is too slow, it skips samples; the recording still contains these samples.

ENDING_S = 2.0


class TwinSwitch(StrEnum):
    """Whether the live twin runs during a measurement."""

    OFF = "off"
    ON = "on"


class TwinProcess:
    """The live twin of this process's engine."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    @property
    def is_on(self) -> bool:
        """Whether the twin was started; the twin may have ended by itself since."""
        return self._process is not None

    def turn(self, switch: TwinSwitch) -> None:
        """Start or end the twin. Allowed in every engine state."""
        match switch:
            case TwinSwitch.ON if self._process is None:
                self._process = subprocess.Popen(  # noqa: S603 - this interpreter, and nothing of a user's
                    [sys.executable, "-m", "vibench.cli", "twin", "--pid", str(os.getpid())],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                    # The program that shows the run handles Ctrl-C in a terminal.
                    start_new_session=True,
                )
            case TwinSwitch.OFF if self._process is not None:
                process, self._process = self._process, None
                process.terminate()
                try:
                    process.wait(ENDING_S)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                if process.stderr is not None:
                    process.stderr.close()

    def last_words(self) -> str | None:
        """Return, only once, why the twin ended by itself; None while the twin runs or is off."""
        process = self._process
        if process is None or process.poll() is None:
            return None
        self._process = None
        with process:
            text = "" if process.stderr is None else process.stderr.read().strip()
        return text.splitlines()[-1] if text else f"code {process.returncode}"
