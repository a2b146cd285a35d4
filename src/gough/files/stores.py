"""Files on this machine and in object stores, by PyArrow's file systems.

A name that begins with s3://, gs://, abfs:// or hdfs:// is an object in a store; its options, such
as ?region=eu-west-1, are PyArrow's. Credentials come from the environment or from the store's own
configuration; a name that holds any is refused.
"""

from __future__ import annotations

import mmap
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO
from urllib.parse import parse_qsl

import pyarrow as pa
from pyarrow import fs

from gough.errors import GoughError, InputError
from gough.whole_file import replacing

STORE = re.compile(r"(s3|gs|gcs|abfss?|hdfs|viewfs)://", re.IGNORECASE)
SECRET = re.compile("secret|token|key|password|signature|^sig$", re.IGNORECASE)
USER, OPTIONS = re.compile(r"(?<=://)[^/?#\s@]*@"), re.compile(r"(://[^\s?'\"]*)\?[^\s'\"]*")


@dataclass(frozen=True)
class Place:
    """A file or a folder, on this machine or in a store.

    Attributes:
        path: as its file system takes it; in a store it begins with the bucket.
        store: URL of the bucket with its options; "" for this machine.
    """

    path: str
    store: str = ""

    @classmethod
    def of(cls, name: str | Path) -> Place:
        """The place that a path or a URL names.

        Raises:
            GoughError: a URL that holds credentials, or of a store that cannot be used here.
        """
        text = str(name)
        if not STORE.match(text):
            return cls(text)
        address, _, options = text.partition("?")
        scheme, _, rest = address.partition("://")
        bucket, _, path = rest.partition("/")
        held = [key for key, _ in parse_qsl(options) if SECRET.search(key)]
        if held or ":" in bucket.rpartition("@")[0]:
            raise GoughError(
                f"{without_credentials(text)}: holds credentials, which others can read there; "
                "leave them to the environment or to the store's own configuration"
            )
        store = f"{scheme.lower()}://{bucket}/" + (f"?{options}" if options else "")
        _, root = _opened(store)
        return cls(f"{root.rstrip('/')}/{path}" if path else root, store)

    def __str__(self) -> str:
        return f"{self.store.partition('://')[0]}://{self.path}" if self.store else self.path

    def __truediv__(self, name: str) -> Place:
        return Place(f"{self.path.rstrip('/')}/{name}" if self.path else name, self.store)

    @property
    def files(self) -> fs.FileSystem:
        """The file system that holds it."""
        return _opened(self.store)[0] if self.store else fs.LocalFileSystem()

    def info(self) -> fs.FileInfo:
        """Kind, size and time of change.

        Raises:
            InputError: the store does not answer.
        """
        with _explained(self, "read"):
            return self.files.get_file_info(self.path)

    def open(self) -> BinaryIO:
        """Open the file for reading.

        Raises:
            InputError: there is none, or it cannot be read.
        """
        if self.store:
            with _explained(self, "read"):
                return self.files.open_input_file(self.path)  # pyright: ignore[reportReturnType]
        try:
            return open(self.path, "rb")
        except IsADirectoryError:
            raise InputError(f"{self}: is a folder; name a file in it") from None
        except (OSError, ValueError) as error:  # ValueError: a NUL in the name
            raise InputError(f"{self}: cannot be read: {reason(error)}") from None


@contextmanager
def written(place: Place, *, tidy: bool = True) -> Iterator[BinaryIO]:
    """Open a file that appears whole at a place when the block ends without an error.

    On this machine see `replacing`, also for `tidy`. For a store the file is made in the folder of
    temporary files and uploaded when it is whole, in one call: a stream to a store that is closed
    early, even by an error, leaves the part that it got.

    Raises:
        GoughError: the place cannot be written; what stood there is unchanged.
    """
    if not place.store:
        with replacing(place.path, tidy=tidy) as file:
            yield file
        return
    with tempfile.TemporaryFile() as file:
        yield file  # pyright: ignore[reportReturnType]
        file.flush()
        with _explained(place, "written"), place.files.open_output_stream(place.path) as stream:
            if file.tell():
                with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
                    stream.write(content)


@contextmanager
def _explained(place: Place, what: str) -> Iterator[None]:
    """Name the place in an error of its file system."""
    try:
        yield
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{place}: cannot be {what}: {reason(error)}") from None


@lru_cache(maxsize=64)
def _opened(store: str) -> tuple[fs.FileSystem, str]:
    """The file system of a bucket, and the bucket's path there."""
    try:
        files, root = fs.FileSystem.from_uri(store)
    except (OSError, pa.ArrowException, ValueError) as error:
        raise GoughError(
            f"{without_credentials(store)}: cannot be opened: {reason(error)}"
        ) from None
    return files, root


def reason(error: Exception) -> str:
    """First line of an error, without what URLs hold of credentials and options."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return without_credentials(text.splitlines()[0])


def without_credentials(text: str) -> str:
    """Text without users, passwords and options in the URLs that it holds."""
    return OPTIONS.sub(r"\1", USER.sub("", text))
