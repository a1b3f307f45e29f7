"""A program in the style of NAOqi 1.x and 2.1, ported to Python 3: the integration test runs it as it is."""

# ruff: noqa: N802, N803, N806, UP031 - the style of its time

import sys
import time

import vision_definitions
from naoqi import ALBroker, ALModule, ALProxy

HumanGreeter = None
memory = None


class HumanGreeterModule(ALModule):
    """Greets at every event GuestCame."""

    def __init__(self, name):
        ALModule.__init__(self, name)
        self.tts = ALProxy("ALTextToSpeech")
        global memory
        memory = ALProxy("ALMemory")
        self.greeted = []
        self.blocks = []
        memory.subscribeToEvent("GuestCame", "HumanGreeter", "onGuestCame")

    def onGuestCame(self, *_args):
        """Called by ALMemory: event, value, message."""
        memory.unsubscribeToEvent("GuestCame", "HumanGreeter")
        self.tts.say("Hello, you")
        self.greeted.append(_args)
        memory.subscribeToEvent("GuestCame", "HumanGreeter", "onGuestCame")

    def processRemote(self, nbOfChannels, nbrOfSamplesByChannel, aTimeStamp, buffer):
        """Called by ALAudioDevice with samples."""
        self.blocks.append((nbOfChannels, nbrOfSamplesByChannel, len(buffer)))


def main(ip, port):
    myBroker = ALBroker("myBroker", "0.0.0.0", 0, ip, port)
    global HumanGreeter
    HumanGreeter = HumanGreeterModule("HumanGreeter")
    try:
        for i in range(2):
            memory.raiseEvent("GuestCame", ["guest", i])
            while len(HumanGreeter.greeted) <= i:
                time.sleep(0.01)
            time.sleep(0.2)
        print("greeted", HumanGreeter.greeted)

        motion = ALProxy("ALMotion", ip, port)
        motion.setStiffnesses("Head", 1.0)
        taskId = motion.post.angleInterpolation("HeadYaw", 0.5, 1.0, True)
        print("running", motion.isRunning(taskId), motion.wait(taskId, 50), motion.wait(taskId, 0), motion.isRunning(taskId))
        print("angle %.2f" % motion.getAngles("HeadYaw", False)[0])
        taskId = motion.post.angleInterpolation("HeadYaw", -0.5, 30.0, True)
        motion.stop(taskId)
        print("stopped", motion.wait(taskId, 5000))
        try:
            motion.getAngles("ThirdArm", True)
        except RuntimeError as e:
            print("error", str(e).split(":")[0:3])
        try:
            motion.fly()
        except RuntimeError as e:
            print("error", repr(str(e)))

        camProxy = ALProxy("ALVideoDevice", ip, port)
        nameId = camProxy.subscribe("python_GVM", vision_definitions.kQQVGA, vision_definitions.kRGBColorSpace, 20)
        naoImage = camProxy.getImageRemote(nameId)
        camProxy.unsubscribe(nameId)
        print("image", type(naoImage).__name__, naoImage[0], naoImage[1], len(bytes(naoImage[6])))

        audio = ALProxy("ALAudioDevice")
        audio.setClientPreferences("HumanGreeter", 16000, 3, 0)
        audio.subscribe("HumanGreeter")
        while len(HumanGreeter.blocks) < 2:
            time.sleep(0.01)
        audio.unsubscribe("HumanGreeter")
        print("samples", HumanGreeter.blocks[0])
    finally:
        myBroker.shutdown()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
