"""On the robot: updates and the way back, the quota, downloads that are gone on with, two RApps at once, no cloud."""

import asyncio
import os
import shutil
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from fakes.packages import source_folder
from fakes.store_client import StoreClient
from rapp_cloud.shelf import Shelf
from rapp_cloud.static import store_files
from rapp_hop.client import HopClient
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.hz.archive import build
from rapp_hop.hz.delivery import Delivery, DeliveryLimits
from rapp_hop.hz.quota import FRESH, size_of
from rapp_hop.registry import ServiceRegistry
from rapp_hop.server import HopServer
from rapp_hop.streaming import Writer

LONG_AGO = 10 * FRESH  # seconds


class Robot:
    """A robot and its store."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.home = folder, folder / "robot"
        self.shelf = Shelf(folder / "tuf", folder / "keys")
        self.shelf.create()
        self.client = StoreClient(folder / "tuf")

    def publish(self, name: str, version: str = "1.0.0", size: int = 0) -> None:
        source = source_folder(self.folder / "sources", name, version, f"print({version!r})\n", keywords={"en": [name]})
        (source / "sound.bin").write_bytes(os.urandom(size))
        self.shelf.publish(build(source))

    def delivery(self, client: object = None, quota: int = 0) -> Delivery:
        root = (self.folder / "tuf/metadata/1.root.json").read_bytes()
        limits = DeliveryLimits(quota=quota)
        return Delivery(client or self.client, root, self.home, limits)  # type: ignore[arg-type]

    def install(self, *names: str, quota: int = 0) -> None:
        """One after the other; each has been used a second after the one before, long ago."""
        delivery = self.delivery(quota=quota)
        for place, name in enumerate(names):
            done = asyncio.run(delivery.install(name))
            used = time.time() - LONG_AGO + place
            os.utime(done.path, (used, used))

    @property
    def rapps(self) -> set[str]:
        return set(self.delivery().folder.list())

    def size(self, *names: str) -> int:
        return sum(size_of(self.home / "rapps" / name) for name in names)


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    return Robot(tmp_path)


# the first start of a new version


async def updated(robot: Robot) -> Delivery:
    """1.0.0 has started; 1.1.0 is installed."""
    delivery = robot.delivery()
    robot.publish("hello", "1.0.0")
    await delivery.install("hello")
    robot.publish("hello", "1.1.0")
    await delivery.install("hello")
    return delivery


def test_a_version_that_did_not_start_gives_way_and_does_not_come_back_by_itself(robot: Robot) -> None:
    async def test() -> None:
        delivery = await updated(robot)
        back = await delivery.started("hello", "1.1.0", ok=False)
        assert back is not None and back.version == "1.0.0"
        again = await delivery.install("hello")
        assert (again.version, again.new) == ("1.0.0", False)
        robot.publish("hello", "1.1.1")
        assert (await delivery.install("hello")).version == "1.1.1"
        assert await delivery.started("hello", "1.1.1", ok=True) is None
        assert sorted(path.name for path in (robot.home / "rapps/hello").iterdir() if path.is_dir()) == ["1.1.1", "current"]

    asyncio.run(test())


def test_it_comes_again_when_it_is_asked_for_by_version_or_after_a_removal(robot: Robot) -> None:
    async def test() -> None:
        delivery = await updated(robot)
        await delivery.started("hello", "1.1.0", ok=False)
        assert (await delivery.install("hello", "1.1.0")).new
        await delivery.started("hello", "1.1.0", ok=False)
        assert await delivery.remove("hello")
        assert (await delivery.install("hello")).version == "1.1.0"

    asyncio.run(test())


def test_what_runs_is_not_removed_and_a_removal_leaves_nothing_of_a_download(robot: Robot) -> None:
    robot.publish("hello")
    robot.install("hello")
    part, package = robot.home / "downloads" / "hello~1.1.0~ab.part", robot.home / "runs" / "r1" / "package"
    package.mkdir(parents=True)
    (package / "package.json").write_text('{"name": "hello"}')
    part.write_bytes(b"x")
    with pytest.raises(Refused, match="it runs"):
        asyncio.run(robot.delivery().remove("hello"))
    assert robot.rapps == {"hello"} and part.exists()
    (package / "package.json").unlink()
    assert asyncio.run(robot.delivery().remove("hello"))
    assert robot.rapps == set() and not part.exists()


def test_news_of_another_version_change_nothing(robot: Robot) -> None:
    async def test() -> None:
        delivery = await updated(robot)
        for version, ok in (("1.0.0", True), ("1.0.0", False), ("2.0.0", False)):
            assert await delivery.started("hello", version, ok) is None
        there = delivery.folder.find("hello")
        assert there is not None and there.version == "1.1.0"
        assert delivery.folder.find("hello", "1.0.0") is not None

    asyncio.run(test())


def test_the_only_version_stays_when_it_does_not_start(robot: Robot) -> None:
    robot.publish("hello")
    robot.install("hello")
    with pytest.raises(Refused, match="no version before"):
        asyncio.run(robot.delivery().started("hello", "1.0.0", ok=False))
    assert robot.rapps == {"hello"}


# the quota


def test_the_least_recently_used_go_first_and_no_more_than_needed(robot: Robot) -> None:
    for name in ("one", "two", "three", "four"):
        robot.publish(name, size=100_000)
    robot.install("one", "two", "three")
    robot.delivery().folder.use(robot.delivery().folder.find("one"))  # type: ignore[arg-type]
    quota = robot.size("one", "two", "three") + 150_000
    done = asyncio.run(robot.delivery(quota=quota).install("four"))
    assert done.new
    assert robot.rapps == {"one", "three", "four"}
    assert size_of(robot.home / "rapps") + size_of(robot.home / "downloads") <= quota + 4 * 4096  # the folders themselves


def test_what_runs_stays(robot: Robot) -> None:
    for name in ("one", "two", "three"):
        robot.publish(name, size=100_000)
    robot.install("one", "two")
    shutil.copytree(robot.home / "rapps/one/1.0.0", robot.home / "runs/r1/package")
    asyncio.run(robot.delivery(quota=robot.size("one", "two") + 150_000).install("three"))
    assert robot.rapps == {"one", "three"}


def test_what_was_just_installed_stays_and_nothing_goes_in_vain(robot: Robot) -> None:
    for name in ("one", "two", "three"):
        robot.publish(name, size=100_000)
    robot.install("one")
    asyncio.run(robot.delivery().install("two"))
    robot.publish("big", size=200_000)
    quota = robot.size("one", "two") + 210_000
    with pytest.raises(Refused, match="what runs or is new stays"):
        asyncio.run(robot.delivery(quota=quota).install("big"))
    assert robot.rapps == {"one", "two"}


def test_a_package_larger_than_the_quota_is_refused_before_it_is_fetched(robot: Robot) -> None:
    robot.publish("one")
    robot.publish("big", size=200_000)
    robot.install("one")
    with pytest.raises(Refused, match=r"cannot install big: \d+ bytes are needed, 150000 are allowed for all RApps, .*--quota"):
        asyncio.run(robot.delivery(quota=150_000).install("big"))
    assert robot.rapps == {"one"}
    assert ("big", 0) not in robot.client.asked


def test_an_update_that_does_not_fit_beside_the_version_that_works_is_refused(robot: Robot) -> None:
    robot.publish("hello", size=200_000)
    robot.install("hello")
    robot.publish("hello", "1.1.0", size=200_000)
    with pytest.raises(Refused, match="remove a RApp"):
        asyncio.run(robot.delivery(quota=500_000).install("hello"))
    assert robot.delivery().folder.find("hello", "1.0.0") == robot.delivery().folder.find("hello")
    assert list((robot.home / "downloads").iterdir()) == []


def test_two_at_once_do_not_pass_the_quota_together(robot: Robot) -> None:
    for name in ("one", "two"):
        robot.publish(name, size=200_000)

    async def test() -> list[object]:
        delivery = robot.delivery(quota=600_000)
        return await asyncio.gather(delivery.install("one"), delivery.install("two"), return_exceptions=True)

    refused = [outcome for outcome in asyncio.run(test()) if isinstance(outcome, Refused)]
    assert len(refused) == 1
    assert len(robot.rapps) == 1


# downloads that are gone on with


class CutLine(StoreClient):
    """A line that breaks after so many bytes of a package."""

    def __init__(self, folder: Path, after: int) -> None:
        super().__init__(folder)
        self.after = after

    async def download(self, path: str, write: Writer, limit: int, *words: object, start: int = 0, **more: object) -> int:
        left = self.after if path.endswith(".hz") else limit

        def cut(piece: bytes) -> None:
            nonlocal left
            write(piece[:left])
            left -= len(piece)
            if left < 0:
                raise Unreachable("cannot read it: the connection was cut, try again")

        return await super().download(path, cut, limit, start=words[2] if len(words) > 2 else start)  # type: ignore[arg-type]


@pytest.mark.parametrize("tenth", range(1, 10))
def test_a_download_goes_on_where_it_was_cut(robot: Robot, tenth: int) -> None:
    robot.publish("hello", size=100_000)
    length = next((robot.folder / "tuf/targets").iterdir()).stat().st_size
    cut = CutLine(robot.folder / "tuf", length * tenth // 10)
    with pytest.raises(Unreachable):
        asyncio.run(robot.delivery(cut).install("hello"))
    asyncio.run(robot.delivery().tidy())  # the link has been started again meanwhile
    assert asyncio.run(robot.delivery().install("hello")).new
    assert robot.client.asked == [("hello", length * tenth // 10)]
    assert list((robot.home / "downloads").iterdir()) == []


def test_what_was_spoilt_in_between_is_fetched_anew(robot: Robot) -> None:
    robot.publish("hello", size=100_000)
    with pytest.raises(Unreachable):
        asyncio.run(robot.delivery(CutLine(robot.folder / "tuf", 50_000)).install("hello"))
    (part,) = (robot.home / "downloads").iterdir()
    part.write_bytes(bytes(part.stat().st_size))  # as a power cut may leave it
    assert asyncio.run(robot.delivery().install("hello")).new
    assert robot.client.asked == [("hello", 50_000), ("hello", 0)]


def test_the_part_of_a_version_that_was_replaced_goes(robot: Robot) -> None:
    robot.publish("hello", size=100_000)
    with pytest.raises(Unreachable):
        asyncio.run(robot.delivery(CutLine(robot.folder / "tuf", 50_000)).install("hello"))
    robot.publish("hello", "1.1.0", size=100_000)
    with pytest.raises(Unreachable):
        asyncio.run(robot.delivery(CutLine(robot.folder / "tuf", 50_000)).install("hello"))
    (part,) = (robot.home / "downloads").iterdir()
    assert part.name.startswith("hello~1.1.0~")


def over_http(robot: Robot, test: Callable[[HopClient, str], Awaitable[None]]) -> None:
    """Serve the store as the platform does; `test` gets a client and the path of the only package."""

    async def main() -> None:
        targets = robot.folder / "tuf/targets"
        server = HopServer(ServiceRegistry(), lambda _: None, robot.folder / "uploads", (store_files("/tuf/targets/", targets),))
        client = HopClient(f"http://127.0.0.1:{server.listen(0, '127.0.0.1')}")
        try:
            await test(client, f"/tuf/targets/{next(targets.iterdir()).name}")
        finally:
            await client.close()
            await server.close()

    asyncio.run(main())


@pytest.mark.parametrize("start", [1, 50_000, -1])
def test_the_rest_of_a_package_over_http(robot: Robot, start: int) -> None:
    robot.publish("hello", size=600_000)
    data = next((robot.folder / "tuf/targets").iterdir()).read_bytes()
    start = start % len(data)
    counts: list[tuple[int, int | None]] = []

    async def test(client: HopClient, path: str) -> None:
        got = bytearray()
        progress = lambda count, whole: counts.append((count, whole))  # noqa: E731
        assert await client.download(path, got.extend, len(data), on_progress=progress, start=start) == len(data)
        assert got == data[start:]
        with pytest.raises(Refused) as caught:
            await client.download(path, got.extend, len(data) + 9, start=len(data))
        assert caught.value.status == 416

    over_http(robot, test)
    assert counts[-1][0] == len(data)


# two at once


def test_a_slow_download_does_not_hold_up_another_rapp(robot: Robot) -> None:
    robot.publish("slow")
    robot.publish("quick")

    async def test() -> None:
        delivery, going_on = robot.delivery(), asyncio.Event()
        robot.client.held["slow"] = going_on
        slow = asyncio.create_task(delivery.install("slow"))
        assert (await asyncio.wait_for(delivery.install("quick"), 60)).new
        assert not slow.done()
        going_on.set()
        assert (await asyncio.wait_for(slow, 60)).new

    asyncio.run(test())
    assert robot.rapps == {"slow", "quick"}


def test_the_same_rapp_asked_for_twice_is_fetched_once(robot: Robot) -> None:
    robot.publish("hello")

    async def test() -> list[bool]:
        delivery, going_on = robot.delivery(), asyncio.Event()
        robot.client.held["hello"] = going_on
        both = [asyncio.create_task(delivery.install("hello")) for _ in range(2)]
        going_on.set()
        return [done.new for done in await asyncio.wait_for(asyncio.gather(*both), 60)]

    assert sorted(asyncio.run(test())) == [False, True]
    assert robot.client.asked == [("hello", 0)]


def test_when_the_first_is_cancelled_the_second_goes_on(robot: Robot) -> None:
    robot.publish("hello")

    async def test() -> None:
        delivery, going_on = robot.delivery(), asyncio.Event()
        robot.client.held["hello"] = going_on
        first = asyncio.create_task(delivery.install("hello"))
        second = asyncio.create_task(delivery.install("hello"))
        while not robot.client.asked:
            await asyncio.sleep(0.01)
        first.cancel()
        await asyncio.wait([first])
        going_on.set()
        assert (await asyncio.wait_for(second, 60)).new

    asyncio.run(test())
