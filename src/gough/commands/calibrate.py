"""gough calibrate: the machine as it is, from poses measured on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from gough.commands.options import PlatformName

if TYPE_CHECKING:
    from gough.calibration.result import Calibration
    from gough.checks import Array

Points = Annotated[tuple[float, ...], arg(metavar="X Y Z", help_behavior_hint="")]
Text = Annotated[str | None, arg(metavar="FILE", help_behavior_hint="")]


def run(
    measured_file: Annotated[Positional[str], arg(metavar="MEASURED")],
    *,
    platform: PlatformName,
    sigma: Annotated[tuple[float, ...], arg(metavar="S")],
    leg_sigma: Annotated[float, arg(metavar="S")],
    tolerance: Annotated[float, arg(metavar="T")],
    out: Annotated[str | None, arg(aliases=["-o"], metavar="OUT", help_behavior_hint="")] = None,
    measured: Literal["pose", "position", "targets", "distances", "inclinometer"] = "pose",
    gains: bool = False,
    frames: Literal["unknown", "known"] = "unknown",
    robust: bool = False,
    drift: Annotated[str | None, arg(metavar="COLUMN", help_behavior_hint="")] = None,
    targets: Points = (),
    stations: Points = (),
    report: Text = None,
    force: bool = False,
) -> int:
    """The machine as it is, from poses measured on it.

    gough calibrate measured.csv -p mine.toml -o calibrated.toml --sigma 0.01 0.002
        --leg-sigma 0.003 --tolerance 0.5

    Each row has leg_1 to leg_6 and, by --measured: x, y, z and a rotation; x, y, z of a target;
    x_1, y_1, z_1, x_2, ... of targets; distance_1, ...; or tilt_x_deg, tilt_y_deg, the angles by
    which an inclinometer's axes point above the horizontal.

    Exit code 0: the new file was written; 1: it was not, as the drawing may be better; 2: error.

    Args:
        measured_file: .csv or .parquet file of measurements, or - for CSV on standard input.
        sigma: standard deviation of what was measured: position [platform unit] and rotation
            [deg] for poses, else one number; of an inclinometer in [deg].
        leg_sigma: standard deviation of the readings, in their unit (motor angles: rad).
        tolerance: standard deviation of joints from the drawing [platform unit].
        out: .toml file to write.
        measured: what the instrument measured.
        gains: fit a gain of each leg's sensor, too.
        frames: known: measurements are in base coordinates, of the platform itself.
        robust: find outliers and leave them out.
        drift: column of time; fit a slow change of offsets and frame over it.
        targets: points looked at [platform coordinates], three numbers each.
        stations: fixed ends of distances [base coordinates], three numbers each.
        report: .html file with figures to write.
        force: write the file although the drawing may be better.
    """
    import numpy as np

    from gough.calibration.fit import calibrate
    from gough.calibration.measured import read_measured
    from gough.errors import GoughError
    from gough.platform import Platform
    from gough.whole_file import check_target

    if out is not None and not out.endswith(".toml"):
        raise GoughError(f"{out}: the name must end in .toml")
    for path in (out, report):
        if path is not None:
            check_target(path)
    machine = Platform.load(platform)
    found = read_measured(measured_file, machine, measured, drift)
    wanted = 2 if measured == "pose" else 1
    if len(sigma) != wanted:
        raise GoughError(f"--sigma: expected {wanted} numbers for {measured}, found {len(sigma)}")
    degrees = float(np.radians(sigma[-1]))
    noise = (sigma[0], degrees) if wanted == 2 else sigma[0]
    noise = degrees if measured == "inclinometer" else noise
    calibration = calibrate(
        machine, found.legs, found.measured, sigma=noise, leg_sigma=leg_sigma,
        tolerance=tolerance, kind=measured, gains=gains, frames=frames, robust=robust,
        targets=_points("targets", targets), stations=_points("stations", stations),
        time=found.time,
    )  # fmt: skip
    print(_summary(calibration))
    for text in calibration.messages:
        print(f"- {text}")
    if report is not None:
        from gough.calibration.report import write_report

        write_report(calibration, report)
        print(f"wrote {report}")
    if out is None:
        return 0 if calibration.better else 1
    if not (calibration.better or force):
        print(f"{out} was not written: the drawing may be better; --force writes it")
        return 1
    calibration.platform.save(out)
    print(f"wrote {out}")
    return 0


def _points(name: str, numbers: tuple[float, ...]) -> Array | None:
    from gough.checks import as_batch
    from gough.errors import GoughError

    if len(numbers) % 3:
        raise GoughError(f"--{name}: expected three numbers a point, found {len(numbers)} in all")
    return as_batch(name, list(numbers), ()).reshape(-1, 3) if numbers else None


def _summary(calibration: Calibration) -> str:
    """Findings as text, one line each."""
    import numpy as np

    from gough.calibration.words import error_text

    used, total = int(np.sum(calibration.inliers)), len(calibration.inliers)
    share = np.abs(calibration.changes / calibration.parameters.tolerance).max()
    ours, theirs = calibration.cross_validated
    unit = calibration.parameters.drawing.unit
    return "\n".join(
        [
            f"{used} of {total} poses used; rank {calibration.rank} of {calibration.changes.size}",
            f"error over the workspace: {error_text(calibration.error_before, unit)} as drawn, "
            f"{error_text(calibration.predicted_error, unit)} calibrated (rms, predicted)",
            f"held-out poses: {theirs:.3g} standard deviations as drawn, {ours:.3g} calibrated",
            f"largest change of a parameter: {share:.2g} tolerances",
        ]
    )
