"""First day at a bench: questions, the resulting configuration, and a page with the test results.

`configured` asks `QUESTIONS` and writes a commented hardware configuration; `first_day` uses it to confirm
wires, measure the noise floor, play a first 5 mVpp sine and check the bench; it returns the page. The caller
supplies the answers (terminal, file or test). `vibench bench new` does all of this (docs/first-day.md).
"""

import errno
import json
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, date, datetime
from operator import attrgetter
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from vibench.sim.operating_system.this import replace_file

from .bench import Bench, BenchReport, CheckResult, InstrumentList, Verdict
from .check.admission import check_bench
from .check.bench_report import bench_report
from .errors import AcquisitionError, CheckFailed, ConfigurationError
from .host.installation import shipped_folder
from .host.printable import printable
from .host.schema import schema_line
from .host.toml_file import complaints, from_toml
from .instruments import PlugInKind, missing_package, plug_in_names, usb_ids
from .rig import GeneratorConfig, Rig, Role, calibrations, channels_of, generator_driver, load_rig
from .stopping.stop import StopSwitch


@dataclass(frozen=True)
class Question:
    """Question whose answer is a value of the configuration."""

    key: str
    """Path of the value: ``"amplifier.gain_db"``; for a channel ``"daq.channels.m0_velocity.physical"``."""
    text: str
    choices: Callable[[InstrumentList], tuple[str, ...]] = lambda _: ()
    """Function that returns the possible answers: the names of the instruments that were found."""


def _converters(seen: InstrumentList) -> tuple[str, ...]:
    return tuple(device.name for device in seen.daq_devices)


QUESTIONS = (
    Question("name", "What is the bench called?"),
    Question("generator.resource", "Which of these is the function generator?", attrgetter("visa_resources")),
    Question("generator.settle_s", "Waiting time after each message to the generator [s]? 0.1 is safe"),
    Question("generator.amplitude_limit_vpp", "Largest amplitude that you allow on this bench [Vpp]?"),
    Question("daq.device", "Which of these is the converter?", _converters),
    Question("daq.sample_rate_hz", "How many samples a second?"),
    Question("daq.channels.drive_voltage.physical", "Which input reads the generator's voltage?"),
    Question("daq.channels.drive_voltage.attenuation", "Voltage divider in front of this input (1: none)?"),
    Question("daq.channels.amplifier_voltage.physical", "Which input reads the amplifier's output?"),
    Question("daq.channels.amplifier_voltage.attenuation", "Voltage divider in front of this input?"),
    Question("daq.channels.base_acceleration.physical", "Which input reads the accelerometer on the base?"),
    Question(
        "daq.channels.base_acceleration.iepe_current_a",
        "Supply current from this input to the accelerometer [A]? 0 if it has its own supply",
    ),
    Question("daq.channels.m0_velocity.physical", "Which input reads the vibrometer?"),
    Question("amplifier.serial", "Serial number of the amplifier?"),
    Question("amplifier.gain_db", "Gain of the amplifier [dB]?"),
    Question("amplifier.current_limit_a", "Current limit of the amplifier [A rms]?"),
    Question("shaker.serial", "Serial number of the shaker?"),
    Question("shaker.fixture_mass_kg", "Mass of the fixture with its screws, without the specimen [kg]?"),
    Question("accelerometer.model", "Model of the accelerometer?"),
    Question("accelerometer.serial", "Serial number of the accelerometer?"),
    Question(
        "accelerometer.sensitivity_v_per_m_per_s2",
        "Accelerometer sensitivity, from its certificate [V per m/s2, or with a unit: 100 mV/g]?",
    ),
    Question("accelerometer.calibrated", "Date on the accelerometer's certificate (YYYY-MM-DD)?"),
    Question("vibrometer.serial", "Serial number of the vibrometer?"),
    Question("vibrometer.decoder", "Decoder of the vibrometer?"),
    Question("vibrometer.range_mm_per_s_per_v", "Range of the vibrometer [mm/s per volt, or with a unit]?"),
    Question("vibrometer.delay_s", "Delay of the vibrometer's output [s]? 0 if not measured"),
    Question("vibrometer.calibrated", "Date of the vibrometer's calibration (YYYY-MM-DD)?"),
    Question("specimen.gap_m", "Gap of the specimen [m], measured with a feeler gauge"),
)
"""Questions in the order in which they are asked."""


