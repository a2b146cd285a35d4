"""From a plan to a calibrated file by the commands, measured by MuJoCo; and what is refused."""

# MuJoCo ships no types.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import mujoco
import mujoco_model
import numpy as np
import pytest
from calibration.machines import truth

import gough
from gough import Platform, Pose
from gough.cli import main

NOISE = ["--sigma", "0.01", "0.002", "--leg-sigma", "0.003", "--tolerance", "0.5"]


def _run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    return int(end.value.code or 0)


def _mujoco_pose(model, data, lengths: np.ndarray, start: Pose) -> Pose:
    """The pose at which MuJoCo's tendons have these lengths, by Newton on its own Jacobian."""
    data.qpos[:] = [*start.position, *start.wxyz]
    for _ in range(20):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_tendon(model, data)
        rows = mujoco_model._dense_tendon_jacobian(model, data)
        step = np.linalg.solve(rows, lengths - data.ten_length)
        mujoco.mj_integratePos(model, data.qpos, step, 1.0)
        if np.abs(step).max() < 1e-12:
            break
    return Pose(data.qpos[:3].copy(), data.qpos[3:].copy())


def _write(path: Path, names: list[str], rows: np.ndarray) -> None:
    lines = [",".join(names), *(",".join(repr(float(v)) for v in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")


def test_a_new_user_calibrates_a_machine_that_mujoco_measures(tmp_path: Path, capsys) -> None:
    known = truth("reference", 11)
    drawing, plan = tmp_path / "mine.toml", tmp_path / "plan.csv"
    known.drawing.save(drawing)
    told = ["-p", str(drawing)]
    assert _run("plan-poses", *told, "-n", "20", "--sensor", "tracker", "-o", str(plan)) == 0
    planned = list(csv.DictReader(plan.read_text("utf-8").splitlines()))
    assert len(planned) == 20

    rng = np.random.default_rng(3)
    model = mujoco.MjModel.from_xml_string(mujoco_model._mjcf(known.platform))
    data = mujoco.MjData(model)
    frame, tool = (p.pose() for p in (known.frames.frame, known.frames.tool))

    def truly(readings: np.ndarray, near: Pose) -> Pose:
        return _mujoco_pose(model, data, readings + known.platform.offset, near)

    rows = []
    for row in planned:
        legs = np.array([float(row[f"leg_{i}"]) for i in range(1, 7)])
        angles = np.radians([float(row[n]) for n in ("rx_deg", "ry_deg", "rz_deg")])
        near = Pose.from_euler([float(row[n]) for n in "xyz"], angles)
        seen = frame @ truly(legs, near) @ tool.inverse()
        wobble = Pose.from_rotation_vector(np.zeros(3), rng.normal(0, np.radians(0.002), 3))
        turned = (wobble @ Pose(np.zeros(3), seen.wxyz)).wxyz
        noisy = legs + rng.normal(0, 0.003, 6)
        rows.append([*noisy, *(seen.position + rng.normal(0, 0.01, 3)), *turned])
    names = [f"leg_{i}" for i in range(1, 7)] + ["x", "y", "z", "qw", "qx", "qy", "qz"]
    _write(tmp_path / "measured.csv", names, np.array(rows))

    made, page = tmp_path / "calibrated.toml", tmp_path / "report.html"
    capsys.readouterr()
    assert _run("calibrate", str(tmp_path / "measured.csv"), *told, "-o", str(made), *NOISE,
                "--report", str(page)) == 0  # fmt: skip
    printed = capsys.readouterr().out
    predicted = re.search(r"drawn, ([\d.]+) mm, ([\d.e-]+) deg calibrated", printed)
    assert predicted is not None, printed
    text = page.read_text("utf-8")
    assert "<svg" in text
    assert "Nothing was learned of 12 more" in text  # base or platform joints moved with a frame

    # solve other readings with the new file, and compare with MuJoCo's truth
    other = known.poses(60, 5)  # some leave the workspace, as the drawing has it
    legs = gough.leg_lengths(known.platform, other)
    _write(tmp_path / "legs.csv", names[:6], legs)
    assert _run("solve", str(tmp_path / "legs.csv"), "-p", str(made), "-o",
                str(tmp_path / "poses.parquet"), "--allow-failures") == 0  # fmt: skip
    solved = gough.solve(Platform.load(made), legs)
    found = gough.calibrate(
        Platform.load(drawing), np.array(rows)[:, :6],
        Pose(np.array(rows)[:, 6:9], np.array(rows)[:, 9:]),
        sigma=(0.01, np.radians(0.002)), leg_sigma=0.003, tolerance=0.5,
    )  # fmt: skip
    seen = found.frame @ solved.pose @ found.tool.inverse()
    true = [frame @ truly(q, other[i]) @ tool.inverse() for i, q in enumerate(legs)]
    errors = [np.linalg.norm(seen.position[i] - t.position) for i, t in enumerate(true)]
    rms = np.sqrt(np.mean(np.square(errors)))
    assert 0.5 * float(predicted[1]) < rms < 1.6 * float(predicted[1])


EXAMPLE = Path(__file__).resolve().parents[2] / "examples"


def test_the_examples_outliers_are_named_and_nothing_doubtful_is_written(
    tmp_path: Path, capsys
) -> None:
    arguments = [
        "calibrate", str(EXAMPLE / "press_measured.csv"), "-p", str(EXAMPLE / "press.toml"),
        "--leg-sigma", "0.003", "--tolerance", "0.3", "--robust", "-o", str(tmp_path / "new.toml"),
    ]  # fmt: skip
    assert _run(*arguments, "--sigma", "0.01", "0.002") == 0
    assert "2 of 30 poses are outliers and left out: rows 12, 23" in capsys.readouterr().out
    (tmp_path / "new.toml").unlink()
    assert _run(*arguments, "--sigma", "5", "2") == 1
    printed = capsys.readouterr().out
    assert "not surely better than the drawing" in printed
    assert "was not written" in printed
    assert not (tmp_path / "new.toml").exists()
    assert _run(*arguments, "--sigma", "5", "2", "--force") == 1 - 1
    assert (tmp_path / "new.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--sigma", "0.01"], "--sigma: expected 2 numbers for pose, found 1"),
        (["--sigma", "0.01", "0"], "sigma[1]: expected a standard deviation above 0"),
        (
            ["--sigma", "0.01", "--measured", "targets"],
            "the file has the columns of --measured pose or orientation or position",
        ),
        (["--sigma", "0.01", "--measured", "distances"], "distance_1, distance_2"),
        (["--sigma", "0.01", "0.002", "--drift", "t"], "no column 't'"),
        (["--sigma", "0.01", "0.002", "-o", "x.csv"], "must end in .toml"),
        ([], "no column sigma, sigma_deg; state the standard deviation"),
    ],
)
def test_what_is_wrong_is_said_in_a_line(arguments: list[str], message: str, capsys) -> None:
    code = _run("calibrate", str(EXAMPLE / "press_measured.csv"), "-p",
                str(EXAMPLE / "press.toml"), "--leg-sigma", "0.003", "--tolerance", "0.3",
                *arguments)  # fmt: skip
    assert code == 2
    assert message in capsys.readouterr().err


