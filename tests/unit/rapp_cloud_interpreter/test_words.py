"""Words of sentences and pieces of words."""

import numpy as np
import pytest

from rapp_cloud.interpreter.errors import Bug
from rapp_cloud.interpreter.meaning import WordPieces
from rapp_cloud.interpreter.tokens import read_vocabulary
from rapp_cloud.interpreter.words import RareWords, content_words, plain


def test_plain_text():
    assert plain("  Send an E-Mail, please!  It's 5 o'clock ") == "send an email please it's o'clock"


def test_content_words_leave_function_words_out():
    assert content_words(["What is the weather?", "will it rain"]) == ["rain", "weather"]


def test_word_of_one_rapp_weighs_more_than_a_common_one():
    words = RareWords({"a": ["play music"], "b": ["play chess"], "c": ["play ball"]})
    assert words.vector("play music") @ words.vector("music") > words.vector("play music") @ words.vector("play")


def test_strange_words_make_texts_less_alike():
    words = RareWords({"a": ["play music"], "b": ["tell the time"]})
    music = words.vector("play music")
    assert music @ music == pytest.approx(1)
    assert music @ words.vector("play music for elephants today") < 0.9
    assert not np.any(words.vector(""))


def test_speech_vocabulary_goes_forth_and_back(tmp_path):
    pieces = [b"<unk>", b"<s>", b"</s>", *(bytes([n]) for n in range(256))]
    pieces += ["▁".encode(), b"a", b"b", b"ab", "▁ab".encode(), b"x" * 200]
    file = tmp_path / "tokenizer.bin"
    lengths = (bytes([len(p)]) if len(p) < 128 else bytes([len(p) & 127 | 128, len(p) >> 7]) for p in pieces)
    file.write_bytes(b"".join(length + piece for length, piece in zip(lengths, pieces, strict=True)))
    vocabulary = read_vocabulary(file)
    assert len(vocabulary) == len(pieces)
    assert vocabulary.numbers("ab") == [pieces.index("▁ab".encode())]
    for text in ("ab", "ba ab", "é"):
        assert vocabulary.text([1, *vocabulary.numbers(text), 2]) == text


def test_vocabulary_cut_off_is_a_bug(tmp_path):
    file = tmp_path / "tokenizer.bin"
    file.write_bytes(b"\x05<un")
    with pytest.raises(Bug, match=r"cut off; install the packages again$"):
        read_vocabulary(file)


def test_word_pieces_take_the_longest(tmp_path):
    file = tmp_path / "vocabulary.txt"
    file.write_text("\n".join(["[PAD]", "[UNK]", "[CLS]", "[SEP]", "play", "##ing", "##in", "cafe", "'", "s"]))
    pieces = WordPieces(file)
    assert pieces.numbers("playing") == [2, 4, 5, 3]
    assert pieces.numbers("café's") == [2, 7, 8, 9, 3]
    assert pieces.numbers("zebra") == [2, 1, 3]
    assert len(pieces.numbers("play " * 500)) == 128
