"""Requests of one client, so many a second: ``python -m tests.lab.serve.flood``.

Arguments: port, request in hexadecimal digits, requests a second, seconds. It prints
how often each status came.
"""

import json
import socket
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor

N_TABS = 8


def flood(port: int, request: bytes, per_s: float, lasts_s: float) -> Counter[str]:
    """Send requests, at most so many a second -> how often each status came."""
    statuses: Counter[str] = Counter()
    with socket.create_connection(("127.0.0.1", port)) as connection:
        answers = connection.makefile("rb")
        begin = time.monotonic()
        for i in range(round(per_s * lasts_s)):
            time.sleep(max(0.0, begin + i / per_s - time.monotonic()))
            if time.monotonic() > begin + lasts_s:
                break
            connection.sendall(request)
            statuses[answers.readline().split()[1].decode()] += 1
            length = 0
            while (line := answers.readline()) != b"\r\n":
                name, _, value = line.partition(b":")
                length = int(value) if name == b"content-length" else length
            answers.read(length)
    return statuses


if __name__ == "__main__":
    port, request = int(sys.argv[1]), bytes.fromhex(sys.argv[2])
    per_s, lasts_s = float(sys.argv[3]) / N_TABS, float(sys.argv[4])
    with ThreadPoolExecutor(N_TABS) as tabs:
        sent = [
            tabs.submit(flood, port, request, per_s, lasts_s) for _ in range(N_TABS)
        ]
        print(json.dumps(sum((each.result() for each in sent), Counter())))
