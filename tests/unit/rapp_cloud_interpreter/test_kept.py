"""Vectors that are kept on the disk: shared, whole or left out, and never in the way."""

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from rapp_cloud.interpreter import kept
from rapp_cloud.interpreter.kept import WIDTH, KeptVectors

TEXTS = [f"text {number}" for number in range(5)]
RECORD = 16 + 2 * WIDTH  # bytes


def vectors(count: int, seed: int = 1) -> np.ndarray:
    found = np.random.default_rng(seed).standard_normal((count, WIDTH)).astype(np.float32)
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@pytest.mark.parametrize("on_disk", [True, False])
def test_what_was_added_is_known(tmp_path: Path, on_disk: bool) -> None:
    mine = KeptVectors(tmp_path / "v" if on_disk else None)
    assert mine.missing([*TEXTS, TEXTS[0]]) == TEXTS
    mine.add(TEXTS[:3], vectors(3))
    assert mine.missing(TEXTS) == TEXTS[3:]
    assert np.allclose(mine.take([TEXTS[2], TEXTS[0]]), vectors(3)[[2, 0]], atol=1e-3)
    assert mine.take([]).shape == (0, WIDTH)


def test_workers_share_what_they_worked_out(tmp_path: Path) -> None:
    mine, other = KeptVectors(tmp_path / "v"), KeptVectors(tmp_path / "v")
    mine.add(TEXTS[:2], vectors(2))
    assert other.missing(TEXTS) == TEXTS[2:]
    other.add(TEXTS[2:], vectors(3, 2))
    assert mine.missing(TEXTS) == []
    assert np.array_equal(mine.take(TEXTS), other.take(TEXTS))
    assert np.array_equal(KeptVectors(tmp_path / "v").take(TEXTS), mine.take(TEXTS))


def test_a_record_cut_off_is_left_out_and_the_next_stand_right(tmp_path: Path) -> None:
    KeptVectors(tmp_path / "v").add(TEXTS[:2], vectors(2))
    whole = (tmp_path / "v").read_bytes()
    (tmp_path / "v").write_bytes(whole[: RECORD + 100])
    mine = KeptVectors(tmp_path / "v")
    assert mine.missing(TEXTS) == TEXTS[1:]
    mine.add(TEXTS[1:], vectors(4, 3))
    assert (tmp_path / "v").stat().st_size == 5 * RECORD
    assert KeptVectors(tmp_path / "v").missing(TEXTS) == []


@pytest.mark.parametrize("byte", [0, 0x7F])
def test_a_file_that_holds_no_vectors_is_begun_anew(tmp_path: Path, byte: int) -> None:
    (tmp_path / "v").write_bytes(bytes([byte]) * 3 * RECORD)
    mine = KeptVectors(tmp_path / "v")
    assert mine.missing(TEXTS) == TEXTS
    mine.add(TEXTS, vectors(5))
    assert KeptVectors(tmp_path / "v").missing(TEXTS) == []


def test_a_file_that_grew_too_large_is_begun_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "MOST", 2)
    KeptVectors(tmp_path / "v").add(TEXTS, vectors(5))
    assert KeptVectors(tmp_path / "v").missing(TEXTS) == TEXTS


def test_a_file_that_grows_too_large_while_it_is_used_is_begun_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept, "MOST", 3)
    mine, other = KeptVectors(tmp_path / "v"), KeptVectors(tmp_path / "v")
    mine.add(TEXTS[:3], vectors(3))
    assert mine.missing(TEXTS[:3]) == other.missing(TEXTS[:3]) == []
    assert mine.missing(TEXTS[2:4]) == TEXTS[2:4]
    mine.add(TEXTS[2:4], vectors(2))
    assert (tmp_path / "v").stat().st_size == 2 * RECORD
    assert np.allclose(other.take(TEXTS[:1]), vectors(1), atol=1e-3)
    assert other.missing([TEXTS[3], TEXTS[4]]) == [TEXTS[4]], "it did not follow into the new file"


