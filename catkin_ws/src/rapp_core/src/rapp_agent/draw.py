"""Drawings of a machine, the same text for the same machine; nested machines are drawn inside their state."""

from collections.abc import Iterator

from rapp_agent.machine import Machine


def to_mermaid(machine: Machine) -> str:
    """The machine as a Mermaid state diagram (stateDiagram-v2)."""
    return "\n".join(["stateDiagram-v2", *_mermaid(machine, "", 1)]) + "\n"


def _mermaid(machine: Machine, prefix: str, depth: int) -> Iterator[str]:
    pad = "    " * depth
    for name, state in machine.states.items():
        node = prefix + name
        label = f"{name} {state.label}".strip()
        if isinstance(state, Machine):
            yield f'{pad}state "{label}" as {node} {{'
            yield from _mermaid(state, f"{node}_", depth + 1)
            yield f"{pad}}}"
        else:
            yield f"{pad}{node} : {label}"
    yield f"{pad}[*] --> {prefix}{machine.initial}"
    for edge in machine.edges:
        yield f"{pad}{prefix}{edge.source} --> {prefix}{edge.target}" + (f" : {edge.label}" if edge.label else "")
    for final in sorted(machine.finals):
        yield f"{pad}{prefix}{final} --> [*]"


def to_dot(machine: Machine) -> str:
    """The machine as a Graphviz digraph; sub-FSMs are double circles, as in Figs 2 and 3 of the paper."""
    lines = [f'digraph "{machine.name}" {{', "    rankdir=LR;"]
    for name, state in machine.states.items():
        shape = "doublecircle" if isinstance(state, Machine) else "circle"
        lines.append(f'    "{name}" [shape={shape}, label="{name}\\n{_escape(state.label)}"];')
    lines += [f'    "{e.source}" -> "{e.target}" [label="{_escape(e.label)}"];' for e in machine.edges]
    return "\n".join([*lines, "}"]) + "\n"


def _escape(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"')