def questions_for(text: str) -> tuple[Question, ...]:
    """Return the questions for a template, including questions about each further sensor."""
    roles = tomllib.loads(text).get("sensors", {})
    others = [
        Question(key, words.format(role.replace("_", " ")))
        for role in roles
        for key, words in (
            (f"daq.channels.{role}.physical", "Which input reads the sensor of {}?"),
            (f"sensors.{role}.model", "Model of the sensor of {}?"),
            (f"sensors.{role}.serial", "Serial number of the sensor of {}?"),
            (
                f"sensors.{role}.sensitivity",
                "Sensitivity of the sensor of {}, from its certificate [such as 100 mV/g]?",
            ),
            (f"sensors.{role}.calibrated", "Date on the certificate of the sensor of {} (YYYY-MM-DD)?"),
        )
    ]
    questions = (*QUESTIONS[:-1], *others, QUESTIONS[-1])
    return tuple(each for each in questions if _table(text, each.key)[1])


_KEY = r"^(?P<key>{key}[ \t]*=[ \t]*)(?P<value>{value})(?P<comment>[ \t]*(?:#.*)?)$"
_VALUE = r"\"[^\"]*\"|\{[^}]*\}|[^\s#]+"
_CHANNEL = "daq.channels."


def value_in(text: str, key: str) -> str:
    """Return the template's value for a key as text; empty if the template has no value."""
    found = _place(text, key)
    return "" if found is None else found.group("value")


def with_answer(text: str, key: str, answer: str, note: str) -> str:
    """Return the template with a value replaced by an answer, and with a note on the answer's source.

    Raises ConfigurationError when the type of the answer is wrong (such as text for a number), or when the
    template has no table for the key.
    """
    found = _place(text, key)
    if found is not None:
        begin, end = found.span()
        line = f"{found.group('key')}{_literal(found.group('value'), answer, key, note)}  # {note}"
        return text[:begin] + line + text[end:]
    begin, end, name = _table(text, key)
    if end == 0:
        raise ConfigurationError(f"the template has no key {key}; remove this key from the answers")
    header = text.index("\n", begin) + 1
    return f"{text[:header]}{name} = {_guess_type(answer)}  # {note}\n{text[header:]}"


def place_of(content: Mapping[str, Any], key: str) -> tuple[str | int, ...]:
    """Return the path of a question's key in the content of a configuration."""
    if not key.startswith(_CHANNEL):
        return tuple(key.split("."))
    role, _, name = key.removeprefix(_CHANNEL).partition(".")
    roles = [channel.get("role") for channel in content["daq"]["channels"]]
    return ("daq", "channels", roles.index(role), name)


def _guess_type(answer: str) -> str:
    """Return an answer as a TOML number if possible, otherwise as TOML text."""
    try:
        return _as_toml(answer)
    except ValueError:
        return json.dumps(answer, ensure_ascii=False)


def _as_toml(number: str) -> str:
    """Return a number in TOML's notation, which excludes .5 and 010; raises ValueError for other text."""
    value = float(number)
    try:
        tomllib.loads(f"number = {number}")
    except tomllib.TOMLDecodeError:
        return repr(value)
    return number


def _place(text: str, key: str) -> re.Match[str] | None:
    begin, end, name = _table(text, key)
    pattern = re.compile(_KEY.format(key=re.escape(name), value=_VALUE), re.MULTILINE)
    return pattern.search(text, begin, end)


def _table(text: str, key: str) -> tuple[int, int, str]:
    """Return the beginning and end of a key's table in the text, and the key's name in that table."""
    if key.startswith(_CHANNEL):
        role, _, name = key.removeprefix(_CHANNEL).partition(".")
        begins = [found.start() for found in re.finditer(r"^\[\[daq\.channels\]\]$", text, re.MULTILINE)]
        for begin in begins:
            end = _end(text, begin + 1)
            if f'role = "{role}"' in text[begin:end]:
                return begin, end, name
        return 0, 0, name
    table, _, name = key.rpartition(".")
    if not table:
        return 0, _end(text, 0), name
    found = re.search(rf"^\[{re.escape(table)}\]$", text, re.MULTILINE)
    return (0, 0, name) if found is None else (found.start(), _end(text, found.end()), name)


def _end(text: str, begin: int) -> int:
    following = re.compile(r"^\[", re.MULTILINE).search(text, begin)
    return len(text) if following is None else following.start()


def _literal(held: str, answer: str, key: str, note: str) -> str:
    value: Any = tomllib.loads(f"value = {held}")["value"]
    match value:
        case str() if "/" in value:  # a sensitivity with its unit
            return _guess_type(answer)
        case str():
            return json.dumps(answer, ensure_ascii=False)
        case dict():
            return f"{{ value = {_number(answer, key)}, source = {json.dumps(note, ensure_ascii=False)} }}"
        case date():
            try:
                return date.fromisoformat(answer).isoformat()
            except ValueError as error:
                raise ConfigurationError(
                    f"{key}: {answer!r} is not a date; give a date such as 2026-02-10"
                ) from error
        case _:
            return _number(answer, key)


