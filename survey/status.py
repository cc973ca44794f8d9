"""Why a point has no answer: one code, one sentence. A scene adds its own from code 16 on (its `STATUS`)."""

SENTENCES = {
    "ok": "every output that applies to the point is finite",
    "invalid_parameters": "the parameters lie outside the scene's domain: see `survey scenes` with its name",
    "overflow": "a value exceeds the range of binary64, or its error bar that of float32: the solution grows too fast",
    "no_convergence": "the iteration did not converge: try another method or a larger rtol",
    "step_limit": "the maximum number of steps was reached: try a larger rtol or another method",
    "worker_died": "workers died repeatedly while solving this block: run the command again",
    "pending": "not computed yet: run the command again to finish",
}
CODES = {name: code for code, name in enumerate(SENTENCES)}
OK, INVALID_PARAMETERS, OVERFLOW, NO_CONVERGENCE, STEP_LIMIT, WORKER_DIED, PENDING = CODES.values()
FIRST_OF_SCENE = 16
FAILURES = frozenset({OVERFLOW, NO_CONVERGENCE, STEP_LIMIT, WORKER_DIED, PENDING})
UNANSWERED = FAILURES | {INVALID_PARAMETERS}


def table(scene):
    """All codes that `scene` (a module of `survey.scenes`) may return: {name: (code, sentence)}.

    A scene's STATUS holds its own codes, and may reword the sentence of a common one.
    """
    given = getattr(scene, "STATUS", {})
    own = [name for name in given if name not in CODES]
    codes = CODES | {name: FIRST_OF_SCENE + i for i, name in enumerate(own)}
    return {name: (code, (SENTENCES | given)[name]) for name, code in codes.items()}
