"""Build sdist and wheel, install the wheel into an empty environment, run README's example there.

    python tools/release_check.py            # or: make release-check

The example runs in another folder, so that nothing comes from the source tree. The sdist must
build the same wheel. Exits with 1 and the reason where anything fails.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Build, install, run; exit with 1 where anything fails."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run(sys.executable, "-m", "build", "--outdir", folder / "dist", ROOT)
        (sdist,) = (folder / "dist").glob("*.tar.gz")
        (wheel,) = (folder / "dist").glob("*.whl")
        check_contents(wheel)
        run(sys.executable, "-m", "twine", "check", "--strict", sdist, wheel)
        venv.create(folder / "env", with_pip=True)
        python = folder / "env" / "bin" / "python"
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
        elsewhere = folder / "elsewhere"
        elsewhere.mkdir()
        printed = run(python, "-c", readme_example(), cwd=elsewhere)
        assert "converged: 1000" in printed, f"README's example printed: {printed}"
        run(python.with_name("gough"), "platforms", cwd=elsewhere)
    print("release-check: sdist and wheel are complete, README's example runs from the wheel")


def check_contents(wheel: Path) -> None:
    """Raise where the wheel lacks a source file or a data file of the package."""
    source = ROOT / "src"
    wanted = {
        str(path.relative_to(source))
        for path in (source / "gough").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    missing = wanted - set(zipfile.ZipFile(wheel).namelist())
    assert not missing, f"the wheel lacks {sorted(missing)}"


def readme_example() -> str:
    """First Python block of README.md."""
    found = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    assert found, "README.md has no Python block"
    return found[1]


def run(*words: object, cwd: Path = ROOT) -> str:
    """Run a command and return its standard output; exit with its messages where it fails."""
    done = subprocess.run([str(w) for w in words], cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"release-check: failed: {words[0]} {words[1]}\n{done.stdout}{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
