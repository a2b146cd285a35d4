"""Make a data set of a calibration: a drawing, planned poses, and what a laser tracker measured.

    python examples/make_calibration_data.py

writes press.toml (the drawing) and press_measured.csv into examples/. The true machine has joints,
zeros and frames of its own; the noise is a tracker's (0.01 mm, 0.002 deg) and an encoder's (0.003
mm). Two poses were spoilt: a target was knocked, and a row was measured while still moving.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import gough
from gough import Platform, Pose, Workspace

HERE = Path(__file__).resolve().parent
RNG = np.random.default_rng(2026)


def drawing() -> Platform:
    """A hexapod of about half a metre, as drawn."""
    pairs = np.radians([-12, 12, 108, 132, 228, 252])
    circle = np.stack([np.cos(pairs), np.sin(pairs), 0 * pairs], axis=-1)
    moving = np.roll(circle @ np.diag([-1.0, -1.0, 1.0]), 3, axis=0)
    base = np.round(280 * circle, 3)
    platform = Platform(
        base, np.round(180 * moving, 3), (0, 0, 380), unit="mm", name="press",
        workspace=Workspace.about_home(40, 12),
    )  # fmt: skip
    return replace(platform, stroke=(330, 480))


def as_built(drawn: Platform) -> Platform:
    """The machine as it is: joints off by 0.3 mm, zeros by 0.2 mm."""
    off = lambda size, *shape: RNG.normal(0, size, shape)  # noqa: E731
    return replace(
        drawn, base=drawn.base + off(0.3, 6, 3), moving=drawn.moving + off(0.3, 6, 3),
        offset=off(0.2, 6), stroke=None,
    )  # fmt: skip


def main() -> None:
    """Write both files."""
    drawn = drawing()
    built = as_built(drawn)
    plan = gough.plan_poses(drawn, 30)
    true = gough.solve(built, plan.legs, seed=plan.poses).pose
    frame = Pose.from_rotation_vector((1480.0, -620.0, 905.0), (0.02, -0.04, 2.1))
    tool = Pose.from_rotation_vector((35.0, -12.0, 60.0), (0.01, 0.02, 0.8))
    seen = frame @ true @ tool.inverse()
    wobble = Pose.from_rotation_vector(np.zeros(3), RNG.normal(0, np.radians(0.002), (30, 3)))
    position = seen.position + RNG.normal(0, 0.01, (30, 3))
    position[11] += (2.4, -0.8, 1.1)
    position[22] += (-0.9, 1.7, 0.3)
    turned = wobble @ Pose(np.zeros(3), seen.wxyz)
    legs = plan.legs + RNG.normal(0, 0.003, (30, 6))
    (HERE / "press.toml").write_text(drawn.to_toml(), "utf-8")
    names = [f"leg_{i}" for i in range(1, 7)] + ["x", "y", "z", "qw", "qx", "qy", "qz"]
    rows = np.concatenate([legs, position, turned.wxyz], axis=1)
    text = [",".join(names)]
    text += [",".join(f"{v:.4f}" for v in r[:9]) + "," + ",".join(f"{v:.8f}" for v in r[9:])
             for r in rows]  # fmt: skip
    (HERE / "press_measured.csv").write_text("\n".join(text) + "\n", "utf-8")


if __name__ == "__main__":
    main()
