"""Make the pictures of `gough view` in the documents, by headless Chromium.

python tools/view_picture.py docs/images/view.png
python tools/view_picture.py docs/images/cell.png cell
"""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path

import chromium
from PIL import Image

from gough import Platform
from gough.view.viewer import Viewer

PATIENCE = 300_000  # [ms]
CELL = Path(__file__).parents[1] / "examples" / "cell.toml"
# machine, frame, pose, and size of the window
PICTURES = {
    "view": ("rubin_camera", None, (0.001, 0.008, 0.01, -0.4, 0.1, -0.1), (1200, 800)),
    "cell": (str(CELL), "tool in work", (0, 0, 20, 35, 0, -45), (1200, 940)),
}


def main(path: str, picture: str = "view") -> None:
    """Move the machine to a pose, and write a screenshot of the page."""
    machine, frame, pose, (width, height) = PICTURES[picture]
    found = chromium.find()
    if found is None:
        sys.exit(chromium.MISSING)
    with (
        chromium.running(found) as browser,
        closing(Viewer(Platform.load(machine), port=0, frame=frame)) as v,
    ):
        page = browser.new_page(viewport={"width": width, "height": height})
        page.set_default_timeout(PATIENCE)
        page.goto(f"http://localhost:{v.port}")
        page.wait_for_selector("[data-gough=status]")
        page.locator("[data-gough=note]").wait_for(state="detached")
        page.locator(".mantine-Notification-closeButton").click()
        boxes = page.locator(".mantine-NumberInput-input")
        for row, value in enumerate(pose):
            boxes.nth(6 + row).fill(str(value))
        page.locator("[data-gough=took]", has_text="inverse").wait_for()
        page.mouse.click(300, height - 20)  # takes the cursor out of the box
        page.wait_for_timeout(2000)  # [ms] for notices to fade
        page.screenshot(path=path)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256, kmeans=4, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