def test_other_instruments_come_from_files_too(tmp_path: Path) -> None:
    from gough.calibration.measured import read_measured

    machine = Platform.load("reference")
    names = [f"leg_{i}" for i in range(1, 7)]
    rows = np.arange(36.0).reshape(3, 12) + 600
    cases = {
        "targets": (["x_1", "y_1", "z_1", "x_2", "y_2", "z_2"], (3, 2, 3)),
        "position": (["x", "y", "z", "a", "b", "c"], (3, 3)),
        "distances": ([f"distance_{i}" for i in range(1, 7)], (3, 6)),
        "orientation": (["rx_deg", "ry_deg", "rz_deg", "sigma_deg", "a", "b"], (3, 4)),
        "inclinometer": (["tilt_x_deg", "tilt_y_deg", "a", "b", "c", "t"], (3, 2)),
    }
    found = None
    for kind, (columns, shape) in cases.items():
        file = tmp_path / f"{kind}.csv"
        _write(file, names + columns, rows)
        sigma = () if "sigma_deg" in columns else (0.01,)
        found = read_measured(str(file), machine, kind, "t" if "t" in columns else None, sigma)
        values = found.measured.wxyz if kind == "orientation" else found.measured
        assert values.shape == shape
        if kind == "orientation":
            np.testing.assert_allclose(found.sigma, np.radians(rows[:, 9]))
        np.testing.assert_array_equal(found.legs, rows[:, :6])
        assert json.dumps(found.place(1)) == '"line 3"'
    assert found is not None
    np.testing.assert_allclose(found.measured, np.radians(rows[:, 6:8]))
    assert found.time is not None
