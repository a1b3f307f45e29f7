"""The timeline prints what happens and lets others wait for it."""

import asyncio
import io

from rapp_cli.timeline import Entry, Timeline


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
