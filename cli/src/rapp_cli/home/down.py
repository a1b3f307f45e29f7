"""`./rapp down`: ends all agents, last started first, then their supervisor."""

import argparse

from rapp_cli.errors import CommandError
from rapp_cli.home.place import add_home_option, home_of
from rapp_cli.home.supervisor import Supervisor


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of `./rapp down`."""
    add_home_option(parser)


def run(options: argparse.Namespace) -> int:
    """End everything; 0 when nothing runs any longer, also when nothing ran before."""
    supervisor = Supervisor(home_of(options))
    try:
        processes = supervisor.processes()
        if not processes:
            print("rapp down: nothing is up")
            return 0
        for name in reversed(processes):
            supervisor.stop(name)
            print(f"rapp down: {name} ended", flush=True)
        supervisor.shut_down()
    except CommandError:
        pid = supervisor.kill()
        if pid is None:
            raise
        print(f"rapp down: the supervisor does not answer: killed it, process {pid}; its agents end by themselves")
    return 0
