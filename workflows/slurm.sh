#!/bin/bash
# A sweep on a cluster with SLURM:   sbatch workflows/slurm.sh WORKFLOW.toml [options of survey run]
# One scheduler, as many workers as tasks, all started by dask's own commands. Five minutes before the walltime the run
# stops, its finished blocks safe, and the job is queued again to go on. With TLS: set dask's certificates and
# DASK_DISTRIBUTED__COMM__DEFAULT_SCHEME=tls in the environment, as workflows/docs/overnight.md shows.
#SBATCH --job-name=survey
#SBATCH --ntasks=8
#SBATCH --cpus-per-task=4
#SBATCH --time=08:00:00
#SBATCH --signal=B:TERM@300
#SBATCH --open-mode=append
set -u
for command in dask survey; do
    command -v $command > /dev/null && continue
    echo "slurm.sh: $command is not on PATH: activate the environment with survey[cluster] before sbatch" >&2
    exit 3
done
file=$PWD/scheduler-${SLURM_JOB_ID:-$$}.json

dask scheduler --scheduler-file "$file" --port 0 --no-dashboard & scheduler=$!
srun dask worker --scheduler-file "$file" --nworkers 1 --nthreads "${SLURM_CPUS_PER_TASK:-1}" \
    --local-directory "${TMPDIR:-/tmp}" --no-dashboard & workers=$!
until [ -s "$file" ]; do
    kill -0 $scheduler 2>/dev/null || { echo "slurm.sh: dask's scheduler did not start" >&2; exit 4; }
    sleep 1
done

survey run "$@" --scheduler "$file" & run=$!
trap 'kill -TERM $run' TERM
wait $run; code=$?
while kill -0 $run 2>/dev/null; do wait $run; code=$?; done  # the trap ends the first wait

kill $workers $scheduler 2>/dev/null
wait
rm -f "$file"
[ $code -eq 143 ] && [ -n "${SLURM_JOB_ID:-}" ] && scontrol requeue "$SLURM_JOB_ID"
exit $code
