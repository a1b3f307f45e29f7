"""Buffers and subsystems (deliverable section 2.1)."""

import pytest

from rapp_agent import Buffer, BufferFull, Subsystem


def test_a_buffer_gives_items_in_their_order() -> None:
    buffer: Buffer[str] = Buffer("heard")
    buffer.put("a")
    buffer.put("b")
    assert (len(buffer), buffer.peek(), buffer.take(), buffer.take(), buffer.take()) == (2, "a", "a", "b", None)
    assert buffer.peek() is None


def test_a_full_buffer_takes_nothing_more_and_loses_nothing() -> None:
    buffer: Buffer[int] = Buffer("heard", capacity=2)
    buffer.put(1)
    buffer.put(2)
    with pytest.raises(BufferFull, match="heard"):
        buffer.put(3)
    assert [buffer.take(), buffer.take(), buffer.take()] == [1, 2, None]
    buffer.put(4)
    buffer.clear()
    assert len(buffer) == 0


def test_a_buffer_that_holds_nothing_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="holds nothing"):
        Buffer("heard", capacity=0)


def test_a_subsystem_s_buffers_are_fixed_and_its_memory_is_its_own() -> None:
    given: dict[str, object] = {"x": 1}
    subsystem = Subsystem("control", inputs=[Buffer("heard")], outputs=[Buffer("say")], memory=given)
    subsystem.memory["x"] = 2
    assert given == {"x": 1}
    assert list(subsystem.inputs) == ["heard"]
    assert list(subsystem.outputs) == ["say"]
    with pytest.raises(TypeError):
        subsystem.inputs["more"] = Buffer("more")  # type: ignore[index]
