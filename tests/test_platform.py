"""Platforms: TOML there and back, digests, and an error that names the field for every mistake."""

from __future__ import annotations

import dataclasses
import os
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

from gough import GoughError, Platform, PlatformError, Pose, RotaryArms, Workspace, leg_lengths
from gough.errors import CONTROL
from gough.platform_file import catalog_text, from_toml

CATALOG = Platform.catalog()
REFERENCE = Platform.load("reference")
REACHY = Platform.load("reachy_mini")
TOML = REFERENCE.to_toml()
ROTARY_TOML = REACHY.to_toml()


# ---- TOML -----------------------------------------------------------------------------


def test_the_catalog_has_every_machine() -> None:
    assert set(CATALOG) == {
        "reference", "linuxcnc_genhex", "nasa_msfc", "rubin_camera", "rubin_simulink",
        "matlab_stewart", "reachy_mini", "dietmaier",
    }  # fmt: skip


@pytest.mark.parametrize("name", CATALOG)
def test_catalog_machines_survive_their_own_toml(name: str, tmp_path: Path) -> None:
    platform = Platform.load(name)
    assert platform.name == name
    support.assert_same_parts(from_toml(platform.to_toml()), platform)
    assert from_toml(platform.to_toml()) == platform
    assert from_toml(catalog_text(name)) == platform
    platform.save(tmp_path / "copy.toml")
    again = Platform.load(tmp_path / "copy.toml")
    assert again == platform
    assert again.digest == platform.digest


@given(support.random_platforms)
def test_any_platform_survives_its_own_toml(platform: Platform) -> None:
    again = from_toml(platform.to_toml())
    support.assert_same_parts(again, platform)
    assert again == platform
    assert (again.digest, hash(again)) == (platform.digest, hash(platform))
    assert again.to_toml() == platform.to_toml()


@given(st.text(), st.text())
def test_any_name_and_unit_survive_toml(name: str, unit: str) -> None:
    """All but those with control characters, which are refused."""
    if CONTROL.search(name + unit):
        with pytest.raises(PlatformError, match="holds control characters"):
            replace(REFERENCE, name=name, unit=unit)
        return
    platform = replace(REFERENCE, name=name, unit=unit)
    assert from_toml(platform.to_toml()) == platform


@pytest.mark.parametrize("name", CATALOG)
def test_a_machine_is_fit_for_use(name: str) -> None:
    """Home is in the workspace and within the stroke; every pose of the workspace has readings."""
    platform = Platform.load(name)
    assert platform.in_workspace(platform.home)
    legs = leg_lengths(platform, platform.sample_poses(500))
    assert legs.shape == (500, 6)
    assert np.all(np.isfinite(legs))


def test_home_may_be_turned_by_euler_angles() -> None:
    turned = from_toml(TOML.replace("wxyz = [1.0, 0.0, 0.0, 0.0]", "euler_deg = [10, -20, 30]"))
    np.testing.assert_allclose(np.degrees(turned.home.euler), (10, -20, 30), rtol=1e-14)
    upright = from_toml(TOML.replace("wxyz = [1.0, 0.0, 0.0, 0.0]", ""))
    assert upright == REFERENCE


def test_stroke_may_be_one_pair_for_all_legs_and_open_to_one_side() -> None:
    platform = from_toml("stroke = [500, inf]\n" + TOML)
    assert platform.stroke is not None
    np.testing.assert_array_equal(platform.stroke, [[500, np.inf]] * 6)
    assert from_toml(platform.to_toml()) == platform


# ---- saving ---------------------------------------------------------------------------


def test_saving_replaces_the_file_whole_and_leaves_nothing_beside_it(tmp_path: Path) -> None:
    target = tmp_path / "machine.toml"
    target.write_text("old")
    REFERENCE.save(target)
    assert target.read_text() == TOML
    assert os.listdir(tmp_path) == ["machine.toml"]


