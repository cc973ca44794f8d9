"""What an unfinished run has left in `OUT.nc.blocks/`, shown to users: how much is done, and what has changed since."""

import datetime
import json
import os
import shlex
import tomllib
from math import prod
from pathlib import Path

from survey.file import lock
from survey.wording import counted

SHOWN = 3  # changes that are told one by one
# what blocks do not depend on
OTHER = ("title", "output.path", "output.figures", "output.style", "boundaries", "refine")
CODE = {"format", "kernels"}  # parts of a fingerprint that no workflow says


def folder_of(path):
    """Where the blocks of the run that writes `path` lie."""
    return Path(f"{path}.blocks")


def finished(path):
    """(blocks that are finished, all blocks) of the run that was to write `path`; (0, 0) if there is none."""
    folder = folder_of(path)
    known = table(folder / "manifest.json")
    return (len(_blocks(folder)), known["blocks"]) if "blocks" in known else (0, 0)


def summary(path):
    """Plain data on the unfinished run that was to write `path`: what is done, who is at it, how to resume it.

    {} if there is none.
    """
    folder = folder_of(path)
    known, holder, files = table(folder / "manifest.json"), table(folder / "holder.json"), _blocks(folder)
    if "blocks" not in known:
        return {}
    at_work = lock.holder(f"{path}.lock")
    last = max(_stat(file, "st_mtime") for file in [*files, *folder.glob("*.extra"), folder / "manifest.json"])
    return {
        "folder": str(folder),
        "blocks_done": len(files),
        "blocks": known["blocks"],
        "points_done": sum(map(_points, files)),
        "points": known.get("points"),
        "last_written": datetime.datetime.fromtimestamp(last, datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "at_work": _who(at_work or holder) if at_work is not None else f"nobody: it was interrupted ({_who(holder)})",
        **({"resume": _resume(path, holder)} if at_work is None else {}),
    }


def size(path):
    """The bytes that the unfinished run that was to write `path` has written."""
    return sum(_stat(file, "st_size") for file in folder_of(path).glob("*"))


def sentence(left):
    """What `summary` has found, in words."""
    points = _counted(left["points"], "point") if left["points"] else "them"
    done = f"{left['blocks_done']:,} of {_counted(left['blocks'], 'block')} ({left['points_done']:,} of {points})"
    who = f"go on with: {left['resume']}" if "resume" in left else f"{left['at_work']} is at work on it"
    return f"{left['folder']} holds an unfinished run: {done}, last written {left['last_written']}; {who}"


def drift(path, old, new, changed, workflow):
    """One line: how the blocks that are there, of manifest `old`, differ from a run of manifest `new`; what to do.

    `changed` are the parts of the fingerprint that differ, `workflow` is the text of the run's workflow.
    """
    folder = folder_of(path)
    done, causes, ways_back = counted(len(_blocks(folder)), "finished block"), [], []
    if CODE & set(changed):
        causes.append(f"of another version of the code ({_code(old, new)})")
        ways_back.append("that version")
    if "scene_hash" in changed:
        causes.append("of another z(u, p)")
        ways_back.append("that z")
    differences = _differences(folder, workflow)
    if not causes and not differences:
        differences = [f"{key} {_short(old.get(key))} -> {_short(new[key])}" for key in changed]
    if differences:
        more = f" and {len(differences) - SHOWN} more" if len(differences) > SHOWN else ""
        causes.append(f"of another workflow ({', '.join(differences[:SHOWN])}{more})")
        ways_back.append(f"that workflow (survey run {shlex.quote(str(folder / 'workflow.toml'))} -o {path})")
    return (
        f"{folder} holds {done} {' and '.join(causes)}; go back to {' and '.join(ways_back)}, or write another file "
        f"with -o, or start anew with --fresh, which deletes {done}"
    )


def _differences(folder, workflow):
    """['solver.rtol 1e-10 -> 1e-09', ...]: keys that the workflow of the blocks and the new one have otherwise."""
    try:
        old = tomllib.loads((folder / "workflow.toml").read_text(encoding="utf-8"))
        changes = list(_changes(old, tomllib.loads(workflow)))
    except (OSError, ValueError):
        return []
    of_blocks = [change for change in changes if not any(f"{change[0]}.".startswith(f"{key}.") for key in OTHER)]
    return [f"{key} {_short(before)} -> {_short(now)}" for key, before, now in of_blocks]


def _changes(old, new, prefix=""):
    """(key, old value, new value) of what differs; None if it is not given."""
    for key in [*new, *(key for key in old if key not in new)]:
        before, now = old.get(key), new.get(key)
        if not prefix and isinstance(before or now, dict):  # a table that is not given is an empty one
            before, now = before or {}, now or {}
        if isinstance(before, dict) and isinstance(now, dict):
            yield from _changes(before, now, f"{prefix}{key}.")
        elif before != now:
            yield f"{prefix}{key}", before, now


def _code(old, new):
    """What differs in the code of two manifests."""
    before, now = (manifest.get("code", {}) for manifest in (old, new))
    return ", ".join(f"{key} {before.get(key)} -> {now[key]}" for key in now if before.get(key) != now[key]) or "format"


def _short(value):
    text = "not given" if value is None else str(value)
    return text if len(text) < 40 else text[:37] + "..."


def _resume(path, holder):
    """The command that goes on: the one that began, or else with the workflow as it was kept."""
    words, folder = _words(holder.get("again")), holder.get("folder")
    if words[:2] != ["survey", "run"]:  # of another program: the folder may be a stranger's
        return f"survey run {shlex.quote(str(folder_of(path) / 'workflow.toml'))} -o {shlex.quote(str(path))}"
    away = isinstance(folder, str) and folder != os.getcwd()
    return (f"cd {shlex.quote(folder)} && " if away else "") + shlex.join(words)


def _words(command):
    """The words of a command as a shell takes them, each of them harmless when it is quoted; [] if there are none."""
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
    """The points of a block, from the line that names its arrays; 0 if it has none."""
    try:
        with open(file, "rb") as opened:
            return prod(json.loads(opened.readline())[1]["status"][1])
    except (OSError, ValueError, LookupError, TypeError):
        return 0


def _stat(file, what):
    """A figure of the file; 0 if it went meanwhile."""
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
