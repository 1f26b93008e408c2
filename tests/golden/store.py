"""Every golden case by group, where results are kept, and how they were made."""

import gzip
import importlib.metadata
import json
import platform
from pathlib import Path

import numpy as np

from tests.golden import scenes, studies, tables
from tests.golden.call import Case

__all__ = ["GROUPS", "differing", "environment", "load", "save"]

GROUPS: dict[str, list[Case]] = {}
for _case in [*tables.cases(), *studies.cases(), *scenes.cases()]:
    GROUPS.setdefault(_case.group, []).append(_case)

DATA = Path(__file__).parent / "data"

PACKAGES = (
    "numpy", "scipy", "pandas", "statsmodels", "matplotlib", "emcee", "arviz-stats",
    "msgspec", "click", "jinja2",
)  # fmt: skip


def environment() -> dict[str, str]:
    """What may change the last bit of a number, or a byte of a figure."""
    simd = np.show_config(mode="dicts")["SIMD Extensions"]
    return {
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in PACKAGES},
        "platform": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()),
        "simd": " ".join(simd.get("found", [])),
    }


def differing() -> str:
    """How this environment differs from that of the data; nothing if it does not."""
    made = json.loads((DATA / "environment.json").read_text("utf-8"))
    here = environment()
    return "; ".join(
        f"{key}: {made.get(key)} stored, {here.get(key)} here"
        for key in here | made
        if made.get(key) != here.get(key)
    )


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
    made = json.dumps(environment(), indent=1)
    (DATA / "environment.json").write_text(made + "\n", "utf-8")
    return len(data)
