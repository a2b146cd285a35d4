"""Writes rubin_camera_legs.csv: a made-up half hour of the Rubin camera hexapod's readings.

    python examples/make_rubin_camera_legs.py

The telescope visits forty fields. While a field is exposed, the hexapod follows the sag of
telescope and camera as the altitude drifts; between fields it slews there smoothly and corrects
focus for the temperature, which falls through the night. Every reading is within the machine's
stroke and every pose within its workspace.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import gough

ROWS, PERIOD = 1000, 2.0  # readings, and the time between them [s]
FIELDS = 40
SLEW = 6  # readings a slew takes


def altitude(rng: np.random.Generator) -> np.ndarray:
    """Altitude of the telescope at each reading, (ROWS,) [rad]: steps with soft corners."""
    fields = np.radians(rng.uniform(35, 85, FIELDS))
    drift = np.radians(rng.uniform(-0.12, 0.12, FIELDS))  # over one visit
    visit, within = np.divmod(np.arange(ROWS), ROWS // FIELDS)
    before = fields[np.maximum(visit - 1, 0)]
    s = np.clip(within / SLEW, 0, 1)
    blend = s**3 * (10 - 15 * s + 6 * s * s)  # no jump in speed or acceleration
    return before + (fields[visit] - before) * blend + drift[visit] * blend * within / FIELDS


def poses(rng: np.random.Generator) -> gough.Pose:
    """Where the camera is to be, batch (ROWS,): sag with altitude, focus with temperature."""
    up = altitude(rng)
    temperature = np.linspace(11.5, 9.8, ROWS)  # [deg C]
    position = np.stack(
        [
            12e-6 * np.sin(2 * up),
            -1.35e-3 * (np.cos(up) - np.cos(np.pi / 4)),
            -0.72e-3 * (np.sin(up) - np.sin(np.pi / 4)) + 0.11e-3 * (temperature - 10),
        ],
        axis=-1,
    )
    turn = np.stack([0.021 * np.cos(up), 0.0016 * np.sin(up), 0.0004 * np.cos(2 * up)], axis=-1)
    return gough.Pose.from_euler(position, np.radians(turn))


def main() -> None:
    """Write the file beside this script."""
    platform = gough.Platform.load("rubin_camera")
    pose = poses(np.random.default_rng(20260401))
    legs = gough.leg_lengths(platform, pose)
    assert platform.stroke is not None
    assert np.all(np.abs(legs) < 0.8 * platform.stroke[:, 1])
    assert np.all(platform.in_workspace(pose))
    path = Path(__file__).with_name("rubin_camera_legs.csv")
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write("time,leg_1,leg_2,leg_3,leg_4,leg_5,leg_6\n")
        for i, row in enumerate(legs):
            file.write(f"{i * PERIOD:.1f}," + ",".join(f"{v:.9f}" for v in row) + "\n")
    print(f"{path.name}: {len(legs)} rows, readings {legs.min():.6f} to {legs.max():.6f} m")


if __name__ == "__main__":
    main()
