"""The table of all sub-commands of `./rapp`: name, what it does, its options, its function."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

from rapp_cli import administer, bench, runs, sim, test
from rapp_cli.demo import command as demo
from rapp_cli.home import down, join, listen, log, remove, retry, say, status, up
from rapp_cli.hz import command as hz
from rapp_cli.store import command as store
from rapp_cli.store import keys, new, publish, trial
from rapp_cli.trace import command as trace


@dataclass(frozen=True)
class Command:
    """One sub-command: `run` gets the parsed options and gives the exit status."""

    name: str
    summary: str
    add_options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


COMMANDS = (
    Command("demo", "run a story end to end: voice-mail, show-around or hazard", demo.add_options, demo.run),
    Command("up", "start a robot and a cloud that keep running", up.add_options, up.run),
    Command("join", "become a robot of a platform, by a one-time code", join.add_options, join.run),
    Command("say", "speak to the simulated robot, and see what it does", say.add_options, say.run),
    Command("listen", "speak to it by this computer's microphone", listen.add_options, listen.run),
    Command("status", "show every agent, its state and since when", status.add_options, status.run),
    Command("retry", "let a RApp that keeps failing be started again at once", retry.add_options, retry.run),
    Command("remove", "take an installed RApp off the robot", remove.add_options, remove.run),
    Command("log", "show what the agents write, and follow it", log.add_options, log.run),
    Command("trace", "draw the last run as a UML sequence diagram", trace.add_options, trace.run),
    Command("runs", "show what robots have run, how long, what failed", runs.add_options, runs.run),
    Command("cloud", "back up and restore a platform; its accounts, tokens, audit log", administer.add_options, administer.run),
    Command("down", "end them", down.add_options, down.run),
    Command("new", "make a RApp to begin with", new.add_options, new.run),
    Command("run", "try a RApp on a simulated robot", trial.add_options, trial.run),
    Command("publish", "check a RApp and put it on offer", publish.add_options, publish.run),
    Command("store", "list and show what is on offer, or take it off", store.add_options, store.run),
    Command("keys", "list, make, rotate and revoke a store's keys", keys.add_options, keys.run),
    Command("hz", "build, inspect, sign and verify packages as files", hz.add_options, hz.run),
    Command("sim", "simulate a NAO in its room, or photograph the room", sim.add_options, sim.run),
    Command("test", "check and test everything, as continuous integration does", test.add_options, test.run),
    Command("bench", "measure: " + ", ".join(bench.SUBJECTS), bench.add_options, bench.run),
)
