"""Odd replies of instruments while complete commands run: one sentence, the right exit code, and silence.

The simulated instruments give invalid replies, from some call on, once or always: empty, endless, not a
number, control sequences, a wrong rate or count, an error. The real pyvisa, nidaqmx and sounddevice receive
the replies in the process of each command; a witness checks the outputs at its end.
"""

import json
import math
import os
import random
import re
import shutil
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unicodedata import category

import numpy as np

from .command_attack import TOLD
from .command_runner import ROOT, CommandRunner
from .limits import HANGS_S, MOST_BYTES, Case, Ending
from .tally import Finding, Shard, Tally

LONGEST_S = 40.0
"""Processor time of a check and a measurement with an odd instrument [s]."""
WITNESS = "witness: "
SWITCH_OFF = re.compile(r"amplifier off", re.IGNORECASE)
RIGS = {
    "usb": "virtual_rig",
    "keysight": "virtual_rig_keysight",
    "daqmx": "virtual_rig",
    "output": "virtual_rig_streaming",
    "served": "virtual_rig",
    "sound card": "virtual_rig",
    "file": "virtual_rig",
}
"""Kinds of instruments, and the rig of each; instruments of a served rig are opened as a real bench."""
PLAN = """
name = "odd"
[[measurements]]
name = "point"
ramp_s = 0.2
ramp_step_s = 0.02
[measurements.excitation]
"""
DWELL = 'kind = "dwell"\namplitude_vpp = 0.2\nfrequency_hz = 160\nsettle_s = 0.1\nduration_s = 0.2\n'
NOISE = (
    'kind = "streamed_noise"\namplitude_vpp = 0.2\nband_start_hz = 50\nband_stop_hz = 600\n'
    "settle_s = 0.1\nduration_s = 0.4\nseed = 1\n"
)
ANSWERS = b'operator = "A. Student"\nwired = "by eye"\n'
CONTROL = "\x1b[2J\x1b]0;title\x07\x9b31m\u202e\r\nerror: all is well\x7f"
"""Clears the screen, names the window, reorders text, and forges an error line."""
TEXTS = ("", " ", CONTROL, "x" * 100_000, "\0", "nan", "-1", "ä\ufffd")
NUMBERS = (0, -1, 1, 2**31 - 1, -(2**31), math.nan, math.inf, -math.inf, 1e300, 5e-324, 0.5)
REPLIES: tuple[bytes, ...] = (
    b"", b"\n", b" \n", b"\x00\n", b"NAN\n", b"1e999\n", b"9.91E+37\n", b"-1\n", b"0\n", b"1\n", b"1,2\n",
    b"TRUE\n", b"#9999", b"#0\n", b"#15abc\n", b"9" * 6000 + b"\n", b"A" * 2_000_000 + b"\n",
    bytes(range(256)), CONTROL.encode() + b"\n", CONTROL.encode("utf-16") + b"\n",
    b'-113,"\x1b[2J\x07"\n', b'-113,"' + b"x" * 290 + b'"\n', b'-350,"Queue overflow"\n', b"0,\n",
    b'0,"No error"\n', b"2.0E-01;2.0E-01\n", b"2.0E-01",
)  # fmt: skip
FAILURES = (TimeoutError("late"), OSError(19, "No such device"), OSError(32, "Pipe error"))
QUERIES = (
    "*IDN?", "SYST:ERR?", "SYST:ERR?", "VOLT?", "VOLT?", "VOLT:OFFS?", "FREQ?", "FUNC", "OUTP1:STAT?",
    "OUTP1:IMP?", "LOAD?", "STAT?", "UNIT?", "?",
)  # fmt: skip
CALLS = (
    "GetSystemInfoAttributeUInt32", "GetDeviceAttributeString", "GetDeviceAttributeUInt32", "CreateTask",
    "GetTaskAttributeString", "CreateAIVoltageChan", "GetChanAttributeInt32", "SetChanAttributeInt32",
    "GetChanAttributeDoubleArray", "GetChanAttributeDouble", "CfgSampClkTiming", "GetTimingAttributeDouble",
    "TaskControl", "StartTask", "ReadBinaryI32", "ReadBinaryI32", "ReadBinaryI32", "ReadBinaryI32",
    "StopTask", "GetReadAttributeUInt32", "GetReadAttributeBool", "ClearTask", "GetSystemInfoAttributeString",
)  # fmt: skip
OUTPUT_CALLS = (
    "CreateAOVoltageChan", "WriteAnalogF64", "WriteAnalogF64", "WaitUntilTaskDone", "GetTrigAttributeString",
    "GetWriteAttributeUInt32", "CfgDigEdgeStartTrig", "SetBufferAttributeUInt32",
)  # fmt: skip
STATUSES = ("UNKNOWN", "INTERNAL", "UNAVAILABLE", "UNAUTHENTICATED", "RESOURCE_EXHAUSTED", "UNIMPLEMENTED")
CODES = ("-200279", "-88709", "200012", "0", "nan", "-999999999999", "")
CARD = (
    "rate", "name", "open fails", "start fails", "not a number", "infinite", "overflow", "underflow",
    "no samples", "one frame", "abort fails", "channels", "error text",
)  # fmt: skip


