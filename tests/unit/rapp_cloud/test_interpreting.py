"""What RApps add to the catalogue is learnt once, in pieces, before anybody is answered."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest

from fakes.packages import manifest
from rapp_cloud.interpreter.errors import Bug
from rapp_cloud.interpreting import Interpreting
from rapp_hop.errors import Unreachable
from rapp_hop.hz.manifest import Manifest, parse_manifest
from rapp_hop.workers import Workers

SOUND = Path("said.wav")


class FakeWorkers:
    """Notes what they are asked; `open` lets them answer, `wrong` is raised once."""

    def __init__(self) -> None:
        self.learnt: list[str] = []
        self.pieces: list[int] = []
        self.interpreted: list[dict[str, Any]] = []
        self.open = asyncio.Event()
        self.open.set()
        self.wrong: Exception | None = None

    async def run(self, method: str, *arguments: Any, timeout: float) -> Any:
        await self.open.wait()
        if self.wrong is not None:
            wrong, self.wrong = self.wrong, None
            raise wrong
        if method == "learn":
            self.learnt += arguments[0]
            self.pieces.append(len(arguments[0]))
        else:
            self.interpreted.append(arguments[1])
        return method


def run(test: Callable[[FakeWorkers, Interpreting], Awaitable[None]]) -> None:
    async def main() -> None:
        workers = FakeWorkers()
        async with asyncio.timeout(30):
            await test(workers, Interpreting(cast(Workers, workers), 0.01))

    asyncio.run(main())


def rapp(name: str, *sentences: str) -> Manifest:
    return parse_manifest(json.dumps(manifest(name, sentences={"en": list(sentences)})).encode())


def test_each_sentence_is_learnt_once_before_the_first_answer() -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        first = {"a": ("one", "two"), "b": ("two", "three")}
        await interpreting(SOUND, first, "en")
        assert workers.learnt == ["one", "two", "three"]
        await interpreting(SOUND, first, "en")
        await interpreting(SOUND, {**first, "c": ("four",)}, "en")
        assert workers.learnt == ["one", "two", "three", "four"]
        assert len(workers.interpreted) == 3

    run(test)


def test_languages_that_somebody_only_names_are_not_remembered() -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        for number in range(100):
            await interpreting(SOUND, {}, f"language {number}")
        assert (workers.learnt, interpreting._learnt, len(workers.interpreted)) == ([], {}, 100)

    run(test)


def test_many_are_learnt_in_pieces() -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        await interpreting(SOUND, {"a": tuple(f"sentence {number}" for number in range(150))}, "en")
        assert workers.pieces == [64, 64, 22]

    run(test)


def test_who_gives_up_waiting_does_not_end_it_for_the_others() -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        workers.open.clear()
        both = [asyncio.create_task(interpreting(SOUND, {"a": ("one",)}, "en")) for _ in range(2)]
        await asyncio.sleep(0)
        both[0].cancel()
        workers.open.set()
        await both[1]
        assert workers.learnt == ["one"]

    run(test)


def test_what_could_not_be_learnt_is_said_and_learnt_the_next_time() -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        workers.wrong = Unreachable("cannot finish learn")
        with pytest.raises(Unreachable, match="learn"):
            await interpreting(SOUND, {"a": ("one",)}, "en")
        await interpreting(SOUND, {"a": ("one",)}, "en")
        assert workers.learnt == ["one"]

    run(test)


@pytest.mark.parametrize("wrong", [Unreachable("cannot finish learn"), KeyError("a worker's"), Bug("a model"), OSError()])
def test_what_is_on_offer_is_learnt_although_nobody_asks(wrong: Exception, caplog: pytest.LogCaptureFixture) -> None:
    async def test(workers: FakeWorkers, interpreting: Interpreting) -> None:
        workers.wrong = wrong  # the first time: later again
        keeping = asyncio.create_task(interpreting.keep_learning(lambda: (rapp("a", "one"), rapp("b", "two", "one"))))
        while len(workers.learnt) < 2:
            await asyncio.sleep(0)
        keeping.cancel()
        await asyncio.gather(keeping, return_exceptions=True)
        assert workers.learnt == ["one", "two"]
        assert [record.levelname for record in caplog.records] == ["ERROR"]
        assert (type(wrong).__name__ in caplog.text) is not isinstance(wrong, Unreachable)

    run(test)
