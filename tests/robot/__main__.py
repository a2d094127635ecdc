"""``python -m tests.robot --seed N --minutes M``: a robot that does random things in the whole window.

It presses keys, clicks, types invalid values, deletes and writes files, and kills and suspends engines. It
looks for exceptions, pages that no longer respond, results of other inputs, and a STOP that takes too long.
The same seed gives the same actions, apart from timing; ``--beside-work`` keeps every core busy.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from .robot import Robot

SPIN = "while True: pass"


def main() -> int:
    """Run the robot; the exit code is 1 if it found something."""
    options = _options()
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    with tempfile.TemporaryDirectory(prefix="vibench_robot_") as folder:
        os.environ["VIBENCH_STATE_DIR"] = str(Path(folder, "state"))
        os.chdir(folder)
        count = os.cpu_count() or 1 if options.beside_work else 0
        others = [subprocess.Popen([sys.executable, "-c", SPIN]) for _ in range(count)]
        try:
            with Path(folder, "stderr").open("wb") as errors:
                os.dup2(errors.fileno(), sys.stderr.fileno())  # also for child processes
            robot = Robot(options.seed, Path(folder))
            robot.work(60.0 * options.minutes)
            told = robot.close()
        finally:
            for each in others:
                each.kill()
                each.wait()
    print(told)
    return int(bool(robot.findings))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.robot", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--beside-work", action="store_true", help="keep every core busy meanwhile")
    return parser.parse_args()


if __name__ == "__main__":  # the worker processes of the window import this file
    sys.exit(main())
