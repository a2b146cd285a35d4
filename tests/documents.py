"""The Python and the commands of README.md, examples/ and docs/, as a reader would run them.

Blocks of one page run in order, in one folder that holds a copy of examples/:

- ```python runs, and shares its names with the page's other Python. If the next thing after it is
  a ```text block, that is what it must print.
- ```console holds commands after `$ `, each followed by what it must print (nothing: anything).
  A command must succeed, unless the next one is `echo $?`.
- ```sh holds commands only; they must succeed.

What is printed must agree word for word, numbers to six digits; `...` stands for anything.
`<!-- not run: reason -->` on the line before a block keeps it from running.

`python tests/documents.py README.md docs/start.md` writes what blocks print into their pages.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import shell

ROOT = Path(__file__).resolve().parent.parent
DOCS = [p for p in sorted((ROOT / "docs").rglob("*.md")) if "_build" not in p.parts]
PAGES = [ROOT / "README.md", ROOT / "examples" / "README.md", *DOCS]

FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r"<!--\s*not run: (?:(?!-->).)+-->\s*\Z", re.DOTALL)
PROMPTED = re.compile(r"^\$ ((?:[^\n]*\\\n)*[^\n]*)\n((?:(?!\$ )[^\n]*\n)*)", re.MULTILINE)
COMMAND = re.compile(r"^(?![ \t]*(?:#|$))((?:[^\n]*\\\n)*[^\n]*)\n", re.MULTILINE)
TOKEN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[A-Za-z_]+|\.\.\.|\S")


@dataclass(frozen=True)
class Step:
    """Python or a command of a page, the line it starts on, what it must print (None: anything)."""

    kind: Literal["python", "shell"]
    code: str
    line: int
    output: str | None = None
    span: tuple[int, int] = (0, 0)  # where the output stands in the page
    may_fail: bool = False


def steps(text: str) -> list[Step]:
    """What of a page runs, in order."""
    found = list(FENCE.finditer(text))
    every: list[Step] = []
    for here, after in zip(found, [*found[1:], None], strict=False):
        if NOT_RUN.search(text[: here.start()]):
            continue
        if here[1] == "python":
            every.append(_python(text, here, after))
        elif here[1] == "console":
            every += _commands(text, here, PROMPTED)
        elif here[1] in ("sh", "bash"):
            every += _commands(text, here, COMMAND)
    return every


def _python(text: str, here: re.Match, after: re.Match | None) -> Step:
    line = text.count("\n", 0, here.start()) + 2
    if after and after[1] == "text" and not text[here.end() : after.start()].strip():
        return Step("python", here[2], line, after[2], after.span(2))
    return Step("python", here[2], line)


def _commands(text: str, block: re.Match, pattern: re.Pattern) -> list[Step]:
    found = list(pattern.finditer(text, *block.span(2)))
    made = []
    for here, after in zip(found, [*found[1:], None], strict=False):
        line = text.count("\n", 0, here.start()) + 1
        may_fail = after is not None and after[1].strip() == "echo $?"
        shown = here[2] if pattern is PROMPTED and here[2].strip() else None
        span = here.span(2) if shown else (0, 0)
        made.append(Step("shell", here[1], line, shown, span, may_fail))
    return made


def run(page: Path, todo: list[Step]) -> Iterator[str]:
    """What each step prints, as it runs. Errors name the page and its line."""
    names: dict = {"__name__": "__main__"}
    code = 0
    for step in todo:
        if step.kind == "shell":
            printed, code = shell.run(step.code, code)
            told = f"{page.name}:{step.line}: exit code {code} of: {step.code}\n{printed}"
            assert code == 0 or step.may_fail, told
            yield printed
            continue
        out = io.StringIO()
        compiled = compile("\n" * (step.line - 1) + step.code, str(page), "exec")
        with contextlib.redirect_stdout(out):
            exec(compiled, names)
        yield out.getvalue()


def differences(page: Path) -> list[str]:
    """Where a page prints something else than it says."""
    todo = steps(page.read_text("utf-8"))
    return [
        f"{page.name}:{step.line} printed\n{printed}\nbut the page says\n{step.output}"
        for step, printed in zip(todo, run(page, todo), strict=True)
        if step.output is not None and not same_output(printed, step.output)
    ]


def with_outputs(page: Path) -> str:
    """The page with each output replaced by what its step prints here."""
    text = page.read_text("utf-8")
    todo = steps(text)
    for step, printed in reversed(list(zip(todo, run(page, todo), strict=True))):
        if step.output is not None and not same_output(printed, step.output):
            lines = [line.rstrip() + "\n" for line in printed.splitlines()]
            text = text[: step.span[0]] + "".join(lines) + text[step.span[1] :]
    return text


def same_output(printed: str, expected: str) -> bool:
    """Word for word, numbers to six digits; `...` in what is expected stands for anything."""
    return _match(TOKEN.findall(printed), TOKEN.findall(expected))


def _match(printed: list[str], expected: list[str]) -> bool:
    """Compare words; between two `...` each part is taken where it first fits, as in a glob."""
    parts: list[list[str]] = [[]]
    for word in expected:
        parts.append([]) if word == "..." else parts[-1].append(word)
    head, *rest = parts
    if not rest:
        return len(printed) == len(head) and _fits(printed, head)
    tail = rest.pop()
    at, end = len(head), len(printed) - len(tail)
    if end < at or not _fits(printed, head) or not _fits(printed[end:], tail):
        return False
    for part in rest:
        found = next((i for i in range(at, end - len(part) + 1) if _fits(printed[i:], part)), None)
        if found is None:
            return False
        at = found + len(part)
    return True


def _fits(printed: list[str], part: list[str]) -> bool:
    """True if `printed` begins with the words of `part`."""
    return len(printed) >= len(part) and all(map(_same_word, printed, part))


def _same_word(a: str, b: str) -> bool:
    if a == b:
        return True
    try:
        x, y = float(a), float(b)
    except ValueError:
        return False
    return abs(x - y) <= 1e-6 * max(abs(x), abs(y)) + 1e-12


@contextlib.contextmanager
def playground() -> Iterator[Path]:
    """A folder with a copy of examples/, to run a page in; it is gone afterwards."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        if (ROOT / "examples").is_dir():
            shutil.copytree(ROOT / "examples", Path(folder, "examples"))
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(before)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        page = Path(name).resolve()
        with playground():
            page.write_text(with_outputs(page), "utf-8")
