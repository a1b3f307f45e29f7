"""Beam search on a small made-up model: pieces are letters, 0 the start, 1 the end."""

import numpy as np

from rapp_cloud.interpreter.beam import Beam, expect

START, END = 0, 1
A, B, C = 2, 3, 4


def search(model, width=3, words=(), bonus=0.0):
    """`model(pieces)` gives the probability of each next piece."""
    beam = Beam(width, START, END, expect(words), bonus)
    rows = [(START,)]
    for _ in range(6):
        pieces = beam.last_pieces()
        assert len(pieces) == len(rows)
        with np.errstate(divide="ignore"):
            kept = beam.extend(np.log(np.array([model(row) for row in rows], dtype=np.float32)))
        if not kept:
            break
        rows = [(*rows[parent], int(piece)) for parent, piece in zip(kept, beam.last_pieces()[:, 0], strict=True)]
    return beam.best()


def two_letters(pieces):
    """Any two letters, A likelier than B likelier than C, then the end."""
    return [0, 1, 0, 0, 0] if len(pieces) == 3 else [0, 0, 0.5, 0.3, 0.2]


def test_finds_the_likeliest_texts_in_order():
    rows = search(two_letters)
    assert rows[0].pieces == (START, A, A, END)
    assert rows[0].score == np.float32(np.log(0.5)) * 2
    assert [row.score for row in rows] == sorted((row.score for row in rows), reverse=True)


def test_expected_word_is_preferred_where_the_model_wavers():
    assert search(two_letters, words=[(C, B)], bonus=1.5)[0].pieces == (START, C, B, END)


def test_expected_word_that_is_improbable_stays_unheard():
    assert search(two_letters, words=[(C, B)], bonus=0.1)[0].pieces == (START, A, A, END)


def test_unfinished_word_gives_its_bonus_back():
    rows = search(two_letters, words=[(C, C, C)], bonus=5.0)
    assert {row.bonus for row in rows} == {0.0}


def test_word_said_twice_earns_once():
    rows = search(two_letters, width=9, words=[(A,)], bonus=1.0)
    bonuses = {row.pieces: row.bonus for row in rows}
    assert bonuses[(START, A, A, END)] == 1.0
    assert bonuses[(START, A, B, END)] == 1.0
    assert bonuses[(START, B, B, END)] == 0.0


def test_finished_word_keeps_its_bonus_when_a_longer_one_is_left():
    rows = search(two_letters, width=9, words=[(A,), (A, B, C)], bonus=1.0)
    assert next(row for row in rows if row.pieces == (START, A, B, END)).bonus == 1.0