def test_a_failed_save_leaves_the_old_file(tmp_path: Path, monkeypatch) -> None:
    target = tmp_path / "machine.toml"
    target.write_text("old")

    def full_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full_disk)
    with pytest.raises(PlatformError, match=r"machine\.toml: cannot be written: the disk is full"):
        REFERENCE.save(target)
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["machine.toml"]


def test_saving_into_a_missing_folder_says_so(tmp_path: Path) -> None:
    with pytest.raises(PlatformError, match=r"x\.toml: cannot be written: there is no folder"):
        REFERENCE.save(tmp_path / "nowhere" / "x.toml")


# ---- what loading refuses -------------------------------------------------------------

FIRST = "375.877"  # base[0][0]
HOME = "wxyz = [1.0, 0.0, 0.0, 0.0]"
WRONG_TOML = {
    "a field is missing": (TOML.replace("moving", "moved"), "moving: missing; expected six rows"),
    "home is missing": (TOML.replace("[home]", "[house]"), "home: missing (is 'house' meant"),
    "empty": ("", "base: missing; expected six rows [x, y, z]"),
    "unknown field": (
        "pivots = [0, 0, 1]\n" + TOML,
        "pivots: unknown field; did you mean 'pivot'?",
    ),
    "unknown in a table": (TOML + "rotation = 3", "workspace.rotation: unknown field; did you"),
    "not a table": (
        "home = 3\n" + TOML.split("[home]")[0],
        "home: expected a table with position, wxyz, euler_deg, order; found 3",
    ),
    "array of tables": (
        TOML.replace("[workspace]", "[[workspace]]"),
        "workspace: expected a table with translation, rotation_deg; found [{",
    ),
    "not TOML": (TOML.replace("= [", "= (", 1), "not valid TOML: Invalid value (at line 4"),
    "cut short": (TOML[:200], "not valid TOML: Invalid value (at end of document)"),
    "twice": (TOML.replace("unit", "name"), "not valid TOML: Cannot overwrite a value"),
    "text for a number": (TOML.replace(FIRST, '"1"', 1), "base[0][0]: expected a number, found '1"),
    "true for a number": (TOML.replace(FIRST, "true", 1), "base[0][0]: expected a number, found T"),
    "a date": (TOML.replace(FIRST, "1979-05-27", 1), "base[0][0]: expected a number, found dateti"),
    "NaN": (TOML.replace(FIRST, "nan", 1), "base[0][0]: expected a finite number, found nan"),
    "infinity": (TOML.replace("600.0", "inf"), "home.position[2]: expected a finite number, found"),
    "overflow": (TOML.replace(FIRST, "1e200"), "base[0][0]: expected a number below 1e+100, found"),
    "huge integer": (TOML.replace(FIRST, "9" * 400), "base[0][0]: expected a number, found 99999"),
    "endless integer": (TOML.replace(FIRST, "9" * 5000), "Exceeds the limit (4300 digits)"),
    "deep nesting": ("base = " + "[" * 900 + "]" * 900, "nested too deeply"),
    "five joints": (
        TOML.replace("  [375.877, -136.808, 0.0],\n", ""),
        "base: expected 6 joints, one for each leg, found 5",
    ),
    "a joint of two numbers": (
        TOML.replace(", -136.808", "", 1),
        "base: rows of unequal length; their lengths are [2, 3, 3, 3, 3, 3]",
    ),
    "a number for joints": ("base = 5\n" + TOML[TOML.index("moving") :],
                            "base: expected shape (6, 3), found one number"),
    "text for joints": ("base = '5'\n" + TOML[TOML.index("moving") :],
                        "base: expected a number, found '5'"),
    "unknown legs": (
        TOML.replace('"telescopic"', '"hydraulic"'),
        "legs: expected one of telescopic, length_change, rotary; found 'hydraulic'",
    ),
    "name is no text": (TOML.replace('"reference"', "5"), "name: expected text, found 5"),
    "unit is no text": (TOML.replace('"mm"', "[1]"), "unit: expected text, found [1]"),
    "no position": (TOML.replace("position =", "wxyz =").replace(HOME, ""),
                    "home.position: missing; expected [x, y, z]"),
    "flat position": (TOML.replace("0.0, 600.0", "600.0"), "home.position: expected 3 num"),
    "zero quaternion": (TOML.replace("wxyz = [1", "wxyz = [0"), "home.wxyz: a quaternion of zeros"),
    "quaternion of three": (TOML.replace(HOME, "wxyz = [1, 0, 0]"), "home.wxyz: expected 4 num"),
    "two rotations": (
        TOML.replace(HOME, HOME + "\neuler_deg = [0, 0, 0]"),
        "home: give wxyz or euler_deg, not both",
    ),
    "two angles": (TOML.replace(HOME, "euler_deg = [0, 0]"), "home.euler_deg: expected 3 numbers"),
    "pivot": ("pivot = [1, 2]\n" + TOML, "pivot: expected 3 numbers, found 2 numbers"),
    "stroke of five": ("stroke = [[1, 2], [1, 2]]\n" + TOML, "stroke: expected [lowest, highest]"),
    "stroke upside down": ("stroke = [800, 500]\n" + TOML, "stroke[0]: expected lowest below high"),
    "stroke of NaN": ("stroke = [500, nan]\n" + TOML, "stroke[0]: expected lowest below highest"),
    "stroke forbids home": (
        "stroke = [500, 600]\n" + TOML,
        "stroke[0]: forbids the home pose: leg readings at home are 655.543, allowed are 500 to "
        "600; change home or stroke",
    ),
    "box upside down": (
        TOML.replace("[-50.0, 50.0]", "[50.0, -50.0]"),
        "workspace.translation[0]: expected [lowest, highest], found [50.0, -50.0]",
    ),
    "box too wide": (
        TOML.replace("[-30.0, 30.0]", "[-90.0, 90.0]"),
        "workspace.rotation_deg[1]: the second Euler angle must stay within 90 deg of home",
    ),
    "half a workspace": (TOML.split("rotation_deg")[0], "workspace.rotation_deg: missing; see the"),
    "rotary without arms": (
        TOML.replace('"telescopic"', '"rotary"'),
        "rotary: a platform with rotary legs needs this table",
    ),
    "arms without rotary": (
        ROTARY_TOML.replace('"rotary"', '"length_change"'),
        "rotary: a platform with length_change legs must not have this table",
    ),
    "no rod": (
        ROTARY_TOML.replace("rod_length = 0.085\n", ""),
        "rotary.rod_length: missing; see the catalog for an example",
    ),
    "rod of zero": (
        ROTARY_TOML.replace("rod_length = 0.085", "rod_length = 0"),
        "rotary.rod_length: expected a length above 0, found 0.0",
    ),
    "rod is a list": (
        ROTARY_TOML.replace("rod_length = 0.085", "rod_length = [0.085]"),
        "rotary.rod_length: expected one number, or six for the six legs, got shape (1,)",
    ),
    "rod too long": (
        ROTARY_TOML.replace("rod_length = 0.085", "rod_length = 0.2"),
        "home: the arm and rod of leg 1 cannot reach the home pose; check home, rotary.arm_length",
    ),
    "branch of 0": (
        ROTARY_TOML.replace("branch = [-1.0", "branch = [0.0"),
        "rotary.branch: expected six of 1 or -1, found [0.0, 1.0, -1.0, 1.0, -1.0, 1.0]",
    ),
    "branch of five": (
        ROTARY_TOML.replace("branch = [-1.0, ", "branch = ["),
        "rotary.branch: expected 6 numbers, found 5 numbers",
    ),
    "skew axes": (
        ROTARY_TOML.replace("0.8660247", "0.9"),
        "rotary.axis_x[0], axis_y[0]: expected two unit vectors at right angles, found [0.9",
    ),
    "axes not square": (
        re.sub("axis_x = (.*)axis_y = .*branch", r"axis_x = \1axis_y = \1branch", ROTARY_TOML,
               flags=re.DOTALL),
        "rotary.axis_x[0], axis_y[0]: expected two unit vectors at right angles, found [0.8660",
    ),
    "motor stroke": (
        "stroke = [1.0, 2.0]\n" + ROTARY_TOML,
        "stroke[0]: forbids the home pose: motor angles at home are ",
    ),
    "motor stroke in degrees": (
        "stroke = [-45.0, 60.0]\n" + ROTARY_TOML,
        "stroke: motor angles are in rad, and -45 is more than a turn; if it is degrees, ",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG_TOML)
def test_wrong_toml_is_named(case: str) -> None:
    text, message = WRONG_TOML[case]
    with pytest.raises(PlatformError) as caught:
        from_toml(text, where="mine.toml")
    told = str(caught.value)
    assert told.startswith("mine.toml: ")
    assert message in told
    assert "\n" not in told
    assert len(told) < 400


@given(st.text() | st.text("[]{}=\"'\n.,-+0123456789einfatru# ") | st.binary().map(repr))
def test_hostile_text_is_a_platform_error(text: str) -> None:
    with pytest.raises(PlatformError):
        from_toml(text)


@given(st.data())
def test_damaged_toml_is_a_platform_error_or_a_platform(data: st.DataObject) -> None:
    """Cut, repeat or overwrite pieces of good files."""
    text = data.draw(st.sampled_from([TOML, ROTARY_TOML]))
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        end = start + data.draw(st.integers(0, 40))
        piece = data.draw(st.sampled_from(["", "9", "-", "nan", "[", "]", "\n", "\0", '"', "1e99"]))
        text = text[:start] + piece + text[end:]
    try:
        platform = from_toml(text)
    except PlatformError:
        return
    assert np.all(np.isfinite(platform.home_legs))
    assert from_toml(platform.to_toml()) == platform


# ---- what the constructor refuses -----------------------------------------------------

GOOD = {"base": REFERENCE.base, "moving": REFERENCE.moving, "home": (0, 0, 600)}
LINE = np.arange(18.0).reshape(6, 3)
WRONG_ARGUMENTS = [
    ({"base": None}, "base: expected a number, found None"),
    ({"base": np.zeros((2, 6, 3))}, "base: expected shape (6, 3), found shape (2, 6, 3)"),
    ({"moving": REFERENCE.moving[:, :2]}, "moving: expected shape (6, 3), found shape (6, 2)"),
    ({"moving": np.full((6, 3), "a")}, "moving[0][0]: expected a number, found 'a'"),
    ({"moving": REFERENCE.moving * 1j}, "moving[0][0]: expected a number, found 114.907j"),
    ({"base": LINE}, "base: all six joints lie on one line"),
    ({"moving": LINE * 1e-3}, "moving: all six joints lie on one line"),
    (
        {k: getattr(REFERENCE, k)[[0, 0, 2, 3, 4, 5]] for k in ("base", "moving")},
        "base[0], base[1] and moving[0], moving[1]: legs 1 and 2 share both joints",
    ),
    ({"home": "up"}, "home: expected a number, found 'up'"),
    ({"home": (0, 0)}, "home: expected 3 numbers, found 2 numbers"),
    ({"home": Pose(np.zeros((2, 3)))}, "home: expected one pose, found batch axes (2,)"),
    ({"home": Pose((np.nan, 0, 0))}, "home.position[0]: expected a finite number, found nan"),
    (
        {"home": REFERENCE.base[0] - REFERENCE.moving[0]},
        "home: leg 1 has length 0 there: base[0] and moving[0] are at the same point [375.877",
    ),
    ({"legs": None}, "legs: expected one of telescopic, length_change, rotary; found None"),
    ({"legs": "rotary"}, "rotary: a platform with rotary legs needs this table"),
    ({"legs": "rotary", "rotary": 5}, "rotary: expected a RotaryArms, found 5"),
    ({"rotary": REACHY.rotary}, "rotary: a platform with telescopic legs must not have this table"),
    ({"workspace": (50, 30)}, "workspace: expected a Workspace, found (50, 30)"),
    ({"unit": None}, "unit: expected text, found None"),
    ({"stroke": "wide"}, "stroke: expected a number, found 'wide'"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), WRONG_ARGUMENTS)
def test_wrong_arguments_are_named(arguments: dict, message: str) -> None:
    with pytest.raises(PlatformError) as caught:
        Platform(**(GOOD | arguments))
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ((1, 95), "workspace.rotation_deg[1]: the second Euler angle must stay within 90 deg"),
        ((-1, 1), "workspace.translation[0]: expected [lowest, highest], found [1.0, -1.0]"),
        (("a", 1), "workspace.translation: expected a number, found 'a'"),
        ((1, np.nan), "workspace.rotation_deg[0][0]: expected a finite number, found nan"),
        (([[1, 2]] * 2, 1), "workspace.translation: expected shape (3, 2), found shape (2, 2)"),
    ],
)
def test_wrong_workspaces_are_named(box: tuple, message: str) -> None:
    with pytest.raises(PlatformError) as caught:
        REFERENCE.with_workspace(*box)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("refrence", "no platform is called 'refrence'; did you mean 'reference'? the catalog has"),
        ("", "no platform is called ''; the catalog has dietmaier, linuxcnc_genhex, "),
        ("../catalog/reference", "no platform is called '../catalog/reference'; "),
        ("nowhere.toml", "nowhere.toml: cannot be read: No such file or directory"),
        ("nul\0.toml", "'nul\\x00.toml': cannot be read: embedded null byte"),
    ],
)
def test_unknown_platforms_are_named(name: str, message: str) -> None:
    with pytest.raises(PlatformError) as caught:
        Platform.load(name)
    assert str(caught.value).startswith(message)


