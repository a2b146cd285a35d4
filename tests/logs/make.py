"""Write logs as loggers, spreadsheets and controllers do, each with one difficulty.

    python tests/logs/make.py

The readings are those of two machines, `press` (six struts, in inches) and `reachy_mini` (six
motors, in radians), at eight poses; `tests/files/test_logs.py` reads every log and compares.
"""

from __future__ import annotations

import gzip
import io
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import xlsxwriter

import gough

FOLDER = Path(__file__).parent
INCH = 25.4  # [mm]
LEGS = [f"leg_{k}" for k in range(1, 7)]


def press() -> gough.Platform:
    """The reference machine in inches."""
    reference = gough.Platform.load("reference")
    machine = gough.Platform(
        reference.base / INCH,
        reference.moving / INCH,
        home=reference.home.position / INCH,
        name="press",
        unit="in",
    )
    return machine.with_workspace(2.0, 10.0)


@dataclass(frozen=True)
class Log:
    """A log.

    Attributes:
        make: gives the file's content for readings (8, 6).
        machine: "press" or "reachy_mini".
        refused: words of the error without options; empty for a log that is read as it is.
        options: fields of `LogFormat` with which a refused log is read, as on the command line.
        said: words that are printed when the log is read.
    """

    make: Callable[[np.ndarray], bytes]
    machine: str = "press"
    refused: str = ""
    options: dict[str, str] = field(default_factory=dict)
    said: str = ""


def table(
    readings: np.ndarray,
    names: list[str] | None,
    separator: str = ",",
    *,
    decimal: str = ".",
    time: str | None = "time",
    units: list[str] | None = None,
    scale: float = 1.0,
    end: str = "",
) -> str:
    """Lines of text, with a column of times first."""
    lines = []
    for head in (names, units):
        if head:
            lines.append(separator.join(([time] if time else []) + head))
    for k, row in enumerate(readings):
        fields = [f"{k * 0.02:.2f}"] if time else []
        fields += [f"{value / scale:.9f}" for value in row]
        lines.append(separator.join(text.replace(".", decimal) for text in fields) + end)
    return "\n".join(lines) + "\n"


def named(names: list[str], **options) -> Callable[[np.ndarray], bytes]:
    return lambda readings: table(readings, names, **options).encode()


def numbered(pattern: str, first: int = 1) -> list[str]:
    return [pattern.format(k) for k in range(first, first + 6)]


def aligned(readings: np.ndarray) -> bytes:
    lines = ["  Time [s]" + "".join(f"{f'Leg {k}':>16}" for k in range(1, 7))]
    lines += [
        f"{k * 0.02:10.2f}" + "".join(f"{v:16.9f}" for v in r) for k, r in enumerate(readings)
    ]
    return ("\r\n".join(lines) + "\r\n").encode()


def with_preamble(readings: np.ndarray) -> bytes:
    head = 'Logger: DAQ-6, rev. B\nOperator:,"Smith, J."\nStart:,2026-11-24 10:02:11\n\n'
    return (head + table(readings, numbered("L{}"))).encode()


def with_commands(readings: np.ndarray) -> bytes:
    both = np.concatenate([readings + 0.01, readings], axis=1)
    names = numbered("leg{}_cmd") + numbered("leg{}_meas")
    return table(both, names).encode()


def two_encoders(readings: np.ndarray) -> bytes:
    names = numbered("motor{}") + numbered("encoder{}")
    return table(np.concatenate([readings, readings + 0.001], axis=1), names).encode()


def stamped(readings: np.ndarray) -> bytes:
    lines = ["timestamp;" + ";".join(numbered("strut_{}"))]
    for k, row in enumerate(readings):
        fields = [f"{value:.9f}".replace(".", ",") for value in row]
        lines.append(f"2026-11-24T10:02:{11 + k:02d},250;" + ";".join(fields))
    return ("\n".join(lines) + "\n").encode()


def sheet(readings: np.ndarray) -> bytes:
    """A workbook with notes on one sheet, and preamble, units, dates and an error on the next."""
    file = io.BytesIO()
    with xlsxwriter.Workbook(file) as book:
        book.set_properties({"created": datetime(2026, 11, 24)})
        book.add_worksheet("Notes").write_column(0, 0, ["Press 6", 'Smith, "J."\nnight shift'])
        log = book.add_worksheet("Log")
        log.write_row(0, 1, ["Logger", "DAQ-6"])
        log.write_row(2, 1, ["time", *numbered("Cylinder {}"), "state"])
        log.write_row(3, 2, ["mm"] * 6)
        stamp = book.add_format({"num_format": "yyyy-mm-dd hh:mm:ss.000"})
        for k, row in enumerate(readings, 4):
            log.write_datetime(
                k, 1, datetime(2026, 11, 24, 10) + timedelta(seconds=0.02 * k), stamp
            )
            log.write_row(k, 2, [*(INCH * row), "stop" if k == 9 else "run"])
        log.write(4, 8, "=1/0", None, "#DIV/0!")
    return file.getvalue()


