"""An S3 server of this process (moto), and a proxy before it that loses and refuses requests."""

from __future__ import annotations

import http.client
import logging
import os
import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from unittest import mock

from moto.server import ThreadedMotoServer
from pyarrow import fs

KEYS = {
    "AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b", "AWS_EC2_METADATA_DISABLED": "true",
}  # fmt: skip
LENGTHS = ("content-length", "transfer-encoding", "expect")
ERRORS = {503: "SlowDown", 500: "InternalError"}


@dataclass
class Faults:
    """Faults of the proxy.

    Attributes:
        share: of requests that fail: throttled, with an internal error, or cut in the middle.
        down: every request fails.
        seen: number of requests, and of faults by kind.
    """

    share: float = 0.0
    down: bool = False
    seen: dict[str, int] = field(default_factory=dict)
    draw: random.Random = field(default_factory=lambda: random.Random(1))
    lock: threading.Lock = field(default_factory=threading.Lock)

    def next(self) -> str:
        """The fault of a request, "" for none."""
        with self.lock:
            fails = self.down or self.draw.random() < self.share
            kind = self.draw.choice(["503", "500", "cut"]) if fails else "good"
            self.seen[kind] = self.seen.get(kind, 0) + 1
        return "" if kind == "good" else kind


@contextmanager
def s3_server(bucket: str = "bucket") -> Iterator[tuple[str, Faults, fs.S3FileSystem]]:
    """Yield options for URLs of the store behind the proxy, its faults, and direct access."""
    moto = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    faults = Faults()
    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    with mock.patch.dict(os.environ, KEYS):
        moto.start()
        host, port = moto.get_host_and_port()
        proxy = ThreadingHTTPServer(("127.0.0.1", 0), _handler(f"{host}:{port}", faults))
        proxy.daemon_threads = True
        threading.Thread(target=proxy.serve_forever, daemon=True).start()
        try:
            direct = fs.S3FileSystem(
                endpoint_override=f"{host}:{port}", scheme="http", region="us-east-1",
                allow_bucket_creation=True,
            )  # fmt: skip
            direct.create_dir(bucket)
            address = f"127.0.0.1:{proxy.server_port}"
            yield f"?endpoint_override={address}&scheme=http&region=us-east-1", faults, direct
        finally:
            proxy.shutdown()
            proxy.server_close()
            moto.stop()


def _handler(upstream: str, faults: Faults) -> type[BaseHTTPRequestHandler]:
    class Proxy(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def forward(self) -> None:
            body = self.body()
            fault = faults.next()
            if fault in ("503", "500"):
                code = int(fault)
                text = f"<Error><Code>{ERRORS[code]}</Code><Message>injected</Message></Error>"
                self.answer(code, {"Content-Type": "application/xml"}, text.encode())
                return
            connection = http.client.HTTPConnection(upstream, timeout=30)
            headers = {k: v for k, v in self.headers.items() if k.lower() not in LENGTHS}
            headers["Content-Length"] = str(len(body))
            connection.request(self.command, self.path, body, headers)
            found = connection.getresponse()
            data = found.read()
            headers = {k: v for k, v in found.getheaders() if k.lower() != "connection"}
            connection.close()
            if fault == "cut":  # half of the answer, or none
                self.close_connection = True
                if data:
                    self.answer(found.status, headers, data[: len(data) // 2], len(data))
                return
            self.answer(found.status, headers, data)

        def body(self) -> bytes:
            if self.headers.get("Transfer-Encoding") != "chunked":
                return self.rfile.read(int(self.headers.get("Content-Length") or 0))
            data = b""
            while size := int(self.rfile.readline().split(b";")[0], 16):
                data += self.rfile.read(size)
                self.rfile.readline()
            while self.rfile.readline().strip():  # trailers
                pass
            return data

        do_GET = do_PUT = do_POST = do_DELETE = do_HEAD = forward  # noqa: N815

        def answer(
            self, code: int, headers: dict[str, str], data: bytes, length: int | None = None
        ) -> None:
            self.send_response_only(code)
            for name, value in headers.items():
                if name.lower() not in LENGTHS:
                    self.send_header(name, value)
            kept = headers.get("Content-Length") or headers.get("content-length")
            size = kept if self.command == "HEAD" and kept else str(length or len(data))
            self.send_header("Content-Length", size)
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(data)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002
            pass

    return Proxy
