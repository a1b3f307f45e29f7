"""Who is let in, and to what: TLS, tokens, origins and permissions, through real sockets."""

import asyncio
import hashlib
import json
import ssl
import time
import xmlrpc.client
from pathlib import Path
from typing import Any

import pytest

from fakes.bridge_certificate import certificate
from fakes.bridge_neighbours import PATIENCE, Peer
from fakes.bridge_wire import BINARY, TurnedAwayError, Wire, framed

TOKEN, OTHER = "the-token-of-one-client", "the-token-of-another-one"
ACCESS = f"""
[clients.one]
token = "{TOKEN}"
topics = ["/one/*", "/latched"]
services = ["/say", "/one/*"]
params = ["/one/*"]

[clients.other]
token = "{OTHER}"
topics = ["/other/*"]
"""


@pytest.fixture(scope="module")
def pem(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return certificate(tmp_path_factory.mktemp("tls"))


@pytest.fixture(scope="module")
def bridge(start_for_module: Any, peer: Peer, pem: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> Any:
    file = tmp_path_factory.mktemp("access") / "access.toml"
    file.write_text(ACCESS)
    words = ["--certfile", pem[0], "--keyfile", pem[1], "--access-file", file, "--origin", "https://friend.example"]
    return start_for_module("rapp_bridge", "--port", "0", "--entry-timeout", "3", "--linger", "0.5", *map(str, words))


@pytest.fixture
def tls(pem: tuple[Path, Path]) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=str(pem[0]))


def bearer(token: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {token}"}


def registered(master: str) -> str:
    """All that anybody has registered, as a text to look into."""
    return json.dumps(xmlrpc.client.ServerProxy(master).getSystemState("/test"))


def test_over_tls_calls_and_large_messages_pass_both_ways(url: str, tls: ssl.SSLContext) -> None:
    async def story() -> None:
        wire = await Wire.open(url, bearer(TOKEN), tls)
        wire.send(op="call_service", service="/say", args=["encrypted"], id="1")
        assert (await wire.receive("service_response"))["values"]["message"] == "encrypted"
        wire.send(op="subscribe", topic="/one/large", type="std_msgs/String")
        wire.send(op="advertise", topic="/one/large", type="std_msgs/String")
        text = "x" * 3_000_000
        wire.send(op="publish", topic="/one/large", msg={"data": text})
        assert (await wire.receive("publish"))["msg"]["data"] == text
        wire.leave()

    asyncio.run(story())


def test_without_tls_nobody_gets_a_word(url: str) -> None:
    async def story() -> None:
        with pytest.raises((asyncio.IncompleteReadError, ConnectionError)):
            await Wire.open(url, bearer(TOKEN))

    asyncio.run(story())


@pytest.mark.filterwarnings("ignore:ssl.TLSVersion:DeprecationWarning")
def test_old_tls_is_not_spoken(url: str, tls: ssl.SSLContext) -> None:
    async def story() -> None:
        tls.minimum_version = ssl.TLSVersion.TLSv1
        tls.maximum_version = ssl.TLSVersion.TLSv1_1
        with pytest.raises((ssl.SSLError, ConnectionError)):
            await Wire.open(url, bearer(TOKEN), tls)

    asyncio.run(story())


ACT = '{"op":"advertise","topic":"/one/must_not_be","type":"std_msgs/String"}'
WRONG = '{"op":"auth","token":"this-is-nobodys-token"}'
RIGHT = f'{{"op":"auth","token":"{TOKEN}"}}'


@pytest.mark.parametrize(
    "first",
    [
        pytest.param([framed(ACT.encode())], id="no-auth"),
        pytest.param([framed((WRONG + ACT).encode())], id="two-in-one-frame"),
        pytest.param([framed((RIGHT + ACT).encode())], id="two-in-one-frame-with-the-right-token"),
        pytest.param([framed(ACT[:20].encode()), framed(ACT[20:].encode())], id="split-over-two-frames"),
        pytest.param([framed(RIGHT[:20].encode()), framed((RIGHT[20:] + ACT).encode())], id="right-token-split"),
        pytest.param([framed(b"}{")], id="garbage"),
        pytest.param([framed(b"\xff")], id="bad-utf8"),
        pytest.param([framed(b"{" * 6000)], id="braces"),
        pytest.param([framed(ACT.encode(), BINARY)], id="binary-json"),
        pytest.param([framed(b"\xa1\x62op\x64auth", BINARY)], id="cbor-without-token"),
        pytest.param([framed(b"\xa1\x62op", BINARY)], id="cbor-cut"),
        pytest.param([framed(WRONG.encode())], id="wrong-token"),
        pytest.param([framed(b'{"op":"auth","token":""}')], id="empty-token"),
        pytest.param([framed(b'{"op":"auth"}')], id="no-token"),
        pytest.param([framed(b'{"op":"auth","token":["a"]}')], id="token-is-a-list"),
        pytest.param([framed(b'{"op":"auth","mac":1,"t":"x"}')], id="digest-of-wrong-types"),
        pytest.param([framed(b'{"op":"auth","mac":"00","t":99999999999999999999999999,"end":1e400}')], id="digest-of-huge-times"),
        pytest.param(
            [framed(json.dumps({"op": "fragment", "id": "f", "num": 0, "total": 1, "data": ACT}).encode())], id="fragment"
        ),
        pytest.param(
            [framed(json.dumps({"op": "fragment", "id": "f", "num": 0, "total": 1, "data": RIGHT}).encode())], id="auth-in-one"
        ),
    ],
)
def test_what_breaks_the_authentication_step_is_never_executed(
    url: str, tls: ssl.SSLContext, roscore: str, first: list[bytes]
) -> None:
    async def story() -> None:
        wire = await Wire.open(url, None, tls)
        wire.raw(b"".join(first) + framed(ACT.encode()))
        code, reason, said = await wire.ending()
        assert (code, reason) == (1008, "not authenticated")
        assert said[-1].startswith("cannot ")
        assert "known" not in registered(roscore)
        assert "must_not_be" not in registered(roscore)
        wire.leave()

    asyncio.run(story())


def test_a_client_that_says_nothing_is_sent_away(url: str, tls: ssl.SSLContext) -> None:
    async def story() -> None:
        wire = await Wire.open(url, None, tls)
        assert (await wire.ending())[:2] == (1008, "not authenticated in time")
        wire.leave()

    asyncio.run(story())


def test_a_wrong_token_in_the_request_is_answered_with_401(url: str, tls: ssl.SSLContext) -> None:
    with pytest.raises(TurnedAwayError, match="401"):
        asyncio.run(Wire.open(url, bearer("this-is-nobodys-token"), tls))


def auth(token: str) -> dict[str, Any]:
    now = int(time.time())
    fields = {"client": "c", "dest": "d", "rand": "r", "t": now, "level": "user", "end": now + 100}
    return {**fields, "mac": hashlib.sha512((token + "".join(map(str, fields.values()))).encode()).hexdigest()}


@pytest.mark.parametrize("fields", [lambda: {"token": TOKEN}, lambda: auth(TOKEN)], ids=["token", "digest"])
def test_a_first_message_may_bring_the_token_or_a_digest_of_it(url: str, tls: ssl.SSLContext, fields: Any) -> None:
    async def story() -> None:
        wire = await Wire.open(url, None, tls)
        wire.send(op="auth", **fields())
        wire.send(op="call_service", service="/say", args=["in"])
        assert (await wire.receive("service_response"))["values"]["message"] == "in"
        wire.leave()

    asyncio.run(story())


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://127.0.0.1.evil.example"])
def test_a_page_from_elsewhere_is_not_let_in_even_with_a_token(url: str, tls: ssl.SSLContext, origin: str) -> None:
    with pytest.raises(TurnedAwayError, match="403"):
        asyncio.run(Wire.open(url, {**bearer(TOKEN), "Origin": origin}, tls))


@pytest.mark.parametrize("origin", ["https://friend.example", "http://localhost:3000"])
def test_a_page_from_a_friend_or_this_machine_is_let_in(url: str, tls: ssl.SSLContext, origin: str) -> None:
    async def story() -> None:
        wire = await Wire.open(url, {**bearer(TOKEN), "Origin": origin}, tls)
        await wire.settle()
        wire.leave()

    asyncio.run(story())


@pytest.mark.parametrize(
    ("op", "fields", "what"),
    [
        ("subscribe", {"topic": "/other/x", "type": "std_msgs/String"}, "topic /other/x"),
        ("subscribe", {"topic": "other/x", "type": "std_msgs/String", "compression": "cbor-raw"}, "topic /other/x"),
        ("advertise", {"topic": "/other/x", "type": "std_msgs/String"}, "topic /other/x"),
        ("publish", {"topic": "/other/x", "msg": {}}, "topic /other/x"),
        ("publish", {"topic": "/one/../other/x", "msg": {}}, "no ROS name"),
        ("advertise_service", {"service": "/other/x", "type": "std_srvs/Empty"}, "service /other/x"),
        ("advertise_service", {"service": "/rosapi/x", "type": "std_srvs/Empty"}, "service /rosapi/x"),
    ],
)
def test_what_the_token_does_not_open_is_refused_with_a_status(
    url: str, tls: ssl.SSLContext, roscore: str, op: str, fields: dict[str, Any], what: str
) -> None:
    async def story() -> None:
        wire = await Wire.open(url, bearer(TOKEN), tls)
        wire.send(op=op, id="i", **fields)
        status = await wire.receive("status")
        assert (status["level"], status["id"]) == ("error", "i")
        assert what in status["msg"]
        wire.leave()

    asyncio.run(story())
    assert "/other/" not in registered(roscore)


@pytest.mark.parametrize(
    ("service", "args", "what"),
    [
        ("/peer/get_loggers", {}, "service /peer/get_loggers"),
        ("peer/get_loggers", {}, "service /peer/get_loggers"),
        ("/peer/get_loggers#1", {}, "service /peer/get_loggers"),
        ("/rosbridge/get_loggers", {}, "service /rosbridge/get_loggers"),
        ("/rosapi/get_param", ["/run_id", ""], "parameter /run_id"),
        ("/rosapi/get_param", ["/", ""], "parameter /"),
        ("/rosapi/set_param", ["/other/x", "1"], "parameter /other/x"),
        ("/rosapi/has_param", ["/other/x"], "parameter /other/x"),
        ("/rosapi/delete_param", ["/"], "parameter /"),
    ],
)
def test_a_refused_call_is_answered(url: str, tls: ssl.SSLContext, service: str, args: Any, what: str) -> None:
    async def story() -> None:
        wire = await Wire.open(url, bearer(TOKEN), tls)
        wire.send(op="call_service", service=service, args=args, id="i")
        answer = await wire.receive("service_response")
        assert (answer["result"], answer["id"]) == (False, "i")
        assert answer["values"].startswith(f"cannot use {what}: one may not")
        wire.leave()

    asyncio.run(story())


def test_each_token_opens_its_own(url: str, tls: ssl.SSLContext) -> None:
    async def ask(wire: Wire, name: str, *args: Any) -> Any:
        wire.send(op="call_service", service=f"/rosapi/{name}", args=args)
        return (await wire.receive("service_response"))["values"]

    async def story() -> None:
        one, other = await Wire.open(url, bearer(TOKEN), tls), await Wire.open(url, bearer(OTHER), tls)
        one.send(op="subscribe", topic="/latched", type="std_msgs/String")
        assert (await one.receive("publish"))["msg"] == {"data": "kept"}
        assert (await ask(one, "topics"))["topics"] == ["/latched"]
        assert (await ask(other, "topics"))["topics"] == []
        assert await ask(one, "set_param", "/one/x", "7") == {}
        assert (await ask(one, "get_param", "/one/x", ""))["value"] == "7"
        assert (await ask(one, "get_param_names"))["names"] == ["/one/x"]
        assert (await ask(one, "services"))["services"] == ["/say"]
        other.send(op="subscribe", topic="/latched", type="std_msgs/String")
        assert "other may not" in (await other.receive("status"))["msg"]
        assert (await ask(other, "get_param", "/one/x", "")).startswith("cannot use parameter /one/x: other may not")
        assert (await ask(other, "get_param_names"))["names"] == []
        one.leave()
        other.leave()

    asyncio.run(story())


def test_who_never_shakes_hands_over_tls_counts_as_a_client(
    start: Any, own_master: Any, pem: tuple[Path, Path], tls: ssl.SSLContext
) -> None:
    """As many as there may be wait for their handshake; those beyond are cut off at once, or in a moment."""
    words = ["--certfile", pem[0], "--keyfile", pem[1], "--clients", 5, "--entry-timeout", 60]
    bridge = start("rapp_bridge", "--port", "0", *map(str, words), env=own_master.env)
    url = f"ws://127.0.0.1:{bridge.ready['port']}"

    async def story() -> None:
        lorises = [await Wire.connect(url) for _ in range(300)]
        for loris in lorises[5:]:
            assert await asyncio.wait_for(loris.reader.read(), PATIENCE) == b""
        with pytest.raises(TurnedAwayError, match="503"):
            await Wire.open(url, tls=tls)
        for loris in lorises:
            loris.leave()
        async with asyncio.timeout(PATIENCE):
            while not await is_served(url, tls):
                await asyncio.sleep(0.05)

    asyncio.run(story())


async def is_served(url: str, tls: ssl.SSLContext) -> bool:
    try:
        wire = await Wire.open(url, tls=tls)
    except TurnedAwayError:
        return False
    await wire.settle()
    wire.leave()
    return True
