"""The attack as a whole: chunks of points, each of its own seed, in processes; what is done is
kept; the table.
"""

import csv
import hashlib
import importlib
import json
import multiprocessing
import os
import shutil
import time
from collections import Counter, defaultdict
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from pathlib import Path

import numpy as np
from rich.console import Console

from attack.compare import FAULTS
from survey import truth

# share of the points, points of a chunk
FAMILIES = {
    "satellite": (0.3, 2500),
    "mathieu": (0.14, 2500),
    "own": (0.03, 1000),
    "libration_elliptic": (0.2, 2500),
    "gyrostat": (0.12, 2000),
    "gyrostat_fate": (0.004, 250),
    "brun": (0.15, 2500),
    "libration": (0.056, 2000),
    "floquet": (0.02, 500),
    "orbit": (0.002, 100),
    "abel": (0.02, 500),
}
WHERE = {"satellite": ("hill", "satellites"), "mathieu": ("hill", "mathieu"), "own": ("hill", "own"),
         "libration_elliptic": ("danby", "chunk"), "gyrostat_fate": ("fate", "chunk")}  # fmt: skip
LATER = ("floquet", "orbit", "abel")
# later families last: those before keep their points
SEEDS = (*sorted(FAMILIES.keys() - set(LATER)), *LATER)
FOLDER, TRUTHS = Path(__file__).parent, Path(truth.__file__).parent
LISTED = 60  # faults in the page


def batches(family, seed, index, size):
    """The batches of a chunk: the same for the same seed."""
    module, name = WHERE.get(family, (family, "chunk"))
    random = np.random.default_rng([seed, SEEDS.index(family), index])
    return getattr(importlib.import_module(f"attack.{module}"), name)(random, size)


def solve(family, seed, index, size):
    """What a chunk found: {"rows": [[scene, method, region, counts, worst]], "faults": [...]}."""
    from attack import compare

    rows, faults = defaultdict(Counter), []
    worst, began = defaultdict(float), time.process_time()
    for batch in batches(family, seed, index, size):
        try:
            counts, ratio, found = compare.compare(batch)
        except Exception:  # of the truth, or of points taken again
            counts, ratio, found = compare.failed(batch)
        key = batch.name, batch.method, batch.region
        rows[key] += counts
        worst[key] = max(worst[key], ratio)
        faults += [fault | {"chunk": f"{family} {index}"} for fault in found]
    return {
        "family": family, "rows": [[*key, dict(counts), worst[key]] for key, counts in rows.items()],
        "faults": faults[:200], "seconds": time.process_time() - began,
    }  # fmt: skip


