"""Targets of the fuzzer: each makes a random input, passes it to gough and checks the result."""

from __future__ import annotations

import io
import random
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import gough
from fuzzing import mutate
from fuzzing.judge import GOOD, Judge
from gough.files import LogFormat, Reading, inverse_file, solve_file
from gough.platform_file import catalog_names, catalog_text

LOGS = Path(__file__).parents[2] / "tests" / "logs"
Outcome = str  # "accepted", "refused", or a description of a wrong answer


def good(judge: Judge, legs: np.ndarray, pose: gough.Pose, usable: np.ndarray) -> Outcome:
    """Judge the rows that are called good."""
    with np.errstate(all="ignore"):
        errors = judge.errors(legs, pose.position, pose.wxyz)
    wrong = usable & ~(errors < GOOD)
    if not np.any(wrong):
        return "accepted"
    row = int(np.argmax(wrong))
    return f"WRONG: row {row} is called good, and misses by {errors[row]:.3g} of the size"


class Toml:
    """Platforms' files; poses near home are solved, and random readings."""

    share = 35

    def __init__(self, folder: Path) -> None:
        self.path = folder / "machine.toml"
        tables = '\n[readings]\ncolumns = "1:6"\nunit = "mm"\nscale = 1.0\ndecimal = "."\n'
        self.texts = [catalog_text(name) for name in catalog_names()]
        self.texts += [(LOGS / "press.toml").read_text() + tables]
        rotary = catalog_text("reachy_mini").replace(
            "\nlegs", "\noffset = 0.1\ngain = -1.5\nlegs", 1
        )
        self.texts += [rotary]

    def __call__(self, dice: random.Random) -> Outcome:
        text = mutate.some_text(dice.choice(self.texts), dice)
        self.path.write_bytes(text)
        platform = gough.Platform.load(self.path)
        LogFormat.of(self.path)
        judge = Judge(text.decode())
        rng = np.random.default_rng(dice.randrange(1 << 30))
        shift = 0.02 * platform.size * rng.standard_normal((3, 3))
        turn = gough.Pose.from_euler(np.zeros((3, 3)), 0.1 * rng.standard_normal((3, 3)))
        poses = gough.Pose(platform.home.position + shift, (platform.home @ turn).wxyz)
        with np.errstate(invalid="ignore"):
            legs = gough.leg_lengths(platform, poses)
        found = good(judge, legs, poses, np.all(np.isfinite(legs), axis=-1))
        if found != "accepted":
            return found.replace("is called good", "has readings")
        wild = platform.home_legs * (1 + 0.3 * rng.standard_normal((2, 6)))
        readings = np.concatenate([legs, wild])
        seed = "auto" if dice.random() < 0.02 else "home"
        solution = gough.solve(platform, readings, seed=seed, max_iterations=30, restarts=4)
        return good(judge, readings, solution.pose, solution.usable)


class Csv:
    """Logs and files of poses in text."""

    share = 35

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.machines = {
            name: (gough.Platform.load(where), Judge(text))
            for name, where, text in (
                ("press", LOGS / "press.toml", (LOGS / "press.toml").read_text()),
                ("reachy_mini", "reachy_mini", catalog_text("reachy_mini")),
            )
        }
        logs = [p for p in sorted(LOGS.iterdir()) if p.suffix not in (".py", ".toml")]
        self.inputs = [
            (p.name, p.read_bytes(), "reachy_mini" if "motor" in p.name else "press")
            for p in logs
            if p.is_file()
        ]
        press = self.machines["press"][0]
        poses = press.sample_poses(8, seed=1)
        rows = np.concatenate([poses.position, np.degrees(poses.euler)], axis=1)
        text = io.StringIO()
        np.savetxt(text, rows, delimiter=",", header="x,y,z,rx_deg,ry_deg,rz_deg", comments="")
        self.inputs += [("poses.csv", text.getvalue().encode(), "press")] * 3

    def __call__(self, dice: random.Random) -> Outcome:
        name, data, machine = dice.choice(self.inputs)
        plain = name.endswith((".gz", ".xlsx")) or b"\0" in data
        changed = mutate.some_bytes(data, dice) if plain else _text(data, dice)
        path = self.folder / name
        path.write_bytes(changed)
        reading = Reading(keep_bad_rows=dice.random() < 0.5, block_rows=dice.choice((1, 3, 1000)))
        return _file(path, *self.machines[machine], reading)


