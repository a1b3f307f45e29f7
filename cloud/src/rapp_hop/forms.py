"""Which form a request is written in: told by its method, headers and query alone, never by what its body holds.

1. a Hop mark (`Hop-Serialize` and its like, `hop-encoding` in the query): Hop;
2. GET, HEAD, PUT: Hop, unless the client names itself as one of the original RAPP clients;
3. POST of application/json: our own; of multipart/form-data: our own when JSON is accepted by name, else the original's;
4. POST of a web form, or without content type: the original's;
5. anything else is refused.
"""

from collections.abc import Mapping

from rapp_hop.errors import Invalid, Refused
from rapp_hop.hop_form import HopForm, is_hop
from rapp_hop.original_form import OriginalForm, is_original
from rapp_hop.own_form import JSON, OwnForm
from rapp_hop.protocol import Form

OWN = OwnForm()
ORIGINAL = OriginalForm()
HOP = HopForm()


def form_of(method: str, headers: Mapping[str, str], query: str = "") -> Form:
    """Return the form of a request.

    :raises Refused: with status 405, for a method that calls nothing
    :raises Invalid: when it is written in none
    """
    if method not in ("GET", "HEAD", "PUT", "POST"):
        raise Refused("cannot call a service so: use POST", 405)
    if is_hop(headers, query):
        return HOP
    if method != "POST":
        return ORIGINAL if is_original(headers) and method == "GET" else HOP
    return _of_post(headers.get("content-type", "").partition(";")[0].strip().lower(), headers)


def _of_post(kind: str, headers: Mapping[str, str]) -> Form:
    if kind == JSON:
        return OWN
    if kind == "multipart/form-data":
        return OWN if JSON in headers.get("accept", "") else ORIGINAL
    if kind in ("application/x-www-form-urlencoded", ""):
        return ORIGINAL
    raise Invalid("cannot read the call: POST application/json or multipart/form-data")
