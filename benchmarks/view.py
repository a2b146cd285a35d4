"""Speed of the page: from the command to a drawn machine, and while a slider is dragged.

    python benchmarks/view.py      # about a minute; needs Chromium

The page is drawn by Chromium without a graphics card, in software, on the same cores as all
else: the first table's rate is what gough sends to a page that reads as fast as it can, the
second one's what such a browser then draws, by the size of its window.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import msgspec
import numpy as np
import viser
import zstandard
from playwright.sync_api import Browser, Page
from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
import chromium

import gough
from gough.kernel.threads import cores
from gough.view.viewer import Viewer

MACHINES = ("reference", "reachy_mini", "rubin_camera")
CELL = Path(__file__).parents[1] / "examples" / "cell.toml"  # joint cones, thick legs, and frames
WINDOWS = ((640, 480), (1360, 900))
SECONDS = 5.0
RATE = 120  # slider positions sent in a second

# drags a slider by as many events as frames, and counts the frames that had something new
DRAG = """async ([row, seconds]) => {
  const root = document.querySelectorAll('.mantine-Slider-root')[row];
  const track = root.querySelector('.mantine-Slider-trackContainer') || root;
  const box = track.getBoundingClientRect(), y = box.top + box.height / 2;
  const at = (kind, x, on) => on.dispatchEvent(new MouseEvent(kind,
    {bubbles: true, cancelable: true, clientX: x, clientY: y, buttons: 1}));
  const middle = box.left + box.width / 2;
  let news = 0, fresh = false, frames = 0;
  const watch = new MutationObserver(() => { fresh = true; });
  watch.observe(document.querySelector('[data-gough=status]').closest('div').parentElement
    .parentElement, {subtree: true, childList: true, characterData: true});
  at('mousedown', middle, track);
  const begin = performance.now();
  while (performance.now() - begin < 1000 * seconds) {
    at('mousemove', middle + 0.05 * box.width * Math.sin((performance.now() - begin) / 300),
       document);
    await new Promise(requestAnimationFrame);
    frames += 1;
    news += fresh;
    fresh = false;
  }
  at('mouseup', middle, document);
  watch.disconnect();
  return [frames / seconds, news / seconds];
}"""


def main() -> None:
    load = os.getloadavg()[0]
    print(f"{cores()} cores, load before the start {load:.1f}, viser {viser.__version__}\n")
    print("| machine | slider positions/s sent | pictures/s that arrive |")
    print("|---|---|---|")
    for name, frame in [*((name, None) for name in MACHINES), (str(CELL), "tool in work")]:
        sent, came = over_the_wire(name, frame)
        print(f"| {Path(name).stem} | {sent:.0f} | {came:.0f} |", flush=True)
    found = chromium.find()
    if found is None:
        sys.exit(chromium.MISSING)
    with chromium.running(found) as browser:
        start_table(browser)
        drag_table(browser)
    print(f"\nload at the end {os.getloadavg()[0]:.1f}")


def over_the_wire(name: str, frame: str | None) -> tuple[float, float]:
    """Positions of a leg slider sent, and positions of the plate received, a second."""
    machine = gough.Platform.load(name)
    with closing(Viewer(machine, port=0, frame=frame)) as viewer:
        viewer._connected.set()
        while not viewer._ready:
            time.sleep(0.05)
        slider = viewer.panel._legs[2].handle
        places: set[tuple] = set()
        stop = threading.Event()
        protocol = f"viser-v{viser.__version__}"
        address = f"ws://localhost:{viewer.port}"
        with connect(address, subprotocols=[protocol], max_size=None) as wire:  # pyright: ignore
            wire.send(_camera())
            reader = threading.Thread(target=_read, args=(wire, places, stop))
            reader.start()
            time.sleep(1.0)
            places.clear()
            begin, sent = time.perf_counter(), 0
            while (now := time.perf_counter() - begin) < SECONDS:
                value = slider.min + (slider.max - slider.min) * (0.5 + 0.02 * np.sin(3 * now))
                update = {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid}
                wire.send(msgspec.msgpack.encode(update | {"updates": {"value": float(value)}}))
                sent += 1
                time.sleep(max(0.0, begin + sent / RATE - time.perf_counter()))
            came = len(places)
            stop.set()
            reader.join()
    return sent / SECONDS, came / SECONDS


def _camera() -> bytes:
    """First message of a browser."""
    message = {
        "type": "ViewerCameraMessage", "wxyz": (1.0, 0.0, 0.0, 0.0), "position": (1.0, 1.0, 1.0),
        "fov": 0.7, "near": 0.01, "far": 100.0, "look_at": (0.0, 0.0, 0.0),
        "up_direction": (0.0, 0.0, 1.0), "image_height": 900, "image_width": 1360,
    }  # fmt: skip
    return msgspec.msgpack.encode(message)


def _read(wire, places: set[tuple], stop: threading.Event) -> None:
    """Collect the different positions of the plate that arrive."""
    unpack = zstandard.ZstdDecompressor()
    while not stop.is_set():
        try:
            data = wire.recv(timeout=0.2)
        except TimeoutError:
            continue
        size = int.from_bytes(data[8:16], "little")
        length = int.from_bytes(data[:8], "little")
        window = msgspec.msgpack.decode(unpack.decompress(data[16 : 16 + size], length))
        for message in window["messages"]:
            if message["type"] == "SetPositionMessage" and message["name"] == "/plate":
                places.add(tuple(message["position"]))


def start_table(browser: Browser) -> None:
    """Seconds from the command to the address, and to the picture in a browser that runs."""
    print("\n| machine | command to address | command to picture |\n|---|---|---|")
    for name in MACHINES:
        page = browser.new_page(viewport={"width": 1360, "height": 900})
        begin = time.perf_counter()
        command = [sys.executable, "-m", "gough.cli", "view", "-p", name, "--port", "0"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            address = process.stdout.readline().split()[3]
            announced = time.perf_counter() - begin
            drawn(page, address)
            seen = time.perf_counter() - begin
            process.terminate()
        page.close()
        print(f"| {name} | {announced:.2f} s | {seen:.2f} s |", flush=True)


def drag_table(browser: Browser) -> None:
    """Frames a second while a leg slider is dragged in the page."""
    print("\n| machine, window | frames/s | of them with new numbers/s |\n|---|---|---|")
    for width, height in WINDOWS:
        page = browser.new_page(viewport={"width": width, "height": height})
        with closing(Viewer(gough.Platform.load("reference"), port=0)) as viewer:
            drawn(page, f"http://localhost:{viewer.port}")
            while not viewer._ready:
                time.sleep(0.05)
            time.sleep(2.0)
            frames, news = page.evaluate(DRAG, [2, SECONDS])
        page.close()
        print(f"| reference, {width} x {height} | {frames:.0f} | {news:.0f} |", flush=True)


def drawn(page: Page, address: str) -> None:
    """Open a page, and wait for two frames after its numbers have come."""
    page.goto(address, wait_until="commit")
    page.wait_for_selector("[data-gough=status]")
    page.evaluate("() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))")


if __name__ == "__main__":
    main()
