"""One grammar: the same words, numbers and help texts in every command."""

from __future__ import annotations

import json
import re
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import gough as library
from gough.commands import COMMANDS

from .conftest import EXAMPLE

LEGS = ("652.1", "660.3", "655.0", "648.8", "671.2", "639.9")
POSE = ("20", "-1e1", "610", "5", "3", "-4")
FAMILIES = {
    "plot": ["pose", "modes", "workspace", "trajectory", "errors"],
    "export": ["c", "mjcf", "sdf", "urdf"],
    "import": ["mjcf", "sdf"],
    "train": ["", "default", "paper"],
}
PAGES = [[c, *([s] if s else [])] for c in COMMANDS for s in FAMILIES.get(c, [""])]


@pytest.mark.parametrize("command", PAGES, ids=" ".join)
def test_help_is_made_of_whole_sentences(gough, command):
    code, out, err = gough(*command, "--help")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert max(map(len, lines)) <= 80
    for words in ("[[", "...]]", "(default: )", "(default: None)", "(default: False)", "{None}"):
        assert words not in out
    # an option's text: indented lines below it, or beside it
    below = out.partition("\n options\n")[2]
    options = re.findall(r"^  (-\S.*(?:\n  (?!-).*)*)", below, re.MULTILINE)
    assert options
    for option in options:
        text = " ".join(re.split(r" {2,}|\n", option, maxsplit=1)[1].split())
        sentence = re.sub(r" \((default: .*|required)\)$", "", text)
        assert sentence[0].isupper() or command[:1] == ["train"], option
        assert sentence.endswith("."), option
    gaps = [b for a, b in pairwise(lines) if not a]
    assert all(line and not line.startswith("  ") for line in gaps)


def test_six_numbers_are_a_file_of_one_row(gough, tmp_path):
    path = tmp_path / "legs.csv"
    path.write_text(",".join(f"leg_{k}" for k in range(1, 7)) + "\n" + ",".join(LEGS) + "\n")
    expected = gough("solve", path, "-p", "reference", "-o", tmp_path / "a.csv")
    assert expected.code == 0
    ways = [LEGS, [f"{v}," for v in LEGS], [", ".join(LEGS)], [v.replace(".", ",") for v in LEGS]]
    for k, words in enumerate(ways):
        out = tmp_path / f"{k}.csv"
        assert gough("solve", *words, "-p", "reference", "-o", out).code == 0
        assert out.read_text() == (tmp_path / "a.csv").read_text()
    inches = [str(float(v) / 25.4) for v in LEGS]
    code, said, _ = gough("solve", *inches, "-p", "reference", "--unit", "in", "--json")
    assert code == 0
    first = json.loads(said)["first_rows"][0]
    z = (tmp_path / "a.csv").read_text().splitlines()[1].split(",")[2]
    assert (first["status"], first["z"]) == ("converged", pytest.approx(float(z)))


def test_motor_angles_may_be_typed_in_degrees(gough):
    legs = np.degrees(library.Platform.load("reachy_mini").home_legs)
    code, out, _ = gough(
        "solve", *map(str, legs), "-p", "reachy_mini", "--angle-unit", "deg", "--json"
    )
    assert code == 0
    assert json.loads(out)["first_rows"][0]["z"] == pytest.approx(0.177)


def test_a_pose_is_typed_in_one_way(gough, tmp_path):
    code, out, _ = gough("inverse", *POSE, "-p", "reference", "--json")
    assert code == 0
    row = json.loads(out)["first_rows"][0]
    legs = [str(row[f"leg_{k}"]) for k in range(1, 7)]
    out = gough("solve", *legs, "-p", "reference", "--angles", "deg", "--json").out
    found = json.loads(out)["first_rows"][0]
    names = ("x", "y", "z", "rx_deg", "ry_deg", "rz_deg")
    np.testing.assert_allclose([found[n] for n in names], list(map(float, POSE)), atol=1e-8)
    pytest.importorskip("matplotlib")
    for words in (("--pose", *POSE), legs):
        picture = tmp_path / f"{len(words)}.png"
        assert gough("plot", "pose", *words, "-p", "reference", "-o", picture).code == 0


