"""A rospy node that does what a test tells it, line of Python by line."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fakes.told_node import told_node

PUPPET = """
import json, sys, threading, time, rospy
from std_msgs.msg import *
from std_srvs.srv import *

rospy.init_node(sys.argv[1], disable_signals=True)
print("READY", flush=True)
for line in sys.stdin:
    code, value = json.loads(line), None
    try:
        value = eval(code)
    except SyntaxError:
        exec(code)
    print(json.dumps(value, default=str), flush=True)
"""


class Puppet:
    """The running node; its namespace has rospy, threading, time, std_msgs and std_srvs."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        assert process.stdout is not None
        assert process.stdout.readline() == "READY\n"

    def do(self, code: str) -> Any:
        """Carry it out; gives the value when it is an expression, as JSON has it."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(code) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


@contextmanager
def puppet(ros_env: dict[str, str], name: str) -> Iterator[Puppet]:
    """A running puppet."""
    with told_node(ros_env, PUPPET, name) as process:
        yield Puppet(process)