def draw_oddity(chance: random.Random, kind: str) -> dict[str, Any]:
    """Choose at random what is odd about an instrument, and from which call on."""
    odd: dict[str, Any] = {
        "kind": kind,
        "after": chance.choice((0, 0, 1, 2, 5, 20, 60)),
        "always": chance.random() < 0.5,
        "seed": chance.randrange(2**32),
    }
    if kind in {"usb", "keysight"} or (kind == "served" and chance.random() < 0.4):
        count = len(REPLIES) + (0 if kind == "served" else len(FAILURES))
        return odd | {"query": chance.choice(QUERIES), "reply": chance.randrange(count)}
    if kind == "sound card":
        return odd | {"how": chance.choice(CARD)}
    return odd | {"call": chance.choice(CALLS + 2 * OUTPUT_CALLS if kind == "output" else CALLS)}


def mutant(chance: random.Random, played: Callable[[random.Random], bytes]) -> Case:
    """Choose an instrument, its oddity, and the command that uses it."""
    kind = chance.choice(tuple(RIGS))
    plan = NOISE if kind == "output" or (kind == "sound card" and chance.random() < 0.5) else DWELL
    files = {"plan.toml": (PLAN + plan).encode(), "answers.toml": ANSWERS}
    if kind == "file":
        files["played.h5"] = played(chance)
        odd: dict[str, Any] = {"kind": kind}
    else:
        odd = draw_oddity(chance, kind)
    measure = ("measure", "plan.toml", "--bench", "bench.toml", "--out", "out")
    waived, sheet = ("--check", "waived"), ("--knobs", "knobs.toml")
    commands: list[tuple[str, ...]] = [(*measure, *waived)]
    if kind in {"served", "sound card"}:
        commands = [(*measure, *waived, *sheet), ("bench", "list", "--bench", "bench.toml"), ("doctor",)]
        commands = commands[: 3 if kind == "served" else 1]
    elif kind != "file":
        commands += [
            measure,
            ("bench", "list", "--bench", "bench.toml"),
            ("bench", "check", "--bench", "bench.toml"),
            ("bench", "new", "new.toml", "--from", "bench.toml", "--answers", "answers.toml"),
        ]
    return Case(chance.choice(commands), files, prepare=(__name__, json.dumps(odd)), hangs_s=4 * HANGS_S)


# --- in the process of the command ----------------------------------------------------------


