"""What the file gets beside the map: edges of tongues, and cells."""

from survey.sweep import boundaries, dispatch, refine


def extras(workflow, once, progress=None):
    """Datasets that go into the file beside the map, their attributes with its own; `once` as in `Blocks`."""
    further, parts = [], parts_beside(workflow)
    if "edges" in parts:
        further.append(parts["edges"].find(workflow, _on_threads(progress), once))
    if "cells" in parts:
        further.append(parts["cells"].find(workflow, _on_threads(), once, getattr(progress, "refining", None)))
    return further


def _on_threads(progress=None):
    """`each` of `survey.measures.tasks` on threads of this process; `progress` hears of every task that ends."""

    def each(task, items, what):
        results = [None] * len(items)

        def solve(number):
            results[number] = task(items[number])

        def finished(done, _=None):
            if progress:
                progress(done, len(items), 0, what)

        dispatch.on_threads(solve, range(len(items)), finished)
        return results

    return each


def parts_beside(workflow):
    """{what the file gets beside the map: the module that finds it}."""
    asked = {"edges": (boundaries, workflow.boundaries), "cells": (refine, workflow.refine)}
    return {what: part for what, (part, wanted) in asked.items() if wanted}