def test_a_file_that_is_deleted_while_it_is_used_is_gone_for_nobody(tmp_path: Path) -> None:
    mine = KeptVectors(tmp_path / "v")
    mine.add(TEXTS, vectors(5))
    (tmp_path / "v").unlink()
    assert np.allclose(mine.take(TEXTS), vectors(5), atol=1e-3)
    other = KeptVectors(tmp_path / "v")
    other.add(TEXTS[::-1], vectors(5, 2))
    assert np.allclose(mine.take(TEXTS), vectors(5), atol=1e-3)
    assert np.allclose(other.take(TEXTS[::-1]), vectors(5, 2), atol=1e-3)


def test_workers_that_start_at_once_begin_a_bad_file_anew_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "v").write_bytes(bytes(3 * RECORD))
    both, locked, begun = threading.Barrier(2), kept._locked, []

    def when_both_are_there(handle: int) -> AbstractContextManager[None]:
        begun.append(handle)
        both.wait(30)
        return locked(handle)

    monkeypatch.setattr(kept, "_locked", when_both_are_there)
    with ThreadPoolExecutor(2) as threads:
        mine, other = threads.map(KeptVectors, [tmp_path / "v"] * 2)
    assert len(begun) == 2
    monkeypatch.setattr(kept, "_locked", locked)
    mine.add(TEXTS[:2], vectors(2))
    assert other.missing(TEXTS) == TEXTS[2:]
    other.add(TEXTS[2:], vectors(3, 2))
    assert np.array_equal(mine.take(TEXTS[:2]), other.take(TEXTS[:2]))
    assert KeptVectors(tmp_path / "v").missing(TEXTS) == []


@pytest.mark.parametrize("wrong", [0.0, 2.0, np.nan])
def test_a_bad_record_hides_no_other(tmp_path: Path, wrong: float) -> None:
    mine, other = KeptVectors(tmp_path / "v"), KeptVectors(tmp_path / "v")
    mine.add(TEXTS[:1], vectors(1))
    with (tmp_path / "v").open("ab") as file:
        file.write(bytes(16) + np.full(WIDTH, wrong, "<f2").tobytes())
    assert mine.missing(TEXTS[:2]) == TEXTS[1:2]
    mine.add(TEXTS[1:2], vectors(1, 2))
    assert (tmp_path / "v").stat().st_size == 3 * RECORD
    assert mine.missing(TEXTS[:2]) == other.missing(TEXTS[:2]) == []
    assert np.allclose(other.take(TEXTS[:2]), [vectors(1)[0], vectors(1, 2)[0]], atol=1e-3)


def test_what_is_no_vector_goes_into_no_file_and_is_not_worked_out_again(tmp_path: Path) -> None:
    mine = KeptVectors(tmp_path / "v")
    found = vectors(3)
    found[1] = np.nan
    mine.add(TEXTS[:3], found)
    assert (tmp_path / "v").stat().st_size == 2 * RECORD
    assert mine.missing(TEXTS) == TEXTS[3:]
    assert np.isnan(mine.take(TEXTS[:3])[1]).all()


def test_a_file_that_is_emptied_is_filled_again(tmp_path: Path) -> None:
    mine = KeptVectors(tmp_path / "v")
    mine.add(TEXTS, vectors(5))
    (tmp_path / "v").write_bytes(b"")
    assert mine.missing(TEXTS) == TEXTS
    mine.add(TEXTS[:1], vectors(1))
    assert mine.missing(TEXTS) == TEXTS[1:]


def test_a_folder_that_is_not_there_keeps_nobody_from_working(tmp_path: Path) -> None:
    mine = KeptVectors(tmp_path / "gone" / "v")
    mine.add(TEXTS, vectors(5))
    assert mine.missing(TEXTS) == []
    assert np.allclose(mine.take(TEXTS), vectors(5), atol=1e-3)


def test_a_full_disk_keeps_nobody_from_working() -> None:
    mine = KeptVectors(Path("/dev/full"))
    mine.add(TEXTS, vectors(5))
    assert mine.missing(TEXTS) == []
    assert np.allclose(mine.take(TEXTS), vectors(5), atol=1e-3)
