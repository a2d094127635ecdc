"""Draw random texts of the project by a seed, to find texts that must be read twice.

    python benchmarks/sample_texts.py --seed 7 --count 200
    python benchmarks/sample_texts.py --seed 7 --count 200 --since COMMIT     # commit titles after it

Kinds are drawn in equal numbers: sentences of documents, docstrings, comments, messages, commit titles and
names of tests. Each is printed with its place.
"""

import argparse
import ast
import io
import random
import re
import subprocess
import textwrap
import tokenize
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PRODUCT = ("acquisition", "analysis", "cli", "extensions", "gui", "sim", "studies", "virtual_rig")
MESSAGE_WORDS = 6
"""Smallest number of words of a message; shorter literals are labels, keys or names."""

Text = tuple[str, str]
"""Place of a text, and the text."""


def _git_files(*patterns: str) -> list[Path]:
    """Return tracked files; git's ``*`` matches slashes too."""
    listed = subprocess.run(
        ["git", "ls-files", *patterns], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return [ROOT / name for name in listed.stdout.splitlines()]


def product_sources() -> list[Path]:
    """Return the Python files of the packages, without tests, benchmarks and examples."""
    return _git_files(*(f"{folder}/*.py" for folder in PRODUCT))


def docstrings(path: Path) -> Iterator[Text]:
    """Yield every docstring of a file, including those of fields and constants."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            text = node.value.value
            if isinstance(text, str):
                yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def comments(path: Path) -> Iterator[Text]:
    """Yield every comment of a file, with consecutive lines joined."""
    place, last, said = 0, -1, list[str]()
    for token in tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline):
        if token.type != tokenize.COMMENT or re.match(r"#\s*(noqa|type:|fmt:|pragma|SPDX)", token.string):
            continue
        if token.start[0] != last + 1 and said:
            yield f"{path.relative_to(ROOT)}:{place}", " ".join(said)
            said = []
        place = place if said else token.start[0]
        last = token.start[0]
        said.append(token.string.lstrip("# "))
    if said:
        yield f"{path.relative_to(ROOT)}:{place}", " ".join(said)


def _messages(path: Path) -> Iterator[Text]:
    tree = ast.parse(path.read_text("utf-8"))
    described = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if id(node) in described | parts:
            continue
        if isinstance(node, ast.JoinedStr):
            text = ast.unparse(node)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        else:
            continue
        if len(text.split()) >= MESSAGE_WORDS:
            yield f"{path.relative_to(ROOT)}:{node.lineno}", text


def _sentences(path: Path) -> Iterator[Text]:
    prose = re.sub(r"^(```|~~~).*?^\1|^\|.*?$|^#.*?$", "", path.read_text("utf-8"), flags=re.S | re.M)
    for paragraph in re.split(r"\n\s*\n|\n(?=[-*] |\d+\. )", prose):
        for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z`*])", " ".join(paragraph.split())):
            if len(sentence.split()) >= MESSAGE_WORDS:
                yield str(path.relative_to(ROOT)), sentence


def _test_names(path: Path) -> Iterator[Text]:
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield f"{path.relative_to(ROOT)}:{node.lineno}", node.name


def _commit_titles(since: str | None) -> Iterator[Text]:
    commits = f"{since}..HEAD" if since else "HEAD"
    log = subprocess.run(
        ["git", "log", "--format=%h %s", commits], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for line in log.stdout.splitlines():
        commit, _, title = line.partition(" ")
        yield commit, title


def _from_files(read: str, paths: list[Path]) -> list[Text]:
    readers = {
        "docstring": docstrings,
        "comment": comments,
        "message": _messages,
        "document": _sentences,
        "test name": _test_names,
    }
    return [text for path in paths for text in readers[read](path)]


def draw_texts(seed: int, count: int, since: str | None) -> dict[str, list[Text]]:
    """Return random texts by kind, in equal numbers; the same seed and sources give the same texts."""
    sources = product_sources()
    kinds = {
        "document": _from_files("document", _git_files("README.md", "CONTRIBUTING.md", "docs/*.md")),
        "docstring": _from_files("docstring", sources),
        "comment": _from_files("comment", sources),
        "message": _from_files("message", sources),
        "commit title": list(_commit_titles(since)),
        "test name": _from_files("test name", _git_files("tests/*test_*.py")),
    }
    chance = random.Random(seed)
    share = -(-count // len(kinds))
    return {kind: chance.sample(texts, min(share, len(texts))) for kind, texts in kinds.items()}


def main() -> None:
    """Draw the texts and print them with their places."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--count", type=int, default=200)
    options.add_argument("--since", help="only commit titles after this tag or commit")
    chosen = options.parse_args()
    number = 0
    for kind, texts in draw_texts(chosen.seed, chosen.count, chosen.since).items():
        print(f"== {kind}")
        for place, text in texts:
            number += 1
            print(f"{number}. [{place}]")
            print(textwrap.indent(textwrap.dedent(text).strip(), "   "))


if __name__ == "__main__":
    main()
