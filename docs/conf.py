"""Settings of the documentation site; ``vibench docs`` builds it, without a warning or not at all."""

import importlib
import importlib.metadata
import os
import re
from pathlib import Path

project = "vibench"
copyright = "the authors of vibench"  # noqa: A001 - Sphinx reads this name
release = importlib.metadata.version("vibench")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "furo"
html_title = f"vibench {release}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

nb_execution_mode = "force" if os.environ.get("VIBENCH_DOCS") == "tutorials" else "off"
nb_execution_raise_on_error = True
nb_execution_timeout = 1200

autodoc_default_options = {
    "members": True,
    "imported-members": True,
    "undoc-members": True,
    "exclude-members": "model_config, model_fields, model_computed_fields, model_post_init",
}
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
python_maximum_signature_line_length = 90
napoleon_use_rtype = False

HERE = Path(__file__).parent
PUBLIC_APIS = re.findall(
    r"^\| `(vibench[\w.]+)` \|",
    (HERE / "architecture.md")
    .read_text("utf-8")
    .split("## Public APIs")[1]
    .split("Other packages of ours")[0],
    flags=re.MULTILINE,
)
# Every name is loaded now: autodoc would import with TYPE_CHECKING set, which runs what only checkers read.
TARGETS = {}
for face in reversed(PUBLIC_APIS):
    module = importlib.import_module(face)
    TARGETS |= {name: f"{face}.{name}" for name in module.__all__ if getattr(module, name) is not None}
    page = f"{face}\n{'=' * len(face)}\n\n.. automodule:: {face}\n"
    (HERE / "reference").mkdir(exist_ok=True)
    (HERE / "reference" / f"{face}.rst").write_text(page, encoding="utf-8")

QUOTED = re.compile(r"(``[^`]+``)|(?<![`:\w])`([^`<>]+)`(?![`_])")
PAGE = re.compile(r"(?<![\w`/])docs/([\w/-]+)\.md(?!`)")


def _keep_colons(
    _app: object, what: str, _name: str, _object: object, _options: object, lines: list[str]
) -> None:
    """Begin an attribute's text with an empty comment: napoleon takes words before a colon for a type."""
    if what in {"attribute", "data", "property"}:
        lines[:0] = ["..", ""]


def _as_code_or_link(
    _app: object, _what: str, _name: str, _object: object, _options: object, lines: list[str]
) -> None:
    """Link single-quoted names and paths of pages, set other quoted text as code, and escape bars."""

    def replaced(match: re.Match[str]) -> str:
        literal, name = match.groups()
        if literal:
            return str(literal)
        target = name if name in PUBLIC_APIS else TARGETS.get(name.rpartition(".")[2])
        return f":py:obj:`{name} <{target}>`" if target else f"``{name}``"

    for number, line in enumerate(lines):
        quoted = PAGE.sub(r":doc:`\g<0> </\1>`", QUOTED.sub(replaced, line))
        # Outside of code a bar would begin a substitution.
        lines[number] = "".join(
            part if part.startswith("``") else part.replace("|", "\\|")
            for part in re.split(r"(``[^`]+``)", quoted)
        )


def _link_pages(_app: object, page: str, source: list[str]) -> None:
    """Link the paths of pages in a text, and a tutorial's notebook below its title."""
    up = "../" * page.count("/")
    parts = re.split(r"(```.*?```|`[^`]*`|\[[^\]]*\]\([^)]*\))", source[0], flags=re.DOTALL)
    parts[::2] = [PAGE.sub(rf"[\g<0>]({up}\1.md)", part) for part in parts[::2]]
    source[0] = "".join(parts)
    folder, _, name = page.rpartition("/")
    if folder == "tutorials":
        link = f"{{nb-download}}`This tutorial as a notebook <{name}.ipynb>`"
        source[0] = re.sub(r"^# .*$", rf"\g<0>\n\n{link}", source[0], count=1, flags=re.MULTILINE)


def setup(app: object) -> None:
    """Register with Sphinx."""
    app.connect("source-read", _link_pages)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", _keep_colons, priority=100)  # type: ignore[attr-defined]
    app.connect("autodoc-process-docstring", _as_code_or_link, priority=900)  # type: ignore[attr-defined]
