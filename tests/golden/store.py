"""Where golden results are kept."""

import gzip
import json
from pathlib import Path

__all__ = ["load", "save"]

DATA = Path(__file__).parent / "data"


def load(group: str) -> dict[str, object]:
    """Case to result, as stored; empty if nothing is."""
    file = DATA / f"{group}.json.gz"
    if not file.is_file():
        return {}
    results: dict[str, object] = json.loads(gzip.decompress(file.read_bytes()))
    return results


def save(group: str, results: dict[str, object]) -> int:
    """Store a group, every digit kept; its size in bytes."""
    text = json.dumps(results, ensure_ascii=False, indent=0)
    data = gzip.compress(text.encode(), 9, mtime=0)
    DATA.mkdir(exist_ok=True)
    (DATA / f"{group}.json.gz").write_bytes(data)
    return len(data)
