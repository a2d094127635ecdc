import shutil
import subprocess
import sys
from pathlib import Path

import sim.compiled

INNER = "from .compiled import compiled\n\n@compiled\ndef inner(x):\n    return {factor} * x\n"


def test_a_kernel_is_recompiled_when_a_kernel_that_it_calls_changes_in_another_file(tmp_path):
    package = tmp_path / "sim"
    package.mkdir()
    shutil.copy(Path(sim.compiled.__file__), package / "compiled.py")
    (package / "__init__.py").write_text("")
    inner = package / "inner.py"
    (package / "outer.py").write_text(
        "from .compiled import compiled\nfrom .inner import inner\n\n"
        "@compiled\ndef outer(x):\n    return inner(x)\n\nprint(outer(1.0))\n"
    )
    answers = []
    for factor in (2.0, 3.0):
        inner.write_text(
            f"from .compiled import compiled\n\n@compiled\ndef inner(x):\n    return {factor} * x\n"
        )
        run = subprocess.run(
            [sys.executable, "-c", "import sim.outer"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        )
        answers.append(float(run.stdout))
    assert answers == [2.0, 3.0]
