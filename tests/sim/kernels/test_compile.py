import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import vibench.sim

KERNELS = Path(vibench.sim.__file__).parent / "kernels"
IMPORT = "from .kernels._compile import kernel\n"
TWICE = (
    "from vibench.sim.kernels import kernel\n\n"
    "@kernel\ndef twice(x):\n    return 2.0 * x\n\nprint(twice(1.5))\n"
)
INNER = IMPORT + "\n@kernel\ndef inner(x):\n    return {factor} * x\n"


def test_a_kernel_is_recompiled_when_a_kernel_that_it_calls_changes_in_another_file(tmp_path):
    package = tmp_path / "vibench" / "sim"
    (package / "kernels").mkdir(parents=True)
    for name in ("_compile.py", "_inlining.py"):
        shutil.copy(KERNELS / name, package / "kernels" / name)
    (package / "__init__.py").write_text("")
    inner = package / "inner.py"
    (package / "outer.py").write_text(
        f"{IMPORT}from .inner import inner\n\n"
        "@kernel\ndef outer(x):\n    return inner(x)\n\nprint(outer(1.0))\n"
    )
    answers = []
    for factor in (2.0, 3.0):
        inner.write_text(INNER.format(factor=factor))
        run = subprocess.run(
            [sys.executable, "-B", "-c", "import vibench.sim.outer"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        answers.append(float(run.stdout))
    assert answers == [2.0, 3.0]


@pytest.mark.thorough
def test_a_kernel_is_kept_when_a_room_changes_that_its_own_does_not_import(tmp_path):
    sim = tmp_path / "vibench" / "sim"
    (sim / "kernels").mkdir(parents=True)
    for name in ("_compile.py", "_inlining.py"):
        shutil.copy(KERNELS / name, sim / "kernels" / name)
    (sim / "__init__.py").write_text("")
    decorated = "from ..kernels._compile import kernel\n"
    rooms = {
        "low": f"{decorated}\n@kernel\ndef low(x):\n    return {{factor}} * x\n",
        "middle": f"{decorated}from ..low._of import low\n\n@kernel\ndef middle(x):\n    return low(x)\n",
        "high": f"{decorated}"
        "from ..middle._of import middle\n\n@kernel\ndef high(x):\n    return middle(x)\n",
        "aside": f"{decorated}\n@kernel\ndef aside(x):\n    return {{factor}} * x\n",
    }
    program = (
        "from vibench.sim.high._of import high; from vibench.sim.aside._of import aside\n"
        "print(high(1.0), sum(high.stats.cache_misses.values()), aside(1.0))"
    )

    def answer(**factors):
        for room, text in rooms.items():
            (sim / room).mkdir(exist_ok=True)
            (sim / room / "_of.py").write_text(text.format(factor=factors.get(room, 0)))
        run = subprocess.run(
            [sys.executable, "-B", "-c", program], cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=True
        )
        return tuple(float(each) for each in run.stdout.split())

    assert answer(low=2.0, aside=5.0) == (2.0, 1, 5.0)
    assert answer(low=2.0, aside=7.0) == (2.0, 0, 7.0)
    assert answer(low=3.0, aside=7.0) == (3.0, 1, 7.0)


def test_importing_vibench_leaves_the_cache_of_other_peoples_kernels_alone():
    program = (
        "from numba import config; before = config.CACHE_DIR\n"
        "import vibench.sim.study, vibench.sim.chain, vibench.virtual_rig.rig, vibench.analysis\n"
        "from vibench.sim import integrate, lyapunov_spectrum\n"
        "assert config.CACHE_DIR == before, config.CACHE_DIR"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


@pytest.mark.parametrize("start", [["own.py"], ["-c", "import loose.own"]], ids=["script", "no __init__"])
def test_a_kernel_may_stand_in_a_script_or_in_a_folder_without_an_init(tmp_path, start):
    (tmp_path / "loose").mkdir()
    for place in (tmp_path, tmp_path / "loose"):
        (place / "own.py").write_text(TWICE)
    run = subprocess.run([sys.executable, *start], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert run.stdout == "3.0\n"


ARRAYS = {"Vector", "Table", "Complex", "PowerStepState", "PowerObserver", "Workspace", "FlightTables"}


def kernels():
    """Every kernel of the package: its name, its decorator, its syntax tree."""
    for source in sorted(Path(vibench.sim.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef):
                decorators = {each.id for each in node.decorator_list if isinstance(each, ast.Name)}
                for kind in decorators & {"kernel", "kernel_without_refcount", "inlined"}:
                    yield node.name, kind, node


def test_no_kernel_without_memory_makes_an_array_or_is_handed_one():
    # It would never be given back: a leak that no run shows.
    found = list(kernels())
    makers = {
        name for name, _, node in found if ARRAYS & {getattr(n, "id", "") for n in ast.walk(node.returns)}
    }
    assert {"clock_at", "contact_workspace", "workspace_for"} <= makers
    for name, kind, node in found:
        if kind == "kernel":
            continue
        called = [call.func for call in ast.walk(node) if isinstance(call, ast.Call)]
        assert not makers & {each.id for each in called if isinstance(each, ast.Name)}, name
        made = {each.attr for each in called if isinstance(each, ast.Attribute)}
        assert not made & {"zeros", "empty", "ones", "full", "eye", "array", "copy", "zeros_like"}, name


def test_where_no_folder_may_be_written_kernels_are_compiled_without_a_cache(tmp_path):
    """It was a traceback, "cannot cache function", from every command of a read-only installation."""
    script = tmp_path / "twice.py"
    # Beside a source that is no file numba finds no folder, whoever runs it.
    script.write_text(f"exec(compile({TWICE!r}, '<nowhere>', 'exec'))")
    run = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False)
    assert run.stdout == "3.0\n", run.stderr