class Parquet:
    """Parquet files of readings and of poses."""

    share = 22

    def __init__(self, folder: Path) -> None:
        self.path = folder / "rows.parquet"
        self.machine = gough.Platform.load("reference")
        self.judge = Judge(catalog_text("reference"))
        poses = self.machine.sample_poses(40, seed=2)
        legs = gough.leg_lengths(self.machine, poses)
        kinds = [pa.float64(), pa.float32(), pa.float16(), pa.decimal128(20, 8), pa.float64()]
        columns = {
            f"leg_{k + 1}": pa.array(np.round(legs[:, k], 6).tolist(), pa.float64()).cast(
                kind, safe=False
            )
            for k, kind in enumerate([*kinds, pa.float64()])
        }
        table = pa.table(columns | {"time": pa.array(range(40))})
        values = np.concatenate([poses.position, poses.wxyz], axis=1)
        names = ("x", "y", "z", "qw", "qx", "qy", "qz")
        pose_table = pa.table({n: pa.array(v) for n, v in zip(names, values.T, strict=True)})
        self.inputs = []
        for one in (table, pose_table):
            for options in ({}, {"compression": "none", "use_dictionary": False}):
                file = io.BytesIO()
                pq.write_table(one, file, **options)
                self.inputs.append(file.getvalue())

    def __call__(self, dice: random.Random) -> Outcome:
        self.path.write_bytes(mutate.some_bytes(dice.choice(self.inputs), dice))
        return _file(self.path, self.machine, self.judge, Reading(block_rows=16))


class Onnx:
    """Networks: damaged, or with other facts or another graph under a right checksum."""

    share = 3

    def __init__(self, folder: Path) -> None:
        from importlib import resources

        self.path = folder / "network.onnx"
        self.machine = gough.Platform.load("reference")
        self.judge = Judge(catalog_text("reference"))
        self.legs = gough.leg_lengths(self.machine, self.machine.sample_poses(4, seed=3))
        file = resources.files("gough").joinpath("weights", "reference-resmlp.onnx")
        self.content = file.read_bytes()

    def __call__(self, dice: random.Random) -> Outcome:
        from gough.seeds.network import _SEAL, seal

        if dice.random() < 0.5:
            self.path.write_bytes(mutate.some_bytes(self.content, dice))
        else:
            body = self.content[:-_SEAL]
            at = body.rfind(b"\x0a\x05gough\x12")
            facts = dice.random() < 0.7
            part = mutate.some_bytes(body[at:] if facts else body[:20_000], dice)
            self.path.write_bytes(seal(body[:at] + part if facts else part + body[20_000:]))
        found = gough.solve(
            self.machine, self.legs, seed=str(self.path), max_iterations=30, restarts=4
        )
        return good(self.judge, self.legs, found.pose, found.usable)


class Safetensors:
    """Weights of the universal network, and checkpoints of a run."""

    share = 3

    def __init__(self, folder: Path) -> None:
        from importlib import resources

        import torch

        from gough.learn.run_folder import save_state

        self.path = folder / "weights.safetensors"
        file = resources.files("gough").joinpath("weights", "universal.safetensors")
        self.weights = file.read_bytes()
        self.model = torch.nn.Linear(3, 2)
        self.optimiser = torch.optim.Adam(self.model.parameters())
        self.model(torch.ones(3)).sum().backward()
        self.optimiser.step()
        save_state(self.path, self.model, {}, self.optimiser, {"step": 1, "seconds": 1.0})
        self.state = self.path.read_bytes()

    def __call__(self, dice: random.Random) -> Outcome:
        from gough.learn.run_folder import load_state
        from gough.learn.universal.export import load

        if dice.random() < 0.8:
            self.path.write_bytes(mutate.some_bytes(self.state, dice))
            load_state(self.path, self.model, {}, self.optimiser)
        else:
            head = mutate.some_bytes(self.weights[:4000], dice)
            self.path.write_bytes(head + self.weights[4000:])
            load(self.path)
        return "accepted"