def _number(answer: str, key: str) -> str:
    try:
        return _as_toml(answer)
    except ValueError as error:
        if "/" in answer:  # a sensitivity with its unit
            return json.dumps(answer, ensure_ascii=False)
        raise ConfigurationError(
            f"{key}: {answer!r} is not a number; give a number such as 0.1 or 2e-3"
        ) from error


Ask = Callable[[Question, Sequence[str], str], str]
"""Function that asks a question, with proposals and the template's value; an empty answer keeps it."""
Refuse = Callable[[ConfigurationError], None]


def refuse_at_once(error: ConfigurationError) -> None:
    """Raise the error of an answer; used where the question cannot be asked again (as in a script)."""
    raise error


_SCHEMA = re.compile(r"^#:schema .*\n")


def configure(
    template: Path,
    target: Path,
    seen: InstrumentList,
    ask: Ask,
    note: str,
    questions: Sequence[Question] | None = None,
    refuse: Refuse = refuse_at_once,
) -> Rig:
    """Ask all questions, write the configuration, read it back, and return it.

    By default, the questions with a place in the template are asked. CONFIRM in comments of ``template``
    marks unchecked values. ``note``, such as name and time, becomes a comment behind each answer. ``refuse``
    receives the error of one answer or of all answers together; if it returns, the questions are repeated.

    Raises ConfigurationError when ``target`` exists or when ``refuse`` raises it; nothing is then written.
    """
    if target.exists():
        raise ConfigurationError(f"{target} exists already, and nothing is overwritten; give another name")
    if not target.absolute().parent.is_dir():
        raise ConfigurationError(
            f"{target.absolute().parent} is not a folder; create it, or choose another folder"
        )
    text = _SCHEMA.sub("", template.read_text(encoding="utf-8"))  # without a relative path to the schema
    questions = questions_for(text) if questions is None else questions
    for question in questions:
        if len(choices := question.choices(seen)) == 1:
            text = with_answer(text, question.key, choices[0], "the only one seen")
    while True:
        for question in questions:
            text = _valid_answer(text, question, question.choices(seen), ask, note, refuse)
        try:
            device = value_in(text, "daq.device").strip('"')
            product = next((each.product for each in seen.daq_devices if each.name == device), "")
            text = _with_driver(with_answer(text, "daq.product", product, note) if product else text, note)
            from_toml(tomllib.loads(text), Rig, target)
            break
        except ConfigurationError as error:
            refuse(error)
    _write(target, schema_line(load_rig(template), shipped_folder("schemas")) + text)
    return load_rig(target)


def _valid_answer(
    text: str, question: Question, choices: Sequence[str], ask: Ask, note: str, refuse: Refuse
) -> str:
    """Ask until an answer has the right type and is within its bounds; return the changed configuration."""
    while answer := ask(question, choices, _default_answer(text, question.key)):
        try:
            _require_text(answer, question.key)
            changed = with_answer(text, question.key, answer, note)
            _require_within_bounds(changed, question.key)
        except ConfigurationError as error:
            refuse(error)
        else:
            return changed
    return text


def _require_text(answer: str, key: str) -> None:
    if not answer.isprintable():
        raise ConfigurationError(f"{key}: {answer!a} has a character that is not printable; remove it")


def _default_answer(text: str, key: str) -> str:
    """Return the template's value as the default answer; if it has a source, only the number."""
    written = value_in(text, key)
    held = tomllib.loads(f"held = {written}")["held"] if written else None
    return str(held["value"]) if isinstance(held, dict) and "value" in held else written.strip('"')


def _require_within_bounds(text: str, key: str) -> None:
    content = tomllib.loads(text)
    try:
        Rig.model_validate(content)
    except ValidationError as error:
        if wrong := complaints(error, content, Rig, place_of(content, key)):
            raise ConfigurationError(wrong) from error
    except ArithmeticError as error:
        raise ConfigurationError(
            f"{key}: the number is too large or too small to compute with; give another number"
        ) from error


def _write(target: Path, text: str) -> None:
    try:
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
        with replace_file(target) as coming:
            coming.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"{target} cannot be written ({error.strerror}); give a new path") from error


def _with_driver(text: str, note: str) -> str:
    resource = value_in(text, "generator.resource").strip('"')
    driver = _driver_of(resource)
    return text if driver is None else with_answer(text, "generator.driver", driver, note)


def _driver_of(resource: str) -> str | None:
    ids = usb_ids(resource)
    if ids is None:
        return None
    for name in plug_in_names(PlugInKind.GENERATOR):
        config = GeneratorConfig(driver=name, resource=resource, connected_ohm=1e6, amplitude_limit_vpp=1.0)
        with suppress(AcquisitionError):  # skip a driver whose package is broken
            if ids in generator_driver(config).describe(config).usb_ids:
                return name
    if missing := missing_package(f"{ids[0]:#06x}"):
        raise ConfigurationError(f"generator.resource = {resource!r}: the USB vendor {missing}")
    return None