def test_the_page_begins_at_six_numbers(gough, tmp_path):
    pytest.importorskip("viser")
    for words in (LEGS, ("--pose", *POSE)):
        page = tmp_path / f"{len(words)}.html"
        assert gough("view", *words, "-p", "reference", "--html", page).code == 0
        assert ("594.58" if words is LEGS else "610") in page.read_text("utf-8")
    bad = gough("view", "--pose", "0", "0", "9", "0", "0", "0", "-p", "reachy_mini")
    assert (bad.code, len(bad.err.splitlines())) == (2, 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["solve", "-p", "reference"], "LEGS: expected six readings, or a file; found nothing"),
        (["solve", *LEGS[:5], "-p", "reference"], "found 5: 652.1"),
        (
            ["solve", "a.csv", "b.csv", "-p", "reference"],
            "many files are written to a folder",
        ),
        (["solve", *LEGS[:5], "six", "-p", "reference"], "found 'six'"),
        (["inverse", *LEGS[:5], "-p", "reference"], "expected six numbers x y z rx ry rz"),
        (["modes", "1", "2", "-p", "reference"], "LEGS: expected six readings"),
        (["view", "1", "2", "-p", "reference"], "LEGS: expected six readings"),
        (["view", *LEGS, "--pose", *POSE, "-p", "reference"], "not both"),
        (["dataset", "-p", "reference", "-o", "a.csv", "--seed", "1"], "--random-seed"),
    ],
)
def test_mistakes_are_named_in_the_same_words(gough, arguments, words):
    code, out, err = gough(*arguments)
    assert (code, out) == (2, "")
    assert words in err


def test_every_answer_is_there_as_json(gough, tmp_path):
    code, out, _ = gough("solve", EXAMPLE, "-p", "rubin_camera", "--json", "--head", 2)
    answer = json.loads(out)
    assert (code, answer["rows"], answer["usable"], answer["unit"]) == (0, 1000, 1000, "m")
    assert answer["statuses"]["converged"]["rows"] == 1000
    assert len(answer["first_rows"]) == 2
    code, out, _ = gough("modes", "-p", "linuxcnc_genhex", "--json")
    found = json.loads(out)["sets"][0]
    assert (code, found["row"], found["complete"]) == (0, 1, True)
    assert found["poses"][0]["pose"] == 1
    assert json.loads(gough("platforms", "--json").out)["reference"]["unit"] == "mm"
    assert json.loads(gough("platforms", "reference", "--json").out)["home"]
    plan = tmp_path / "plan.csv"
    out = gough("plan-poses", "-p", "reference", "-n", 8, "--json", "-o", plan).out
    answer = json.loads(out)
    assert len(answer["poses"]) == 8
    assert len(plan.read_text().splitlines()) == 9
    assert answer["error"]["position"] > 0


def test_rows_without_a_pose_are_null(gough):
    code, out, _ = gough("solve", "nan", *LEGS[1:], "-p", "reference", "--json")
    assert code == 1
    assert json.loads(out)["first_rows"][0]["x"] is None


def test_deviations_follow_the_unit_of_angles(gough, tmp_path):
    values = {}
    for angles in ("rad", "deg"):
        out = tmp_path / f"{angles}.csv"
        gough(
            "solve", *LEGS, "-p", "reference", "--angles", angles, "--leg-noise", "0.1", "-o", out
        )
        head, row = (line.split(",") for line in out.read_text().splitlines())
        values[angles] = dict(zip(head, row, strict=True))
    assert float(values["deg"]["std_rx_deg"]) == pytest.approx(
        np.degrees(float(values["rad"]["std_rx"]))
    )
    assert values["deg"]["std_x"] == values["rad"]["std_x"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_commands_and_options(gough, tmp_path, shell):
    code, out, err = gough("--print-completion", shell)
    assert (code, err) == (0, "")
    assert "--angle-unit" in out
    if shell == "bash":
        script = tmp_path / "complete"
        script.write_text(
            out + "\nCOMP_WORDS=(gough plot mo); COMP_CWORD=2; _tyro_gough; echo $COMPREPLY\n"
        )
        done = subprocess.run(["bash", script], capture_output=True, text=True, check=True)
        assert done.stdout == "modes\n"


def test_a_shell_that_is_not_known(gough):
    assert "expected one of bash, zsh, fish" in gough("--print-completion", "csh").err


def test_rows_of_modes_count_from_1(gough, tmp_path):
    path = Path(tmp_path / "legs.csv")
    rows = "\n".join([",".join(LEGS)] * 2)
    path.write_text(",".join(f"leg_{k}" for k in range(1, 7)) + f"\n{rows}\n")
    _, out, _ = gough("modes", path, "-p", "reference", "-o", "-")
    assert [line.partition(",")[0] for line in out.splitlines()[1:]] == ["1"] * 12 + ["2"] * 12
