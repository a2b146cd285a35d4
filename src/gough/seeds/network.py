"""A trained network as a first guess, run by onnxruntime: PyTorch is not needed.

A network's file is plain ONNX. Its metadata entry "gough" is a JSON text that names its platform
and unit, the meaning of its numbers and how it was trained; its last entry, "gough.sha256", is a
checksum of all bytes before that entry, so that a truncated or altered file is refused.
"""

from __future__ import annotations

import hashlib
import json
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gough import quaternion
from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.platform import Platform
from gough.pose import Pose

if TYPE_CHECKING:
    from gough.seeds.universal import UniversalSeed

FORMAT = 1
NETWORK = "network.onnx"
KEYS = {"kind", "platform", "platform_name", "unit"}  # which the facts of all networks have
OTHER_FORMAT = "a network of another format; train again with this version"
WIDTHS = {"quaternion": 7, "nine": 12, "euler": 6}  # numbers of an output, by form of the rotation
CHUNK = 1024  # rows evaluated at a time: more take memory, and no less time
_KEY = b"gough.sha256"
_ENTRY = len(_KEY) + 64 + 4
_HEAD = b"\x72" + bytes([_ENTRY]) + b"\x0a" + bytes([len(_KEY)]) + _KEY + b"\x12\x40"
_SEAL = len(_HEAD) + 64


class NetworkSeed:
    """A trained network for one platform; a `gough.seeds.base.Seed`.

    Attributes:
        name: name for messages.
        facts: metadata of its file: kind, parameters, configuration, training record, ...
        leg_range: (6, 2) lowest and highest reading it was trained on.
    """

    def __init__(self, platform: Platform, path: str | Path, *, threads: int = 0) -> None:
        """Load a .onnx file, or that of a run's folder.

        Args:
            threads: CPU threads for evaluation; 0: as many as there are cores.

        Raises:
            GoughError: no such file, a damaged one, or one of another platform or unit.
        """
        file = Path(path)
        file = file / NETWORK if file.is_dir() else file
        self._open(platform, read(file), str(path), threads)

    @classmethod
    def shipped(cls, platform: Platform, name: str = "disgnet", *, threads: int = 0) -> NetworkSeed:
        """A network that comes with the package.

        Raises:
            GoughError: there is none of this name for this platform.
        """
        seed = cls.__new__(cls)
        ours = {facts["kind"]: file for file, facts in _shipped(platform)}
        if name not in ours:
            there = f"there are: {', '.join(sorted(ours))}" if ours else "there is none for it"
            raise GoughError(
                f"no network {name!r} is shipped for platform {platform.name!r} as it is now "
                f"({there}); train one with: gough train -p your-platform.toml"
            )
        content = resources.files("gough").joinpath("weights", ours[name]).read_bytes()
        seed._open(platform, content, ours[name], threads)
        return seed

    def _open(self, platform: Platform, content: bytes, where: str, threads: int) -> None:
        self.facts = read_facts(content, where)
        _check_platform(platform, self.facts, where)
        self._session, self._where = session(content, where, threads), where
        self.name, self._platform = self.facts["kind"], platform
        try:
            self._rotation = self.facts["rotation"]
            width = WIDTHS[self._rotation]
            self.leg_range: Array = _numbers(self.facts, "leg_range", (6, 2))
            scaling = self.facts["scaling"]
            self._mean, self._scale, self._turn = (
                _numbers(scaling, name, (3,))
                for name in ("shift_mean", "shift_scale", "turn_scale")
            )
        except (GoughError, KeyError, TypeError) as error:
            raise GoughError(f"{where}: {OTHER_FORMAT} ({error})") from None
        found = [put.shape for put in self._session.get_outputs()]
        if len(found) != 1 or len(found[0]) != 2 or found[0][1] != width:
            raise GoughError(f"{where}: {OTHER_FORMAT} (outputs {found}, expected {width} numbers)")

    def guess(self, legs: Array) -> Pose:
        """Poses (N,) for readings (N, 6), finite for finite readings.

        Readings outside the range trained on are moved to its nearest end, since a network's
        values beyond it mean nothing. `outside` names the rows that this concerns.

        Example:
            >>> seed = gough.NetworkSeed.shipped(gough.Platform.load("reference"), "resmlp")
            >>> seed.guess(seed.leg_range.mean(axis=1)[None]).batch
            (1,)
        """
        legs = as_batch("legs", legs, (6,))
        flat = np.clip(legs.reshape(-1, 6), *self.leg_range.T)
        parts = [flat[i : i + CHUNK] for i in range(0, len(flat), CHUNK)]
        raw = [run(self._session, self._where, {"legs": part})[0] for part in parts]
        outputs = np.concatenate([*raw, np.zeros((0, WIDTHS[self._rotation]))])
        with np.errstate(all="ignore"):  # a network of wild weights gives no finite numbers
            return self._decode(outputs.reshape(*legs.shape[:-1], outputs.shape[-1]))

    def outside(self, legs: Array) -> NDArray[np.bool_]:
        """Return which rows (N,) have a reading outside the range trained on, or NaN."""
        inside = (legs >= self.leg_range[:, 0]) & (legs <= self.leg_range[:, 1])
        return ~np.all(inside, axis=-1)

    def _decode(self, raw: Array) -> Pose:
        """Raw numbers (..., 7, 12 or 6) to poses; see `gough.learn.models.base.PoseNetwork`."""
        home = self._platform.home
        shift = self._mean + self._scale * raw[..., :3]
        rest = raw[..., 3:]
        if self._rotation == "quaternion":
            turn = rest
        elif self._rotation == "euler":
            turn = Pose.from_euler(shift, self._turn * rest).wxyz
        else:
            matrices = nearest_rotations(rest.reshape(*rest.shape[:-1], 3, 3))
            turn = Pose.from_rotation(shift, matrices).wxyz
        return Pose(home.position + shift, quaternion.product(home.wxyz, turn))


