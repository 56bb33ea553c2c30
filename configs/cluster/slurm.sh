#!/bin/sh
# sbatch configs/cluster/slurm.sh CONFIG.ini [OPTIONS]: lgd-train on four nodes with two ranks each, eight threads a
# rank. The run's folder has to be on a file system that the job's first node sees; the others write nothing.
#SBATCH --job-name=lgd
#SBATCH --nodes=4
#SBATCH --ntasks-per-node=2
#SBATCH --cpus-per-task=8
#SBATCH --time=24:00:00
# Ten minutes before the end every rank is asked to save a checkpoint and stop; the job goes back into the queue.
#SBATCH --signal=TERM@600
#SBATCH --requeue
#SBATCH --open-mode=append
# --resume begins a run where there is none to go on with, if its folder is there.
resume=
if [ "${SLURM_RESTART_COUNT:-0}" -gt 0 ]; then resume=--resume; fi
# Open MPI; for MPICH: --mpi=pmi2
srun --mpi=pmix --cpu-bind=cores build/bin/lgd-train "$@" --threads "$SLURM_CPUS_PER_TASK" $resume
status=$?
# 130: interrupted, with a checkpoint.
if [ $status -eq 130 ]; then scontrol requeue "$SLURM_JOB_ID"; fi
exit $status