HOSTILE = (
    *mutate.NUMBERS, "", " ", "-", "--", "5", "3", "650", "home", "polynomial-99", "taylor-2", "/",
    "/dev/null", "/dev/full", "no/such.csv", "a.csv", "leg_1", "6:1", "0:5", "1:1000000000",
    "leg_1,leg_2", "\x1b[31mred", "x" * 5000, "\udcff", "1,2,3,4,5,6", "deg", "rad", "mm",
)  # fmt: skip
USUAL = {
    "--seed": ("home", "auto", "taylor-2", "polynomial-2", "universal"),
    "--tolerance": ("1e-9", "1e-12", "0.1"), "--max-iterations": ("0", "1", "60"),
    "--workers": ("1", "2"), "--leg-noise": ("0.01",), "--angles": ("deg", "rad"),
    "--keep": ("time",), "--head": ("0", "2", "100"), "--block-rows": ("1", "3"),
    "--columns": ("2:7", "1:6"), "--unit": ("in", "mm", "m"), "--angle-unit": ("deg", "rad"),
    "--scale": ("1", "-1", "0.5,1,1,1,1,1"), "--offset": ("0", "1", "0,0,0,0,0,1"),
    "--decimal": (".", ","), "-o": ("a.csv", "b.parquet", "-"), "-p": ("press.toml", "reachy_mini"),
    "--json": (), "--keep-bad-rows": (), "--gains": (), "--linuxcnc": (), "-n": ("7", "20"),
    "--sensor": ("camera",), "--measured": ("pose", "position"), "--sigma": ("0.1", "1"),
    "--random-seed": ("1",), "--reference-every": ("0", "2"), "--prefix": ("a_b",),
    "--real": ("float",),
}  # fmt: skip
FILES = ("--keep", "--head", "--block-rows", "--columns", "--unit", "--angle-unit", "--scale",
         "--offset", "--decimal", "-o", "-p", "--json", "--keep-bad-rows")  # fmt: skip
OPTIONS = {
    "solve": (*FILES, "--seed", "--tolerance", "--max-iterations", "--workers", "--leg-noise",
              "--angles"),
    "inverse": FILES,
    "platforms": ("--json",),
    "plan-poses": ("-n", "--sensor", "--measured", "--sigma", "--tolerance", "--random-seed",
                   "--reference-every", "-o", "--json", "--gains"),
    "export": ("--prefix", "--real", "--unit", "--linuxcnc", "-o", "-p"),
}  # fmt: skip


class Options:
    """Command lines with hostile values, run in this process."""

    share = 2

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "legs.csv").write_bytes((LOGS / "plain.csv").read_bytes())
        (folder / "press.toml").write_bytes((LOGS / "press.toml").read_bytes())
        (folder / "poses.csv").write_text("x,y,z,rx_deg,ry_deg,rz_deg\n0,0,24,0,0,0\n")
        self.base = {
            "solve": ["legs.csv", "-p", "press.toml"],
            "inverse": ["poses.csv", "-p", "press.toml"],
            "platforms": ["reference"],
            "plan-poses": ["-p", "reference"],
            "export": ["c", "-p", "press.toml", "-o", "out"],
        }

    def __call__(self, dice: random.Random) -> Outcome:
        from fuzzing.command import call

        command = dice.choices(list(OPTIONS), (10, 4, 1, 1, 1))[0]
        words = list(self.base[command])
        if command in ("solve", "inverse") and dice.random() < 0.3:
            words[:1] = [dice.choice(HOSTILE) for _ in range(dice.choice((1, 2, 6, 6, 6)))]
        for _ in range(dice.randint(1, 3)):
            option = dice.choice(OPTIONS[command])
            words.append(option)
            if dice.random() < 0.5 and USUAL[option]:
                words.append(dice.choice(USUAL[option]))
            elif dice.random() < 0.9:
                words.append(dice.choice(HOSTILE))
        return call([command, *words], self.folder)


def _text(data: bytes, dice: random.Random) -> bytes:
    """Text of a log changed; text that is not UTF-8 as bytes."""
    try:
        return mutate.some_text(data.decode(), dice)
    except UnicodeDecodeError:
        return mutate.some_bytes(data, dice)


def _file(path: Path, machine: gough.Platform, judge: Judge, reading: Reading) -> Outcome:
    """Solve a file, or calculate the readings of its poses, and judge the rows called good."""
    options: dict[str, Any] = {"reading": reading, "head": 100}
    if "poses" in path.name:
        report = inverse_file(path, None, machine, **options)
    else:
        report = solve_file(path, None, machine, seed="home", **options)
    usable = np.array([report.outcomes[s].usable for s in report.status], bool)
    if "poses" in path.name:  # a pose outside stroke or workspace has its readings all the same
        usable = np.all(np.isfinite(report.legs), axis=-1)
    return good(judge, report.legs, report.pose, usable)


TARGETS = {
    "toml": Toml, "csv": Csv, "parquet": Parquet, "onnx": Onnx, "safetensors": Safetensors,
    "options": Options,
}  # fmt: skip
