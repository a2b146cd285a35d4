"""What became of a job: rows by status, files made, skipped and failed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gough.jobs.job import Job, Made
from gough.status import InverseStatus, ModesStatus, Outcome, Status

MOST_NOTES = 1_000
OUTCOMES: dict[str, type[Outcome]] = {
    "solve": Status,
    "inverse": InverseStatus,
    "modes": ModesStatus,
}


@dataclass
class Summary:
    """Counts over all outputs of a job, those of earlier runs too.

    Attributes:
        job: what was done.
        total: number of outputs there should be.
        made, skipped: number of outputs made by this run, and by earlier ones.
        failed: input and reason of each output that could not be made.
        counts: rows by the label of their status.
        unusable: rows without a usable result.
        notes: what a user should know of inputs, and of how many; the first thousand.
        seconds: time taken by this run.
        rows_made: rows of the outputs made by this run.
        skipped_bytes: size of the inputs whose outputs were there.
    """

    job: Job
    total: int
    made: int = 0
    skipped: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    counts: dict[str, int] = field(default_factory=dict)
    unusable: int = 0
    notes: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    rows_made: int = 0
    skipped_bytes: int = 0

    def add(self, made: Made) -> None:
        """Count a unit."""
        if made.error:
            self.failed.append((_label(made), made.error))
            return
        self.made += not made.skipped
        self.skipped += made.skipped
        self.rows_made += 0 if made.skipped else made.rows
        self.skipped_bytes += made.unit.size if made.skipped else 0
        self.unusable += made.failures
        for label, count in made.counts.items():
            self.counts[label] = self.counts.get(label, 0) + count
        for text in made.notes:
            if text in self.notes or len(self.notes) < MOST_NOTES:
                self.notes[text] = self.notes.get(text, 0) + 1

    @property
    def rows(self) -> int:
        """Number of rows of all outputs."""
        return sum(self.counts.values())

    @property
    def outcomes(self) -> list[Outcome]:
        """The statuses that rows have."""
        return [one for one in OUTCOMES[self.job.command] if self.counts.get(one.label)]

    def facts(self) -> dict[str, Any]:
        """The summary as plain data."""
        return {
            "command": self.job.command,
            "platform": self.job.machine.name,
            "version": self.job.version,
            "rows": self.rows,
            "usable": self.rows - self.unusable,
            "seconds": self.seconds,
            "statuses": {
                one.label: {"rows": self.counts[one.label], "text": one.text}
                for one in self.outcomes
            },
            "outputs": {
                "total": self.total,
                "made": self.made,
                "skipped": self.skipped,
                "failed": len(self.failed),
            },
            "failed": [{"input": name, "reason": why} for name, why in self.failed],
            "notes": self.notes,
        }


def _label(made: Made) -> str:
    number, count = made.unit.part
    return made.unit.input + (f" (part {number} of {count})" if count > 1 else "")
