"""What a job is to do, its units of work, and what came of a unit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import gough
from gough.checks import as_whole
from gough.errors import GoughError
from gough.files.formats import FilePart
from gough.files.rows import Reading
from gough.files.stores import Place
from gough.platform import Platform
from gough.platform_file import from_toml
from gough.seeds.network import NETWORK, read

SHARD_ROWS = 1_000_000  # rows of a part
Command = Literal["solve", "inverse", "modes"]
# one thread a unit, whatever the engine: it does not change the result
NEUTRAL = ("workers", "progress", "head")


@dataclass(frozen=True)
class Job:
    """Settings that all units of a job share; plain data, which any engine can send.

    Make one with `Job.of`.

    Attributes:
        command: "solve", "inverse" or "modes".
        platform: text of the machine's TOML file.
        out: folder to write to.
        reading: options for reading files.
        options: arguments of `gough.files.solve_file` or `inverse_file`.
        ending: of all outputs; "" for that of the input, .csv for any text.
        shard_rows: largest number of rows of a unit, as far as row groups allow it.
        network: SHA-256 of the network that the seed names by its path; "" for other seeds.
        version: of gough.
    """

    command: Command
    platform: str
    out: Place
    reading: Reading = Reading()
    options: Mapping[str, Any] = field(default_factory=dict)
    ending: str = ""
    shard_rows: int = SHARD_ROWS
    network: str = ""
    version: str = ""

    @classmethod
    def of(
        cls,
        command: Command,
        platform: Platform,
        out: str | Path,
        *,
        reading: Reading = Reading(),
        ending: str = "",
        shard_rows: int = SHARD_ROWS,
        **options: Any,
    ) -> Job:
        """Check the settings, and take down all that the outputs depend on.

        Raises:
            GoughError: an option out of range, an unknown seed or frame, a store that cannot be
                used.
        """
        as_whole("shard_rows", shard_rows, low=1)
        if ending not in ("", ".csv", ".parquet"):
            raise GoughError(f"ending: expected .csv or .parquet, found {ending!r}")
        options = {k: v for k, v in options.items() if k not in NEUTRAL}
        network, seed = "", options.get("seed", "auto")
        if not isinstance(seed, str):
            raise GoughError("seed: expected a name or a path; a job cannot send an object")
        if command == "solve":
            from gough.fk.solve import Solver

            frame = options.get("frame")
            Solver(platform, seed, frame=frame, **_solver_settings(options))
            if seed and Path(seed).exists():
                path = Path(seed).absolute()  # a worker may stand in another folder
                file = path / NETWORK if path.is_dir() else path
                network, options["seed"] = hashlib.sha256(read(file)).hexdigest(), str(path)
        elif options.get("frame"):
            platform.frame(options["frame"])
        return cls(
            command, platform.to_toml(), Place.of(out), reading, options, ending, shard_rows,
            network, gough.__version__,
        )  # fmt: skip

    @cached_property
    def facts(self) -> dict[str, Any]:
        """All that an output depends on beside its input, as plain data; defaults left out."""
        options = dict(self.options)
        if self.network:
            options["seed"] = f"network {self.network[:16]}"
        found = {
            "command": self.command,
            "gough": self.version,
            "platform": hashlib.sha256(self.platform.encode()).hexdigest()[:16],
            **options,
            **asdict(self.reading),
        }
        found |= found.pop("log")
        # 0 is a value, though it equals False
        found = {n: v for n, v in found.items() if v not in (None, "", ()) and v is not False}
        return json.loads(json.dumps(found, sort_keys=True))

    @cached_property
    def machine(self) -> Platform:
        """The platform."""
        return from_toml(self.platform)


def _solver_settings(options: Mapping[str, Any]) -> dict[str, Any]:
    names = ("tolerance", "max_iterations", "restarts", "singular")
    return {name: options[name] for name in names if name in options}


@dataclass(frozen=True)
class Unit:
    """One output file to make.

    Attributes:
        source: the input file, or some of its rows.
        name: the output's name below the job's folder, with / between folders.
        size: bytes of the input file, or its share of them for a part.
        changed: when the input was last changed [ns since 1970].
        input: name of the input below the folder it was found in.
        part: number of the part from 1, and how many there are; (1, 1) for a whole file.
    """

    source: FilePart
    name: str
    size: int
    changed: int
    input: str
    part: tuple[int, int] = (1, 1)

    @property
    def facts(self) -> dict[str, Any]:
        """What identifies the input: name, size, time of change, part."""
        part = {} if self.part == (1, 1) else {"part": list(self.part)}
        stop = {} if self.source.stop is None else {"span": [self.source.start, self.source.stop]}
        return {"input": self.input, "size": self.size, "changed": self.changed, **part, **stop}


@dataclass(frozen=True)
class Made:
    """What came of a unit.

    Attributes:
        unit: the unit.
        counts: rows by the label of their status.
        failures: rows without a usable result.
        error: why there is no output; "" where there is.
        skipped: the output was there already.
        notes: what a user should know of the input: how it was read, the first invalid rows.
        seconds: time taken.
    """

    unit: Unit
    counts: dict[str, int] = field(default_factory=dict)
    failures: int = 0
    error: str = ""
    skipped: bool = False
    notes: tuple[str, ...] = ()
    seconds: float = 0.0

    @property
    def rows(self) -> int:
        """Number of rows."""
        return sum(self.counts.values())