def test_a_binary_file_is_no_platform(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(PlatformError, match=r"x\.toml: not a text file; expected TOML"):
        Platform.load(path)


def test_every_error_is_a_value_error() -> None:
    assert issubclass(PlatformError, GoughError)
    assert issubclass(GoughError, ValueError)


# ---- identity -------------------------------------------------------------------------


def test_the_digest_is_the_same_in_every_version_and_on_every_machine() -> None:
    """A changed digest orphans every saved seed and network: change this line only on purpose."""
    assert REFERENCE.digest == "653528e5bbf14068e5749956985fbd1eeba85931db2cd64eca1e820fa6e401af"


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_the_digest_tells_every_fact_but_the_name(name: str) -> None:
    sensors = {"offset": np.linspace(0.1, 0.2, 6) * 1e-3, "gain": np.linspace(0.9, 1.1, 6)}
    plain = replace(Platform.load(name), stroke=None)
    platform = replace(plain, **sensors)
    digests = {platform.digest}
    stated = {f.name for f in dataclasses.fields(platform) if getattr(platform, f.name) is not None}
    assert platform.to_dict().keys() == stated
    changed = _each_number_nudged(platform.to_dict())
    for facts in changed:
        digests.add(from_toml(_toml(facts)).digest)
    digests.add(replace(platform, unit="furlong").digest)
    digests.add(replace(platform, workspace=None).digest)
    digests.add(plain.digest)
    assert len(digests) == 4 + len(changed)
    assert replace(plain, offset=0, gain=np.ones(6)).digest == plain.digest
    assert replace(platform, name="other").digest == platform.digest


def _each_number_nudged(facts: dict) -> list[dict]:
    """Copies of the dictionary, in each of which one number is one part in 10^9 larger."""
    out = []
    skip = {"wxyz", "branch"}  # unit length or +-1: not free to change alone
    for key, value in facts.items():
        if isinstance(value, dict):
            inner = _each_number_nudged({k: v for k, v in value.items() if k not in skip})
            out += [facts | {key: value | change} for change in inner]
        elif isinstance(value, (list, float)) and value:
            array = np.array(value, dtype=float)
            for i in np.ndindex(array.shape):
                nudged = array.copy()
                nudged[i] += 1e-9 * (abs(nudged[i]) or 1.0)
                out.append(facts | {key: nudged.tolist()})
    return out


def _toml(facts: dict) -> str:
    """TOML of plain facts, written apart from the library's own writer."""
    text = "".join(f"{k} = {v!r}\n" for k, v in facts.items() if not isinstance(v, dict))
    for name, table in facts.items():
        if isinstance(table, dict):
            text += f"[{name}]\n" + "".join(f"{k} = {v!r}\n" for k, v in table.items())
    assert tomllib.loads(text) == facts
    return text


def test_equal_platforms_hash_alike_whatever_their_zeros_look_like() -> None:
    negative = replace(REFERENCE, base=np.where(REFERENCE.base == 0, -0.0, REFERENCE.base),
                       home=Pose((-0.0, 0.0, 600.0)))  # fmt: skip
    assert negative == REFERENCE
    assert hash(negative) == hash(REFERENCE)
    assert len({negative, REFERENCE, replace(REFERENCE, unit="m")}) == 2
    assert REFERENCE != "reference"


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
def test_a_platform_cannot_be_changed(name: str) -> None:
    platform = Platform.load(name)
    with pytest.raises(dataclasses.FrozenInstanceError):
        platform.unit = "m"  # pyright: ignore[reportAttributeAccessIssue]
    parts = [platform, platform.home, platform.workspace, platform.rotary]
    held = [
        getattr(part, f.name)
        for part in parts
        if part is not None
        for f in dataclasses.fields(part)
    ]
    held += [platform.home_lengths, platform.home_legs, platform.pivot_point]
    arrays = [value for value in held if isinstance(value, np.ndarray)]
    assert len(arrays) >= 9
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_changing_the_callers_arrays_changes_no_platform() -> None:
    base, home, stroke = REFERENCE.base.copy(), np.array([0.0, 0.0, 600.0]), np.array([500.0, 900])
    platform = Platform(base, REFERENCE.moving, home, stroke=stroke)
    before = platform.digest
    base[:], home[:], stroke[:] = 1.0, 2.0, 3.0
    assert replace(platform).digest == before


def test_repr_says_what_it_is() -> None:
    assert repr(REFERENCE) == "Platform('reference', telescopic legs, size 813.9 [mm])"
    assert "[unit not named]" in repr(Platform.load("nasa_msfc"))


# ---- workspace, origin ----------------------------------------------------------------


@given(support.random_platforms, st.integers(0, 2**63))
def test_samples_are_in_the_workspace_and_fixed_by_the_seed(platform: Platform, seed: int) -> None:
    poses = platform.sample_poses(50, seed=seed)
    assert np.all(platform.in_workspace(poses))
    again = platform.sample_poses(50, seed=seed)
    np.testing.assert_array_equal(poses.matrix, again.matrix)
    assert not np.allclose(poses.matrix, platform.sample_poses(50, seed=seed + 1).matrix)


LOPSIDED = REFERENCE.with_workspace(
    [[-10, 50], [-5, 1], [0, 20]], [[-5, 30], [0, 10], [-40, 0]]
)  # fmt: skip


@pytest.mark.parametrize("platform", [*map(Platform.load, CATALOG), LOPSIDED], ids=repr)
def test_the_workspace_has_edges(platform: Platform) -> None:
    space, home = platform.workspace, platform.home
    assert space is not None
    for axis, (low, high) in enumerate(space.translation):
        for edge, outward in ((low, -1), (high, 1)):
            step = np.zeros(3)
            for beyond, inside in ((0.0, True), (1e-6 * platform.size, False)):
                step[axis] = edge + outward * beyond
                assert platform.in_workspace(Pose(home.position + step, home.wxyz)) == inside
    for axis, (low, high) in enumerate(np.radians(space.rotation_deg)):
        for edge, outward in ((low, -1), (high, 1)):
            angles = np.zeros(3)
            for beyond, inside in ((0.0, True), (1e-6, False)):
                angles[axis] = edge + outward * beyond
                turn = Pose.from_euler(np.zeros(3), angles)
                there = Pose(home.position, (Pose(np.zeros(3), home.wxyz) @ turn).wxyz)
                assert platform.in_workspace(there) == inside


def test_a_platform_without_workspace_takes_every_pose_but_cannot_sample() -> None:
    platform = replace(REFERENCE, workspace=None)
    assert np.all(platform.in_workspace(Pose(np.full((3, 3), 1e9))))
    with pytest.raises(PlatformError, match=r"workspace: platform 'reference' states none; add a"):
        platform.sample_poses(1)
    assert platform.with_workspace(50, 30) == REFERENCE


def test_a_pose_of_nan_is_not_in_the_workspace() -> None:
    assert not REFERENCE.in_workspace(Pose([np.nan] * 3, [np.nan] * 4))


@given(support.seeds)
def test_a_moved_origin_is_the_same_machine(seed: int) -> None:
    """Readings are the same when positions tell where another point of the platform is."""
    rng = np.random.default_rng(seed)
    platform = replace(machines.random_platform(seed), pivot=None)
    point = platform.size * rng.standard_normal(3)
    tool = platform.with_origin_at(point)
    pose = support.sample(platform, (4,), seed)
    at_tool = Pose(pose.apply(point), pose.wxyz)
    np.testing.assert_allclose(leg_lengths(tool, at_tool), leg_lengths(platform, pose), rtol=1e-13)
    np.testing.assert_allclose(tool.home.position, platform.home.apply(point))


@given(support.seeds, st.floats(0, 89), st.sampled_from([0.0, 0.1, 3.0]))
def test_a_moved_origin_keeps_every_pose_of_the_workspace(
    seed: int, deg: float, far: float
) -> None:
    rng = np.random.default_rng(seed)
    platform = replace(machines.random_platform(seed), pivot=None)
    widths = np.sort(rng.uniform(-1, 1, (3, 2)), axis=1)
    platform = platform.with_workspace(0.1 * platform.size * widths, deg * widths[::-1])
    point = far * platform.size * rng.standard_normal(3)
    pose = platform.sample_poses(2_000, seed=1)
    tool = platform.with_origin_at(point)
    at_tool = Pose(pose.apply(point), pose.wxyz)
    assert np.all(tool.in_workspace(at_tool))
    # and little more: every face of the new box is nearly touched
    box, lever = tool.workspace, np.linalg.norm(point)
    assert box is not None
    shift = at_tool.position - tool.home.position
    slack = 0.02 * lever + 0.2 * np.ptp(box.translation, axis=1).max() + 1e-12 * platform.size
    assert np.all(shift.min(axis=0) - box.translation[:, 0] < slack)
    assert np.all(box.translation[:, 1] - shift.max(axis=0) < slack)


def test_a_pivot_and_a_moved_origin_exclude_each_other() -> None:
    with pytest.raises(PlatformError, match="pivot: a platform has a pivot or a moved origin"):
        Platform.load("rubin_camera").with_origin_at((0, 0, 1))


def test_parts_can_be_made_by_hand() -> None:
    space = Workspace(translation=[[-1, 1]] * 3, rotation_deg=[[-5, 5]] * 3)
    assert REFERENCE.with_workspace(1, 5).workspace is not None
    assert replace(REFERENCE, workspace=space) == REFERENCE.with_workspace(1, 5)
    arms = REACHY.rotary
    assert arms is not None
    made = RotaryArms(0.04, 0.085, arms.axis_x.tolist(), arms.axis_y, arms.branch)
    assert replace(REACHY, rotary=made) == REACHY


def test_axes_stated_in_a_few_digits_are_made_exact() -> None:
    arms = REACHY.rotary
    assert arms is not None
    rough = replace(arms, axis_x=np.round(arms.axis_x, 7), axis_y=np.round(arms.axis_y, 7))
    platform = replace(REACHY, rotary=rough)
    legs = platform.home_legs
    tips = platform.base + rough.arm_length[:, None] * (
        np.cos(legs)[:, None] * rough.axis_x + np.sin(legs)[:, None] * rough.axis_y
    )
    rods = np.linalg.norm(platform.home.apply(platform.moving) - tips, axis=-1)
    np.testing.assert_allclose(rods, rough.rod_length, rtol=1e-14)
    again = RotaryArms(**vars(rough))
    np.testing.assert_array_equal(again.axis_y, rough.axis_y)