def plan(points, scenes):
    """[(family, index, size)], the families mixed, so that an early stop has seen all of them."""
    all_points = sum(FAMILIES[name][0] for name in scenes)
    chunks = []
    for name in scenes:
        share, size = FAMILIES[name]
        wanted = max(1, round(points * share / all_points))
        number = -(-wanted // size)
        chunks += [((i + 0.5) / number, name, i, -(-wanted // number)) for i in range(number)]
    return [chunk[1:] for chunk in sorted(chunks)]


def sources():
    """Hash of what the numbers depend on."""
    from survey.kernels.jit import deciding_hash

    digest = hashlib.sha256(deciding_hash().encode())
    for path in sorted([*FOLDER.glob("*.py"), *TRUTHS.glob("*.py")]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def run(points, scenes, seed, output, workers, minutes, fresh):
    """Do what is left of the attack and write its page; 1 if there is a fault, 4 if it was stopped early."""
    console = Console(stderr=True)
    kept = output.with_name(output.name + ".chunks")
    identity = {"points": points, "scenes": scenes, "seed": seed, "sources": sources()}
    if fresh and kept.exists():
        shutil.rmtree(kept)
    kept.mkdir(parents=True, exist_ok=True)
    manifest = kept / "attack.json"
    if manifest.exists() and json.loads(manifest.read_text(encoding="utf-8")) != identity:
        console.print(f"attack: {kept} holds another attack (points, scenes, seed or sources differ); "
                      "give --fresh to start again, or another -o", style="red", soft_wrap=True)  # fmt: skip
        return 2
    manifest.write_text(json.dumps(identity), encoding="utf-8")
    chunks = plan(points, scenes)
    left = [c for c in chunks if not _path(kept, c).exists()]
    _work(left, seed, kept, workers, minutes, console, len(chunks) - len(left), len(chunks))
    found = [
        json.loads(_path(kept, c).read_text(encoding="utf-8"))
        for c in chunks
        if _path(kept, c).exists()
    ]
    if not found:
        return 4
    count = write(output, found, identity, len(found) == len(chunks))
    console.print(f"attack: {output}: {count or 'no'} faults", soft_wrap=True)
    if len(found) < len(chunks):
        console.print(
            f"attack: {len(chunks) - len(found)} of {len(chunks)} chunks left: give the same command again"
        )
        return 4
    return 1 if count else 0


def _path(kept, chunk):
    return kept / f"{chunk[0]}-{chunk[1]}.json"


def _work(left, seed, kept, workers, minutes, console, done, number):
    from survey.sweep.progress import Progress

    began = time.monotonic()
    context = multiprocessing.get_context("spawn")
    with Progress(console, FOLDER) as progress, ProcessPoolExecutor(workers, context) as pool:
        reused, waiting, queue = done, {}, list(reversed(left))
        progress(done, number, reused, "chunks")
        while queue or waiting:
            out_of_time = minutes is not None and time.monotonic() - began > 60 * minutes
            while queue and not out_of_time and len(waiting) < workers:
                chunk = queue.pop()
                waiting[pool.submit(solve, chunk[0], seed, *chunk[1:])] = chunk
            if not waiting:
                break
            ready, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ready:
                chunk = waiting.pop(future)
                path = _path(kept, chunk)
                path.with_suffix(".part").write_text(
                    json.dumps(future.result(), default=str), encoding="utf-8"
                )
                os.replace(path.with_suffix(".part"), path)
                done += 1
                progress(done, number, reused, "chunks")


COLUMNS = (
    "points",
    "undecided",
    "missed",
    "refused",
    "unchecked",
    "lies",
    "wrong",
    "silent",
    "tracebacks",
    "slow",
)


def _merged(rows, key):
    counts, worst = defaultdict(Counter), defaultdict(float)
    for row in rows:
        counts[key(row)] += Counter(row[3])
        worst[key(row)] = max(worst[key(row)], row[4])
    return counts, worst


def _table(rows, key, titles):
    counts, worst = _merged(rows, key)
    shares, numbers = (
        ("undecided", "missed", "refused", "unchecked"),
        ("lies", "wrong", "silent", "tracebacks", "slow"),
    )
    heads = [
        *titles,
        "points",
        *(f"{x} %" for x in shares),
        "worst error / bar",
        *numbers,
        "us a point",
    ]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for name in sorted(counts):
        c = counts[name]
        share = [f"{100 * c[x] / c['points']:.1f}" for x in shares]
        cells = [f"{c['points']:,}", *share, f"{worst[name]:.2g}", *(str(c[x]) for x in numbers)]
        lines.append(
            "| " + " | ".join([*name, *cells, f"{1e6 * c['seconds'] / c['points']:.0f}"]) + " |"
        )
    return lines


def write(output, found, identity, complete):
    """The page and the CSV; returns the number of faults."""
    rows = [row for part in found for row in part["rows"]]
    faults = [fault for part in found for fault in part["faults"]]
    counts, worst = _merged(rows, lambda r: tuple(r[:3]))
    with output.with_suffix(".csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "method", "region", *COLUMNS, "worst_error_over_bar", "seconds"])
        for name in sorted(counts):
            c = counts[name]
            writer.writerow(
                [*name, *(c[x] for x in COLUMNS), f"{worst[name]:.4g}", f"{c['seconds']:.4g}"]
            )
    total = sum(counts.values(), Counter())
    count = sum(total[x] for x in FAULTS)
    seconds = sum(part["seconds"] for part in found)
    page = [*_prose(identity, total, seconds, complete), "", "## By scene and method", "",
            *_table(rows, lambda r: (r[0], r[1]), ("scene", "method")), "", "## By scene and region", "",
            *_table(rows, lambda r: (r[0], r[2]), ("scene", "region")), ""]  # fmt: skip
    if faults:
        page += ["## Faults", ""]
    for fault in _spread(faults):
        words = (
            f"{fault['kind']}, {fault['scene']}, {fault['region']}: {fault['what']} {fault['said']}"
        )
        shown = [f"  {line}" for line in fault["line"].splitlines()]
        page += [f"- {words} (chunk {fault['chunk']})", "", "  ```text", *shown, "  ```"]
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text("\n".join(page) + "\n", encoding="utf-8")
    return count


def _spread(faults):
    """The first few of each sort."""
    seen = Counter()
    for fault in faults:
        sort = fault["kind"], fault["scene"], fault["what"]
        seen[sort] += 1
        if seen[sort] <= 3 and sum(min(n, 3) for n in seen.values()) <= LISTED:
            yield fault


PROSE = """# An attack on error bars and verdicts

Made by `python workflows/attack {asked}`{stopped}:
{points:,} points, {seconds:,.0f} s of processor time; survey {version_survey}, numba {version_numba},
numpy {version_numpy}, Python {version_python}, {cpu}, commit {commit} (changed since: {dirty}), sources {sources}.

Random points are drawn where answers are hardest: consecutive doubles about edges of tongues and separatrices, tips,
ends of domains, tiny and huge values, exact special values, long times, all methods, rtol from 1e-6 to 1e-13, one by
one, in batches and as maps. Each answer is held against a truth of higher accuracy that shares no code with the
package: Taylor series in double-double arithmetic of the attack's own, of other forms of the equations (Duffing's
equation for satellites, the eccentric anomaly for Danby's map), closed forms where z is piecewise constant, trapezoidal
sums for Brun's problem (with 120 digits for a sample of the states beside a saddle, where double-double is too
short), exact fractions, 60 digits of the closed forms of the normal form (whose integers are the package's), long
motions and exact mirror images for fates and portraits, 45 digits of the exponentials of matrices that are composed of
integers for linear periodic systems, 40 digits of the closed forms of narrow steps for Abel equations of one's own.
Some points of each batch are solved again, alone and at another rtol: both answers must lie within the sum of their
bars.

A **lie** is a value farther from the truth than its error bar and the truth's own doubt together. A **wrong** verdict
is one that the truth contradicts; an undecided one is honest, and so are a bar wider than rtol asks for (missed) and
a refusal with its reason. **Silent** is a NaN, a negative bar or a flag without a word beside a status that is ok;
slow is more than half a second a point. Unchecked are answered points whose truth would have been too dear or too
coarse. The time is that of the package, without compiling."""


def _prose(identity, total, seconds, complete):
    from survey.file.labels import provenance

    asked = f"--points {identity['points']} --seed {identity['seed']}"
    if identity["scenes"] != list(FAMILIES):
        asked += f" --scenes {','.join(identity['scenes'])}"
    stopped = "" if complete else " (stopped early)"
    words = PROSE.format(
        asked=asked,
        stopped=stopped,
        points=total["points"],
        seconds=seconds,
        sources=identity["sources"],
        **provenance(),
    )
    return words.splitlines()
