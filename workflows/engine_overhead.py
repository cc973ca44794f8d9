"""Overhead of the engine: a map of ten million points against its kernels and netCDF4 alone, and
the time to start.

python workflows/engine_overhead.py [-o results] [--variables discriminant,verdict] [--points
2500x4000]
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import netCDF4

from survey.file.labels import now, provenance
from survey.request import workflow
from survey.sweep import cost, dispatch, solve

WORKFLOW = Path(__file__).with_name("satellite_prolate.toml")
REPEATS = 5
# the program, printing when its first block was solved
FIRST_BLOCK = """
import sys, time
from survey.file.blocks import Blocks
save = Blocks.save
def reporting(*arguments):
    print(time.time(), flush=True)
    Blocks.save = save
    save(*arguments)
Blocks.save = reporting
from survey.cli import main
main(sys.argv[1:])
"""
# the program, printing when everything that reads a workflow is imported
READING = """
import sys, time
from survey.request import workflow
from survey.cli import main
print(time.time(), flush=True)
main(sys.argv[1:])
"""


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", metavar="DIR", type=Path, default=Path("results"))
    parser.add_argument("--variables", default="discriminant,verdict")
    parser.add_argument("--points", default="2500x4000", metavar="KxRHO")
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=given.output) as folder:
        page = measure(given, Path(folder))
    path = given.output / "engine_overhead.md"
    path.write_text(page, encoding="utf-8")
    print(path)


def measure(given, folder):
    """The page, from runs that write to `folder`, without the edges of tongues."""
    points_alone, target = folder / "points.toml", folder / "map.nc"
    points_alone.write_text(WORKFLOW.read_text(encoding="utf-8").partition("[boundaries]")[0])
    k, rho = given.points.split("x")
    overrides = [
        f"axes.k.num={k}",
        f"axes.rho.num={rho}",
        f"output.variables={given.variables.split(',')}",
    ]
    overrides.append("output.figures=[]")
    command = [
        "run",
        str(points_alone),
        "-o",
        str(target),
        *(word for text in overrides for word in ("--set", text)),
    ]
    small = [*command, "--set", "axes.k.num=40", "--set", "axes.rho.num=400", "--quiet"]
    checked = workflow.read(points_alone, overrides, target)
    cold, warm = starts(small)
    measured = [run(command) for _ in range(REPEATS)]
    arrays, packing = read(target)
    runs = {
        "kernels": [kernels(checked) for _ in range(REPEATS)],
        "netCDF4": [
            netcdf4_alone(arrays, packing, target.with_name("alone.nc")) for _ in range(REPEATS)
        ],
        "command": [seconds for seconds, _, _ in measured],
        "since": [seconds - begin for seconds, begin, _ in measured],
    }
    times = {name: statistics.median(values) for name, values in runs.items()}
    least = times["kernels"] + times["netCDF4"]
    points = checked.grid.points
    added = max(0.0, times["since"] - least) / points * 1e9
    peak = max(peak for _, _, peak in measured)
    own = provenance()
    return f"""# What the engine adds

Made by `python {" ".join(sys.argv)}`, {now()}, commit {own["commit"][:10]}, on {own["cpu"]}, {dispatch.cpus()} threads,
load {os.getloadavg()[0]:.1f}; medians of {REPEATS}.

A map of {points:,} points, {k} x {rho}: `{given.variables}` with error bars and status, from the workflow file to the
closed, synced, digested and renamed netCDF file of {target.stat().st_size / 1e6:.0f} MB.

| | seconds |
|---|---|
| kernels alone, the same blocks on the same threads, results dropped | {times["kernels"]:.2f} |
| netCDF4 alone, the same variables and encoding, neither synced nor digested | {times["netCDF4"]:.2f} |
| sum of the two | {least:.2f} |
| the command from reading its workflow on | {times["since"]:.2f} |
| the command, Python's start and imports included | {times["command"]:.2f} |

Ratio to the sum: {times["since"] / least:.2f} from reading the workflow on, {times["command"] / least:.2f} for all of
the command; asked: at most 1.5. The engine adds {added:.0f} ns a point (0 is possible: it packs while kernels run).
Peak memory of the command: {peak:.0f} MiB; asked: below 1024.

| the first block is solved, after the command was given | seconds |
|---|---|
| on a new machine: nothing compiled; asked: 5 | {_spread(cold)} |
| in a later process; asked: 1.5 | {_spread(warm)} |
"""


def starts(command):
    """Repeated seconds until the first block is solved: with an empty kernel cache, and with a filled one."""
    cold, warm = [], []
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as cache:
            cold.append(first_block(command, cache))
            warm.append(first_block(command, cache))
    return cold, warm


def _spread(seconds):
    return f"{statistics.median(seconds):.2f} ({min(seconds):.2f} to {max(seconds):.2f})"


def first_block(command, cache):
    begin = time.time()
    done = subprocess.run(
        [sys.executable, "-c", FIRST_BLOCK, *command, "--fresh"],
        env=os.environ | {"NUMBA_CACHE_DIR": cache}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(done.stdout.split()[0]) - begin


def run(command):
    """(seconds of the command, how many of them before it read its workflow, peak MiB)."""
    begin = time.time()
    process = subprocess.Popen(
        [sys.executable, "-c", READING, *command, "--quiet"], stdout=subprocess.PIPE, text=True
    )
    reading = float(process.stdout.readline())
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.time() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"the command failed with exit code {process.returncode}")
    return seconds, reading - begin, usage.ru_maxrss / 1024


def kernels(checked):
    """Seconds to solve all blocks, on as many threads as the command uses."""
    blocks = cost.blocks_of(checked)

    def solve_one(block):
        solve.solve_block(checked.scene, checked.request, checked.grid, block)

    solve_one(blocks[0])
    begin = time.perf_counter()
    with ThreadPoolExecutor(dispatch.cpus()) as pool:
        list(pool.map(solve_one, blocks))
    return time.perf_counter() - begin


def read(path):
    """The map's arrays, and how each is packed in the file."""
    arrays, packing = {}, {}
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        for name, variable in file.variables.items():
            if variable.dimensions == file["status"].dimensions:
                filters = variable.filters()
                packing[name] = {
                    key: filters[key] for key in ("zlib", "shuffle", "complevel", "fletcher32")
                }
                packing[name]["chunksizes"] = variable.chunking()
                arrays[name] = variable[:]
    return arrays, packing


def netcdf4_alone(arrays, packing, path):
    """Seconds to write the arrays, each in one piece, with netCDF4."""
    begin = time.perf_counter()
    with netCDF4.Dataset(path, "w") as file:
        for number, size in enumerate(arrays["status"].shape):
            file.createDimension(f"x{number}", size)
        for name, values in arrays.items():
            made = file.createVariable(name, values.dtype, tuple(file.dimensions), **packing[name])
            made.set_auto_maskandscale(False)
            made[:] = values
    seconds = time.perf_counter() - begin
    path.unlink()
    return seconds


if __name__ == "__main__":
    main()
