"""Who may sign for what: keys made, rotated and revoked; publishers, and the names of packages that are theirs.

A name belongs to the publisher who first published under it, also after their key was revoked: the register of names
stays in the signed targets list.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from rapp_cloud.keys import ROLES, ROOTS
from rapp_cloud.ledger import Ledger, Lists
from rapp_cloud.register import add_publisher, admit, delegated, follow, owner_of, revoked_of
from rapp_hop.errors import Refused
from rapp_hop.hz.application import Application
from rapp_hop.hz.standing import RESTORED, REVOKED, package_of, pattern
from rapp_hop.hz.text import check_name

_ROOTS = 8  # written at a resumption: robots may have seen some after the back-up


@dataclass(frozen=True)
class Holder:
    """A role or publisher, as `./rapp keys list` shows them."""

    name: str
    keys: tuple[str, ...]  # key ids; none: revoked
    expires: datetime | None
    here: bool  # whether as many private keys as must sign are in the folder
    packages: tuple[str, ...] = ()
    threshold: int = 1  # keys that must sign


class Custody:
    """The keys of one store and what they stand for. Blocking; each call holds the store's lock."""

    def __init__(self, ledger: Ledger) -> None:
        self._ledger = ledger

    def holders(self) -> list[Holder]:
        """Return all roles and publishers, revoked ones last."""
        lists, here = self._ledger.read(), set(self._ledger.keys.names())
        expiries = {name: getattr(lists, name).expires for name in ROLES}
        root = lists.root.roles["root"]
        signs = len(here & set(ROOTS[: len(root.keyids)])) >= root.threshold
        found = [Holder("root", tuple(root.keyids), expiries["root"], signs, (), root.threshold)]
        found += [Holder(name, tuple(lists.root.roles[name].keyids), expiries[name], name in here) for name in ROLES[1:]]
        for name, role in sorted(delegated(lists).items()):
            names = tuple(package_of(path) for path in role.paths or ())
            found.append(Holder(name, tuple(role.keyids), lists.publishers[name].expires, name in here, names))
        gone = revoked_of(lists)
        return [*found, *(Holder(name, (), None, False, tuple(gone[name]["names"])) for name in sorted(gone))]

    def publishers(self) -> list[Holder]:
        """Return the publishers whose word counts."""
        return [holder for holder in self.holders()[len(ROLES) :] if holder.keys]

    def add(self, publisher: str, application: Application | None = None) -> None:
        """Make a publisher's key and let them publish; one whose key was revoked gets their names back.

        :param application: of one who has made their key at home and keeps it there
        :raises Refused: when there is such a publisher, or the name is a role's
        """
        with self._ledger.locked():
            lists = self._ledger.read()
            taken = {*ROLES, *ROOTS, *delegated(lists)}
            if check_name(publisher) in taken or publisher.startswith("next_"):
                raise Refused(f"cannot make the publisher {publisher}: the name is taken, see ./rapp keys list")
            if application is not None:
                self._ledger.write(lists, ["targets"], admit(self._ledger, lists, application))
                return
            add_publisher(self._ledger, lists, publisher)
            self._ledger.write(lists, ["targets", publisher])

    def grant(self, publisher: str, names: Sequence[str]) -> None:
        """Give package names to a publisher, for good.

        :raises Refused: when there is no such publisher, or a name is another's
        """
        with self._ledger.locked():
            lists = self._ledger.read()
            role = delegated(lists).get(publisher)
            if role is None:
                raise Refused(f"cannot give names to {publisher}: they have no key, see ./rapp keys list")
            free = [name for name in names if owner_of(lists, check_name(name)) is None]
            if others := [name for name in names if name not in free and pattern(name) not in (role.paths or ())]:
                raise Refused(f"cannot give {others[0]} to {publisher}: it is {owner_of(lists, others[0])}'s, choose another name")
            role.paths = [*(role.paths or ()), *(pattern(name) for name in dict.fromkeys(free))]
            if free:
                self._ledger.write(lists, ["targets"])

    def rotate(self, name: str, application: Application | None = None) -> None:
        """Give a role or publisher a new key; the old one is worth nothing from then on.

        A new root is signed by the old keys too, so that robots follow; all its keys are new.

        :param application: of a publisher who has made the new key at home, and signed the list that is on offer with it
        :raises Refused: when there is no such role or publisher, or a key that must sign is not here
        """
        with self._ledger.locked():
            lists = self._ledger.read()
            if application is not None and name in delegated(lists):
                self._ledger.write(lists, ["targets"], follow(lists, application))
                self._ledger.keys.remove(name)
            elif application is not None:
                raise Refused(f"cannot put another key in the place of {name}'s: that is no publisher, see ./rapp keys list")
            elif name == "root":
                self._rotate_root(lists, len(lists.root.roles["root"].keyids), lists.root.roles["root"].threshold)
            elif name in ROLES:
                self._rotate_roles(lists, [name])
            elif name in delegated(lists):
                self._ledger.signer(lists, name)
                self._rotate_publisher(lists, name)
            else:
                raise Refused(f"cannot rotate the key of {name}: it has none, see ./rapp keys list")

    def share_root(self, keys: int, threshold: int) -> None:
        """Give the root so many new keys, some of which must sign from then on: one lost or stolen does not end the store.

        :raises Refused: when the numbers make no sense, a publisher has a key's name, or a key that must sign is not here
        """
        if not 1 <= threshold <= keys <= len(ROOTS):
            raise Refused(f"cannot have {threshold} of {keys} keys sign: give 1 to {len(ROOTS)} keys, and at most all of them")
        with self._ledger.locked():
            lists = self._ledger.read()
            if taken := sorted({*ROOTS[:keys]} & {*lists.publishers}):
                raise Refused(f"cannot make the key {taken[0]}: a publisher has that name, have fewer keys")
            self._rotate_root(lists, keys, threshold)

    def revoke(self, publisher: str) -> None:
        """Take a publisher's right to sign away: nothing they have signed is on offer any more.

        :raises Refused: when there is no such publisher; a role's key is rotated
        """
        with self._ledger.locked():
            lists = self._ledger.read()
            if publisher in ROLES:
                raise Refused(f"cannot revoke the key of {publisher} without another: rotate it")
            role = delegated(lists).get(publisher)
            if role is None:
                raise Refused(f"cannot revoke the key of {publisher}: it has none, see ./rapp keys list")
            names = [package_of(path) for path in role.paths or ()]
            lists.targets.unrecognized_fields[REVOKED] = {
                **revoked_of(lists), publisher: {"keyids": list(role.keyids), "names": names},
            }  # fmt: skip
            for keyid in list(role.keyids):
                lists.targets.revoke_key(keyid, publisher)
            del delegated(lists)[publisher]
            del lists.publishers[publisher]
            self._ledger.write(lists, ["targets"])
            self._ledger.keys.remove(publisher)

    def resume(self) -> list[str]:
        """Have robots believe a store that is older than the one they saw, as after a restore.

        Timestamp and snapshot get new keys, so they drop those they saw (TUF §5.3.11); lists are numbered by the clock, beyond
        all that were given. Robots that saw more new roots than this writes still refuse; then do it again.

        :return: packages that robots refuse: the list has expired, and its publisher's key is elsewhere
        :raises Refused: when a key of root or targets is not here, or the passphrase is not; nothing is changed then
        """
        with self._ledger.locked():
            lists, now = self._ledger.read(), datetime.now(UTC)
            self._ledger.root_signers(lists)
            self._ledger.signer(lists, "targets")
            here = [name for name in lists.publishers if self._signs(lists, name)]
            lists.targets.unrecognized_fields[RESTORED] = now.replace(microsecond=0).isoformat()
            for signed in (lists.timestamp, lists.snapshot, lists.targets, *(lists.publishers[name] for name in here)):
                signed.version = max(signed.version, int(now.timestamp()))
            self._rotate_roles(lists, ["snapshot", "timestamp"], ["targets", *here], _ROOTS)
            late = {name: own for name, own in lists.publishers.items() if name not in here and own.expires < now}
            return [f"{path.removesuffix('.hz')} of {name}" for name, own in late.items() for path in sorted(own.targets)]

    def _signs(self, lists: Lists, name: str) -> bool:
        try:
            self._ledger.signer(lists, name)
        except Refused:
            return False
        return True

    def _rotate_roles(self, lists: Lists, names: Sequence[str], changed: Sequence[str] = (), roots: int = 1) -> None:
        """Give roles new keys, and sign their lists and the changed ones anew, below so many new roots."""
        signers, root = self._ledger.root_signers(lists), lists.root
        for name in names:
            new = self._ledger.prepare(lists, name)
            for keyid in list(root.roles[name].keyids):
                root.revoke_key(keyid, name)
            root.add_key(new.public_key, name)
        for _ in range(roots):
            root.version += 1
            self._ledger.write_root(root, signers)
        for name in names:
            self._ledger.settle(name)
        self._ledger.write(lists, [*changed, *(name for name in names if name != "timestamp")])

    def _rotate_root(self, lists: Lists, keys: int, threshold: int) -> None:
        old, root = self._ledger.root_signers(lists), lists.root
        new = [self._ledger.prepare(lists, name) for name in ROOTS[:keys]]
        for keyid in list(root.roles["root"].keyids):
            root.revoke_key(keyid, "root")
        for signer in new:
            root.add_key(signer.public_key, "root")
        root.roles["root"].threshold = threshold
        root.version += 1
        self._ledger.write_root(root, [*old, *new])
        for name in ROOTS[:keys]:
            self._ledger.settle(name)
        for name in ROOTS[keys:]:
            if name not in lists.publishers:
                self._ledger.drop(name)

    def _rotate_publisher(self, lists: Lists, name: str) -> None:
        new = self._ledger.prepare(lists, name)
        for keyid in list(delegated(lists)[name].keyids):
            lists.targets.revoke_key(keyid, name)
        lists.targets.add_key(new.public_key, name)
        self._ledger.write(lists, ["targets", name])
