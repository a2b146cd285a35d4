import csv as plain_csv
import json
import tomllib

import numpy as np
import pyarrow.parquet as parquet
import pytest
from learn.networks import reference

from gough import GoughError, Pose, assembly_sign, leg_lengths
from gough.learn import data as module
from gough.learn.data import DatasetSpec, HexapodGraph, chunks, dataset, write_dataset


def read(path) -> tuple[list[str], np.ndarray]:
    if path.suffix == ".parquet":
        table = parquet.read_table(path)
        return table.column_names, np.stack([c.to_numpy() for c in table.columns], axis=-1)
    with path.open(newline="") as file:
        rows = list(plain_csv.reader(file))
    return rows[0], np.array(rows[1:], dtype=float)


def test_rows_are_poses_of_the_workspace_with_their_readings():
    platform = reference()
    pose, legs = dataset(platform, DatasetSpec(12_000, seed=3))
    assert len(pose) == len(legs) == 12_000
    assert platform.in_workspace(pose).all()
    np.testing.assert_allclose(legs, leg_lengths(platform, pose), rtol=1e-12)
    angles = pose.euler  # home does not turn here
    np.testing.assert_allclose(angles.std(axis=0), np.radians(30) / 3**0.5, rtol=0.03)


def test_a_smaller_set_is_the_beginning_of_a_larger_one_and_seeds_differ():
    few = dataset(reference(), DatasetSpec(10_000, seed=1))[1]
    many = dataset(reference(), DatasetSpec(20_000, seed=1))[1]
    np.testing.assert_array_equal(few, many[:10_000])
    assert not np.any(few[:, 0] == many[10_000:, 0])
    assert not np.any(few[:, 0] == dataset(reference(), DatasetSpec(10_000, seed=2))[1][:, 0])


def test_the_number_of_processes_changes_no_row(monkeypatch):
    spec = DatasetSpec(25_000, seed=4)
    alone = list(chunks(reference(), spec))
    together = list(chunks(reference(), spec, processes=2))
    assert [len(legs) for _, legs in alone] == [10_000, 10_000, 5_000]
    for (pose, legs), (other, others) in zip(alone, together, strict=True):
        np.testing.assert_array_equal(legs, others)
        np.testing.assert_array_equal(pose.wxyz, other.wxyz)


def test_same_assembly_keeps_poses_on_homes_side():
    wide = reference().with_workspace(100, 60)
    pose, legs = dataset(wide, DatasetSpec(3000, seed=0, same_assembly=True))
    assert len(legs) == 3000
    assert (assembly_sign(wide, pose) > 0).all()


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_compact_files_say_what_they_hold(tmp_path, suffix):
    path = tmp_path / f"data{suffix}"
    write_dataset(reference(), path, DatasetSpec(500, seed=9))
    names, numbers = read(path)
    assert names == ["x", "y", "z", "qw", "qx", "qy", "qz", *(f"leg_{i}" for i in range(1, 7))]
    pose, legs = dataset(reference(), DatasetSpec(500, seed=9))
    np.testing.assert_allclose(numbers[:, :3], pose.position, rtol=1e-15)
    np.testing.assert_allclose(numbers[:, 7:], legs, rtol=1e-15)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    if suffix == ".parquet":
        facts = parquet.read_schema(path).metadata
        assert facts[b"gough.train_rows"] == b"400"
        assert facts[b"gough.unit"] == b"mm"
        assert tomllib.loads(facts[b"gough.toml"].decode())["name"] == "reference"


@pytest.mark.parametrize("rotation", ["quaternion", "euler"])
def test_the_papers_layout_is_its_concatenation(tmp_path, rotation):
    platform = reference()
    path = tmp_path / "paper.parquet"
    write_dataset(platform, path, DatasetSpec(50, seed=9), layout="paper", rotation=rotation)
    names, numbers = read(path)
    turns = 4 if rotation == "quaternion" else 3
    assert numbers.shape == (50, 3 + turns + 6 + 144)
    assert names[-144:][:2] == ["e_1_1", "e_1_2"]
    assert names[-1] == "e_12_12"
    assert np.abs(numbers[:, :3]).max() <= 50  # relative to home, as the paper has it
    E = numbers[:, -144:].reshape(50, 12, 12)
    legs = numbers[:, 3 + turns : 9 + turns]
    np.testing.assert_array_equal(E, HexapodGraph.of(platform).matrix(legs))
    make = Pose if rotation == "quaternion" else Pose.from_euler
    pose = make(numbers[:, :3] + platform.home.position, numbers[:, 3 : 3 + turns])
    np.testing.assert_allclose(leg_lengths(platform, pose), legs, rtol=1e-12)


def test_mistakes_are_named(tmp_path):
    for path, count, text in (
        (tmp_path / "data.txt", 10, ".parquet or .csv"),
        (tmp_path / "data.csv", 0, "1 or more"),
        (tmp_path / "no" / "data.csv", 10, "no folder"),
    ):
        with pytest.raises(GoughError, match=text):
            write_dataset(reference(), path, DatasetSpec(count))
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "data.csv"
    path.write_text("old")
    monkeypatch.setattr(module, "_columns", lambda *a: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_dataset(reference(), path, DatasetSpec(10))
    assert path.read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_training_share_is_eight_of_ten():
    assert DatasetSpec().count == 500_000
    assert DatasetSpec().train_rows == 400_000
    json.dumps(DatasetSpec().__dict__)