def prepare(text: str) -> Callable[[], None]:
    """Build the bench, make an instrument odd, and return the witness, which is called at the end."""
    from vibench.acquisition import save_toml
    from vibench.acquisition.drivers import _daqmx
    from vibench.acquisition.rig import load_rig
    from vibench.virtual_rig.generator.afg1022 import AFG1022
    from vibench.virtual_rig.world.world import World
    from vibench_more_drivers import sound_card

    odd = json.loads(text)
    os.environ |= {"VIBENCH_STATE_DIR": str(Path.cwd() / "state"), "VIBENCH_LOCK_DIR": str(Path.cwd())}
    # A hung server times out sooner than usual; a card that is late on a busy computer, later.
    _daqmx.CALL_DEADLINE_S, sound_card._LATEST_S = 15.0, 60.0
    rig = _slow(load_rig(ROOT / "hardware_configs" / f"{RIGS[odd['kind']]}.toml"))
    made: list[Any] = []
    for each in (AFG1022, World):
        _note(each, made)
    played: dict[str, float] = {}
    _watch(World, played)
    held = ExitStack()
    if "query" in odd:
        _reply_oddly(AFG1022, odd)
    elif "call" in odd:
        _answer_oddly(odd)
    if odd["kind"] == "sound card":
        rig = _plug_card_in(rig, odd)
    elif odd["kind"] == "served":
        rig = _serve(rig, held)
    elif odd["kind"] == "file":
        daq = rig.daq.model_copy(update={"driver": "file", "options": {"recording": "played.h5"}})
        generator = rig.generator.model_copy(update={"driver": "file"})
        rig = rig.model_copy(update={"daq": daq, "generator": generator, "virtual": None})
    save_toml(rig, Path("bench.toml"))

    def look() -> None:
        held.close()
        on = [each.serial for each in made if isinstance(each, AFG1022) and _is_closed(each)]
        on += [f"{name} at {volts:g} V" for name, volts in played.items() if volts]
        if on:
            print(f"{WITNESS}{', '.join(on)}", file=sys.stderr)

    return look


def _slow(rig: Any) -> Any:
    """Return a rig with a low sample rate."""
    daq = {"sample_rate_hz": 5120.0}
    if rig.daq.output is not None:
        daq["output"] = rig.daq.output.model_copy(update=daq)
    return rig.model_copy(update={"daq": rig.daq.model_copy(update=daq)})


def _is_closed(generator: Any) -> bool:
    return bool(generator.settings(1).relay.value == "closed")


def _note(kind: type, made: list[Any]) -> None:
    original = kind.__init__

    def create(self: Any, *given: Any, **named: Any) -> None:
        original(self, *given, **named)
        made.append(self)

    kind.__init__ = create  # type: ignore[misc]


def _watch(world: Any, played: dict[str, float]) -> None:
    """Record the last voltage of every analogue output."""
    play, silence = world.play, world.silence

    def watched_play(self: Any, channel: str, volts: Any, rate_hz: float) -> None:
        play(self, channel, volts, rate_hz)
        played[channel] = float(volts[-1]) if len(volts) else played.get(channel, 0.0)

    def watched_silence(self: Any, channel: str) -> None:
        silence(self, channel)
        played[channel] = 0.0

    world.play, world.silence = watched_play, watched_silence


def _is_due(odd: dict[str, Any]) -> Callable[[], bool]:
    left = [odd["after"]]

    def due() -> bool:
        left[0] -= 1
        return left[0] < 0 if odd["always"] else left[0] == -1

    return due


def _reply_oddly(instrument: Any, odd: dict[str, Any]) -> None:
    from vibench.virtual_rig.generator.scpi_instrument import Reply

    execute, due = instrument.execute, _is_due(odd)

    def reply_oddly(self: Any, message: bytes) -> Any:
        reply = execute(self, message)
        if not reply.data or odd["query"] not in message.decode("latin-1") or not due():
            return reply
        if odd["reply"] >= len(REPLIES):
            raise FAILURES[odd["reply"] - len(REPLIES)]
        return Reply(REPLIES[odd["reply"]])

    instrument.execute = reply_oddly


def _answer_oddly(odd: dict[str, Any]) -> None:
    import grpc
    from nidaqmx._stubs import nidaqmx_pb2

    from vibench.virtual_rig.daqmx.server import SERVICE, DaqServer

    usual, due, chance = DaqServer._answer, _is_due(odd), random.Random(odd["seed"])
    is_refused, status, code = chance.random() < 0.3, chance.choice(STATUSES), chance.choice(CODES)
    response = getattr(nidaqmx_pb2, SERVICE.methods_by_name[odd["call"]].output_type.name)

    def answer(self: Any, name: str, call: Any) -> Any:
        handle = usual(self, name, call)
        if name != odd["call"]:
            return handle

        def answer_oddly(request: Any, context: Any) -> Any:
            fields = handle(request, context)
            if not due():
                return fields
            if is_refused or not fields:
                context.set_trailing_metadata((("ni-error", code),))
                context.abort(grpc.StatusCode[status], chance.choice(TEXTS[1:4]).replace("\r\n", " "))
            changed = {**fields, **_odd_fields(fields, random.Random(odd["seed"]))}
            try:
                response(**changed)
            except (TypeError, ValueError, OverflowError):
                return fields
            return changed

        return answer_oddly

    DaqServer._answer = answer  # type: ignore[method-assign]


