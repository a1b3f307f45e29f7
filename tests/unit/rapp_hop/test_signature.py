"""A signature beside a package: by a believed key, for these bytes, in time."""

from datetime import timedelta
from pathlib import Path

import pytest
from securesystemslib.signer import CryptoSigner

from fakes.packages import source_folder
from rapp_hop.errors import Invalid
from rapp_hop.hz.archive import build
from rapp_hop.hz.signature import sign_package, verify_package
from rapp_hop.hz.trust import Attack, Untrusted


@pytest.fixture
def signer() -> CryptoSigner:
    return CryptoSigner.generate_ed25519()


@pytest.fixture
def package(tmp_path: Path) -> bytes:
    return build(source_folder(tmp_path))


def attack(package: bytes, signature: bytes, signer: CryptoSigner) -> Attack:
    with pytest.raises(Untrusted) as caught:
        verify_package(package, signature, believed(signer))
    return caught.value.attack


def believed(signer: CryptoSigner) -> frozenset[str]:
    return frozenset({signer.public_key.keyid})


def test_what_is_signed_is_verified(package: bytes, signer: CryptoSigner) -> None:
    found = verify_package(package, sign_package(package, signer), believed(signer))
    assert (found.manifest.name, found.keyid) == ("hello", signer.public_key.keyid)


def test_other_bytes_and_other_packages(package: bytes, signer: CryptoSigner, tmp_path: Path) -> None:
    signature = sign_package(package, signer)
    changed = build(source_folder(tmp_path / "b", program="evil()\n"))
    assert attack(changed, signature, signer) == Attack.WRONG_CONTENT
    other = build(source_folder(tmp_path / "c", "parrot"))
    assert attack(other, signature, signer) == Attack.WRONG_CONTENT
    with pytest.raises(Invalid):
        verify_package(b"<html>", signature, believed(signer))
    with pytest.raises(Invalid):
        sign_package(b"<html>", signer)


def test_keys_that_nobody_vouches_for(package: bytes, signer: CryptoSigner) -> None:
    stranger = CryptoSigner.generate_ed25519()
    assert attack(package, sign_package(package, stranger), signer) == Attack.UNSIGNED
    claimed = sign_package(package, stranger).replace(
        stranger.public_key.keyval["public"].encode(), signer.public_key.keyval["public"].encode()
    )
    assert attack(package, claimed, signer) == Attack.UNSIGNED
    both = claimed.replace(stranger.public_key.keyid.encode(), signer.public_key.keyid.encode())
    assert attack(package, both, signer) == Attack.UNSIGNED


def test_signatures_run_out(package: bytes, signer: CryptoSigner) -> None:
    assert attack(package, sign_package(package, signer, timedelta(seconds=-1)), signer) == Attack.FREEZE


@pytest.mark.parametrize("broken", [b"", b"{}", b"[]", b"\xff", b"x" * 100_000])
def test_signature_files_that_are_none(package: bytes, signer: CryptoSigner, broken: bytes) -> None:
    assert attack(package, broken, signer) == Attack.MALFORMED


def test_a_public_key_that_is_none(package: bytes, signer: CryptoSigner) -> None:
    signature = sign_package(package, signer).replace(signer.public_key.keyval["public"].encode(), b"zz")
    assert attack(package, signature, signer) == Attack.MALFORMED
