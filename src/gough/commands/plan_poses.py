"""gough plan-poses: the poses to measure for a calibration."""

from __future__ import annotations

from typing import Annotated, Literal

from tyro.conf import arg

from gough.commands.options import PlatformName

Number = Annotated[float | None, arg(metavar="S", help_behavior_hint="")]


def run(
    *,
    platform: PlatformName,
    count: Annotated[int, arg(aliases=["-n"], metavar="N")] = 20,
    sensor: Literal["tracker", "camera"] = "tracker",
    measured: Literal["pose", "position", "targets", "distances", "inclinometer"] = "pose",
    sigma: Annotated[tuple[float, ...], arg(metavar="S", help_behavior_hint="")] = (),
    leg_sigma: Number = None,
    tolerance: Number = None,
    gains: bool = False,
    reference_every: Annotated[int, arg(metavar="K")] = 0,
    seed: Annotated[int, arg(metavar="N")] = 0,
    out: Annotated[str | None, arg(aliases=["-o"], metavar="OUT", help_behavior_hint="")] = None,
) -> int:
    """The poses to measure for a calibration.

    gough plan-poses -p mine.toml -n 20 --sensor tracker -o plan.csv

    Chosen within workspace and stroke so that the calibrated machine errs least, in an order of
    little travel. Write what the instrument measures, and the readings at that moment, beside.

    Args:
        count: how many poses.
        sensor: tracker (0.01 mm, 0.002 deg) or camera (0.1 mm, 0.05 deg).
        measured: what the instrument measures.
        sigma: its standard deviation instead, as for gough calibrate.
        leg_sigma: standard deviation of the readings, in their unit; 0.003 mm unless given.
        tolerance: standard deviation of joints from the drawing; 0.5 mm unless given.
        gains: plan for a fit of gains, too.
        reference_every: return to home after so many poses, to see drift; 0: never.
        seed: of the poses to choose from.
        out: .csv or .parquet file to write; without it the poses are printed.
    """
    import numpy as np
    import pyarrow as pa

    from gough.calibration.plan import plan_poses
    from gough.calibration.words import error_text
    from gough.columns import LEGS, pose_names
    from gough.files import write_table
    from gough.platform import Platform

    machine = Platform.load(platform)
    noise: float | tuple[float, ...] | None = None
    if sigma:
        noise = (sigma[0], *np.radians(sigma[1:])) if measured == "pose" else sigma[0]
        noise = float(np.radians(sigma[0])) if measured == "inclinometer" else noise
    plan = plan_poses(
        machine, count, sensor, kind=measured, sigma=noise, leg_sigma=leg_sigma,
        tolerance=tolerance, gains=gains, reference_every=reference_every, seed=seed,
    )  # fmt: skip
    values = np.concatenate([plan.poses.position, np.degrees(plan.poses.euler), plan.legs], axis=1)
    columns = {n: pa.array(v) for n, v in zip((*pose_names("deg"), *LEGS), values.T, strict=True)}
    if reference_every:
        columns["reference"] = pa.array(plan.reference.astype(np.int64))
    write_table(out or "-", columns, machine)
    if out:
        print(
            f"{len(values)} poses; error over the workspace after calibrating with them: "
            f"{error_text(plan.error, machine.unit)} (rms)\nwrote {out}"
        )
    return 0
