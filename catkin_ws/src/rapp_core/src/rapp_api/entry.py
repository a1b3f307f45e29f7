"""Finding the dynamic agent in a RApp's package."""

import importlib.util
import sys
from pathlib import Path

from rapp_api.dynamic_agent import DynamicAgent
from rapp_api.errors import Invalid


def load(entry: Path) -> type[DynamicAgent]:
    """The DynamicAgent class that a RApp's entry file defines. Raises Invalid when there is not just one.

    Modules beside the entry file can be imported by it. A class that others in the file derive from is not the agent.
    """
    spec = importlib.util.spec_from_file_location("rapp_entry", entry)
    if spec is None or spec.loader is None or not entry.is_file():
        raise Invalid(f"cannot run {entry.name}: it is no Python file of the package")
    sys.path.insert(0, str(entry.parent))
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    own = [value for value in vars(module).values() if isinstance(value, type) and value.__module__ == spec.name]
    agents = {cls for cls in own if issubclass(cls, DynamicAgent)}
    agents -= {base for cls in agents for base in cls.__mro__[1:]}
    if len(agents) != 1:
        names = ", ".join(sorted(cls.__name__ for cls in agents)) or "none"
        raise Invalid(f"cannot run {entry.name}: define one class derived from DynamicAgent; found {names}")
    return agents.pop()
