"""Buffers between subsystems (deliverable section 2.1: input and output buffers of a subsystem)."""

from collections import deque
from typing import Generic, TypeVar

from rapp_agent.errors import BufferFull

T = TypeVar("T")


class Buffer(Generic[T]):
    """A bounded first-in first-out buffer."""

    def __init__(self, name: str, capacity: int = 64) -> None:
        if capacity < 1:
            raise ValueError(f"cannot make buffer {name}: a capacity of {capacity} holds nothing")
        self.name = name
        self.capacity = capacity
        self._items: deque[T] = deque()

    def put(self, item: T) -> None:
        """Add an item; raises BufferFull when `capacity` items wait already."""
        if len(self._items) >= self.capacity:
            raise BufferFull(f"cannot put into buffer {self.name}: {self.capacity} items wait already")
        self._items.append(item)

    def take(self) -> T | None:
        """Remove and give the oldest item; None when there is none."""
        return self._items.popleft() if self._items else None

    def peek(self) -> T | None:
        """The oldest item, left where it is; None when there is none."""
        return self._items[0] if self._items else None

    def clear(self) -> None:
        """Forget all items."""
        self._items.clear()

    def __len__(self) -> int:
        return len(self._items)
