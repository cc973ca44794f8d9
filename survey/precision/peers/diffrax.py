"""diffrax's Dopri8 in double precision, compiled by jax: vectorised over 300 points, then over all
such batches.

Measured: smaller batches cost more per point, a single `vmap` waits for its slowest point; Tsit5
takes longer for the same error wherever that is below 1e-2.
"""

import os
from functools import cache, partial

# one thread: XLA reads this when it starts
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import diffrax
import jax
import numpy as np

from survey.precision.peers import batches

POINTS = 600
LANES = 300
# beyond, a solution is lost: one that has slipped past a pole takes ever smaller steps
MOST_STEPS = 10_000

jax.config.update("jax_enable_x64", True)


def integrate(system, rtol):
    order = batches(system, LANES)
    start, parameters = (list(values.T[:, order]) for values in (system.start, system.parameters))
    shares = None if system.samples is None else tuple(system.samples)
    reached = np.asarray(
        _compiled(system.slope, shares)(start, parameters, system.span[order], rtol)
    )
    states = np.empty((len(system.start), reached.shape[-1], system.start.shape[1]))
    states[order] = reached.transpose(1, 2, 3, 0)
    return states[:, 0] if shares is None else states


@cache
def _compiled(slope, shares):
    def field(_, state, parameters):
        return list(slope(state, parameters, jax.numpy.sin, jax.numpy.cos))

    def one(start, parameters, span, rtol):
        solved = diffrax.diffeqsolve(
            diffrax.ODETerm(field), diffrax.Dopri8(), 0.0, span, None, start,
            args=parameters, stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol),
            saveat=diffrax.SaveAt(t1=True) if shares is None else diffrax.SaveAt(ts=jax.numpy.array(shares) * span),
            max_steps=MOST_STEPS, throw=False,
        )  # fmt: skip
        return solved.ys

    @jax.jit
    def run(start, parameters, span, rtol):
        batch = jax.vmap(partial(one, rtol=rtol))
        return jax.numpy.stack(
            jax.lax.map(lambda points: batch(*points), (start, parameters, span))
        )

    return run
