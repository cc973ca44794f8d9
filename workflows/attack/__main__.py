"""Attack survey: hard random points for every scene, each held against an independent truth; a
table of the faults.

    python workflows/attack --points 1000000 --workers 2 -o results/attack.md

writes the table, the same numbers as CSV by scene, method and region beside it, and every fault
with a line of Python that reproduces it. When stopped, it resumes where it was; the same seed draws
the same points.
"""

import argparse
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).parent.parent)

from attack import command  # noqa: E402


def main(arguments=None):
    words = argparse.ArgumentParser(prog="attack", description=__doc__.split("\n\n")[0])
    words.add_argument(
        "--points", type=int, default=1_000_000, metavar="N", help="points in all (default 1000000)"
    )
    words.add_argument(
        "--scenes", default="", metavar="A,B", help=f"of these alone: {', '.join(command.FAMILIES)}"
    )
    words.add_argument(
        "--seed", type=int, default=1, help="another seed draws other points (default 1)"
    )
    words.add_argument(
        "--minutes", type=float, metavar="M", help="stop after so long, and write what is known"
    )
    words.add_argument("--workers", type=int, default=1, metavar="N", help="processes (default 1)")
    words.add_argument("--fresh", action="store_true", help="start again")
    words.add_argument(
        "-o", "--output", type=Path, default=Path("results/attack.md"), metavar="FILE.md"
    )
    asked = words.parse_args(arguments)
    scenes = [name for name in asked.scenes.split(",") if name] or list(command.FAMILIES)
    if unknown := [name for name in scenes if name not in command.FAMILIES]:
        words.error(f"--scenes {unknown[0]}: choose among {', '.join(command.FAMILIES)}")
    if asked.points < 1 or asked.workers < 1:
        words.error("--points and --workers must be at least 1")
    return command.run(
        asked.points, scenes, asked.seed, asked.output, asked.workers, asked.minutes, asked.fresh
    )


if __name__ == "__main__":
    sys.exit(main())
