"""A job on the command line, killed with all its processes again and again, and what is left."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path


def kill_and_go_on(
    arguments: Sequence[str], out: Path, kills: int, longest: float, seed: int = 0
) -> dict[str, int]:
    """Start a command `kills` times and kill it at random moments, then let it end.

    Args:
        arguments: of `gough`.
        out: the folder that it writes to.
        kills: number of runs that are killed with SIGKILL.
        longest: [s] from the start of a run to its kill at most.
        seed: of the random moments.

    Returns:
        `killed`: runs that were killed before they ended; `kept`: finished outputs that a later
        run found; `made_again`: those of them that did not stay as they were; `partial`: unfinished
        files after the last run; `code`: its exit code.
    """
    draw, finished, facts = random.Random(seed), {}, {"killed": 0, "kept": 0, "made_again": 0}
    command = [sys.executable, "-m", "gough.cli", *arguments]
    for _ in range(kills):
        run = subprocess.Popen(
            command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(draw.uniform(0, longest))
        facts["killed"] += run.poll() is None
        with_all = os.getpgid(run.pid) if run.poll() is None else 0
        if with_all:
            os.killpg(with_all, signal.SIGKILL)
        run.wait()
        now = _outputs(out)
        facts["kept"] += len(finished)
        facts["made_again"] += sum(now.get(name) != stamp for name, stamp in finished.items())
        finished = now
    done = subprocess.run(command, check=False, capture_output=True)
    now = _outputs(out)
    facts["made_again"] += sum(now.get(name) != stamp for name, stamp in finished.items())
    facts["kept"] += len(finished)
    facts["partial"] = len([*out.rglob("*.partial")])
    return facts | {"code": done.returncode}


def _outputs(out: Path) -> dict[str, tuple[int, int]]:
    """Inode and time of change of each finished output."""
    files = [path for path in out.rglob("*.parquet") if "_gough" not in path.parts]
    return {str(path): (path.stat().st_ino, path.stat().st_mtime_ns) for path in files}
