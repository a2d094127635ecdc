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
    """Where an engine stands.

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
"""The drive may be on, for a recording."""
SOUNDING = DRIVING | {EngineState.CHECKING}
"""The drive may be on, if only for the small sine of a check."""


class Supervision(StrEnum):
    """Whether a run needs somebody who looks."""

    ATTENDED = "attended"
    """Nobody has asked for too long (`patience_s`): the run is aborted."""
    UNATTENDED = "unattended"
    """A campaign that is left alone: viewers may come and go."""


class ConnectionRole(StrEnum):
    """What a connection is for."""

    ATTENDING = "attending"
    """The client in charge of the run, which stops when this client stops asking."""
    VISITING = "visiting"
    """A look from elsewhere: it keeps nothing running."""


VIEWER_PATIENCE_S = 0.5
"""How long an attended run at a limit of the rig goes on while nobody asks [s]."""
LONGEST_PATIENCE_S = 10.0
"""More cannot be granted to any drive [s]."""
HUNG_FACTOR = 4.0
"""A viewer that is there and says that its window stands still is given this many times the patience."""


def hung_patience_s(granted_s: float) -> float:
    """How long a drive may go on while a window stands still that is granted ``granted_s`` in silence [s]."""
    return min(HUNG_FACTOR * granted_s, LONGEST_PATIENCE_S)


def patience_s(longest_s: float, use: float) -> float:
    """How long a drive may go on while nobody looks: the closer to a limit, the shorter [s].

    ``use`` is the share of the tightest limit; ``longest_s`` [s] is what was granted far from all of them.
    """
    return max(VIEWER_PATIENCE_S, min(longest_s, VIEWER_PATIENCE_S / max(use, 1e-9)))


class ChannelFacts(FrozenModel):
    """One channel, as needed to show its samples."""

    role: str
    unit: str
    units_per_volt: float
    full_scale_v: float


class BenchFacts(FrozenModel):
    """Which bench is open."""

    rig_name: str
    is_simulated: bool
    identities: Mapping[str, str]
    """Reply of each instrument, by its part in the bench."""
    channels: tuple[ChannelFacts, ...]
    sample_rate_hz: float


class ArmedPlan(FrozenModel):
    """What will happen at the start, in words that an experimenter can check."""

    campaign: str
    folder: str
    lines: tuple[str, ...]
    """What, at which level, within which limits, how long, and where it is saved."""
    expires_in_s: float
    """The engine disarms itself after this long."""
    attendance: Supervision
    """Whether somebody must look while it runs."""
    patience_s: float
    """For how long nobody may look at it, if somebody must [s]."""


class RunStatus(FrozenModel):
    """The measurement that runs."""

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
    """What is played, in words: kind and highest level."""
    until: UntilNote | None = None
    """How well results are known, of a measurement that lasts until they are."""


class ChannelLevel(FrozenModel):
    """How far a channel was driven during the last block, of its full scale."""

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
    """How a message is to be taken."""

    INFO = "info"
    WARNING = "warning"
    FAULT = "fault"


class EngineMessage(FrozenModel):
    """Something that has happened: what, what was done about it, and what to do next."""

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
    """What the live twin told last: where m1 is between its stops, its numbers, and how late it is."""

    pid: int = 0
    """Number of its process, once it has told anything."""
    state: str = "starting"
    """``"starting"``, ``"waiting"``, ``"tracked"`` or ``"lost"``."""
    sentence: str = ""
    run_id: int = 0
    end_sample: int = 0
    """One past the newest sample that it used."""
    step_s: float = 0.0
    """Between two values of ``p_m``, which end at the newest sample."""
    p_m: tuple[float | None, ...] = ()
    """Relative displacement; None where it was not followed."""
    forecast_m: tuple[float, ...] = ()
    """From the newest sample on, as far as it is worth anything."""
    forecast_error_m: tuple[float, ...] = ()
    """Within which 68 % of earlier forecasts were, as far ahead."""
    stops_m: tuple[float, float] = (0.0, 0.0)
    """Places of the lower and the upper stop."""
    numbers: tuple[tuple[str, str], ...] = ()
    """What this run's collisions told: name, and value with bounds of 95 %."""
    level: float | None = None
    """Innovation of the last tenth of a second, 1 when nothing but noise is left; None when lost."""
    limit: float | None = None
    """Beyond which the specimen is suspected; None while the usual level is being learnt."""
    busy_share: float = 0.0
    """Processor time of the twin's process over the time since the run began."""
    missed_s: float = 0.0
    """Duration of motion that it was too slow for [s]; the recording has it."""
    behind_s: float = 0.0
    """By how much its newest sample was behind the newest of the run, when it told [s]."""


class EngineStatus(FrozenModel):
    """Everything a viewer shows, but the samples."""

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
    """Changes whenever a row does: thousands of rows go over the wire only when they are news."""
    overloads: int = 0
    """Ranges of samples past a channel's full scale, in this run."""
    lost_blocks: int = 0
    """Gaps in this run's samples."""
    disk_free_bytes: int = 0
    samples: int = 0
    """Samples per channel of this run so far."""
    run_id: int = 0
    """Changes with every recording; what was seen of another one is no longer true."""
    twin: TwinStatus | None = None
    """What the live twin told last; None while there is none."""
    is_left_alone: bool = False
    """The program that started the engine has ended, its job goes on, and nobody has taken it over."""
    messages: tuple[EngineMessage, ...] = ()
    """The newest, oldest first."""


# The process of the live twin: started and ended by an engine, which never waits for it.
#
# It is a viewer like any other (`vibench twin`, reached by name as a virtual rig is): it pulls samples,
# reports what it found, and keeps no run alive. When it is too slow it misses samples; the recording does
# not.

ENDING_S = 2.0


class TwinSwitch(StrEnum):
    """Whether the live twin runs beside a measurement."""

    OFF = "off"
    ON = "on"


class TwinProcess:
    """The live twin of this process' engine."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    @property
    def is_on(self) -> bool:
        """Whether it was started; it may have ended since."""
        return self._process is not None

    def turn(self, switch: TwinSwitch) -> None:
        """Start or end it. Legal in every state."""
        match switch:
            case TwinSwitch.ON if self._process is None:
                self._process = subprocess.Popen(  # noqa: S603 - this interpreter, and nothing of a user's
                    [sys.executable, "-m", "vibench.cli", "twin", "--pid", str(os.getpid())],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                    # Ctrl-C in a terminal is handled by the program that shows the run.
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
        """Return why it has ended by itself, once; None while it runs or is off."""
        process = self._process
        if process is None or process.poll() is None:
            return None
        self._process = None
        with process:
            said = "" if process.stderr is None else process.stderr.read().strip()
        return said.splitlines()[-1] if said else f"code {process.returncode}"
