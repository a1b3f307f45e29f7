"""What a publisher's own list may change in the store, and every way to try more than that."""

import dataclasses
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from securesystemslib.signer import CryptoSigner
from tuf.api.metadata import DelegatedRole, Delegations, Metadata, Snapshot, TargetFile, Targets

from rapp_cloud.judge import STALE, judge
from rapp_hop.errors import HopError, Invalid, Refused
from rapp_hop.hz.application import first_list, read_application, write_application
from rapp_hop.hz.standing import KNOWN, MAX_LIST, YANKED, Standing, pattern, signed

NOW = datetime.now(UTC).replace(microsecond=0)
MARIA, STRANGER = CryptoSigner.generate_ed25519(), CryptoSigner.generate_ed25519()


def target(name: str, version: str, data: bytes = b"right", **custom: Any) -> TargetFile:
    found = TargetFile.from_data(f"{name}-{version}.hz", data, ["sha256"])
    found.unrecognized_fields["custom"] = {"name": name, "version": version, **custom}
    return found


def put(own: Targets, *targets: TargetFile) -> Targets:
    own.targets.update({one.path: one for one in targets})
    return own


@pytest.fixture
def standing() -> Standing:
    """Maria's: clock 1.0.0 and 1.1.0, 0.9.0 yanked; 0.1.0 is known from before her key was revoked once."""
    targets = Targets(delegations=Delegations({}, {}))
    assert targets.delegations is not None and targets.delegations.roles is not None
    for name, package, signer in (("maria", "clock", MARIA), ("rapp", "hello", STRANGER)):
        targets.delegations.roles[name] = DelegatedRole(name, [], 1, True, [pattern(package)])
        targets.add_key(signer.public_key, name)
    targets.unrecognized_fields[KNOWN] = {"maria": {"clock-0.1.0.hz": "00"}}
    own = put(Targets(version=7, expires=NOW + timedelta(days=30)), target("clock", "1.0.0"), target("clock", "1.1.0"))
    own.unrecognized_fields[YANKED] = {"clock-0.9.0.hz": "99", "clock-0.1.0.hz": "00"}
    return Standing("maria", targets, own)


Change = Callable[[Targets], object]


def changed(standing: Standing, *changes: Change) -> Targets:
    own = standing.renewed()
    for change in changes:
        change(own)
    return own


def judged(standing: Standing, *changes: Change, signer: CryptoSigner = MARIA) -> HopError | None:
    try:
        judge(standing, signed(changed(standing, *changes), signer), NOW)
    except HopError as error:
        return error
    return None


def test_what_may_be(standing: Standing) -> None:
    renewal = judge(standing, signed(standing.renewed(), MARIA), NOW)
    assert (renewal.own.version, renewal.added, renewal.withdrawn) == (8, None, ())
    more = target("clock", "1.2.0", robots=["nao1"])
    publication = judge(standing, signed(put(standing.renewed(), more), MARIA), NOW)
    assert (publication.added, publication.withdrawn) == (more, ())
    yank = judge(standing, signed(standing.without("clock", "1.0.0"), MARIA), NOW)
    assert (yank.added, yank.withdrawn) == (None, ("clock-1.0.0.hz",))
    assert yank.own.unrecognized_fields[YANKED].keys() == {"clock-0.1.0.hz", "clock-0.9.0.hz", "clock-1.0.0.hz"}
    back = dataclasses.replace(standing, own=yank.own)
    again = put(changed(back, lambda own: own.unrecognized_fields[YANKED].pop("clock-1.0.0.hz")), target("clock", "1.0.0"))
    assert judge(back, signed(again, MARIA), NOW).added == target("clock", "1.0.0")


def only(field: str, **values: Any) -> Change:
    """Change a field of the new package's entry."""

    def change(own: Targets) -> None:
        new = target("clock", "1.2.0")
        (new.unrecognized_fields if field == "entry" else new.unrecognized_fields["custom"]).update(values)
        put(own, new)

    return change