FIRST_VPP = 5e-3
"""Level of the first signal on a new bench, peak to peak [V]."""
_FROM = {
    Role.DRIVE_VOLTAGE: "T-piece at the output of the generator",
    Role.AMPLIFIER_VOLTAGE: "output of the amplifier, at the shaker",
}
Confirmed = Callable[[str], str]
"""Function that asks whether a wire connects two ends; an empty answer aborts. The page shows the answer."""


@dataclass(frozen=True)
class DayPage:
    """Page that documents the first day at a bench."""

    text: str
    """Text of the page in Markdown."""
    verdict: Verdict
    """Worst verdict of the bench checks."""


def first_day(
    bench: Bench, config: Path, operator: str, confirmed: Confirmed, switch: StopSwitch | None = None
) -> DayPage:
    """Confirm wires, measure the noise floor, play a first 5 mVpp sine, check the bench; return the page.

    The check at the usual level is made and stored only if the check at 5 mVpp has no verdict FAIL.

    Raises CheckFailed when a wire is not confirmed; in this case nothing has been played. Raises
    InstrumentError when an instrument fails.
    """
    folder = config.absolute().parent
    again = f"start again with --from {in_a_command(config)} and a new name for the configuration"
    pages = [*_heading(bench, config, operator), *_wires(bench.rig, confirmed, again)]
    first = bench_report(bench, folder, switch, FIRST_VPP)
    pages += _chapter(f"Noise floor, and a first sine of {1e3 * FIRST_VPP:g} mVpp", first)
    if first.verdict is Verdict.FAIL:
        pages.append(f"The bench check was not run: correct each FAIL above, and {again}.")
        return DayPage("\n".join(pages) + "\n", Verdict.FAIL)
    checked = check_bench(bench, folder, switch=switch)
    pages += _chapter("The bench check, at two per cent of the amplitude limit", checked.report)
    pages += list(_next_steps(bench.rig, checked, config))
    return DayPage("\n".join(pages) + "\n", checked.verdict)


def in_a_command(path: Path) -> str:
    """Return a path, quoted for a shell."""
    return f'"{path}"' if " " in str(path) else str(path)


def _heading(bench: Bench, config: Path, operator: str) -> Iterator[str]:
    sheet = bench.confirmations
    yield f"# First day of {bench.rig.name}"
    now = datetime.now(UTC).astimezone()
    yield f"\n{now:%Y-%m-%d %H:%M %Z}, by {operator}. Configuration: `{config.name}`."
    yield "\n## Instruments\n"
    for part, identity in bench.identities.items():
        yield f"- {part}: {printable(identity.reply)}"
    for one in calibrations(bench.rig, datetime.now(UTC).astimezone().date()):
        yield f"- {one}{'' if one.is_valid else f': {one.advice}'}"
    yield f"\n## Confirmed by hand ({sheet.operator})\n"
    for knob in sheet.knobs:
        yield f"- {knob.instrument}, {knob.setting}: {knob.value}"


def _wires(rig: Rig, confirmed: Confirmed, again: str) -> Iterator[str]:
    yield "\n## Wires (both ends checked)\n"
    for channel in channels_of(rig):
        config = next(each for each in rig.daq.channels if each.role is channel.role)
        divider = f" through a divider of {config.attenuation:g}:1" if config.attenuation != 1 else ""
        current = f", IEPE {1e3 * config.iepe_current_a:g} mA" if config.iepe_current_a else ""
        source = _FROM.get(channel.role, f"{channel.sensor} ({channel.role.value.replace('_', ' ')})")
        pair = f"{source}{divider} to {channel.physical} ({channel.coupling}{current})"
        answer = confirmed(pair)
        if not answer:
            raise CheckFailed(f"not confirmed: {pair}. Nothing was played; connect both ends and {again}")
        yield f"- {pair}: {answer}"


def _chapter(title: str, report: BenchReport) -> Iterator[str]:
    yield f"\n## {title}: {report.verdict.value}\n\n```"
    yield report.text()
    yield "```"


def _next_steps(rig: Rig, checked: CheckResult, config: Path) -> Iterator[str]:
    bench = in_a_command(config)
    if checked.verdict is Verdict.FAIL:
        yield "\nDo not energise: correct each FAIL, and check again with"
        yield f"\n    vibench bench check --bench {bench}"
        return
    yield f"\nThe check is valid for {rig.check_valid_h:g} h. Record a first sweep with"
    yield f"\n    vibench measure first_day --bench {bench} --out recordings"
