"""Every public function documents its parameters, results with unit or shape, and exceptions.

A parameter is documented by a Parameters section, by its name in the text, by a unit at the end of its name,
or by a type of vibench. Numbers and arrays that are returned have a unit or a shape.
"""

import ast
import importlib
import inspect
import re
import textwrap
from pathlib import Path

import pytest

from tests.test_public_apis import FOR_PEOPLE

ROOT = Path(__file__).resolve().parent.parent
UNIT = re.compile(r"_(hz|s|m|rad|j|v|vpp|kg|a|ohm|n|db|decibel|bytes|samples|pa|m2)$")
SECTIONS = re.compile(r"\n(Parameters|Returns|Yields|Raises)\n-+\n")


def public_objects():
    """Yield the name of every public function and class, and the object."""
    for face in FOR_PEOPLE:
        module = importlib.import_module(face)
        for name in module.__all__:
            found = getattr(module, name)
            found = getattr(found, "py_func", found)
            if inspect.isfunction(found) or inspect.isclass(found):
                yield f"{face}.{name}", found


def sections(told):
    parts = SECTIONS.split(told)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def undocumented_parameters(function, told):
    parameters = sections(told).get("Parameters", "")
    listed = re.findall(r"^([\w, *]+)(?: :.*)?$", parameters, flags=re.MULTILINE)
    named = {name.strip(" *") for line in listed for name in line.split(",")}
    named |= set(re.findall(r"`+(\w+)`+", told))
    for each in inspect.signature(function).parameters.values():
        kind = str(each.annotation) + str(getattr(each.annotation, "__module__", ""))
        if each.name not in named and not UNIT.search(each.name) and not re.search(r"vibench|Path", kind):
            yield f"parameter {each.name}"


def docstring_faults(function):
    """Yield what the docstring of a function leaves out."""
    told = inspect.getdoc(function) or ""
    if not told:
        yield "no docstring"
    yield from undocumented_parameters(function, told)
    given = str(inspect.signature(function).return_annotation)
    is_number = "ndarray" in given.lower() or given == "<class 'float'>" or given.startswith("tuple[float")
    if is_number and not (
        "Returns" in sections(told) or re.search(r"\[|shape \(", told) or UNIT.search(function.__name__)
    ):
        yield "unit or shape of what it gives"
    source = ast.parse(textwrap.dedent(inspect.getsource(function)))
    raises = any(isinstance(node, ast.Raise) for node in ast.walk(source))
    if raises and "Raises" not in sections(told) and "raises" not in told.lower():
        yield "what it raises"


def test_every_public_function_is_documented():
    functions = {name: found for name, found in public_objects() if inspect.isfunction(found)}
    assert len(functions) > 200
    short = {name: list(docstring_faults(found)) for name, found in functions.items()}
    assert {name: found for name, found in short.items() if found} == {}


def test_every_public_class_has_a_docstring():
    classes = {name: found for name, found in public_objects() if inspect.isclass(found)}
    assert [name for name, found in classes.items() if not found.__dict__.get("__doc__")] == []


def undocumented(angle, mass_kg, limit=1.0):
    """Turn something."""
    if angle > limit:
        raise ValueError(mass_kg)


def test_an_undocumented_parameter_is_found():
    assert list(docstring_faults(undocumented)) == ["parameter angle", "parameter limit", "what it raises"]


@pytest.mark.parametrize("folder", ["docs", "docs/decisions", "docs/tutorials"])
def test_every_page_is_in_the_index_of_the_site(folder):
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    decisions = (ROOT / "docs" / "decisions" / "index.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^([\w/-]+)$", index, flags=re.MULTILINE))
    for page in (ROOT / folder).glob("*.md"):
        match folder:
            case "docs":
                assert page.stem in listed | {"index"}, f"{page.name} stands in no list of docs/index.md"
            case "docs/decisions":
                assert page.stem == "index" or (page.stem.startswith("0") and "\n0*\n" in decisions)
            case "docs/tutorials":
                assert f"tutorials/{page.stem}" in listed, f"{page.name} stands in no list of docs/index.md"
