"""Programs for NAOqi's old Python module run with ours."""

import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from naoqi import ALBroker, ALModule, ALProxy

PROGRAM = Path(__file__).with_name("old_program.py")
HERE = "127.0.0.1"


def test_an_old_program_runs_as_it_is(bodied):
    command = [sys.executable, str(PROGRAM), HERE, str(bodied.port)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [
        "greeted [('GuestCame', ['guest', 0], ''), ('GuestCame', ['guest', 1], '')]",
        "running True True False False",
        "angle 0.50",
        "stopped False",
        "error ['ALMotion', '', \"getAngles\\n\\tcannot find joint 'ThirdArm'\"]",
        "error 'ALMotion::fly\\n\\tcannot find method fly'",
        "image list 160 120 57600",
        "samples (1, 2730, 5460)",
    ]


def away(name, port):
    """Whether the robot knows a module no longer; its clients hear of that a moment later."""
    try:
        ALProxy(name, HERE, port)
    except RuntimeError as error:
        return str(error).startswith(f"ALProxy::ALProxy\n\tcannot use {name}")
    return False


class Counting(ALModule):
    """Counts what it is told."""

    def __init__(self, name):
        ALModule.__init__(self, name)
        self.told = []
        self.enough = threading.Event()

    def tell(self, what):
        """Take note."""
        self.told.append(what)
        if what == "enough":
            self.enough.set()
        return len(self.told)

    def fail(self):
        """Fail."""
        raise ValueError("no luck today")

    def _hidden(self):
        return "hidden"


@pytest.fixture
def broker(bodied):
    broker = ALBroker("test", "0.0.0.0", 0, HERE, bodied.port)
    yield broker
    broker.shutdown()


def test_a_module_is_called_from_the_robot(broker, bodied, wait_for):
    module = Counting("Counting")
    assert (module.getName(), module.getBrokerName(), broker.getParentPort()) == ("Counting", "test", bodied.port)
    remote = ALProxy("Counting", HERE, bodied.port)
    assert (remote.tell("one"), remote.call("tell", "two"), remote.ping()) == (1, 2, True)
    number = remote.post.tell("enough")
    assert module.enough.wait(5)
    assert remote.wait(number, 1000) is False
    assert module.told == ["one", "two", "enough"]
    with pytest.raises(RuntimeError, match="Counting::fail\n\tno luck today"):
        remote.fail()
    with pytest.raises(RuntimeError, match="cannot find method"):
        remote.call("_hidden")
    with pytest.raises(RuntimeError, match="ALModule::ALModule\n\tcannot register Counting"):
        Counting("Counting")
    module.exit()
    wait_for(lambda: away("Counting", bodied.port))


def test_what_cannot_be_reached_is_said(bodied):
    with socket.socket() as nobody:
        nobody.bind((HERE, 0))
        port = nobody.getsockname()[1]
        with pytest.raises(RuntimeError, match="ALProxy::ALProxy\n\tcannot use ALMotion"):
            ALProxy("ALMotion", HERE, port)
        with pytest.raises(RuntimeError, match=f"ALBroker::createBroker\n\tcannot join {HERE}:{port}"):
            ALBroker("test", "0.0.0.0", 0, HERE, port)
    with pytest.raises(RuntimeError, match="create an ALBroker first"):
        ALProxy("ALMotion")
    with pytest.raises(RuntimeError, match="create an ALBroker first"):
        Counting("Counting")


def test_a_broker_takes_its_modules_along(bodied, wait_for):
    broker = ALBroker("short", "", 0, HERE, bodied.port)
    Counting("Leaving")
    assert ALProxy("Leaving", HERE, bodied.port).ping() is True
    broker.shutdown()
    broker.shutdown()
    wait_for(lambda: away("Leaving", bodied.port))


def test_a_task_is_stopped_in_its_midst(bodied):
    motion = ALProxy("ALMotion", HERE, bodied.port)
    [before] = motion.getAngles("HeadYaw", False)
    number = motion.post.angleInterpolation("HeadYaw", 1.5, 30.0, True)
    assert motion.wait(number, 200) is True
    motion.stop(number)
    assert motion.wait(number, 5000) is False
    assert motion.getAngles("HeadYaw", False)[0] == pytest.approx(before, abs=0.1)