def yanked(path: str, digest: str) -> Change:
    return lambda own: own.unrecognized_fields[YANKED].update({path: digest})


def two_hashes(own: Targets) -> None:
    new = target("clock", "1.2.0")
    new.hashes["md5"] = "0" * 32
    put(own, new)


def moved(own: Targets) -> None:
    new = target("clock", "1.2.0")
    new.path = "clock-9.0.0.hz"
    put(own, new)


REFUSALS: list[tuple[str, type[HopError], str, Change]] = [
    ("another's name", Refused, "the name is not theirs", lambda own: put(own, target("hello", "2.0.0"))),
    ("nobody's name", Refused, "./rapp keys grant maria new", lambda own: put(own, target("new", "1.0.0"))),
    ("changed package", Refused, "it changes clock-1.0.0.hz", lambda own: put(own, target("clock", "1.0.0", b"evil"))),
    ("other robots", Refused, "it changes clock-1.0.0.hz", lambda own: put(own, target("clock", "1.0.0", robots=["nao"]))),
    ("removed package", Refused, "clock-1.0.0.hz is gone", lambda own: own.targets.pop("clock-1.0.0.hz")),
    ("forgotten yank", Refused, "clock-0.9.0.hz is gone", lambda own: own.unrecognized_fields[YANKED].pop("clock-0.9.0.hz")),
    ("forgotten before", Refused, "clock-0.1.0.hz is gone", lambda own: own.unrecognized_fields[YANKED].pop("clock-0.1.0.hz")),
    ("changed yank", Refused, "other bytes", yanked("clock-0.9.0.hz", "98")),
    (
        "yanked with other bytes", Refused, "other bytes",
        lambda own: (own.unrecognized_fields[YANKED].pop("clock-0.9.0.hz"), put(own, target("clock", "0.9.0", b"evil"))),
    ),
    ("strange yank", Invalid, "never on offer", yanked("hello-1.0.0.hz", "1")),
    ("yanked and offered", Invalid, "yanked cannot be read", yanked("clock-1.0.0.hz", "1")),
    ("yanks that are none", Invalid, "yanked cannot be read", lambda own: own.unrecognized_fields.update({YANKED: ["x"]})),
    ("two at once", Invalid, "2 packages more", lambda own: put(own, target("clock", "1.2.0"), target("clock", "1.3.0"))),
    ("delegation", Invalid, "more than packages", lambda own: setattr(own, "delegations", Delegations({}, {}))),
    ("other words", Invalid, "more than packages", lambda own: own.unrecognized_fields.update({"more": 1})),
    ("soon over", Invalid, "good until", lambda own: setattr(own, "expires", NOW + timedelta(hours=1))),
    ("for ever", Invalid, "good until", lambda own: setattr(own, "expires", NOW + timedelta(days=4000))),
    ("path of another name", Invalid, "says another thing", lambda own: put(own, moved_name())),
    ("path of another version", Invalid, "says another thing", moved),
    ("word beside the hashes", Invalid, "says another thing", only("entry", more=1)),
    ("word beside the name", Invalid, "says another thing", only("custom", more=1)),
    ("version that is none", Invalid, "version", only("custom", version="new")),
    ("name that is none", Invalid, "cannot use the name", only("custom", name="../hello")),
    ("robots that are none", Invalid, "must be a list", only("custom", robots="nao")),
    ("robot that is none", Invalid, "cannot use the name", only("custom", robots=["../nao"])),
    ("robots without number", Invalid, "must be a list", only("custom", robots=["nao"] * 2000)),
    ("no words of what it is", Invalid, "does not say what it is", lambda own: put(own, wordless())),
    ("number that is true", Invalid, "another kind", lambda own: setattr(own, "version", True)),
    ("another hash", Invalid, "no other hash", two_hashes),
]  # fmt: skip


