"""A configuration from a template and answers: asked one by one, looked up where the computer can see."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from ..bench import InstrumentList
from ..errors import ConfigurationError
from ..host import load_toml, schema_line, shipped_folder
from ..instruments import PlugInKind, plug_in_names
from ..rig import GeneratorConfig, Rig, generator_driver, load_rig
from ._questions import QUESTIONS, Found, Question
from ._template import value_in, with_answer

Ask = Callable[[Question, Sequence[str], str], str]
"""Asks a question, with what was found for it and what the template holds; empty: as it is."""
_SCHEMA = re.compile(r"^#:schema .*\n")
_USB = re.compile(r"USB\d*::(0x[0-9a-f]+|\d+)::(0x[0-9a-f]+|\d+)::", re.IGNORECASE)


def found_choices(question: Question, seen: InstrumentList) -> tuple[str, ...]:
    """Give what the computer sees for a question."""
    match question.found:
        case Found.GENERATORS:
            return seen.visa_resources
        case Found.CONVERTERS:
            return tuple(device.name for device in seen.daq_devices)
        case None:
            return ()


def configured(
    template: Path,
    target: Path,
    seen: InstrumentList,
    ask: Ask,
    note: str,
    questions: Sequence[Question] = QUESTIONS,
) -> Rig:
    """Ask everything, write the configuration, and read it back.

    Parameters
    ----------
    template
        A hardware configuration whose comments say CONFIRM where nobody has looked yet.
    target
        Where the new one goes; it must not be there.
    seen
        What can be seen from here.
    ask
        Asks one question.
    note
        Who answers, and when; it stands behind each answer.
    questions
        What to ask, where it is more than usual.

    Raises
    ------
    ConfigurationError
        When ``target`` is there, or an answer is not allowed; nothing is written then.

    """
    if target.exists():
        raise ConfigurationError(f"{target} is there already, and nothing is overwritten; give another name")
    if not target.absolute().parent.is_dir():
        raise ConfigurationError(f"{target.absolute().parent} is no folder; make it, or give another place")
    text = _SCHEMA.sub("", template.read_text(encoding="utf-8"))  # its path is that of the template
    for question in questions:
        choices = found_choices(question, seen)
        held = value_in(text, question.key).strip('"')
        if len(choices) == 1:
            held = choices[0]
            text = with_answer(text, question.key, held, "the only one seen")
        answer = ask(question, choices, held)
        if answer:
            text = with_answer(text, question.key, answer, note)
    text = _with_driver(_with_product(text, seen, note), note)
    text = schema_line(load_rig(template), shipped_folder("schemas")) + text
    draft = target.with_name(target.name + ".draft")
    try:
        draft.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"{target} cannot be written ({error.strerror}); give another") from error
    try:
        load_toml(draft, Rig)
    except ConfigurationError:
        draft.unlink()
        raise
    draft.rename(target)
    return load_rig(target)


def _with_product(text: str, seen: InstrumentList, note: str) -> str:
    """Enter the product of the device that was chosen."""
    device = value_in(text, "daq.device").strip('"')
    product = next((each.product for each in seen.daq_devices if each.name == device), "")
    return with_answer(text, "daq.product", product, note) if product else text


def _with_driver(text: str, note: str) -> str:
    """Enter the driver whose instruments have the address that was chosen."""
    resource = value_in(text, "generator.resource").strip('"')
    driver = _driver_of(resource)
    if driver is None:
        return text
    if re.search(
        r"^driver[ \t]*=", text[text.index("[generator]") :].split("\n[", maxsplit=1)[0], re.MULTILINE
    ):
        return with_answer(text, "generator.driver", driver, note)
    return text.replace("[generator]\n", f'[generator]\ndriver = "{driver}"  # {note}\n', 1)


def _driver_of(resource: str) -> str | None:
    found = _USB.match(resource)
    if found is None:
        return None
    ids = int(found.group(1), 0), int(found.group(2), 0)
    for name in plug_in_names(PlugInKind.GENERATOR):
        config = GeneratorConfig(driver=name, resource=resource, connected_ohm=1e6, amplitude_limit_vpp=1.0)
        if ids in generator_driver(config).describe(config).usb_ids:
            return name
    return None
