"""What [boundaries] and [refine] add to the file of a map: edges of tongues and curves, surfaces,
and cells.
"""

from survey.sweep import dispatch


def find(workflow, once, progress=None):
    """The datasets that [boundaries] and [refine] add to the file, their attributes included;
    `once` as in `Blocks`.
    """
    found = []
    parts = requested(workflow)
    if "edges" in parts and not (workflow.proves and workflow.refine is None):
        found.append(parts["edges"].find(workflow, on_threads(progress), once))
    if "surfaces" in parts:
        found.append(parts["surfaces"].find(workflow, on_threads(progress), once))
    if workflow.proves:
        from survey.sweep import proofs  # most runs prove nothing

        found.append(proofs.find(workflow, once, progress))
    elif "cells" in parts:
        found.append(
            parts["cells"].find(workflow, on_threads(), once, getattr(progress, "refining", None))
        )
    return found


def on_threads(progress=None):
    """`each` of `survey.measures.tasks` on threads of this process; `progress` is called as each
    task ends.
    """

    def each(task, items, what):
        results = [None] * len(items)

        def solve(number):
            results[number] = task(items[number])

        def report(done, _=None):
            if progress:
                progress(done, len(items), 0, what)

        dispatch.on_threads(solve, range(len(items)), report)
        return results

    return each


def requested(workflow):
    """{"edges", "surfaces", "cells": the module that finds them}, as far as the workflow requests them."""
    modules = {}  # each is loaded where it is wanted: a run without them starts sooner
    if workflow.boundaries:
        from survey.sweep import boundaries

        modules["edges"] = boundaries
    if workflow.surfaces:
        from survey.sweep import surfaces

        modules["surfaces"] = surfaces
    if workflow.refine:
        from survey.sweep import refine

        modules["cells"] = refine
    return modules
