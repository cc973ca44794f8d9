"""Why a point has no answer: one code, one sentence. A scene adds its own from 16 on (its `STATUS`)."""

SENTENCES = {
    "ok": "every output that applies to the point is finite",
    "invalid_parameters": "the parameters lie outside the scene's domain: see `survey scenes` with its name",
    "overflow": "a value left the range of binary64, or its bar that of float32 (3.4e38): the solution grows too fast",
    "no_convergence": "the iteration did not converge: try another method or a larger rtol",
    "step_limit": "the step budget was used up: try a larger rtol or another method",
    "worker_died": "the worker that solved this block died more than once: run the command again",
    "pending": "not computed yet: run the command again to finish",
}
CODES = {name: code for code, name in enumerate(SENTENCES)}
OK, INVALID_PARAMETERS, OVERFLOW, NO_CONVERGENCE, STEP_LIMIT, WORKER_DIED, PENDING = CODES.values()
FIRST_OF_SCENE = 16
FAILURES = frozenset({OVERFLOW, NO_CONVERGENCE, STEP_LIMIT, WORKER_DIED, PENDING})
UNANSWERED = FAILURES | {INVALID_PARAMETERS}


def table(scene):
    """All codes that `scene` (a module of `survey.scenes`) may give: {name: (code, sentence)}.

    A scene's STATUS holds its own, and its own sentence for a common one.
    """
    given = getattr(scene, "STATUS", {})
    own = [name for name in given if name not in CODES]
    codes = CODES | {name: FIRST_OF_SCENE + i for i, name in enumerate(own)}
    return {name: (code, (SENTENCES | given)[name]) for name, code in codes.items()}
