"""Docstrings of a model's fields; they are the help texts of command options and forms."""

import ast
import inspect
import re
import sys
from collections.abc import Mapping
from functools import cache
from itertools import pairwise

from pydantic import BaseModel


def field_docstring(model: type[BaseModel], name: str) -> str:
    """Return the docstring under a field, from the class or the nearest base class that declares it."""
    texts = (
        _docstrings(each.__module__).get((each.__name__, name), "")
        for each in model.__mro__
        if name in inspect.get_annotations(each)
    )
    return re.sub(r"\s*\[[^\]]*\]", "", re.sub(r"`+([^`]*)`+", r"\1", next(texts, ""))).strip()


@cache
def _docstrings(module: str) -> Mapping[tuple[str, str], str]:
    """Read the docstrings of all fields in a module's classes, when the first docstring is needed.

    Pydantic's ``use_attribute_docstrings`` reads them when a class is defined: 22 ms at every start.
    """
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except OSError:  # without source files, no field is explained
        return {}
    return {
        (each.name, field.target.id): inspect.cleandoc(text.value.value)
        for each in ast.walk(tree)
        if isinstance(each, ast.ClassDef)
        for field, text in pairwise(each.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
