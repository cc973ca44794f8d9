"""What the file gets beside the map: edges of tongues, and cells."""

from survey.sweep import boundaries, dispatch, refine


def extras(workflow, once, progress=None):
    """Datasets that go into the file beside the map, their attributes with its own; `once` as in `Blocks`."""
    further, parts = [], parts_beside(workflow)
    if "edges" in parts:

        def each(task, numbers, what):
            told = (lambda done, _=None: progress(done, len(numbers), 0, what)) if progress else (lambda *_: None)
            dispatch.on_threads(task, numbers, told)

        further.append(parts["edges"].find(workflow, each, once))
    if "cells" in parts:
        further.append(parts["cells"].find(workflow, dispatch.on_threads, once, getattr(progress, "refining", None)))
    return further


def parts_beside(workflow):
    """{what the file gets beside the map: the module that finds it}."""
    asked = {"edges": (boundaries, workflow.boundaries), "cells": (refine, workflow.refine)}
    return {what: part for what, (part, wanted) in asked.items() if wanted}
