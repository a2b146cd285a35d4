"""Give gough damaged files and hostile options, and judge its answers independently.

    python tools/fuzz.py --seconds 60
    python tools/fuzz.py --inputs 100000 --targets toml csv
    python tools/fuzz.py --targets csv --first 4711 --inputs 1      # one input again

Input number N of a target is the same in every run. Printed are the inputs tried, those accepted
and refused, tracebacks (exceptions that are no GoughError, warnings, messages of several lines) and
answers called good that are not: `fuzzing.judge` calculates their residuals from the joints in the
machine's file. Exit code 1 if there was any of these.
"""

from __future__ import annotations

import argparse
import logging
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from fuzzing.targets import TARGETS

from gough.errors import GoughError

SHOWN = 5  # findings of each target that are printed in full
PATIENCE = 20.0  # [s] of processor time that one input may take


@dataclass
class Tally:
    """Counts of one target, and its findings."""

    counts: Counter[str] = field(default_factory=Counter)
    findings: list[str] = field(default_factory=list)
    seconds: float = 0.0


def fuzz(
    names: list[str], *, inputs: int | None, seconds: float, first: int = 0
) -> dict[str, Tally]:
    """Try inputs of the targets in turn, by their shares, until one of the limits is met."""
    logging.getLogger("gough").addHandler(logging.NullHandler())
    logging.getLogger("gough").propagate = False
    tallies = {name: Tally() for name in names}
    with tempfile.TemporaryDirectory(dir=_memory()) as folder, warnings.catch_warnings():
        warnings.simplefilter("error")
        targets = {name: TARGETS[name](Path(folder)) for name in names}
        order = [name for name in names for _ in range(TARGETS[name].share)]
        random.Random(1).shuffle(order)
        begin, tried = time.monotonic(), 0
        while time.monotonic() - begin < seconds and (inputs is None or tried < inputs):
            name = order[tried % len(order)]
            number = first + sum(tallies[name].counts.values())
            _try(name, number, targets[name], tallies[name])
            tried += 1
    return tallies


def _try(name: str, number: int, target, tally: Tally) -> None:
    begin = time.process_time()
    try:
        outcome = target(random.Random(f"{name} {number}"))
    except GoughError as error:
        several = "\n" in str(error)
        outcome = f"WRONG: several lines: {str(error)!r:.300}" if several else "refused"
    except Exception:
        outcome = f"TRACEBACK {traceback.format_exc(limit=-6)}"
    took = time.process_time() - begin
    tally.seconds += took
    if took > PATIENCE and tally.counts:  # the first input compiles
        outcome = f"WRONG: took {took:.0f} s"
    kind = outcome.partition(" ")[0].rstrip(":")
    tally.counts[kind] += 1
    if kind in ("WRONG", "TRACEBACK"):
        tally.findings.append(f"{name} {number}: {outcome}")


def _memory() -> str | None:
    """A folder in memory, where the system has one."""
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


def report(tallies: dict[str, Tally]) -> int:
    """Print the counts and the first findings; return the number of findings."""
    print("target        inputs  accepted   refused  tracebacks  wrong   seconds")
    total: Counter[str] = Counter()
    for name, tally in tallies.items():
        total += tally.counts
        print(_line(name, tally.counts, tally.seconds))
    print(_line("all", total, sum(tally.seconds for tally in tallies.values())))
    for tally in tallies.values():
        for finding in tally.findings[:SHOWN]:
            print(f"\n{finding}")
    return total["WRONG"] + total["TRACEBACK"]


def _line(name: str, counts: Counter[str], seconds: float) -> str:
    columns = [counts[kind] for kind in ("accepted", "refused", "TRACEBACK", "WRONG")]
    values = [sum(counts.values()), *columns]
    widths = (8, 10, 10, 12, 7)
    numbers = "".join(f"{value:{width},d}" for value, width in zip(values, widths, strict=True))
    return f"{name:<12}{numbers}{seconds:10.1f}"


def main() -> None:
    """Parse the options, try the inputs and print what was found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seconds", type=float, default=float("inf"))
    parser.add_argument("--inputs", type=int)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--targets", nargs="+", choices=list(TARGETS), default=list(TARGETS))
    options = parser.parse_args()
    if options.inputs is None and options.seconds == float("inf"):
        parser.error("give --seconds or --inputs")
    found = fuzz(
        options.targets, inputs=options.inputs, seconds=options.seconds, first=options.first
    )
    sys.exit(1 if report(found) else 0)


if __name__ == "__main__":
    main()
