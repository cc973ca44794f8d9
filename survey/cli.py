"""The commands. Only this file prints: data to stdout, messages and progress to stderr."""

import ctypes
import gc
import io
import json
import os
import re
import shlex
import signal
import sys
import traceback

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from survey import __version__
from survey.errors import BadInput, SurveyError, Untrusted
from survey.wording import counted, plain, reason_of, shown

out = Console(highlight=False, soft_wrap=True, emoji=False)
err = Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
CELL = 10_000  # characters of an attribute that are shown
TRUST = "Allow the survey's own scene, a Python file, to run: only if you have read it, or trust its author."


def main(arguments=None):
    """Run the program and exit: 0 done, 1 points failed, 2 bad input, 3 damaged, 4 stopped, 130/143
    interrupted.
    """
    for stream in (sys.stdout, sys.stderr):  # a pipe on Windows knows few characters
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    # measured: otherwise garbage collection takes a tenth of the time of compiling kernels
    gc.set_threshold(100_000)
    _keep_freed_memory()
    try:
        arguments = sys.argv[1:] if arguments is None else arguments
        code = program.main(arguments or ["--help"], prog_name="survey", standalone_mode=False)
    except SurveyError as error:
        code = complain(error, error.exit_code)
    except click.Abort:
        code = complain("interrupted", 130)
    except click.ClickException as error:
        code = complain(_usage(error), 2)
    except BrokenPipeError:  # the reader of a pipe went away
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    except OSError as error:
        code = complain(
            f"{error.filename or 'the program'}: {error.strerror or error}; fix this and try again",
            4,
        )
    gc.freeze()  # measured: without it, the collections at exit take 0.35 s
    sys.exit(code or 0)


def _keep_freed_memory():
    """Measured: otherwise a map of 4 million points spends a sixth of its time on fetching the
    memory anew that each block gives back to the system.
    """
    allocator = ctypes.CDLL(None) if sys.platform == "linux" else None
    if hasattr(allocator, "mallopt"):  # not musl's
        for option, size in ((M_TRIM_THRESHOLD, 256 << 20), (M_MMAP_THRESHOLD, 32 << 20)):
            allocator.mallopt(option, size)


def _usage(error):
    """What is wrong with the command line, and where to find its usage, in one line."""
    message = error.format_message().replace("\n", " ").removesuffix(".")
    context = getattr(error, "ctx", None)
    message = re.sub(r"is not a valid (integer|float) range", r"is not a valid \1", message)
    message = re.sub(r"is not in the range (\S+)<=x<=(\S+)", r"is not from \1 to \2", message)
    message = re.sub(r"is not in the range x>=(\S+)", r"is below \1", message)
    message = re.sub(r"is not in the range x>(\S+)", r"is not above \1", message)
    return f"{message}; see {context.command_path} --help" if context else message


def complain(message, code):
    """One line on stderr; returns the exit code."""
    err.print(plain(f"survey: {message}"), markup=False)
    return code


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="survey")
def program():
    """Stability maps of mechanical systems: every point with an error bar, and a verdict that respects it."""


def _scene_names(_context, _parameter, incomplete):
    """Completion of a scene's name."""
    import survey.scenes

    return [name for name in survey.scenes() if name.startswith(incomplete)]


class _Files(click.ParamType):
    """A path; completed with the files of one kind, and folders."""

    name = "path"

    def __init__(self, suffix):
        self.suffix = suffix

    def shell_complete(self, ctx, param, incomplete):
        from click.shell_completion import CompletionItem

        folder = os.path.dirname(incomplete)
        found = [os.path.join(folder, name) for name in sorted(os.listdir(folder or "."))]
        return [
            CompletionItem(path + "/" * os.path.isdir(path))
            for path in found
            if path.startswith(incomplete) and (path.endswith(self.suffix) or os.path.isdir(path))
        ]


WORKFLOW = _Files(".toml")


