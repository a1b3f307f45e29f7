"""What each token may call, and how often: scopes, calls per second, calls per day. No I/O."""

from collections.abc import Callable

from rapp_cloud.accounts import Accounts, Holder
from rapp_cloud.quotas import Quotas
from rapp_hop.errors import Refused
from rapp_hop.fairness import Fairness

EVERYBODY = frozenset({"available_services", "openapi"})
_PUBLISH = frozenset({"publish"})
SCOPES_OF = {"runs": frozenset({"read", "robot"}), "publish_package": _PUBLISH, "publish_list": _PUBLISH}
"""Which scopes let a service be called, where it is not `robot`."""
_ROBOT = frozenset({"robot"})


class Turnstile:
    """Counts the calls of one platform."""

    def __init__(self, accounts: Accounts, quotas: Quotas, clock: Callable[[], float]) -> None:
        """Begin with nobody.

        :param clock: seconds, never going back
        """
        self._accounts = accounts
        self._quotas = quotas
        self._clock = clock
        self._rates: dict[str, tuple[float, Fairness]] = {}  # by the token's id

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
            self._rate(holder, holder.rate)
        if holder.quota is not None:
            self._quotas.count(holder.token, holder.quota)

    def _rate(self, holder: Holder, rate: float) -> None:
        known = self._rates.get(holder.token)
        if known is None or known[0] != rate:
            known = self._rates[holder.token] = rate, Fairness(rate, max(1.0, rate), self._clock)
        known[1].admit(holder.token)
