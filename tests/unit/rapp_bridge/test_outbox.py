import threading

import pytest

from rapp_bridge.outbox import Outbox


class Watch:
    def __init__(self) -> None:
        self.wakes = 0
        self.overflows = 0

    def box(self, limit: int = 1000) -> Outbox:
        return Outbox(limit, self._wake, self._overflow)

    def _wake(self) -> None:
        self.wakes += 1

    def _overflow(self) -> None:
        self.overflows += 1


@pytest.fixture
def watch() -> Watch:
    return Watch()


def drain(box: Outbox) -> list[bytes]:
    frames = []
    while (frame := box.take()) is not None:
        frames.append(frame)
    return frames


def test_frames_come_out_in_order(watch: Watch) -> None:
    box = watch.box()
    box.keep(b"a")
    box.offer("t", b"b", 5)
    box.keep(b"c")
    assert drain(box) == [b"a", b"b", b"c"]
    assert box.waiting == 0


def test_of_a_topic_only_the_newest_are_kept_and_others_lose_nothing(watch: Watch) -> None:
    box = watch.box()
    box.offer("quiet", b"q", 1)
    for number in range(5):
        box.offer("loud", b"%d" % number, 2)
        box.keep(b"answer")
    assert drain(box) == [b"q", b"answer", b"answer", b"answer", b"3", b"answer", b"4", b"answer"]


def test_too_many_bytes_drop_the_oldest_topic_message_first(watch: Watch) -> None:
    box = watch.box(limit=10)
    box.offer("a", b"1234", 9)
    box.offer("b", b"5678", 9)
    box.keep(b"answer")
    assert drain(box) == [b"5678", b"answer"]
    assert watch.overflows == 0


def test_a_message_larger_than_the_limit_is_dropped_alone(watch: Watch) -> None:
    box = watch.box(limit=10)
    box.offer("a", b"x" * 11, 9)
    box.offer("a", b"small", 9)
    assert drain(box) == [b"small"]
    assert watch.overflows == 0


def test_answers_beyond_the_limit_overflow_once_and_free_all(watch: Watch) -> None:
    box = watch.box(limit=10)
    for _ in range(5):
        box.keep(b"answer")
    assert watch.overflows == 1
    assert box.waiting == 0
    assert box.take() is None


def test_the_sleeping_reader_is_woken_once_for_all_that_comes(watch: Watch) -> None:
    box = watch.box()
    box.keep(b"a")
    assert watch.wakes == 0, "a reader that has not looked yet does not sleep"
    drain(box)
    for _ in range(3):
        box.keep(b"b")
    assert watch.wakes == 1
    drain(box)
    box.keep(b"c")
    assert watch.wakes == 2


def test_nothing_is_kept_after_close(watch: Watch) -> None:
    box = watch.box()
    box.keep(b"a")
    box.close()
    box.keep(b"b")
    box.offer("t", b"c", 1)
    assert drain(box) == []


def test_many_writers_and_one_reader_lose_no_answer(watch: Watch) -> None:
    box = watch.box(limit=10**6)
    threads = [threading.Thread(target=lambda: [box.keep(b"x") for _ in range(1000)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    seen = 0
    while any(thread.is_alive() for thread in threads):
        seen += len(drain(box))
    for thread in threads:
        thread.join()
    assert seen + len(drain(box)) == 4000