LEFT = ["left front", "right front", "right", "right rear", "left rear", "left"]
LOGS = {
    "plain.csv": Log(named(LEGS)),
    "short_names.csv": Log(named(numbered("L{}")), said="L1, L2, L3, L4, L5, L6 are read as leg_1"),
    "capitals.csv": Log(named(numbered("LEG_{}")), said="LEG_1"),
    "words.csv": Log(named(numbered("Actuator {} (in)")), said="Actuator 1 (in)"),
    "from_zero.csv": Log(named(numbered("leg_{}", 0)), said="leg_0, leg_1"),
    "names_with_unit.csv": Log(
        named(numbered("leg{} [mm]"), scale=1 / INCH), said="converted from [mm] to [in]"
    ),
    "units_row.csv": Log(
        named(numbered("L{}"), scale=1 / INCH, units=["mm"] * 6), said="converted from [mm] to [in]"
    ),
    "units_row_brackets.tsv": Log(
        named(numbered("L{}"), separator="\t", units=["[in]"] * 6), said="L1"
    ),
    "tabs.tsv": Log(named(LEGS, separator="\t")),
    "semicolons.csv": Log(named(LEGS, separator=";", end=";")),
    "decimal_commas.csv": Log(
        named(numbered("Leg {}"), separator=";", decimal=","), said="numbers have a decimal comma"
    ),
    "decimal_commas_with_tabs.txt": Log(
        named(LEGS, separator="\t", decimal=","), said="numbers have a decimal comma"
    ),
    "decimal_commas_between_commas.csv": Log(
        named(LEGS, decimal=",", time=None), refused="write decimal points, or semicolons"
    ),
    "aligned.txt": Log(aligned, said="Leg 1"),
    "hash.dat": Log(lambda r: b"# " + table(r, LEGS, " ").encode()),
    "preamble.csv": Log(with_preamble, said="line 5 is the header"),
    "no_header.csv": Log(
        named([], time=None), refused="as in --columns 1:6", options={"columns": "1:6"}
    ),
    "no_header_after_time.txt": Log(
        lambda r: table(r, None, "\t", decimal=",").encode(),
        refused="as in --columns 1:6",
        options={"columns": "2:7"},
    ),
    "own_names.csv": Log(
        named(LEFT),
        refused="--columns A,B,C,D,E,F",
        options={"columns": ",".join(f"{name}={k + 1}" for k, name in enumerate(LEFT))},
    ),
    "commands_and_readings.csv": Log(with_commands, said="leg1_meas"),
    "two_encoders.csv": Log(
        two_encoders,
        refused="--columns A,B,C,D,E,F",
        options={"columns": ",".join(numbered("motor{}"))},
    ),
    "utf16.txt": Log(
        lambda r: table(r, numbered("Leg {}"), "\t").replace("\n", "\r\n").encode("utf-16"),
        said="Leg 1",
    ),
    "byte_order_mark.csv": Log(lambda r: b"\xef\xbb\xbf" + table(r, LEGS).encode()),
    "sep_line.csv": Log(lambda r: b"sep=;\n" + table(r, LEGS, ";").encode()),
    "packed.csv.gz": Log(lambda r: gzip.compress(table(r, LEGS).encode(), mtime=0)),
    "stamps.csv": Log(stamped, said="numbers have a decimal comma"),
    "millimetres.csv": Log(
        named(LEGS, scale=1 / INCH), refused="pass --unit mm", options={"unit": "mm"}
    ),
    "from_home.csv": Log(
        lambda r: table(r - press().home_legs, LEGS).encode(),
        refused="pass --offset=",
        options={"offset": ",".join(f"{v:.12g}" for v in press().home_legs)},
    ),
    "counts.csv": Log(
        named([f"L{k} [counts]" for k in range(1, 7)], scale=1e-4),
        refused="[counts], which cannot be converted to [in]; pass --unit and --scale",
        options={"scale": "1e-4"},
    ),
    "sheet.xlsx": Log(sheet, said="converted from [mm] to [in]"),
    "motor_degrees.csv": Log(
        named(numbered("motor_{}"), scale=np.pi / 180),
        machine="reachy_mini",
        refused="pass --angle-unit deg",
        options={"angle_unit": "deg"},
    ),
    "motor_degrees_named.csv": Log(
        named(numbered("motor {} [deg]"), scale=np.pi / 180),
        machine="reachy_mini",
        said="converted from [deg] to [rad]",
    ),
}  # fmt: skip


def machine(name: str) -> gough.Platform:
    return press() if name == "press" else gough.Platform.load(name)


def readings(name: str) -> np.ndarray:
    """Readings (8, 6) of a machine."""
    platform = machine(name)
    return gough.leg_lengths(
        platform, platform.sample_poses(8, seed=4) if name == "press" else arms()
    )


def arms() -> gough.Pose:
    """Poses (8,) of the head of reachy_mini that move its motors."""
    home = gough.Platform.load("reachy_mini").home
    tilt = np.linspace(-0.25, 0.25, 8)
    angles = np.stack([tilt, tilt[::-1], 0.5 * tilt], axis=-1)
    return gough.Pose.from_euler(np.broadcast_to(home.position, (8, 3)), angles)


def main() -> None:
    """Write all logs beside this file."""
    for name, log in LOGS.items():
        (FOLDER / name).write_bytes(log.make(readings(log.machine)))
    press().save(FOLDER / "press.toml")


if __name__ == "__main__":
    main()
