"""Choosing ports that are really free."""

import socket
from collections.abc import Iterator

import pytest

from rapp_cli.errors import UsageError
from rapp_cli.home.ports import RANGE, USUAL, choose, is_free, is_served


@pytest.fixture
def taken() -> Iterator[int]:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield int(server.getsockname()[1])


def free_ports(count: int) -> list[int]:
    probes = [socket.socket() for _ in range(count)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [int(probe.getsockname()[1]) for probe in probes]
    for probe in probes:
        probe.close()
    return ports


def test_a_port_is_free_or_served(taken: int) -> None:
    (free,) = free_ports(1)
    assert (is_free(taken), is_served(taken)) == (False, True)
    assert (is_free(free), is_served(free)) == (True, False)


def test_what_was_kept_is_kept_and_a_wish_goes_before() -> None:
    *kept, wish = free_ports(len(USUAL) + 1)
    before = dict(zip(USUAL, kept, strict=True))
    assert choose(before, {}) == before
    assert choose(before, {"cloud": wish}) == {**before, "cloud": wish}


def test_a_kept_port_that_is_taken_meanwhile_is_replaced_by_one_nobody_gets_by_chance(taken: int) -> None:
    before = {**dict(zip(USUAL, free_ports(len(USUAL)), strict=True)), "cloud": taken}
    chosen = choose(before, {})
    assert {**chosen, "cloud": taken} == before
    assert chosen["cloud"] != taken
    assert chosen["cloud"] == USUAL["cloud"] or chosen["cloud"] < int(RANGE.read_text().split()[0])


def test_a_wish_that_cannot_be_met_is_refused(taken: int) -> None:
    with pytest.raises(UsageError, match="--nao-sim-port"):
        choose({}, {"nao_sim": taken})
    (free,) = free_ports(1)
    with pytest.raises(UsageError, match="taken"):
        choose({}, {"nao_sim": free, "mail": free})
