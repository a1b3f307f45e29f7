"""What each token may call, and how often: scopes, calls per second, calls per day; and what strangers may fetch. No I/O."""

from collections.abc import Callable
from dataclasses import replace

from rapp_cloud.accounts import Accounts, Holder
from rapp_cloud.quotas import Quotas
from rapp_cloud.tls import is_here
from rapp_hop.callers import token_of
from rapp_hop.errors import Refused
from rapp_hop.fairness import Fairness
from rapp_hop.mounts import Mount, Visit
from rapp_hop.protocol import WireAnswer

EVERYBODY = frozenset({"available_services", "openapi"})
_PUBLISH = frozenset({"publish"})
SCOPES_OF = {"runs": frozenset({"read", "robot"}), "publish_package": _PUBLISH, "publish_list": _PUBLISH}
"""Which scopes let a service be called, where it is not `robot`."""
_ROBOT = frozenset({"robot"})
RATE = 50.0  # visits per second to what everybody may fetch, of an address, or of a token that has no rate of its own
BURST = 100.0  # visits at once, of whoever: an installation takes a handful
_PACKAGES = (".hz", "download")  # how the paths of packages end, at `/tuf/targets/` and `/hop/weblets/`


class Turnstile:
    """Counts the calls of one platform."""

    def __init__(self, accounts: Accounts, quotas: Quotas, clock: Callable[[], float]) -> None:
        """Begin with nobody.

        :param clock: seconds, never going back
        """
        self._accounts = accounts
        self._quotas = quotas
        self._clock = clock
        self._rates: dict[str, tuple[float, Fairness]] = {}  # by the token's id, calls and visits apart
        self._visits = Fairness(RATE, BURST, clock)

    def admit(self, token: str | None, service: str) -> None:
        """Count one call; whoever has no token of ours, such as a cloud agent at its door, is not our business.

        :raises Refused: (403) when the token has not the scope
        :raises Unreachable: (429) when it calls too often; `retry_after` says when it may again
        """
        holder = self._accounts.holder(token)
        if holder is None:
            return
        needed = SCOPES_OF.get(service, _ROBOT)
        if service not in EVERYBODY and not needed & holder.scopes:
            raise Refused(f"cannot call {service[:70]}: the token's scope is {' '.join(sorted(holder.scopes))}", 403)
        if holder.rate is not None:
            self._rate(holder.token, holder.rate, 1.0)
        self._count(holder)

    def counted(self, mount: Mount) -> Mount:
        """Count the visits to a mount that everybody may fetch from.

        Of a token's calls of a day, a package takes one; the store's lists and pages take none. Programs on this computer
        are not bounded, unless their token is.
        """

        async def handler(visit: Visit) -> WireAnswer:
            self._visit(visit)
            return await mount.handler(visit)

        return replace(mount, handler=handler)

    def _visit(self, visit: Visit) -> None:
        holder = self._accounts.holder(token_of(visit.request.headers))
        if holder is not None and holder.rate is not None:
            self._rate(f"visits of {holder.token}", holder.rate, BURST)
        elif not is_here(visit.address, visit.request.headers):
            self._visits.admit(holder.token if holder else visit.address)
        if holder is not None and visit.rest.endswith(_PACKAGES) and visit.request.method == "GET":
            self._count(holder)

    def _rate(self, key: str, rate: float, burst: float) -> None:
        known = self._rates.get(key)
        if known is None or known[0] != rate:
            known = self._rates[key] = rate, Fairness(rate, max(burst, rate), self._clock)
        known[1].admit(key)

    def _count(self, holder: Holder) -> None:
        if holder.quota is not None:
            self._quotas.count(holder.token, holder.quota)
