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
        label = _words(f"{name} {state.label}".strip())
        if isinstance(state, Machine):
            yield f'{pad}state "{label}" as {node} {{'
            yield from _mermaid(state, f"{node}_", depth + 1)
            yield f"{pad}}}"
        else:
            yield f"{pad}{node} : {label}"
    yield f"{pad}[*] --> {prefix}{machine.initial}"
    for edge in machine.edges:
        label = f" : {_words(edge.label)}" if edge.label else ""
        yield f"{pad}{prefix}{edge.source} --> {prefix}{edge.target}{label}"
    for final in sorted(machine.finals):
        yield f"{pad}{prefix}{final} --> [*]"
    if machine.failure:
        yield f"{pad}note right of {prefix}{machine.failure} : every failure leads here"


def _words(text: str) -> str:
    """A label without what Mermaid would take as its own syntax."""
    return " ".join(text.split()).replace(";", ",").replace('"', "#quot;")


def to_dot(machine: Machine) -> str:
    """The machine as a Graphviz digraph; sub-FSMs are double circles, as in Figs 2 and 3 of the paper.

    A dot marks where it begins, bold circles where it ends, a dashed circle where every failure leads.
    """
    lines = [f"digraph {_quoted(machine.name)} {{", "    rankdir=LR;", '    "[*]" [shape=point];']
    for name, state in machine.states.items():
        styles = ["bold"] * (name in machine.finals) + ["dashed"] * (name == machine.failure)
        shape = "doublecircle" if isinstance(state, Machine) else "circle"
        style = f', style="{",".join(styles)}"' if styles else ""
        label = _quoted(f"{name}\n{state.label}".strip())
        lines.append(f"    {_quoted(name)} [shape={shape}, label={label}{style}];")
    lines.append(f'    "[*]" -> {_quoted(machine.initial)};')
    for edge in machine.edges:
        label = f" [label={_quoted(edge.label)}]" if edge.label else ""
        lines.append(f"    {_quoted(edge.source)} -> {_quoted(edge.target)}{label};")
    return "\n".join([*lines, "}"]) + "\n"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