@program.command()
@click.argument("scene", shell_complete=_scene_names)
@click.option(
    "-o", "--output", metavar="FILE.toml", help="The workflow file; by default SCENE.toml."
)
def init(scene, output):
    """Write a commented workflow of the scene to start from; it runs as it is."""
    from survey.file.disk import check_folder
    from survey.request import starter

    text = starter.workflow(scene)
    path = output or f"{os.path.basename(scene).removesuffix('.py')}.toml"
    check_folder(path, ".toml")
    try:
        with open(path, "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise BadInput(f"{path} exists; name another file with -o") from None
    err.print(plain(f"wrote {path}; run it with: survey run {shlex.quote(path)}"), markup=False)
    out.print(plain(path), markup=False)


@program.command()
def schema():
    """Print the JSON schema of a workflow file, which editors use to complete and check it."""
    from survey.request import starter

    _show(starter.schema(), True)


@program.command()
@click.argument("workflow", type=WORKFLOW)
@click.option(
    "-o",
    "--output",
    metavar="OUT.nc",
    help="The netCDF file, instead of the workflow's output.path.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a key, such as axes.k.num=40.",
)
@click.option(
    "--workers",
    type=click.IntRange(1),
    help="Worker processes; by default threads of this process.",
)
@click.option(
    "--scheduler", metavar="ADDRESS", help="A dask.distributed scheduler, or its scheduler file."
)
@click.option(
    "--block-timeout",
    type=click.FloatRange(0, min_open=True),
    metavar="SECONDS",
    help="Replace a worker that takes longer than this for a block; by default 20 times the longest "
    "block so far, and at least 5 minutes.",
)
@click.option(
    "--fresh", is_flag=True, help="Replace the results of earlier runs: the file or its blocks."
)
@click.option(
    "--reuse",
    metavar="FILE.nc",
    help="Reuse the points that this file of an earlier run already holds.",
)
@click.option("--quiet", is_flag=True, help="No progress and no closing lines.")
def run(workflow, output, overrides, workers, scheduler, block_timeout, fresh, reuse, quiet):
    """Run, or resume, a sweep; write OUT.nc and the pictures that the workflow requests."""
    from survey.request import earlier
    from survey.request.workflow import read
    from survey.sweep import engine

    checked = read(workflow, overrides, output)
    held, note = earlier.find(checked, reuse, fresh) if reuse else (None, "")
    if note and not quiet:
        err.print(plain(note), markup=False)

    def start(progress, resume_command):
        return engine.run(
            checked, workers, scheduler, fresh, progress, resume_command, block_timeout, held
        )

    return _carry_out(checked, quiet, start)


@program.command()
@click.argument("workflow", type=WORKFLOW)
@click.option(
    "-o",
    "--output",
    metavar="OUT.nc",
    help="The netCDF file; by default the workflow's output.path with _proved added.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a key: refine.width=0.01.",
)
@click.option("--fresh", is_flag=True, help="Delete the results of an earlier, interrupted run.")
@click.option("--quiet", is_flag=True, help="No progress and no closing lines.")
def prove(workflow, output, overrides, fresh, quiet):
    """Prove the cells of a map, or the edges along one axis; OUT.cert is what `survey-check`
    verifies by itself.
    """
    from dataclasses import replace

    from survey.request.workflow import read
    from survey.sweep import engine, proofs

    checked = read(workflow, overrides, output, proves=True)
    if output is None:
        checked = replace(checked, path=checked.path.with_stem(f"{checked.path.stem}_proved"))
    proofs.equation_of(checked)  # refuses what cannot be proved
    certificate = checked.path.with_suffix(".cert")
    code = _carry_out(
        checked, quiet, lambda *more: engine.run(checked, None, None, fresh, *more), [certificate]
    )
    if not quiet:
        err.print(f"verify it, also on another machine: survey-check {certificate}", markup=False)
    return code


@program.command()
@click.argument("workflow", type=WORKFLOW)
@click.option(
    "-o",
    "--output",
    metavar="OUT.model",
    help="The model file; by default beside the output, with the suffix .model.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a key: solver.rtol=1e-12.",
)
@click.option(
    "--proof",
    metavar="PROVED.nc",
    help="The proof of this map (from survey prove), which the model then carries.",
)
def model(workflow, output, overrides, proof):
    """Write the map's series, which answer anywhere with error bars: survey.Model reads them, with
    numpy alone.
    """
    from pathlib import Path

    from survey import api
    from survey.file.disk import check_folder
    from survey.model import build, proved
    from survey.request.workflow import read
    from survey.sweep.progress import Progress

    if output is not None:
        check_folder(output, ".model")
    # with -o nothing is written where the workflow's output would be
    checked = read(workflow, overrides, None if output is None else Path(output).with_suffix(".nc"))
    path = output or str(checked.path.with_suffix(".model"))
    proof = proved.matching(api.open(proof), checked) if proof else None
    with Progress(err, checked) as progress:
        size = build.model(checked, path, proof, progress)
    err.print(
        plain(f"wrote {path} ({size:,} bytes); in Python: survey.Model({path!r})"), markup=False
    )
    out.print(plain(path), markup=False)


@program.command()
@click.argument("workflow", type=WORKFLOW)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a key, such as axes.k.num=40.",
)
@click.option(
    "-o",
    "--output",
    metavar="OUT.nc",
    help="The netCDF file, instead of the workflow's output.path.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def plan(workflow, overrides, output, as_json):
    """Points, blocks, size, method and estimated time, by the runs on this machine so far; nothing
    is solved.
    """
    from survey.request.workflow import read
    from survey.sweep import plan

    planned = plan.plan(read(workflow, overrides, output))
    # of which the size and the time are the words
    numbers = () if as_json else ("bytes", "estimated_seconds")
    _show({key: value for key, value in planned.items() if key not in numbers}, as_json)


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option(
    "--points", type=click.IntRange(0), default=20, show_default=True, help="Points to solve again."
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Seed of the random points.",
)
@click.option("--trust-scene", is_flag=True, help=TRUST)
def verify(path, points, seed, trust_scene):
    """Check digest, completeness and counts; solve N random points again by another method. Bundles too."""
    from survey.share import bundle

    if not bundle.is_bundle(path):
        return _verify(path, points, seed, trust_scene)
    with bundle.unpacked(path) as folder:
        complaints, data = bundle.complaints(folder)
        for complaint in complaints:
            complain(f"{path}: {complaint}", 3)
        if complaints:
            return 3
        out.print(plain(f"{path}: all files are those that the bundle lists"), markup=False)
        return _verify(str(data), points, seed, trust_scene)


def _verify(path, points, seed, trust_scene):
    """Verify one netCDF file; the exit code."""
    from survey.file import reading
    from survey.request import trust

    ds = reading.load(path)
    complaints = reading.check(path, ds)
    for complaint in complaints:
        complain(complaint, 3)
    if complaints != reading.undigested(path):
        return 3
    if trust_scene:
        trust.allow(ds.attrs.get("scene_hash", ""))
    result = f"{path}: {'sound except for the digest' if complaints else 'sound'}; "
    try:
        report = _audit(ds, points, seed)
    except BadInput:
        out.print(plain(f"{result}no points were solved again"), markup=False)
        raise
    for complaint in report["complaints"]:
        complain(f"{path}: {complaint}", 3)
    if not report["complaints"]:
        out.print(plain(result + _audited(report)), markup=False)
    return 3 if complaints or report["complaints"] else 0


def _audit(ds, points, seed):
    """`audit`; if the scene is untrusted, after the user has allowed it in the terminal."""
    from survey.analysis.audit import audit
    from survey.request import trust

    try:
        return audit(ds, points, seed)
    except Untrusted as untrusted:
        if not _may_run(untrusted):
            raise
        trust.allow(untrusted.digest)
        return audit(ds, points, seed)


def _may_run(untrusted):
    """Ask in the terminal, if there is one, whether an untrusted scene may run."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    what = f"The scene of this survey is a Python file that you have not run here before: {untrusted.path}"
    for line in (
        what,
        f"sha256 {untrusted.digest}",
        f"Read it first: {untrusted.reading(untrusted.path)}",
    ):
        err.print(plain(line), markup=False)
    return click.confirm("It can do anything that you can do. Run it?", default=False, err=True)


def _audited(report):
    """What an audit without complaints has done."""
    parts = {"point": report["points"], "edge": report["edges"], "cell": report["cells"]}
    numbers = [counted(number, noun) for noun, number in parts.items() if number]
    vertices = report["vertices"]
    numbers += [f"{vertices} vertices" if vertices > 1 else "1 vertex"] if vertices else []
    silent = f" (no answer at {counted(report['silent'], 'other')})" if report["silent"] else ""
    if not numbers:
        return "no points were solved again"
    return f"{', '.join(numbers)} solved again by {report['method']}{silent}, all within the error bars"


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def info(path, as_json):
    """Contents of the file: axes, variables, counts, provenance; and what an unfinished run has
    left beside it.
    """
    from survey.file import reading, unfinished
    from survey.file.summary import summary  # without the engine, which takes a second to import

    left = unfinished.summary(path)
    table = summary(reading.load(path)) if os.path.exists(path) or not left else {}
    if as_json:
        return _show(table | ({"unfinished": left} if left else {}), True)
    if left:
        out.print(plain(unfinished.sentence(left)), markup=False)
    if table:
        _show(table, False)


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option(
    "-o",
    "--output",
    metavar="OUT.png",
    help="The picture, .png, .pdf or .svg; by default beside the file.",
)
@click.option("--var", metavar="NAME", help="The variable; by default the verdict.")
@click.option(
    "--style", type=click.Choice(["screen", "paper"]), default="screen", help="paper: PDF, hatched."
)
@click.option(
    "--width",
    type=click.Choice(["single", "double"]),
    default="single",
    help="Column width, for style paper.",
)
@click.option(
    "--at",
    metavar="NAME=VALUE",
    multiple=True,
    help="Draw this plane, row or well instead of the first (the last angle of Abel's equation).",
)
def plot(path, output, var, style, width, at):
    """Draw the stability map, or the named variable."""
    from pathlib import Path

    from survey import api
    from survey.analysis.point import plane
    from survey.show import figures

    if width != "single" and style != "paper":
        raise BadInput(f"--width {width} applies only to --style paper; give both, or neither")
    if output and (os.path.isdir(output) or not os.path.splitext(output)[1]):
        raise BadInput(f"-o {shown(output)}: name a .png, .pdf or .svg file, such as map.png")
    ds = plane(api.open(path), dict(part.partition("=")[::2] for part in at))
    suffix = ".pdf" if style == "paper" else ".png"
    target = Path(output or f"{path.removesuffix('.nc')}{f'_{var}' if var else ''}{suffix}")
    try:
        left_out = figures.save(ds, target, var, style, width)
    except BadInput:
        raise
    except (OSError, ValueError) as error:
        raise BadInput(
            f"{target}: the picture cannot be written ({reason_of(error)}); name a .png, .pdf or .svg file with -o"
        ) from None
    out.print(plain(str(target)), markup=False)
    if left_out:
        err.print(left_out, markup=False)


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option("-o", "--output", metavar="OUT.html", help="The page; by default beside the file.")
@click.option(
    "--at", metavar="NAME=VALUE", multiple=True, help="Show this plane of a map with more axes."
)
@click.option("--trust-scene", is_flag=True, help=TRUST)
def share(path, output, at, trust_scene):
    """Write the map as one HTML file that opens anywhere, offline: zoom without end, values with
    error bars.
    """
    from pathlib import Path
    from types import SimpleNamespace

    from survey import api
    from survey.share import page
    from survey.sweep.progress import Progress

    ds = api.open(path, trust_scene=trust_scene)
    target = output or f"{path.removesuffix('.nc')}.html"
    with Progress(err, SimpleNamespace(name=Path(path).stem, scene=None)) as progress:
        written = page.write(ds, target, dict(part.partition("=")[::2] for part in at), progress)
    how = (
        "drawn from series, sharp at every scale"
        if written["series"]
        else f"of points: {written['why']}"
    )
    err.print(plain(f"{target}: {written['bytes']:,} bytes, {how}"), markup=False)
    if written["plane"]:
        plane = ", ".join(f"{name} = {value}" for name, value in written["plane"].items())
        err.print(plain(f"the page shows the plane {plane}; --at chooses another"), markup=False)
    if written["left_out"]:
        err.print(written["left_out"], markup=False)
    out.print(plain(target), markup=False)


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option(
    "-o",
    "--output",
    metavar="OUT.zip",
    help="The .zip file or folder; by default OUT.zip beside the file.",
)
@click.option("--author", default="", metavar="NAME", help="Who computed it, for the description.")
@click.option(
    "--license", "license_url", default="", metavar="URL", help="The licence of the data."
)
def bundle(path, output, author, license_url):
    """Write a folder or zip for an archive: data, workflow, scene, pictures, versions, RO-Crate;
    `verify` checks it.
    """
    from survey.share import bundle as bundles

    target = output or f"{path.removesuffix('.nc')}.zip"
    files = bundles.write(path, target, author, license_url)
    err.print(plain(f"{target}: {counted(len(files), 'file')}; check it with: survey verify {shlex.quote(target)}"),
              markup=False)  # fmt: skip
    out.print(plain(target), markup=False)


@program.command()
@click.argument("paths", metavar="A.nc B.nc...", nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    metavar="C.nc",
    required=True,
    help="The netCDF file to write; it must not exist.",
)
def merge(paths, output):
    """Join surveys that differ in the values of one axis, or in one fixed parameter, into one file."""
    from survey.analysis import join

    joined, left_out = join.merge(paths, output)
    of_parts = f"; {left_out}" if left_out else ""
    err.print(
        plain(f"{output}: {counted(joined.status.size, 'point')} of {len(paths)} files{of_parts}"),
        markup=False,
    )
    out.print(plain(str(output)), markup=False)


@program.command()
@click.argument("path", metavar="OUT.nc")
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=5006,
    show_default=True,
    help="0 for any free port.",
)
@click.option("--link", default="", help="The address of an earlier view, to open it again.")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
@click.option("--trust-scene", is_flag=True, help=TRUST)
def view(path, port, link, no_browser, trust_scene):
    """Show the map in the browser, on this machine only: zoom, values with error bars, the motion
    at a point.
    """
    from survey.viewer.server import serve

    serve(
        path,
        port,
        link,
        lambda line: err.print(plain(line), markup=False),
        not no_browser,
        trust_scene,
    )


@program.command()
@click.argument("name", required=False, shell_complete=_scene_names)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def scenes(name, as_json):
    """List the scenes; or show one scene's equations, parameters, outputs and sources."""
    if name is None:
        import survey.scenes

        return _show(survey.scenes(), as_json)
    from survey import api

    if as_json:
        _show(api.scene(name), True)
    else:
        _describe(api.scene(name))


@program.command()
@click.argument("scene", shell_complete=_scene_names)
@click.option(
    "--peers", is_flag=True, help="Also measure the best other programs that are installed."
)
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    default=".",
    show_default=True,
    help="Folder for CSV, JSON and PNG.",
)
def precision(scene, peers, output):
    """The work-precision chart: error against time for every method that applies."""
    from survey.precision import write

    for path in write(scene, output, peers, say=lambda line: err.print(line, markup=False)):
        out.print(str(path), markup=False)


