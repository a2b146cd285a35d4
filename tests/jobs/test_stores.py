"""Jobs in an object store: an S3 server (moto) behind a proxy that loses and refuses requests."""

from __future__ import annotations

import dataclasses

import pyarrow.parquet as pq
import pytest
from pyarrow import fs

from gough.errors import GoughError
from gough.files import Reading, solve_file
from gough.files.stores import Place, reason, without_credentials
from gough.jobs import Job, make, plan, run_job

from .conftest import ROWS

pytest.importorskip("moto")


@pytest.mark.slow
@pytest.mark.process
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_job_in_a_store_survives_a_bad_network(tmp_path, platform, logs, readings):
    from .s3 import s3_server

    with s3_server() as (options, faults, direct):
        for path in sorted(p for p in logs.rglob("*") if p.is_file()):
            key = f"bucket/logs/{path.relative_to(logs).as_posix()}"
            with direct.open_output_stream(key) as stream:
                stream.write(path.read_bytes())
        for key in ("logs//etc/hostile.parquet", "logs/../../hostile.parquet"):
            put(key, (logs / "a.parquet").read_bytes())
        job = Job.of(
            "solve", platform, f"s3://bucket/poses{options}", reading=Reading(keep=("id",)),
            seed="home",
        )  # fmt: skip
        where = f"s3://bucket/logs{options}"
        faults.share = 0.2
        summary = run_job(job, [where])
        assert {"503", "500", "cut"} <= {*faults.seen}
        # the other one begins with ".", and such files are left alone
        assert [name for name, _ in summary.failed] == ["/etc/hostile.parquet"]
        assert (summary.made, summary.rows) == (6, 6 * ROWS)
        again = run_job(job, [where])
        assert (again.made, again.skipped, again.rows) == (0, 6, 6 * ROWS)
        faults.share = 0.0
        assert visible(direct, "bucket/poses") == {
            "_gough/job.json", "_gough/report.json", "_gough/text.csv.json", "a.parquet",
            "b.parquet", "day=1/c.parquet", "day=2/c.parquet", "deep/er/d.parquet", "text.csv",
        }  # fmt: skip
        solve_file(
            logs / "a.parquet", tmp_path / "a.parquet", platform, reading=Reading(keep=("id",)),
            seed="home",
        )  # fmt: skip
        rows = pq.read_table("bucket/poses/a.parquet", filesystem=direct)
        assert rows.equals(pq.read_table(tmp_path / "a.parquet"), check_metadata=False)
        # one file, without a job
        solve_file(f"s3://bucket/logs/a.parquet{options}", tmp_path / "b.parquet", platform)

        unit = plan(job, [where])[1]
        other = dataclasses.replace(job, out=job.out / "other")
        faults.down = True
        made = make(other, unit)
        assert made.error.startswith("s3://bucket/")
        assert options not in made.error
        with pytest.raises(GoughError, match="s3://bucket/logs: cannot be read"):
            run_job(other, [where])
        faults.down = False
        assert visible(direct, "bucket/poses/other") == set()


def put(key: str, content: bytes) -> None:
    """Write an object whatever its name, as other programs can."""
    from moto.core.models import DEFAULT_ACCOUNT_ID
    from moto.s3.models import s3_backends

    s3_backends[DEFAULT_ACCOUNT_ID]["aws"].put_object("bucket", key, content)


def visible(files: fs.FileSystem, folder: str) -> set[str]:
    selector = fs.FileSelector(folder, recursive=True, allow_not_found=True)
    found = files.get_file_info(selector)
    return {one.path[len(folder) + 1 :] for one in found if one.type == fs.FileType.File}


def test_an_upload_is_whole_or_not_there(platform):
    """PyArrow completes what it has got when a stream is dropped: an error must come before."""
    from gough.files.stores import written

    memory = fs._MockFileSystem()
    place = Place("out.bin", "mock://")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gough.files.stores._opened", lambda store: (memory, ""))
        with pytest.raises(ZeroDivisionError), written(place) as file:
            file.write(b"half" * (1 // len(b"")))
        assert memory.get_file_info("out.bin").type == fs.FileType.NotFound
        with written(place) as file:
            file.write(b"whole")
        assert memory.open_input_file("out.bin").read() == b"whole"


@pytest.mark.parametrize(
    "url",
    [
        "s3://AKIAIO:wJalr@bucket/logs", "abfs://:wJalr@account/container", "hdfs://u:wJalr@host/x",
        "s3://bucket/x?secret_key=wJalr", "gs://bucket/x?access_token=wJalr&a=b",
        "abfs://c@a.dfs.core.windows.net/x?sig=wJalr", "S3://b/x?scheme=http&PASSWORD=wJalr",
    ],
)  # fmt: skip
def test_credentials_in_names_are_refused_and_never_shown(platform, url):
    for refused in (lambda: Place.of(url), lambda: Job.of("solve", platform, url)):
        with pytest.raises(GoughError, match="holds credentials") as error:
            refused()
        assert "wJalr" not in str(error.value)
    assert "wJalr" not in without_credentials(f"error at {url} again")
    assert "wJalr" not in reason(OSError(f"When opening '{url}': refused"))


def test_a_place_keeps_options_out_of_its_name():
    place = Place("bucket/logs", "s3://bucket/?endpoint_override=host")
    assert str(place / "a.parquet") == "s3://bucket/logs/a.parquet"
    assert without_credentials("is it a.csv? yes") == "is it a.csv? yes"
    for name in ("a b.csv", "/x/y.parquet", "C:\\x.csv", "what?.csv"):
        assert str(Place.of(name)) == name
