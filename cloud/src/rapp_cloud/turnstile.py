"""What each token may call, and how often: scopes, calls per second, calls per day. No I/O; the day's counts are this process's."""

from collections.abc import Callable

from rapp_cloud.accounts import Accounts, Holder
from rapp_hop.errors import Refused, Unreachable
from rapp_hop.fairness import Fairness
from rapp_hop.protocol import TURNED_AWAY

DAY = 86400  # seconds
EVERYBODY = frozenset({"available_services", "openapi"})
_PUBLISH = frozenset({"publish"})
SCOPES_OF = {"runs": frozenset({"read", "robot"}), "publish_package": _PUBLISH, "publish_list": _PUBLISH}
"""Which scopes let a service be called, where it is not `robot`."""
_ROBOT = frozenset({"robot"})


class Turnstile:
    """Counts the calls of one platform."""

    def __init__(self, accounts: Accounts, clock: Callable[[], float]) -> None:
        """Begin with nobody.

        :param clock: seconds, never going back
        """
        self._accounts = accounts
        self._clock = clock
        self._rates: dict[str, tuple[float, Fairness]] = {}  # by the token's id
        self._day = 0
        self._calls: dict[str, int] = {}  # of that day, by the token's id

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
            self._count(holder, holder.quota)

    def _rate(self, holder: Holder, rate: float) -> None:
        known = self._rates.get(holder.token)
        if known is None or known[0] != rate:
            known = self._rates[holder.token] = rate, Fairness(rate, max(1.0, rate), self._clock)
        known[1].admit(holder.token)

    def _count(self, holder: Holder, quota: int) -> None:
        now = self._accounts.clock()
        if int(now // DAY) != self._day:
            self._day, self._calls = int(now // DAY), {}
        count = self._calls[holder.token] = self._calls.get(holder.token, 0) + 1
        if count > quota:
            error = Unreachable(f"cannot serve more than {quota} calls a day with this token: come again tomorrow (UTC)", 429)
            error.reason, error.retry_after = TURNED_AWAY, int(DAY - now % DAY) + 1
            raise error