def nearest_rotations(matrices: Array) -> Array:
    """Rotation nearest to each matrix M = U S V^T, U diag(1, 1, det(U V^T)) V^T, (..., 3, 3).

    Newton's iteration for the polar factor (Higham 1986), which converges in about five steps
    for matrices near a rotation, as a trained network's are; the others are decomposed.
    """
    x = matrices.reshape(-1, 3, 3)
    with np.errstate(all="ignore"):
        close = np.linalg.det(x) > 0.1
        close &= np.sum(x * x, axis=(1, 2)) < 30
        out = np.where(close[:, None, None], x, np.eye(3))
        for _ in range(10):
            new = (out + _inverse_transposed(out)) / 2
            moved = np.abs(new - out).max(initial=0.0)
            out = new
            if moved < 1e-9:  # the next step would change 1e-18
                break
    rest = np.flatnonzero(~close)
    if rest.size:
        u, _, vt = np.linalg.svd(np.nan_to_num(x[rest]))
        u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]
        out[rest] = u @ vt
    return out.reshape(matrices.shape)


def _inverse_transposed(m: Array) -> Array:
    """M^-T, (N, 3, 3): its rows are cross products of M's."""
    a, b, c = m[:, 0], m[:, 1], m[:, 2]
    cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
    return cofactors / np.sum(a * cofactors[:, 0], axis=-1)[:, None, None]


# ---- files --------------------------------------------------------------------------------


def seal(body: bytes) -> bytes:
    """An ONNX file with its checksum as a last metadata entry.

    A protocol buffer may be followed by more entries of a repeated field: the entry is field
    14 of the model, with the strings 1 (key) and 2 (value).
    """
    return body + _HEAD + hashlib.sha256(body).hexdigest().encode()


def _unseal(content: bytes, where: str) -> bytes:
    """The ONNX file without its checksum, which must be right."""
    body, head, digest = content[:-_SEAL], content[-_SEAL:-64], content[-64:]
    if head != _HEAD or hashlib.sha256(body).hexdigest().encode() != digest:
        raise GoughError(
            f"{where}: truncated, corrupt, or not a network written by gough; copy it again, or "
            "train again"
        )
    return body


def read_facts(content: bytes, where: str) -> dict:
    """Read the metadata of a network's file.

    Raises:
        GoughError: a damaged file, or one of another format.
    """
    return _facts(_unseal(content, where), where)


def _facts(body: bytes, where: str) -> dict:
    """The JSON text of the metadata entry "gough", without parsing the graph.

    onnxruntime's `get_modelmeta` gives it as well, but only from a session, which optimises the
    whole graph first; the names of all networks that come with the package are read at each solve.
    """
    at = body.rfind(b"\x0a\x05gough\x12")
    try:
        size, start = _varint(body, at + 8)
        facts = json.loads(body[start : start + size])
    except (IndexError, ValueError):
        facts = {}
    facts = facts if at >= 0 and isinstance(facts, dict) else {}
    if facts.get("format") != FORMAT or not facts.keys() >= KEYS:
        raise GoughError(f"{where}: {OTHER_FORMAT}")
    recipe = facts.get("config", {}).get("optimiser", {})
    if facts["kind"] == "disgnet" and "refresh" not in recipe:
        facts["kind"] = "disgnet-linear"  # which was called so before the nonlinear reading
    return facts