def moved_name() -> TargetFile:
    """An entry whose path is another's, whatever it says of itself."""
    found = target("clock", "1.2.0")
    found.path = "hello-1.2.0.hz"
    return found


def wordless() -> TargetFile:
    found = target("clock", "1.2.0")
    found.unrecognized_fields["custom"] = ["clock", "1.2.0"]
    return found


@pytest.mark.parametrize(("kind", "text", "change"), [row[1:] for row in REFUSALS], ids=[row[0] for row in REFUSALS])
def test_what_may_not_be(standing: Standing, kind: type[HopError], text: str, change: Change) -> None:
    error = judged(standing, change)
    assert type(error) is kind
    assert text in str(error)


@pytest.mark.parametrize(
    ("number", "text"), [(6, "somebody published meanwhile; run it again"), (7, "run it again"), (9, "8 comes next")]
)
def test_the_number_is_the_next_one(standing: Standing, number: int, text: str) -> None:
    error = judged(standing, lambda own: setattr(own, "version", number))
    assert isinstance(error, Refused) and text in str(error)
    assert error.status == STALE


def test_whose_key_has_signed(standing: Standing) -> None:
    error = judged(standing, signer=STRANGER)
    assert isinstance(error, Refused) and error.status == 403
    assert "not signed by maria's key" in str(error)
    forged = Metadata.from_bytes(signed(standing.renewed(), STRANGER))
    forged.signatures[MARIA.public_key.keyid] = forged.signatures.pop(STRANGER.public_key.keyid)
    with pytest.raises(Refused, match="not signed by"):
        judge(standing, forged.to_bytes(), NOW)
    assert standing.role.threshold == 1
    standing.role.threshold = 2
    assert "not signed by" in str(judged(standing))


def test_what_is_no_list(standing: Standing) -> None:
    snapshot = Metadata(Snapshot(version=8, expires=NOW + timedelta(days=30)))
    snapshot.sign(MARIA)
    right = signed(standing.renewed(), MARIA)
    for data in (b"", b"{}", b"x", b"[]", right[:-1], right.replace(b"{", b'{"signatures":[],', 1), snapshot.to_bytes()):
        with pytest.raises(Invalid):
            judge(standing, data, NOW)
    with pytest.raises(Invalid, match="at most"):
        judge(standing, right + b" " * MAX_LIST, NOW)


def test_nothing_is_around_what_was_signed(standing: Standing) -> None:
    right = signed(standing.renewed(), MARIA)
    worded, both = (Metadata.from_bytes(right) for _ in range(2))
    worded.signatures[MARIA.public_key.keyid].unrecognized_fields["more"] = "x" * 100
    both.sign(STRANGER, append=True)
    outside = right.replace(b'{"signatures"', b'{"more":1,"signatures"', 1)
    for data in (right + b" ", b"\n" + right, right.replace(b",", b" ,", 1), worded.to_bytes(), both.to_bytes(), outside):
        with pytest.raises(Invalid, match="more in it than was signed"):
            judge(standing, data, NOW)


def test_an_application_is_signed_by_the_key_it_names() -> None:
    data = write_application("maria", MARIA, first_list(3))
    found = read_application(data)
    assert (found.publisher, found.key.keyid, found.own.version) == ("maria", MARIA.public_key.keyid, 4)
    public = MARIA.public_key.keyval["public"].encode()
    for broken, text in [
        (data.replace(public, STRANGER.public_key.keyval["public"].encode()), "not signed by it"),
        (data.replace(public, b"00"), "broken"),
        (data.replace(b"maria", b"../maria"), "cannot use the name"),
        (data.replace(b'"publisher"', b'"who"'), "must have the texts"),
        (data.replace(b'\\"version\\":4', b'\\"version\\":5'), "not signed by it"),
        (b"{}", "must have the texts"),
    ]:
        assert broken != data
        with pytest.raises(Invalid, match=text):
            read_application(broken)
