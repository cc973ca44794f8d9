"""What an unfinished run has left in `OUT.nc.blocks/`, for users: how much is done, and what has
changed since.
"""

import datetime
import json
import os
import shlex
import tomllib
from math import prod
from pathlib import Path

from survey.file import lock
from survey.wording import counted

SHOWN = 3  # changes that are listed one by one
# keys of a workflow on which blocks do not depend
INDEPENDENT = ("title", "output.path", "output.figures", "output.style", "boundaries", "refine")
CODE = {"format", "kernels"}  # parts of a fingerprint that do not come from the workflow
# does the processor have fused multiply-adds? The last bits of trajectories depend on that
FUSED = "fused_multiply_adds"


def folder_of(path):
    """The folder of the blocks of the run that writes `path`."""
    return Path(f"{path}.blocks")


def finished(path):
    """(finished blocks, all blocks) of the unfinished run that was writing `path`; (0, 0) if there
    is none.
    """
    folder = folder_of(path)
    known = table(folder / "manifest.json")
    return (len(_blocks(folder)), known["blocks"]) if "blocks" in known else (0, 0)


def summary(path):
    """Plain data on the unfinished run that was writing `path`: what is done, who is writing it,
    how to resume it.

    {} if there is none.
    """
    folder = folder_of(path)
    known = table(folder / "manifest.json")
    holder = table(folder / "holder.json")
    files = _blocks(folder)
    if "blocks" not in known:
        return {}
    active = lock.holder(f"{path}.lock")
    last = max(
        _stat(file, "st_mtime")
        for file in [*files, *folder.glob("*.extra"), folder / "manifest.json"]
    )
    return {
        "folder": str(folder),
        "blocks_done": len(files),
        "blocks": known["blocks"],
        "points_done": sum(map(_points, files)),
        "points": known.get("points"),
        "last_written": datetime.datetime.fromtimestamp(last, datetime.UTC).strftime(
            "%Y-%m-%dT%H:%M:%SZ"
        ),
        "at_work": _who(active or holder)
        if active is not None
        else f"nobody: it was interrupted ({_who(holder)})",
        **({"resume": _resume_command(path, holder)} if active is None else {}),
    }


def size(path):
    """The bytes that the unfinished run that was writing `path` has stored."""
    return sum(_stat(file, "st_size") for file in folder_of(path).glob("*"))


def sentence(left):
    """The `summary` as a sentence."""
    points = _counted(left["points"], "point") if left["points"] else "them"
    done = f"{left['blocks_done']:,} of {_counted(left['blocks'], 'block')} ({left['points_done']:,} of {points})"
    who = (
        f"resume with: {left['resume']}" if "resume" in left else f"{left['at_work']} is writing it"
    )
    return f"{left['folder']} contains an unfinished run: {done}, last written {left['last_written']}; {who}"


def drift(path, old, new, changed, workflow):
    """One line: how the existing blocks, of manifest `old`, differ from a run of manifest `new`,
    and what to do.

    `changed` are the parts of the fingerprint that differ; `workflow` is the text of the new run's
    workflow.
    """
    folder = folder_of(path)
    done = counted(len(_blocks(folder)), "finished block")
    causes = []
    ways_back = []
    if CODE & set(changed):
        causes.append(f"from another version of the code ({_code(old, new)})")
        ways_back.append("that version")
    if FUSED in changed:
        causes.append(from_processor(not new[FUSED]))
        ways_back.append("such a processor")
    if "scene_hash" in changed:
        causes.append("from a different z(u, p) (or f and g)")
        ways_back.append("those functions")
    changes = _differences(folder, workflow)
    if not causes and not changes:
        changes = [f"{key} {_short(old.get(key))} -> {_short(new[key])}" for key in changed]
    if changes:
        causes.append(f"from another workflow ({listed(changes)})")
        ways_back.append(
            f"that workflow (survey run {shlex.quote(str(folder / 'workflow.toml'))} -o {path})"
        )
    return (
        f"{folder} contains {done} {' and '.join(causes)}; go back to {' and '.join(ways_back)}, "
        f"or write to another file with -o, or start again with --fresh, which deletes {done}"
    )


