import pytest

from rapp_bridge.outbox import OVERHEAD, Outbox


class Watch:
    """A queue of frames as bytes, and what it has lost."""

    def __init__(self, limit: int) -> None:
        self.lost: list[str] = []
        self.box: Outbox[bytes] = Outbox(limit, self.lost.append)

    def keep(self, frame: bytes) -> bool:
        return self.box.keep(frame, len(frame))

    def offer(self, topic: str, frame: bytes, queue_length: int = 0) -> None:
        self.box.offer(topic, frame, len(frame), queue_length)

    def drain(self) -> list[bytes]:
        frames = []
        while (frame := self.box.take()) is not None:
            frames.append(frame)
        return frames


@pytest.fixture
def watch() -> Watch:
    return Watch(10_000)


def room(frames: int, size: int) -> Watch:
    """A queue with room for so many frames of this size."""
    return Watch(frames * (size + OVERHEAD))


def test_frames_come_out_in_order(watch: Watch) -> None:
    watch.keep(b"a")
    watch.offer("t", b"b", 5)
    watch.keep(b"c")
    assert len(watch.box) == 3
    assert watch.drain() == [b"a", b"b", b"c"]
    assert watch.box.waiting == 0


def test_of_a_topic_only_the_newest_are_kept_and_others_lose_nothing(watch: Watch) -> None:
    watch.offer("quiet", b"q", 1)
    for number in range(5):
        watch.offer("loud", b"%d" % number, 2)
        watch.keep(b"answer")
    assert watch.drain() == [b"q", b"answer", b"answer", b"answer", b"3", b"answer", b"4", b"answer"]
    assert watch.lost == ["loud"] * 3


def test_too_many_bytes_drop_the_oldest_topic_message_first() -> None:
    watch = room(2, 6)
    watch.offer("a", b"1234", 9)
    watch.offer("b", b"5678", 9)
    assert watch.keep(b"answer")
    assert watch.drain() == [b"5678", b"answer"]
    assert watch.lost == ["a"]


def test_a_message_larger_than_the_limit_is_dropped_alone() -> None:
    watch = room(1, 10)
    watch.offer("a", b"x" * 11)
    watch.offer("a", b"small")
    assert watch.drain() == [b"small"]


def test_answers_beyond_the_limit_cost_the_client_its_connection() -> None:
    watch = room(1, 6)
    assert watch.keep(b"answer")
    assert not watch.keep(b"answer")
    assert not watch.keep(b"answer")
    assert watch.box.waiting == 0
    assert watch.drain() == []


def test_what_waits_never_exceeds_the_limit() -> None:
    watch = room(3, 100)
    for number in range(100):
        watch.offer(f"topic {number % 7}", bytes(1 + number * 3 % 300))
        assert watch.box.waiting <= 3 * (100 + OVERHEAD)
    assert watch.lost


def test_nothing_is_kept_after_close(watch: Watch) -> None:
    watch.keep(b"a")
    watch.box.close()
    assert not watch.keep(b"b")
    watch.offer("t", b"c", 1)
    assert watch.drain() == []
