"""The timeline prints what happens and lets others wait for it."""

import asyncio
import io
from pathlib import Path

import pytest

from rapp_cli.timeline import Entry, Timeline, append, backwards


def test_entries_are_printed_with_agent_state_and_words() -> None:
    out = io.StringIO()
    timeline = Timeline(out)
    asyncio.run(timeline.add(Entry("core", "core", "s3", "heard", "e-mail")))
    assert "core" in out.getvalue()
    assert "s3" in out.getvalue()
    assert "“e-mail”" in out.getvalue()


def test_leaving_a_state_is_kept_but_not_printed() -> None:
    out = io.StringIO()
    timeline = Timeline(out)
    asyncio.run(timeline.add(Entry("core", "core", "s3", "left", "")))
    assert out.getvalue() == ""
    assert timeline.entries


def test_a_waiter_sees_entries_of_before_and_after_but_not_twice() -> None:
    async def story() -> tuple[int, int]:
        timeline = Timeline(io.StringIO())
        entry = Entry("core", "core", "s3", "entered", "")
        await timeline.add(entry)
        first = await timeline.wait_for("core", "entered", "s3")
        waiting = asyncio.create_task(timeline.wait_for("core", "entered", "s3", first))
        await timeline.add(Entry("core", "core", "s4", "entered", ""))
        assert not waiting.done()
        await timeline.add(entry)
        return first, await waiting

    assert asyncio.run(story()) == (1, 3)


@pytest.mark.parametrize("block", [1, 7, 100, 1 << 18])
def test_a_record_is_read_from_its_end_as_far_as_is_wanted(tmp_path: Path, block: int) -> None:
    path = tmp_path / "timeline.jsonl"
    assert list(backwards(path)) == []
    written = [Entry("core", "core", f"s{number}", "entered", "é" * number, float(number)) for number in range(9)]
    for entry in written:
        append(path, entry)
    with path.open("a") as lines:
        lines.write('{"agent": "co')
    assert list(backwards(path, block=block)) == written[::-1]
    assert list(backwards(path, ('"s3"', '"s5"'), block=block)) == [written[5], written[3]]
    size = path.stat().st_size
    assert list(backwards(path, most=size - 1, block=block)) == written[:0:-1]
