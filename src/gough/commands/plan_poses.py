"""gough plan-poses: the poses to measure for a calibration."""

from __future__ import annotations

from typing import Annotated, Literal

from tyro.conf import arg

from gough.calibration.kinds import Kind
from gough.commands.options import Json, PlatformName, RandomSeed, option

Number = Annotated[float | None, option(metavar="S")]


def run(
    *,
    platform: PlatformName,
    count: Annotated[int, arg(aliases=["-n"], metavar="N")] = 20,
    sensor: Literal["tracker", "camera"] = "tracker",
    measured: Kind = "pose",
    sigma: Annotated[tuple[float, ...], option(metavar="S")] = (),
    leg_sigma: Number = None,
    tolerance: Number = None,
    gains: Annotated[bool, option()] = False,
    reference_every: Annotated[int, arg(metavar="K")] = 0,
    random_seed: RandomSeed = 0,
    out: Annotated[str | None, option(metavar="OUT", aliases=["-o"])] = None,
    json: Json = False,
) -> int:
    """Choose the poses to measure for a calibration.

    gough plan-poses -p mine.toml -n 20 --sensor tracker -o plan.csv

    They are chosen within workspace and stroke so that the calibrated machine errs least, in an
    order of little travel. Write what the instrument measures, and the readings at that moment,
    beside them.

    Args:
        count: Choose this many poses.
        sensor: Plan for a tracker (0.01 mm, 0.002 deg) or a camera (0.1 mm, 0.05 deg).
        measured: Plan for an instrument that measures this.
        sigma: Take this standard deviation of the instrument instead, as in gough calibrate.
        leg_sigma: Take this standard deviation of the readings, in their unit; 0.003 mm unless
            given.
        tolerance: Take this standard deviation of joints from the drawing; 0.5 mm unless given.
        gains: Plan for a fit of gains, too.
        reference_every: Return to home after this many poses, to see drift; 0 is never.
        out: Write the poses to this file, .csv or .parquet; without it they are printed.
    """
    import numpy as np
    import pyarrow as pa

    from gough.calibration.measured import stated_noise
    from gough.calibration.plan import plan_poses
    from gough.calibration.words import error_text
    from gough.columns import LEGS, pose_names
    from gough.files import write_table
    from gough.platform import Platform

    machine = Platform.load(platform)
    noise = stated_noise(measured, sigma) if sigma else None
    plan = plan_poses(
        machine, count, sensor, kind=measured, sigma=noise, leg_sigma=leg_sigma,
        tolerance=tolerance, gains=gains, reference_every=reference_every, seed=random_seed,
    )  # fmt: skip
    values = np.concatenate([plan.poses.position, np.degrees(plan.poses.euler), plan.legs], axis=1)
    columns = {n: pa.array(v) for n, v in zip((*pose_names("deg"), *LEGS), values.T, strict=True)}
    if reference_every:
        columns["reference"] = pa.array(plan.reference.astype(np.int64))
    if out or not json:
        write_table(out or "-", columns, machine)
    if json:
        from gough.commands import as_json

        rows = pa.table(columns).to_pylist()
        error = {"position": plan.error.position, "rotation_deg": np.degrees(plan.error.rotation)}
        facts = {"platform": machine.name, "unit": machine.unit, "error": error, "poses": rows}
        as_json.print_json(facts, out)
    elif out:
        print(
            f"{len(values)} poses; error over the workspace after calibrating with them: "
            f"{error_text(plan.error, machine.unit)} (rms)\nwrote {out}"
        )
    return 0