@program.command()
@click.argument("scene", shell_complete=_scene_names)
@click.option(
    "--share",
    type=float,
    default=1.0,
    metavar="S",
    help="Fraction of the points along each axis; below 1 is coarser.",
)
@click.option(
    "-o",
    "--output",
    metavar="DIR",
    default=".",
    show_default=True,
    help="Folder for JSON, page and PNG.",
)
def failures(scene, share, output):
    """Where each method fails: its true error and its error bar over the planes on which it is
    expected to fail.
    """
    from survey.failures import write

    for path in write(scene, output, share, say=lambda line: err.print(plain(line), markup=False)):
        out.print(str(path), markup=False)


def _show(table, as_json):
    """A mapping as JSON or as two columns."""
    if as_json:
        return click.echo(json.dumps(table, indent=1, default=str).replace("\x7f", "\\u007f"))
    grid = Table.grid(padding=(0, 2))
    for key, value in _rows(table):
        grid.add_row(Text(plain(key)), Text(plain(value, CELL, lines=True)))
    out.print(grid, markup=False)


def _rows(table, prefix=""):
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _rows(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", str(value).rstrip()


def _describe(scene):
    """Print everything about a scene."""
    click.echo(f"{scene['name']}: {scene['title']}\n\n{scene['about']}\n")
    for heading in ("parameters", "options", "outputs", "status", "methods", "references"):
        if not scene[heading]:
            continue
        click.echo(f"{heading}:")
        rows = (
            scene[heading]
            if isinstance(scene[heading], dict)
            else {item: "" for item in scene[heading]}
        )
        width = max(map(len, rows))
        for key, text in rows.items():
            click.echo(f"  {key:<{width}}  {text}".rstrip())
        click.echo()


def _carry_out(checked, quiet, start, further=()):
    """Run the engine by `start(progress, resume_command)`, draw, and say what was written; the exit
    code.

    `further`: paths of other files that it writes.
    """
    from survey.sweep.progress import Progress

    finished = None
    resume_command = shlex.join(["survey", *(word for word in sys.argv[1:] if word != "--fresh")])
    _stop_on_sigterm()
    try:
        with Progress(err, checked, silent=quiet) as progress:
            finished = start(progress, resume_command)
            pictures = _draw(checked)
    except KeyboardInterrupt as stop:
        # the semaphores they hold would be reported as leaked
        traceback.clear_frames(stop.__traceback__)
        _end_interrupted(stop.args[0] if stop.args else 130, checked.path, finished, resume_command)
    if not quiet:
        _summarise(finished, [checked.path, *further, *pictures])
    return 1 if _failed(finished) else 0


def _draw(workflow):
    """Draw the figures of a finished run; their paths."""
    if not workflow.figures:
        return []
    from survey import api

    return api.draw(api.open(workflow.path), workflow)


def _summarise(finished, paths):
    """Print the files written, the counts, and the times."""
    if finished.already_complete:
        err.print(f"{paths.pop(0)}: already complete; nothing was computed", markup=False)
    for path in paths:
        err.print(f"wrote {path}", markup=False)
    attributes = finished.attributes
    for key in ("verdict_counts", "status_counts", "areas"):
        if key in attributes:
            err.print(f"{key.removesuffix('_counts')}: {attributes[key]}", markup=False)
    if attributes["accuracy_missed"]:
        missed = attributes["accuracy_missed"]
        verb = "has" if missed == 1 else "have"
        err.print(f"accuracy_missed: {counted(missed, 'point')} {verb} an error bar above rtol")
    if attributes.get("edge_incomplete_rows"):
        rows = counted(attributes["edge_incomplete_rows"], "row")
        err.print(f"edges: {rows} may have more than were found (edge_complete = 0)")
    if attributes.get("curves_lost"):
        curves = counted(attributes["curves_lost"], "curve")
        err.print(f"edges: {curves} could not be followed to the map's border (curve_complete = 0)")
    if attributes.get("surfaces_left_out"):
        lost = counted(attributes["surfaces_left_out"], "triangle")
        err.print(f"surfaces: {lost} with an uncertain corner left out (at edges and tips)")
    if attributes.get("surfaces_unexplained"):
        lost = counted(attributes["surfaces_unexplained"], "edge")
        err.print(
            f"surfaces: a surface is missing on {lost} of the lattice that is searched "
            "(surfaces_unexplained), as where two pairs of multipliers pass together"
        )
    if attributes.get("curves_unexplained"):
        segments = counted(attributes["curves_unexplained"], "segment")
        err.print(
            f"edges: a curve is missing on {segments} of lines across the map (curves_unexplained)"
        )
    if "edge_left_out" in attributes:
        err.print(
            f"edges: not searched for {attributes['edge_left_out']}, where they accumulate",
            markup=False,
        )
    if finished.already_complete:
        return
    times = {
        "compiling": finished.compiling,
        "kernels": finished.computing,
        "file": finished.writing,
    }
    times |= {"edges and cells": finished.edges_and_cells} if finished.edges_and_cells else {}
    err.print(", ".join(f"{name} {seconds:.1f} s" for name, seconds in times.items()))


def _end_interrupted(code, path, finished, resume_command):
    """Say what is safe and how to resume (`finished`: only the pictures are missing), and end the
    process at once.

    Threads inside a kernel cannot be interrupted, and there is no need to wait for them.
    """
    from survey.file import unfinished

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    done, blocks = unfinished.finished(path)
    state = (
        f"finished blocks are safe: {done:,} of {blocks:,}" if done else "no block was finished yet"
    )
    state += f"; resume with: {resume_command}"
    if finished:
        state = f"{path} is complete, but its pictures are not; draw them with: survey plot {path}"
    complain(f"interrupted; {state}", code)
    sys.stderr.flush()
    os._exit(code)


def _failed(finished):
    """The number of points that failed."""
    from survey import status

    failures = [name for name, code in status.CODES.items() if code in status.FAILURES]
    return sum(finished.counts["status"].get(name, 0) for name in failures)


def _stop_on_sigterm():
    """SIGTERM ends the run as Ctrl-C does, with exit code 143."""

    def stop(*_):
        raise KeyboardInterrupt(143)

    signal.signal(signal.SIGTERM, stop)
