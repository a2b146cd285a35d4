#!/usr/bin/env bash
# A folder of logs on a Slurm cluster: each task of the array makes its share of the files.
#
#     sbatch --export=ALL,LOGS=/scratch/logs,PLATFORM=mine.toml,POSES=/scratch/poses deploy/slurm.sh
#
# A task that was killed, or ran out of time, is given again and goes on where it was.
#SBATCH --job-name=gough
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=1G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --output=gough-%A-%a.log
set -euo pipefail

: "${LOGS:?the folder of logs}" "${PLATFORM:?the platform}" "${POSES:?the folder to write to}"
share="${SLURM_ARRAY_TASK_ID:?run it with sbatch}/${SLURM_ARRAY_TASK_COUNT:?run it with sbatch}"

exec gough solve "$LOGS" -p "$PLATFORM" -o "$POSES" \
  --share "$share" --workers "${SLURM_CPUS_PER_TASK:-1}"
