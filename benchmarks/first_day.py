"""Print transcript and duration of a new user's first commands on the virtual rig in real time.

python benchmarks/first_day.py > transcript.txt
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COMMANDS = (
    "vibench bench new my_bench.toml --from virtual_rig --answers answers.toml",
    "vibench measure first_day --bench my_bench.toml --out recordings",
    "vibench catalogue recordings",
)
WALL = """
[virtual]
pace = "wall"
"""


def main() -> None:
    """Run the commands in an empty folder, and print them with their output."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        answers = (ROOT / "examples" / "first_day_answers.toml").read_text(encoding="utf-8")
        (folder / "answers.toml").write_text(answers + WALL, encoding="utf-8")
        began_s = time.monotonic()
        for command in COMMANDS:
            print(f"$ {command}")
            words = [sys.executable, "-m", "vibench.cli", *command.split()[1:]]
            environment = {**os.environ, "VIBENCH_STATE_DIR": str(folder / "state"), "COLUMNS": "120"}
            done = subprocess.run(
                words, cwd=folder, env=environment, capture_output=True, text=True, check=False
            )
            print(done.stdout + done.stderr)
            done.check_returncode()
        print(f"From nothing to a recorded sweep: {(time.monotonic() - began_s) / 60:.1f} minutes.")


if __name__ == "__main__":
    main()