def _odd_fields(fields: dict[str, Any], chance: random.Random) -> dict[str, Any]:
    name = chance.choice([each for each in fields if each != "new_session_initialized"] or list(fields))
    value = fields[name]
    match value:
        case bool():
            return {name: not value}
        case str():
            return {name: chance.choice(TEXTS)}
        case float():
            return {name: chance.choice((*NUMBERS, 2 * value, -value, value * 1.01))}
        case int():
            return {name: chance.choice((*NUMBERS[:5], value + 1, value - 1, 2 * value))}
        case list() if value and isinstance(value[0], str):
            return {name: chance.choice(([], [CONTROL], value * 1000, value[:-1]))}
        case list():
            whole = np.array(value).tolist()
            bent = [chance.choice((math.nan, math.inf, 1e300, 2**31 - 1, -(2**31))) for _ in whole]
            return {name: chance.choice(([], whole[:-1], whole[: len(whole) // 2], whole * 2, bent))}
    return {}


def _serve(rig: Any, held: ExitStack) -> Any:
    """Start the instruments separately; the bench is then opened like a real one."""
    from datetime import UTC, datetime

    from vibench.acquisition.rig import KnobSheet, save_knob_sheet
    from vibench.virtual_rig import VirtualRig

    served = held.enter_context(VirtualRig(rig))
    save_knob_sheet(
        KnobSheet(operator="test", confirmed=datetime.now(UTC), knobs=rig.knobs), Path("knobs.toml")
    )
    daq = rig.daq.model_copy(update={"server": served.daq_address})
    generator = rig.generator.model_copy(update={"resource": served.socket_resource})
    return rig.model_copy(update={"daq": daq, "generator": generator, "virtual": None})


def _plug_card_in(rig: Any, odd: dict[str, Any]) -> Any:
    from datetime import UTC, datetime

    from vibench.acquisition.rig import KnobSheet, save_knob_sheet
    from vibench.virtual_rig.world.world import World
    from vibench_more_drivers.sound_card import SoundCardDigitizer

    from ..extensions.more_drivers import portaudio

    simulated = portaudio.card_rig(rig)
    audio, opened = portaudio.simulated(), []
    card_open = SoundCardDigitizer.open.__func__  # type: ignore[attr-defined]

    def noted(cls: Any, given: Any) -> Any:
        opened.append(card_open(cls, given))
        return opened[-1]

    SoundCardDigitizer.open = classmethod(noted)  # type: ignore[assignment, method-assign]
    audio.wire(World(simulated, portaudio.Silent()), lambda: opened[-1].card.waiting < 9600)
    _bend_card(audio, odd)
    real = simulated.model_copy(update={"virtual": None})
    save_knob_sheet(
        KnobSheet(operator="test", confirmed=datetime.now(UTC), knobs=real.knobs), Path("knobs.toml")
    )
    return real


def _bend_card(audio: Any, odd: dict[str, Any]) -> None:
    chance, due, usual = random.Random(odd["seed"]), _is_due(odd), audio.heard
    fails = chance.choice((-9999, -9997, -9985, -9986, -10000, -1))
    long_text = chance.choice((b"", b"\xff\xfe", CONTROL.encode(), b"x" * 100_000))

    def heard(block: Any, flags: int) -> tuple[Any, int] | None:
        block, flags = usual(block, flags)
        return _odd_block(odd["how"], block, flags, chance) if due() else (block, flags)

    audio.heard = heard
    match odd["how"]:
        case "rate":
            audio.reported_hz = chance.choice((0.0, -1.0, math.nan, math.inf, 44_100.0, 48_000.5, 1e300))
        case "name":
            audio.name = audio.ffi.new("char[]", long_text)
        case "channels":
            audio.most_inputs = chance.choice((0, -1, 1, 2))
        case "open fails" | "start fails" | "abort fails":
            audio.codes[odd["how"].split()[0]] = fails
        case "error text":
            audio.codes["start"] = fails
            audio.text = audio.ffi.new("char[]", long_text)


def _odd_block(how: str, block: Any, flags: int, chance: random.Random) -> tuple[Any, int] | None:
    match how:
        case "not a number":
            block[chance.randrange(len(block)), 0] = math.nan
        case "infinite":
            block[-1] = chance.choice((math.inf, 1e38))
        case "overflow" | "underflow":
            return block, {"overflow": 2, "underflow": 4}[how]
        case "no samples":
            return None
        case "one frame":
            return block[:1], flags
    return block, flags


# --- verdict ---------------------------------------------------------------------------------


def harmful(text: str) -> list[str]:
    """Return the characters that a terminal acts upon."""
    return sorted(
        {each for each in text if not (each.isprintable() or category(each) == "Zs" or each == "\n")}
    )


def faults(case: Case, ending: Ending) -> tuple[str, ...]:
    """Return the faults of an ending."""
    said = f"{ending.out}\n{ending.err}"
    odd = json.loads(case.prepare[1])
    is_cut_off = odd.get("reply", 0) >= len(REPLIES) and odd["always"]
    is_on, is_told = WITNESS in ending.err, bool(SWITCH_OFF.search(said)) and ending.code == 1
    found = [
        *(each for each in ending.faults if not each.startswith("took ")),
        *(["control characters: " + repr(harmful(said))] if harmful(said) else []),
        *(["a forged line"] if re.search(r"^error: all is well", said, re.MULTILINE) else []),
        *(["the output is on"] if is_on and not (is_cut_off and is_told) else []),
        *([f"took {ending.took_s:.1f} s"] if ending.took_s > LONGEST_S else []),
        *([f"took {ending.clock_s:.1f} s"] if ending.clock_s > case.hangs_s else []),
        *([f"took {ending.peak_bytes / 1e6:.0f} MB"] if ending.peak_bytes > MOST_BYTES else []),
    ]
    return (*found, " ".join(case.arguments), case.prepare[1]) if found else ()


def _usual(kind: str, *options: str) -> Case:
    """Return a measurement without a fault; it must succeed, or the attack would prove nothing."""
    odd = {"kind": kind, "how": "as usual", "after": 0, "always": True, "seed": 0}
    return Case(
        ("measure", "plan.toml", "--bench", "bench.toml", "--out", "out", *options),
        {"plan.toml": (PLAN + DWELL).encode()},
        prepare=(__name__, json.dumps(odd)),
        hangs_s=4 * HANGS_S,
    )


def attack(shard: Shard) -> Tally:
    """Let instruments reply oddly to complete commands."""
    from .recordings_mutants import restructure

    tally = shard.tally("replies")
    with CommandRunner() as runner, tempfile.TemporaryDirectory(prefix="vibench_replies_") as name:
        folder = Path(name)
        for usual in (_usual("sound card", "--check", "waived", "--knobs", "knobs.toml"), _usual("usb")):
            usual.write(folder)
            ended = runner.run_in(folder, usual)
            if ended.code:
                raise RuntimeError(f"a usual measurement failed: {ended.faults} {ended.err}")
            recorded = (folder / "out" / "point.h5").read_bytes()
            shutil.rmtree(folder / "out")

        def played(chance: random.Random) -> bytes:
            return restructure("point.h5", recorded, chance)

        for number, chance in shard.chances(tally):
            case = mutant(chance, played)
            ending = runner.run(case)
            kind = json.loads(case.prepare[1])["kind"]
            tally.count(f"{kind} {ending.code}", ending.took_s, ending.peak_bytes)
            if said := faults(case, ending):
                told = (ending.err or ending.out)[-TOLD:]
                tally.findings.append(Finding("replies", shard.seed, number, said, told))
    return tally
