"""The page itself, driven in headless Chromium as a person would drive it."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gough
from gough import Platform
from gough.view.export import page as html_page
from gough.view.follow import REFUSED
from gough.view.model import UNCHANGED, Model
from gough.view.trajectory import read
from gough.view.viewer import Viewer

from .conftest import Tab

EXAMPLE = Path(__file__).parents[2] / "examples" / "rubin_camera_legs.csv"
CELL = Path(__file__).parents[2] / "examples" / "cell.toml"
Show = Callable[..., Viewer]


def pixels(tab: Tab) -> bytes:
    """The left half of the page, where the machine is."""
    tab.settle()
    return tab.page.screenshot(clip={"x": 0, "y": 0, "width": 900, "height": 900})


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera", "dietmaier"])
def test_it_opens_without_a_word_and_without_a_network(show: Show, tab: Tab, name: str):
    viewer = show(name)
    assert tab.status.startswith(("Within ", "The platform states no limits"))
    tab.await_ready()
    tab.shot("home")
    assert tab.elsewhere(f"http://localhost:{viewer.port}") == []
    assert len(set(pixels(tab))) > 100, "the page shows no picture"


def test_a_leg_slider_moves_the_pose(show: Show, tab: Tab):
    viewer = show("reference")
    tab.await_ready()
    before, picture = tab.numbers(), pixels(tab)
    slider = tab.page.locator(".mantine-Slider-root").nth(2)
    box = slider.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 10, y, steps=3)
    tab.page.mouse.up()
    tab.await_took("forward kinematics")
    tab.await_other(8, "600")
    after = tab.numbers()
    tab.shot("moved")
    assert after[2] > before[2]
    assert after[:2] == before[:2]
    assert after[3:6] == before[3:6]
    assert np.any(np.abs(np.subtract(after[6:], before[6:])) > 0.1)
    assert "forward kinematics" in tab.page.inner_text("[data-gough=took]")
    assert pixels(tab) != picture
    legs = gough.leg_lengths(viewer.platform, viewer.model.pose)
    np.testing.assert_allclose(legs, viewer.model.legs, atol=1e-9)
    np.testing.assert_allclose(after[:6], legs, atol=0.01)


def test_a_pose_slider_moves_the_legs(show: Show, tab: Tab):
    viewer = show("reachy_mini")
    before = tab.number(0).input_value()
    tab.number(11).fill("10")  # rz
    tab.await_took("inverse")
    tab.settle()
    legs = np.degrees(gough.leg_lengths(viewer.platform, viewer.model.pose))
    assert viewer.model.numbers[5] == 10
    tab.await_other(0, before)
    np.testing.assert_allclose(tab.numbers()[:6], legs, atol=0.02)
    tab.shot("turned")
    shown = gough.Pose(viewer.model.pose.position, viewer.model.pose.wxyz)
    tab.click("Home")
    tab.await_took("home")
    assert viewer.model.pose is viewer.platform.home
    tab.click("Undo")
    tab.await_took("undone")
    assert np.array_equal(viewer.model.pose.wxyz, shown.wxyz)
    assert viewer.model.numbers[5] == 10


def test_a_mode_can_be_picked(show: Show, tab: Tab):
    viewer = show("reference")
    tab.await_ready()
    tab.tab("Modes")
    tab.click("Find all assembly modes")
    tab.page.get_by_text("16 poses").wait_for()
    tab.shot("ghosts")
    modes = gough.assembly_modes(viewer.platform, viewer.platform.home_legs)
    fifth = tab.mode(5)
    picture = pixels(tab)
    fifth.click()
    tab.await_took("assembly mode")
    tab.shot("picked")
    assert pixels(tab) != picture
    shift, turn = modes.pose.distance(viewer.model.pose)
    picked = int(np.argmin(shift + turn))
    assert shift[picked] < 1e-9
    rank = gough.choose_mode(modes).rank
    assert rank[picked] == 4
    assert np.array_equal(viewer.model.legs, viewer.platform.home_legs)
    # other readings have other modes
    tab.tab("Move")
    tab.number(8).fill(f"{viewer.model.numbers[2] + 5:.1f}")
    tab.tab("Modes")
    tab.page.get_by_text("The readings have changed").wait_for()
    assert not fifth.is_visible()


def test_all_forty_modes_of_dietmaiers_machine_are_listed(show: Show, tab: Tab):
    show("dietmaier")
    tab.await_ready()
    tab.tab("Modes")
    tab.click("Find all assembly modes")
    tab.page.get_by_text("40 poses").wait_for()
    tab.mode(40).wait_for()
    tab.shot("forty")


def test_what_cannot_be_reached_says_so_and_moves_nothing(show: Show, tab: Tab):
    viewer = show("reference")
    tab.await_ready()
    picture = pixels(tab)
    tab.number(3).fill("800")
    tab.await_status(REFUSED["unreachable"])
    tab.shot("unreached")
    assert tab.status.endswith(UNCHANGED)
    assert tab.page.get_attribute("[data-gough=status]", "data-reached") == "false"
    assert viewer.model.pose is viewer.platform.home
    assert pixels(tab) == picture
    assert tab.numbers()[3] == 800
    tab.click("Undo")
    tab.await_other(3, "800")
    np.testing.assert_allclose(tab.numbers()[:6], viewer.platform.home_legs, atol=0.01)


def test_home_is_seen_in_a_small_window_and_the_page_is_dark_if_the_browser_is(
    show: Show, tab: Tab
):
    tab.page.set_viewport_size({"width": 1000, "height": 700})
    tab.page.emulate_media(color_scheme="dark")
    show("rubin_camera")
    tab.page.locator("html[data-mantine-color-scheme=dark]").wait_for()
    tab.page.get_by_role("button", name="Home").wait_for()
    box = tab.page.get_by_role("button", name="Home").bounding_box()
    assert box is not None
    assert box["y"] + box["height"] < 700
    before = pixels(tab)
    tab.click("Top")
    tab.page.wait_for_timeout(500)
    tab.shot("top")
    assert pixels(tab) != before


def test_numbers_are_copied_with_all_their_digits(show: Show, tab: Tab):
    viewer = show("reachy_mini")
    tab.number(11).fill("10")
    tab.await_took("inverse")
    copied = tab.page.get_by_role("button", name="copy readings").get_attribute("data-copy")
    assert copied is not None
    assert [float(word) for word in copied.split()] == viewer.model.legs.tolist()
    tab.page.get_by_role("button", name="copy readings").click()
    tab.page.get_by_role("button", name="copied").wait_for()


def test_legs_out_of_stroke_are_red(show: Show, tab: Tab):
    show("rubin_camera")
    tab.click("Handle")  # which has a red arrow
    few = red_pixels(tab)
    tab.number(8).fill("0.02")
    tab.await_status("Shown beyond its limits: legs 1, 2, 3, 4, 5, 6 below their stroke")
    tab.shot("out")
    assert red_pixels(tab) > 5 * few + 500


def red_pixels(tab: Tab) -> int:
    """How many pixels of the picture are red."""
    with Image.open(BytesIO(pixels(tab))) as picture:
        red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB"), float), -1, 0)
    return int(np.sum((red > 120) & (red > 2.5 * green) & (red > 2 * blue)))


def test_the_handle_moves_the_plate(show: Show, tab: Tab):
    viewer = show("reference")
    assert viewer.scene.handle is not None
    tab.settle()
    hub = np.array(viewer.scene.handle.position)
    start, end = (on_screen(viewer, hub + np.array([0, 0, h])) for h in (0.15, 0.25))
    tab.page.mouse.move(*start)
    tab.page.mouse.move(start[0] + 1, start[1])
    tab.page.mouse.down()
    tab.page.mouse.move(*end, steps=5)
    tab.page.mouse.up()
    tab.await_took("inverse")
    tab.shot("dragged")
    x, y, z = viewer.model.pose.position
    assert z > viewer.platform.home.position[2] + 10
    assert abs(x) + abs(y) < 1
    np.testing.assert_allclose(viewer.model.pose.wxyz, viewer.platform.home.wxyz, atol=1e-6)


def on_screen(viewer: Viewer, point: np.ndarray) -> tuple[float, float]:
    """Where a drawn point is on the page [pixel], by the camera that the page starts with."""
    camera = viewer.server.initial_camera
    forward = camera.look_at - camera.position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    offset = point - camera.position
    depth = offset @ forward
    scale = 900 / 2 / np.tan(camera.fov / 2)
    return (
        1360 / 2 + scale * float(offset @ right) / depth,
        900 / 2 - scale * float(offset @ np.cross(right, forward)) / depth,
    )


def test_a_file_plays(show: Show, tab: Tab):
    platform = Platform.load("rubin_camera")
    trajectory = read(EXAMPLE, platform, rows=100)
    viewer = show("rubin_camera", trajectory=trajectory)
    tab.page.get_by_text(trajectory.about).wait_for()
    tab.page.get_by_text("row 1 of 1,000").wait_for()
    tab.shot("first")
    assert tab.number(0).input_value() == "1"  # as in the file
    tab.number(0).fill(str(trajectory.number[30]))
    tab.page.get_by_text(trajectory.where(30)).wait_for()
    np.testing.assert_allclose(viewer.model.legs, trajectory.legs[30], atol=0)
    cell = tab.page.locator("[data-gough=numbers] td").nth(1)
    assert float(cell.inner_text()) == pytest.approx(trajectory.legs[30, 0], abs=1e-6)
    tab.click("Play")
    tab.click("Pause")
    assert 30 <= viewer._player.row < len(trajectory)
    tab.number(0).fill(str(trajectory.number[-2]))
    tab.page.get_by_text(trajectory.where(len(trajectory) - 2)).wait_for()
    tab.click("Play")
    tab.page.get_by_text(trajectory.where(len(trajectory) - 1)).wait_for()
    tab.page.get_by_role("button", name="Play").wait_for()  # it stops at the end
    tab.shot("last")


def test_the_button_saves_a_page(show: Show, tab: Tab, tmp_path: Path):
    show("reference")
    tab.number(11).fill("10")
    tab.await_took("inverse")
    with tab.page.expect_download() as waiting:
        tab.click("Save page")
    path = tmp_path / "saved.html"
    waiting.value.save_as(path)
    assert "<td>rz [deg]</td><td>10.0000</td>" in path.read_text("utf-8")


# ---- pages without a server ------------------------------------------------------------


@pytest.mark.offline
def test_an_exported_page_opens_offline(tab: Tab, tmp_path: Path):
    model = Model(Platform.load("reachy_mini"))
    model.ask_numbers({5: 12.0})
    path = tmp_path / "reachy.html"
    path.write_text(html_page(model), "utf-8")
    tab.open(path.as_uri())
    tab.shot("page")
    assert tab.requests[0] == path.as_uri()
    assert tab.elsewhere(path.as_uri()) == []
    assert tab.status == model.answer.text
    assert "12" in tab.page.inner_text("#gough")
    assert tab.page.title() == "reachy_mini · gough"
    assert len(set(pixels(tab))) > 100


@pytest.mark.offline
def test_an_exported_trajectory_plays_offline(tab: Tab, tmp_path: Path):
    platform = Platform.load("rubin_camera")
    trajectory = read(EXAMPLE, platform, rows=100)
    path = tmp_path / "rubin.html"
    path.write_text(html_page(Model(platform), trajectory), "utf-8")
    tab.open(path.as_uri())
    tab.shot("page")
    clock = tab.page.locator("input").first
    first = float(clock.input_value())
    tab.page.wait_for_function("t => Number(document.querySelector('input').value) != t", arg=first)
    assert tab.elsewhere(path.as_uri()) == []
    assert tab.status == trajectory.about
    clock.fill("1.5")
    row = int(np.searchsorted(trajectory.time, 1.5, side="right")) - 1
    tab.page.get_by_text(trajectory.where(row)).wait_for()
    cells = tab.page.locator("[data-gough=numbers] td")
    assert float(cells.nth(1).inner_text()) == pytest.approx(trajectory.legs[row, 0], abs=1e-6)


def test_a_frame_shows_what_is_left_in_it_and_names_legs_that_touch(show: Show, tab: Tab):
    viewer = show(str(CELL), frame="tool in work")
    tab.await_ready()
    bars = tab.page.locator("[data-gough=reach]", has_text="about z")
    bars.wait_for()
    before = bars.inner_text()
    assert "leg 1: stroke" in before
    tab.number(9).fill("40")  # rx
    tab.await_status("Shown beyond its limits: legs 2 and 3 touch")
    tab.page.wait_for_function(
        "t => document.querySelector('[data-gough=reach]').innerText != t", arg=before
    )
    assert "legs 2 and 3: clearance" in bars.inner_text()
    tab.shot("touching")
    shown = viewer.platform.frame("tool in work").of(viewer.model.pose)
    np.testing.assert_allclose(np.degrees(shown.euler[0]), 40, atol=1e-9)
