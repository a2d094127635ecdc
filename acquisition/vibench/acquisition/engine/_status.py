"""Status of an engine, as its viewers receive it: state, running measurement, events."""

import os
import subprocess
import sys
from collections.abc import Mapping
from enum import StrEnum

from ..bench.result import BenchReport
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
    """Whether a run needs a viewer."""

    ATTENDED = "attended"
    """The run is aborted when no request comes for longer than `patience_s`."""
    UNATTENDED = "unattended"
    """A campaign that is left alone: viewers may come and go."""


class ConnectionRole(StrEnum):
    """Purpose of a connection."""

    ATTENDING = "attending"
    """The client in charge of the run, which stops when this client sends no more requests."""
    VISITING = "visiting"
    """A viewer that does not keep the run alive."""


VIEWER_PATIENCE_S = 0.5
"""How long an attended run at a limit of the rig continues without requests [s]."""
LONGEST_PATIENCE_S = 10.0
"""Longest patience that can be granted [s]."""
HUNG_FACTOR = 4.0
"""Factor on the patience for a viewer that reports that its window is blocked."""


def hung_patience_s(granted_s: float) -> float:
    """Return how long a drive may continue with a blocked window; ``granted_s``: without requests [s]."""
    return min(HUNG_FACTOR * granted_s, LONGEST_PATIENCE_S)


def patience_s(longest_s: float, use: float) -> float:
    """Return how long a drive may continue without requests: the closer to a limit, the shorter [s].

    ``use`` is the share of the tightest limit; ``longest_s`` [s] is the patience far from all limits.
    """
    return max(VIEWER_PATIENCE_S, min(longest_s, VIEWER_PATIENCE_S / max(use, 1e-9)))


class ChannelFacts(FrozenModel):
    """One channel, with the values needed to display its samples."""

    role: str
    unit: str
    units_per_volt: float
    full_scale_v: float


class BenchFacts(FrozenModel):
    """The open bench."""

    rig_name: str
    is_simulated: bool
    identities: Mapping[str, str]
    """Reply of each instrument, by its part in the bench."""
    channels: tuple[ChannelFacts, ...]
    sample_rate_hz: float


class ArmedPlan(FrozenModel):
    """What will happen at the start, in words for the experimenter."""

    campaign: str
    folder: str
    lines: tuple[str, ...]
    """Signal, level, limits, duration, and folder."""
    expires_in_s: float
    """The engine disarms itself after this time."""
    attendance: Supervision
    """Whether the run needs a viewer."""
    patience_s: float
    """How long the run continues without requests, if it needs a viewer [s]."""


class RunStatus(FrozenModel):
    """The running measurement."""

    name: str
    number: int
    """Number of the campaign's recordings, from 1."""
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
    """The signal in words: kind and highest level."""
    until: UntilNote | None = None
    """Bounds of the results so far, for a measurement with `until`."""


class ChannelLevel(FrozenModel):
    """Level of a channel during the last block, relative to its full scale."""

    role: str
    peak_share: float
    rms_share: float


class RowStatus(FrozenModel):
    """One recording of the armed or running campaign."""

    name: str
    state: str
    """``"queued"``, ``"running"``, or how it ended."""
    reason: str
    file: str


class MessageKind(StrEnum):
    """Severity of a message."""

    INFO = "info"
    WARNING = "warning"
    FAULT = "fault"


class EngineMessage(FrozenModel):
    """An event: what happened, what was done about it, and what to do next."""

    number: int
    """Counts all messages of an engine, from 1."""
    utc: str
    kind: MessageKind
    what: str
    done: str = ""
    next_step: str = ""
    code: str = ""
    """Name of the error, for a search."""


class TwinStatus(FrozenModel):
    """The live twin's last report: motion of m1 between its stops, numbers, and delay."""

    pid: int = 0
    """Number of its process, after its first report."""
    state: str = "starting"
    """``"starting"``, ``"waiting"``, ``"tracked"`` or ``"lost"``."""
    sentence: str = ""
    run_id: int = 0
    end_sample: int = 0
    """One past the newest sample that it used."""
    step_s: float = 0.0
    """Time step of ``p_m``, which ends at the newest sample."""
    p_m: tuple[float | None, ...] = ()
    """Relative displacement; None where the track was lost."""
    forecast_m: tuple[float, ...] = ()
    """Forecast from the newest sample on, as far as it is reliable."""
    forecast_error_m: tuple[float, ...] = ()
    """Bound that contained 68 % of earlier forecasts, for each time ahead."""
    stops_m: tuple[float, float] = (0.0, 0.0)
    """Positions of the lower and the upper stop."""
    numbers: tuple[tuple[str, str], ...] = ()
    """Numbers found in this run's collisions: name, and value with 95 % bounds."""
    level: float | None = None
    """Innovation of the last tenth of a second; 1 for noise alone, None when lost."""
    limit: float | None = None
    """Level above which a change of the specimen is suspected; None while the usual level is being learnt."""
    busy_share: float = 0.0
    """Processor time of the twin's process over the time since the run began."""
    missed_s: float = 0.0
    """Duration of motion that the twin skipped because it was too slow [s]; the recording contains it."""
    behind_s: float = 0.0
    """Delay of the newest sample at the last report [s]."""


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
    """Changes whenever a row does, so that thousands of rows are sent only when needed."""
    overloads: int = 0
    """Number of sample ranges beyond a channel's full scale in this run."""
    lost_blocks: int = 0
    """Gaps in this run's samples."""
    disk_free_bytes: int = 0
    samples: int = 0
    """Samples per channel of this run so far."""
    run_id: int = 0
    """Changes with every recording; data of another number are out of date."""
    twin: TwinStatus | None = None
    """The live twin's last report; None without a twin."""
    is_left_alone: bool = False
    """The parent program has ended, the campaign continues, and nobody attends the engine."""
    messages: tuple[EngineMessage, ...] = ()
    """The newest, oldest first."""


# The live twin's process (decision 0044), started and ended by an engine, which never waits for it. It is a
# viewer like any other (`vibench twin`): it requests samples, reports its results, and keeps no run alive.
# When it is too slow it skips samples; the recording does not.

ENDING_S = 2.0


class TwinSwitch(StrEnum):
    """Whether the live twin runs beside a measurement."""

    OFF = "off"
    ON = "on"


class TwinProcess:
    """The live twin of this process's engine."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    @property
    def is_on(self) -> bool:
        """Whether the twin was started; it may have ended since."""
        return self._process is not None

    def turn(self, switch: TwinSwitch) -> None:
        """Start or end the twin. Legal in every state."""
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
        """Return, once, why the twin ended by itself; None while it runs or is off."""
        process = self._process
        if process is None or process.poll() is None:
            return None
        self._process = None
        with process:
            text = "" if process.stderr is None else process.stderr.read().strip()
        return text.splitlines()[-1] if text else f"code {process.returncode}"
