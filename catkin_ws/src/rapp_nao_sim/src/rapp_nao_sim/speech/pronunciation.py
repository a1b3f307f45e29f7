"""Pronunciation of any word: espeak-ng's phonemes (IPA) mapped to the ARPABET of pocketsphinx's English model."""

import re

from rapp_nao_sim.sound.synthesis import espeak

# Longest first; the right side is one or more phones of CMUdict.
_PHONES = {
    "tʃ": "CH", "dʒ": "JH", "aɪ": "AY", "eɪ": "EY", "ɔɪ": "OY", "aʊ": "AW", "oʊ": "OW", "əʊ": "OW", "ɪə": "IY R", "eə": "EH R",
    "ʊə": "UH R", "iə": "IY AH", "ɔː": "AO", "ɑː": "AA", "iː": "IY", "uː": "UW", "ɜː": "ER", "oː": "AO", "əl": "AH L",
    "ɐ": "AH", "ɚ": "ER", "ɝ": "ER", "ə": "AH", "ɪ": "IH", "i": "IY", "ʊ": "UH", "u": "UW", "ʌ": "AH", "ɛ": "EH", "e": "EY",
    "æ": "AE", "a": "AE", "ɒ": "AA", "ɔ": "AO", "o": "OW", "ɑ": "AA", "θ": "TH", "ð": "DH", "ʃ": "SH", "ʒ": "ZH", "ŋ": "NG",
    "ɹ": "R", "r": "R", "ɾ": "T", "ʔ": "T", "ɡ": "G", "g": "G", "j": "Y", "x": "K", "ɬ": "L", "ç": "HH", "h": "HH",
    **{c: c.upper() for c in "bdfklmnpstvwz"},
}  # fmt: skip
_SPELLINGS = sorted(_PHONES, key=len, reverse=True)
_MARKS = re.compile(r"[ˈˌ\s\u0303\u0329\u032f_|ʲ\u200d]")


def to_arpabet(ipa: str) -> str:
    """Map IPA as espeak-ng prints it to ARPABET phones, separated by blanks; unknown signs are left out."""
    rest = _MARKS.sub("", ipa)
    phones: list[str] = []
    while rest:
        spelling = next((s for s in _SPELLINGS if rest.startswith(s)), None)
        if spelling is None:
            rest = rest[1:]
            continue
        rest = rest[len(spelling) :]
        for phone in _PHONES[spelling].split():
            if not (phone == "R" and phones and phones[-1] == "ER"):
                phones.append(phone)
    return " ".join(phones)


def pronounce(word: str, voice: str = "en-us") -> str:
    """ARPABET pronunciation of a word as an espeak-ng voice says it; empty when it says nothing. Raises VoiceError."""
    return to_arpabet(espeak("-q", "--ipa", "-v", voice, "--", word).decode())
