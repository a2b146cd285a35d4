"""The paper's own recipe: errors on held-out poses over the epochs of runs that follow it.

gough train -p reference -o runs/paper-disgnet paper                    # 120,000 steps: hours
gough train -p reference -o runs/paper-plain-mlp paper --model.kind plain-mlp
python benchmarks/recipe.py                                             # however far they are

prints both beside the paper's figures after 1,200 epochs, and writes docs/figures/recipe.json, from
which `python docs/figures/draw.py recipe` draws the curves. Errors are of 2,000 held-out poses.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

STEPS = 100  # per epoch: 400,000 rows in batches of 4,000
RUNS = Path("runs")
PAPER = {"disgnet": (1.45, 0.41, 1.14), "plain-mlp": (2.03, 6.13, 36.5)}  # mm, deg, mm
EPOCHS = (1, 3, 10, 30, 60, 100, 200, 400, 800, 1200)


def curve(name: str, runs: Path) -> list[list[float]]:
    """Rows of epoch, E-trans [mm], E-rot [deg], E-ik [mm] of a run, as far as it has come."""
    with (runs / f"paper-{name}" / "metrics.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    numbers = [[float(r[k]) for k in ("step", "trans", "rot_deg", "ik")] for r in rows]
    return [[step / STEPS, *errors] for step, *errors in numbers]


def main(runs: Path) -> None:
    """Print the table and write the numbers of the figure."""
    print("| network | epoch | E-trans mm | E-rot deg | E-ik mm |\n|---|---:|---:|---:|---:|")
    kept: dict[str, dict] = {}
    for name, paper in PAPER.items():
        rows = curve(name, runs)
        shown = {0: rows[-1]} | {e: r for e in EPOCHS for r in rows if r[0] <= e}
        for row in sorted({r[0]: r for r in shown.values()}.values()):
            print(f"| {name} | {row[0]:.0f} | {' | '.join(f'{v:.3g}' for v in row[1:])} |")
        print(f"| {name}, paper | 1200 | {' | '.join(f'{v:.3g}' for v in paper)} |")
        thin = [r for k, r in enumerate(rows) if k % max(1, len(rows) // 120) == 0]
        kept[name] = {"paper": paper, "rows": [[float(f"{v:.4g}") for v in r] for r in thin]}
    for name, paper in PAPER.items():
        below = [next((r[0] for r in curve(name, runs) if r[k + 1] < paper[k]), None)
                 for k in range(3)]  # fmt: skip
        text = ", ".join("not yet" if e is None else f"{e:.0f}" for e in below)
        print(f"\n{name}: below the paper's E-trans, E-rot, E-ik from epoch {text} on (first time)")
    Path("docs/figures/recipe.json").write_text(json.dumps(kept) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
