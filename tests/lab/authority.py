"""A local authority that stamps times by RFC 3161: ``openssl ts`` behind HTTP."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

CONFIGURATION = """
[tsa]
default_tsa = stamps
[stamps]
serial = serial
signer_cert = stamps.pem
signer_key = stamps.key
signer_digest = sha256
digests = sha256
default_policy = 1.2.3.4.1
[extensions]
extendedKeyUsage = critical,timeStamping
"""
_KEY = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes"
MAKING = (
    f"req -x509 {_KEY} -subj /CN=root -keyout root.key -out root.pem",
    f"req {_KEY} -subj /CN=stamps -keyout stamps.key -out stamps.csr",
    "x509 -req -in stamps.csr -CA root.pem -CAkey root.key -CAcreateserial "
    "-extfile stamps.cnf -extensions extensions -out stamps.pem",
)
REPLY = "ts -reply -config stamps.cnf -queryfile query.tsq -out reply.tsr"


@contextmanager
def authority(folder: Path) -> Iterator[tuple[str, Path]]:
    """Give the address of the service, and the certificate of its root."""
    if shutil.which("openssl") is None:
        pytest.skip("needs openssl: it is the authority")
    pytest.importorskip("rfc3161_client")

    def openssl(call: str) -> None:
        command = ["openssl", *call.split()]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)

    class Service(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers["Content-Length"])
            (folder / "query.tsq").write_bytes(self.rfile.read(length))
            openssl(REPLY)
            self.send_response(200)
            self.end_headers()
            self.wfile.write((folder / "reply.tsr").read_bytes())

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    folder.mkdir(exist_ok=True)
    (folder / "stamps.cnf").write_text(CONFIGURATION, encoding="utf-8")
    for call in MAKING:
        openssl(call)
    with ThreadingHTTPServer(("127.0.0.1", 0), Service) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}", folder / "root.pem"
        server.shutdown()
