"""What [boundaries] and [refine] add to the file of a map: edges of tongues and curves, and cells."""

from survey.sweep import boundaries, dispatch, refine


def find(workflow, once, progress=None):
    """The datasets that [boundaries] and [refine] add to the file, their attributes included; `once` as in `Blocks`."""
    found, parts = [], requested(workflow)
    if "edges" in parts:

        def each(task, numbers, what):
            report = (lambda done, _=None: progress(done, len(numbers), 0, what)) if progress else (lambda *_: None)
            dispatch.on_threads(task, numbers, report)

        found.append(parts["edges"].find(workflow, each, once))
    if "cells" in parts:
        found.append(parts["cells"].find(workflow, dispatch.on_threads, once, getattr(progress, "refining", None)))
    return found


def requested(workflow):
    """{"edges", "cells": the module that finds them}, as far as the workflow requests them."""
    tables = {"edges": (boundaries, workflow.boundaries), "cells": (refine, workflow.refine)}
    return {what: module for what, (module, table) in tables.items() if table}
