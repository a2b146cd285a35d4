"""gough calibrate: the machine as it is, from poses measured on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from gough.calibration.kinds import Kind
from gough.commands.options import Json, PlatformName, option

if TYPE_CHECKING:
    from gough.calibration.result import Calibration
    from gough.checks import Array

Points = Annotated[tuple[float, ...], option(metavar="X Y Z")]


def run(
    measured_file: Annotated[Positional[str], arg(metavar="MEASURED")],
    *,
    platform: PlatformName,
    leg_sigma: Annotated[float, arg(metavar="S")],
    tolerance: Annotated[float, arg(metavar="T")],
    out: Annotated[str | None, option(metavar="OUT", aliases=["-o"])] = None,
    json: Json = False,
    sigma: Annotated[tuple[float, ...], option(metavar="S")] = (),
    measured: Kind = "pose",
    gains: Annotated[bool, option()] = False,
    frames: Literal["unknown", "known"] = "unknown",
    robust: Annotated[bool, option()] = False,
    drift: Annotated[str | None, option(metavar="COLUMN")] = None,
    targets: Points = (),
    stations: Points = (),
    report: Annotated[str | None, option(metavar="FILE")] = None,
    force: Annotated[bool, option()] = False,
) -> int:
    """Fit joints and sensors of a machine to poses measured on it.

    gough calibrate measured.csv -p mine.toml -o calibrated.toml --sigma 0.01 0.002
        --leg-sigma 0.003 --tolerance 0.5

    Each row has leg_1 to leg_6 and, by --measured: x, y, z and a rotation; a rotation; x, y, z of
    a target; x_1, y_1, z_1, x_2, ... of targets; distance_1, ...; or tilt_x_deg, tilt_y_deg, the
    angles by which an inclinometer's axes point above the horizontal.

    Exit code 0: the new file was written; 1: it was not, as the drawing may be better; 2: error.

    Args:
        measured_file: Read the measurements from this file, .csv, .txt, .tsv, .xlsx or .parquet,
            or from standard input (-).
        sigma: State the standard deviation of what was measured: position [platform unit] and
            rotation [deg] for poses, else one number; of orientations and inclinometers in [deg].
            Without it each row has its own, in the columns sigma and sigma_deg.
        leg_sigma: State the standard deviation of the readings, in their unit (motor angles: rad).
        tolerance: State the standard deviation of joints from the drawing [platform unit].
        out: Write the calibrated machine to this .toml file.
        measured: State what the instrument measured.
        gains: Fit a gain of each leg's sensor, too.
        frames: Pass known if measurements are in base coordinates, of the platform itself.
        robust: Find outliers and leave them out.
        drift: Fit a slow change of offsets and frame over this column of time.
        targets: State the points looked at [platform coordinates], three numbers each.
        stations: State the fixed ends of distances [base coordinates], three numbers each.
        report: Write a report with figures to this .html file.
        force: Write the file although the drawing may be better.
    """
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
    found = read_measured(measured_file, machine, measured, drift, sigma)
    calibration = calibrate(
        machine, found.legs, found.measured, sigma=found.sigma, leg_sigma=leg_sigma,
        tolerance=tolerance, kind=measured, gains=gains, frames=frames, robust=robust,
        targets=_points("targets", targets), stations=_points("stations", stations),
        time=found.time,
    )  # fmt: skip
    lines = [_summary(calibration), *(f"- {text}" for text in calibration.messages)]
    if report is not None:
        from gough.calibration.report import write_report

        write_report(calibration, report)
        lines.append(f"wrote {report}")
    written = out if calibration.better or force else None
    if written is not None:
        calibration.platform.save(written)
        lines.append(f"wrote {written}")
    elif out is not None:
        lines.append(f"{out} was not written: the drawing may be better; --force writes it")
    if json:
        from gough.commands import as_json

        as_json.print_json(_facts(calibration) | {"written": written})
    else:
        print("\n".join(lines))
    return 0 if written or (out is None and calibration.better) else 1


def _points(name: str, numbers: tuple[float, ...]) -> Array | None:
    from gough.checks import as_batch
    from gough.errors import GoughError

    if len(numbers) % 3:
        raise GoughError(f"--{name}: expected three numbers a point, found {len(numbers)} in all")
    return as_batch(name, list(numbers), ()).reshape(-1, 3) if numbers else None


def _facts(calibration: Calibration) -> dict:
    """Findings for JSON; angles of errors in degrees."""
    import numpy as np

    before, after = (
        {"position": error.position, "rotation_deg": np.degrees(error.rotation)}
        for error in (calibration.error_before, calibration.predicted_error)
    )
    ours, theirs = calibration.cross_validated
    return {
        "platform": calibration.platform.to_dict(),
        "rows": len(calibration.inliers),
        "used": np.sum(calibration.inliers),
        "rank": calibration.rank,
        "parameters": calibration.changes.size,
        "error_as_drawn": before,
        "error_calibrated": after,
        "held_out_as_drawn": theirs,
        "held_out_calibrated": ours,
        "better": calibration.better,
        "messages": calibration.messages,
    }


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
