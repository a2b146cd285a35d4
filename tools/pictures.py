"""Make the pictures of the documents by the commands printed above them.

    python tools/pictures.py            (make pictures)

Runs every `gough` line of the bash blocks of docs/plots.md in one empty folder that has the
`examples`, and moves the .svg files that they write to docs/images.
"""

from __future__ import annotations

import io
import re
import shlex
import shutil
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path

from gough import cli

ROOT = Path(__file__).resolve().parent.parent
PAGE, IMAGES = ROOT / "docs" / "plots.md", ROOT / "docs" / "images"
BLOCK = re.compile(r"^```bash\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def commands(page: Path = PAGE) -> list[str]:
    """List the `gough` lines of a page, continued lines joined."""
    blocks = [block.replace("\\\n", " ") for block in BLOCK.findall(page.read_text("utf-8"))]
    lines = [" ".join(line.split()) for block in blocks for line in block.splitlines()]
    return [line.partition(" #")[0] for line in lines if line.startswith("gough ")]


def make(images: Path = IMAGES) -> list[Path]:
    """Run the commands; returns the paths of the pictures."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        Path("examples").symlink_to(ROOT / "examples")
        for line in commands():
            print(line, flush=True)
            try:
                with redirect_stdout(io.StringIO()):
                    cli.main(shlex.split(line)[1:])
            except SystemExit as end:
                if end.code:
                    raise SystemExit(f"exit code {end.code}: {line}") from None
        made = sorted(Path(folder).glob("*.svg"))
        return [Path(shutil.copy(picture, images / picture.name)) for picture in made]


if __name__ == "__main__":
    for picture in make():
        print(f"{picture.relative_to(ROOT)}: {picture.stat().st_size / 1000:.0f} kB")