def from_processor(fused):
    """`from a processor ...`, which has fused multiply-adds or none."""
    return f"from a processor {'with' if fused else 'without'} fused multiply-adds, which decide last bits"


def _differences(folder, workflow):
    """['solver.rtol 1e-10 -> 1e-09', ...]: keys in which the workflow of the blocks and the new one
    differ.
    """
    try:
        return differences(
            (folder / "workflow.toml").read_text(encoding="utf-8"), workflow, INDEPENDENT
        )
    except (OSError, ValueError):
        return []


def differences(old, new, independent):
    """['solver.rtol 1e-10 -> 1e-09', ...]: keys in which two workflows' texts differ, except
    `independent` ones.

    Raises ValueError if a text is not TOML.
    """
    changes = _changes(tomllib.loads(old), tomllib.loads(new))
    return [
        f"{key} {_short(before)} -> {_short(now)}"
        for key, before, now in changes
        if not any(f"{key}.".startswith(f"{other}.") for other in independent)
    ]


def listed(differences):
    """The first differences, and how many more there are."""
    more = f" and {len(differences) - SHOWN} more" if len(differences) > SHOWN else ""
    return f"{', '.join(differences[:SHOWN])}{more}"


def _changes(old, new, prefix=""):
    """Yield (key, old value, new value) of what differs; None for a value that is not given."""
    for key in [*new, *(key for key in old if key not in new)]:
        before, now = old.get(key), new.get(key)
        # a table that is not given is an empty one
        if not prefix and isinstance(before or now, dict):
            before, now = before or {}, now or {}
        if isinstance(before, dict) and isinstance(now, dict):
            yield from _changes(before, now, f"{prefix}{key}.")
        elif before != now:
            yield f"{prefix}{key}", before, now


def _code(old, new):
    """What differs in the code of two manifests."""
    before, now = (manifest.get("code", {}) for manifest in (old, new))
    return (
        ", ".join(
            f"{key} {before.get(key)} -> {now[key]}" for key in now if before.get(key) != now[key]
        )
        or "format"
    )


def _short(value):
    text = "not given" if value is None else str(value)
    return text if len(text) < 40 else text[:37] + "..."


def _resume_command(path, holder):
    """The command that resumes: the one that started the run, or else one with the workflow that
    the folder keeps.
    """
    words = _words(holder.get("resume_command"))
    folder = holder.get("folder")
    if words[:2] != ["survey", "run"]:  # another program: the folder may be untrusted
        return f"survey run {shlex.quote(str(folder_of(path) / 'workflow.toml'))} -o {shlex.quote(str(path))}"
    elsewhere = isinstance(folder, str) and folder != os.getcwd()
    return (f"cd {shlex.quote(folder)} && " if elsewhere else "") + shlex.join(words)


def _words(command):
    """The words of a command as a shell splits them, harmless once quoted; [] if there are none."""
    try:
        return shlex.split(command) if isinstance(command, str) else []
    except ValueError:
        return []


def _counted(number, noun):
    return counted(number, noun) if isinstance(number, int) else f"{number} {noun}s"


def _who(holder):
    return f"host {holder.get('host', 'unknown')}, pid {holder.get('pid', 'unknown')}"


def _blocks(folder):
    return list(folder.glob("*.block"))


def _points(file):
    """The number of points of a block, from its first line; 0 if that is not valid."""
    try:
        with open(file, "rb") as opened:
            return prod(json.loads(opened.readline())[1]["status"][1])
    except (OSError, ValueError, LookupError, TypeError):
        return 0


def _stat(file, what):
    """A field of the file's status; 0 if the file has been removed."""
    try:
        return getattr(file.stat(), what)
    except OSError:
        return 0


def table(file):
    """The JSON object in a file; {} if there is none."""
    try:
        table = json.loads(file.read_bytes())
    except (OSError, ValueError):
        return {}
    return table if isinstance(table, dict) else {}
