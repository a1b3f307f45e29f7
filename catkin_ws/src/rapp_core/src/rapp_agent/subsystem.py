"""A subsystem of an agent: control subsystem, virtual effector or virtual receptor (deliverable Fig. 1)."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from rapp_agent.buffers import Buffer


class Subsystem:
    """Input buffers, output buffers and internal memory: all that a transition function may read and write."""

    def __init__(
        self,
        name: str,
        inputs: Iterable[Buffer[Any]] = (),
        outputs: Iterable[Buffer[Any]] = (),
        memory: Mapping[str, object] | None = None,
    ) -> None:
        self.name = name
        self.inputs: Mapping[str, Buffer[Any]] = MappingProxyType({b.name: b for b in inputs})
        self.outputs: Mapping[str, Buffer[Any]] = MappingProxyType({b.name: b for b in outputs})
        self.memory: dict[str, object] = dict(memory or {})
