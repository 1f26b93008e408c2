"""Messages between the server and the process of a session: a JSON object a line."""

import contextlib
import json
import socket
import threading
from collections.abc import Iterator
from typing import Any

Message = dict[str, Any]
"""One message; ``kind`` says what it is."""

MAX_LINE = 1 << 20
"""Bytes of the longest line that is read."""


def encoded(message: Message) -> bytes:
    """Return a message as a line."""
    return json.dumps(message, ensure_ascii=False).encode() + b"\n"


class Channel:
    """The end of the process of a session; anybody may send, one thread receives."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._sending = threading.Lock()

    def send(self, message: Message) -> None:
        """Send a message; nothing where nobody is there any more."""
        with self._sending, contextlib.suppress(OSError):
            self._connection.sendall(encoded(message))

    def received(self) -> Iterator[Message]:
        """Yield messages until the other end is gone."""
        with contextlib.suppress(OSError), self._connection.makefile("rb") as lines:
            while line := lines.readline(MAX_LINE):
                if not line.endswith(b"\n"):
                    return  # torn: the other end died while it wrote
                yield json.loads(line)
