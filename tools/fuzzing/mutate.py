"""Inputs changed at random: bytes, lines, numbers."""

from __future__ import annotations

import random
import re

NUMBER = re.compile(r"-?\d+\.?\d*(?:e[+-]?\d+)?")
NUMBERS = (
    "0", "-0.0", "1", "-1", "2.5", "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e100",
    "1e-9", "1e17", "99999999999999999999", "1" * 5000, "0x10", "1_000", "true", "1,5", "''", "[]",
    "[1, 2]", "{}", '"a"', "1979-05-27", "\u0663", "1e", "--1", "-",
)  # fmt: skip
PIECES = (
    b'"', b"'", b";", b",", b"\t", b"\r", b"\n", b"\r\n", b"\0", b"[", b"]", b"=", b"#", b" ",
    b"(mm)", b"sep=|\n", b"\xff\xfe", b"\xef\xbb\xbf", b"\x1b[31m", b"\x1f\x8b", b"PAR1", b"\xff",
    b"nan", b"leg_1", b"-", b".", b"\xc2\xa0", b"\xe2\x80\xae",
)  # fmt: skip
LARGEST = 1 << 20  # bytes of an input


def some_bytes(data: bytes, dice: random.Random) -> bytes:
    """One to four changes of bytes: flipped, removed, repeated, inserted, cut off."""
    changed = bytearray(data)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(changed)) if changed else 0
        kind = dice.randrange(6)
        if kind == 0 and changed:
            changed[at] ^= 1 << dice.randrange(8)
        elif kind == 1:
            del changed[at : at + dice.randint(1, 80)]
        elif kind == 2 and len(changed) < LARGEST:
            changed[at:at] = changed[at : at + dice.randint(1, 60)] * dice.choice((1, 1, 1, 50))
        elif kind == 3:
            changed[at:at] = dice.choice(PIECES)
        elif kind == 4 and dice.random() < 0.2:
            del changed[at:]
        elif changed:
            changed[at] = dice.randrange(256)
    return bytes(changed)


def some_numbers(text: str, dice: random.Random) -> str:
    """One to three numbers replaced, by a similar one or by one of NUMBERS."""
    for _ in range(dice.randint(1, 3)):
        places = list(NUMBER.finditer(text))
        if not places:
            return text
        found = dice.choice(places)
        text = text[: found.start()] + _other(found[0], dice) + text[found.end() :]
    return text


def some_lines(text: str, dice: random.Random) -> str:
    """A line removed, repeated or moved."""
    lines = text.splitlines(keepends=True)
    if not lines:
        return text
    line = lines.pop(dice.randrange(len(lines)))
    for _ in range(dice.randrange(3)):
        lines.insert(dice.randint(0, len(lines)), line)
    return "".join(lines)


def some_text(text: str, dice: random.Random) -> bytes:
    """Numbers, lines or bytes changed."""
    kind = dice.random()
    if kind < 0.6:
        text = some_numbers(text, dice)
    elif kind < 0.75:
        text = some_lines(text, dice)
    else:
        return some_bytes(text.encode(), dice)
    return text.encode("utf-8")


def _other(number: str, dice: random.Random) -> str:
    if dice.random() < 0.4:
        return dice.choice(NUMBERS)
    try:
        value = float(number)
    except (ValueError, OverflowError):
        return dice.choice(NUMBERS)
    return repr(value * dice.choice((-1.0, 0.5, 25.4, 1.001, 1.0 + 0.2 * dice.gauss(0, 1))))
