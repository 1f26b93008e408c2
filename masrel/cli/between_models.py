"""Models between models, and where the numbers of each come from."""

import hashlib
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import masrel
from masrel.elbow import STANDARD_MODELS, ElbowParameters, intermediate_models
from masrel.elbow.identification import model_document
from masrel.elbow.identification.model_file import MODEL_KEYS
from masrel.errors import ParameterError
from masrel.protocol import read_model_file

__all__ = ["Between", "Source", "between", "read_source"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A model that others are put next to."""

    name: str  # name of a standard model, or that of a file without its ending
    said: str  # the same for people, with the file and the start of its checksum
    joint: ElbowParameters  # the model
    simulated: bool  # whether it comes from simulated recordings


@dataclass(frozen=True, slots=True, kw_only=True)
class Between:
    """A model between two others."""

    name: str  # ``D01`` and so on
    # first, second: its neighbours among the sources
    first: str
    second: str
    way: str  # how far it is from the first to the second, as a fraction
    simulated: bool  # whether one of them is
    numbers: dict[str, float]  # L, H, Q and D by the key of a model file
    document: dict[str, object]  # content of its model file


def read_source(model: str) -> Source:
    """Find a model by name or read its file."""
    if not model.endswith(".toml"):
        if model not in STANDARD_MODELS:
            known = ", ".join(STANDARD_MODELS)
            raise ParameterError(
                f"MODEL: needs {known} or a model file (.toml), got {model!r}"
            )
        joint = STANDARD_MODELS[model]
        return Source(name=model, said=model, joint=joint, simulated=False)
    path = Path(model)
    joint = read_model_file(path)
    content = path.read_bytes()
    simulated = tomllib.loads(content.decode("utf-8-sig")).get("simulated")
    if not isinstance(simulated, bool):
        raise ParameterError(
            f"{path}: simulated must be true or false: what is made of the model says "
            f"the same; got {'nothing' if simulated is None else repr(simulated)}"
        )
    checksum = hashlib.sha256(content).hexdigest()
    return Source(
        name=path.stem,
        said=f"{path.stem} ({path}, sha256 {checksum[:16]})",
        joint=joint,
        simulated=simulated,
    )


def between(sources: Sequence[Source], n_models: int) -> list[Between]:
    """Put models at even steps between neighbours."""
    joints = {source.name: source.joint for source in sources}
    if len(joints) < len(sources):
        names = [source.name for source in sources]
        twice = next(name for name in names if names.count(name) > 1)
        raise ParameterError(
            f"MODEL: needs models whose names differ, got two called {twice}"
        )
    gaps = len(sources) - 1
    if gaps < 1:
        raise ParameterError(f"MODEL: needs two or more, got {sources[0].name} alone")
    if n_models < gaps or n_models % gaps:
        raise ParameterError(
            f"--number: needs a multiple of {gaps}, one or more in each gap, "
            f"got {n_models}"
        )
    each = n_models // gaps
    return [
        _one(name, joint, sources[i // each], sources[i // each + 1], (i % each, each))
        for i, (name, joint) in enumerate(intermediate_models(joints, n_models).items())
    ]


def _one(
    name: str,
    joint: ElbowParameters,
    first: Source,
    second: Source,
    place: tuple[int, int],
) -> Between:
    way = f"{place[0] + 1}/{place[1] + 1}"
    simulated = first.simulated or second.simulated
    return Between(
        name=name,
        first=first.name,
        second=second.name,
        way=way,
        simulated=simulated,
        numbers={
            key: getattr(joint, field) * factor
            for key, (field, factor) in MODEL_KEYS.items()
        },
        document=model_document(
            joint,
            simulated=simulated,
            made_from=(
                f"masrel between {masrel.__version__}: {way} of the way from "
                f"{first.said} to {second.said}"
            ),
        ),
    )