def _numbers(facts: dict, name: str, shape: tuple[int, ...]) -> Array:
    """Finite numbers of a network's facts.

    Raises:
        GoughError: others.
    """
    values = as_batch(name, facts[name], shape)
    if values.shape != shape or not np.all(np.isfinite(values)):
        raise GoughError(f"{name}: expected {shape} finite numbers")
    return values


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Read a protocol buffer's whole number at `at`; return it and the position of its end."""
    value, shift = 0, 0
    while True:
        byte = data[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at


def _check_platform(platform: Platform, facts: dict, where: str) -> None:
    if facts["unit"] != platform.unit:
        raise GoughError(
            f"{where}: trained in {facts['unit'] or 'no named unit'!r}, but platform "
            f"{platform.name!r} is in {platform.unit or 'no named unit'!r}; use weights trained "
            "for it"
        )
    if facts["platform"] != platform.digest:
        raise GoughError(
            f"{where}: weights of platform {facts['platform_name']!r}, not of {platform.name!r} as "
            "it is now (joints, home, legs or workspace differ); train a network for it"
        )


def read(path: Path) -> bytes:
    """The content of a file.

    Raises:
        GoughError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise GoughError(f"{path}: cannot be read: {error.strerror}") from None


def _shipped_files() -> list:
    files = resources.files("gough").joinpath("weights")
    if not files.is_dir():
        return []
    return sorted((f for f in files.iterdir() if f.name.endswith(".onnx")), key=lambda f: f.name)


def find_network(platform: Platform, name: str | Path) -> NetworkSeed | UniversalSeed:
    """Open the network of a name that comes with the package, or of a run's or file's path.

    Raises:
        GoughError: there is none, or it is damaged or of another platform.
    """
    from gough.seeds.universal import KIND, UniversalSeed

    if str(name) == KIND:
        return UniversalSeed(platform)
    if Path(name).exists():
        file = Path(name) / NETWORK if Path(name).is_dir() else Path(name)
        universal = read_facts(read(file), str(name))["kind"] == KIND
        return (UniversalSeed if universal else NetworkSeed)(platform, name)
    if Path(name).suffix or len(Path(name).parts) > 1:
        raise GoughError(f"{name}: no such run's folder or .onnx file")
    return NetworkSeed.shipped(platform, str(name))


def shipped_names(platform: Platform) -> list[str]:
    """Networks that come with the package for a platform, as it is now."""
    return sorted(facts["kind"] for _, facts in _shipped(platform))


def shipped_weights(platform: Platform, name: str) -> Path | None:
    """The file for the weights of a network that comes with the package, None for other names."""
    for file, facts in _shipped(platform):
        if facts["kind"] == name:
            folder = Path(str(resources.files("gough").joinpath("weights")))
            return (folder / file).with_suffix(".safetensors")
    return None


def _shipped(platform: Platform) -> list[tuple[str, dict]]:
    """File name and facts of each of them."""
    out = []
    for file in _shipped_files():
        facts = read_facts(file.read_bytes(), file.name)
        if facts["platform"] == platform.digest:
            out.append((file.name, facts))
    return out


def run(session: Any, where: str, inputs: dict[str, Array]) -> list[Array]:
    """Evaluate a network.

    Raises:
        GoughError: it does not take these inputs.
    """
    try:
        return session.run(None, inputs)
    except Exception as error:  # onnxruntime's exceptions have no common base but this
        reason = str(error).splitlines()[0]
        raise GoughError(f"{where}: onnxruntime cannot run this network: {reason}") from None


def session(content: bytes, where: str, threads: int):
    """An onnxruntime session that evaluates a network's file on the CPU.

    Raises:
        GoughError: onnxruntime cannot run it.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.enable_cpu_mem_arena = False
    options.log_severity_level = 3
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    try:
        return onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions have no common base but this
        reason = str(error).splitlines()[0]
        raise GoughError(f"{where}: onnxruntime cannot run this network: {reason}") from None
