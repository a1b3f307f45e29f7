"""rapp_play_audio: playAudio of the deliverable."""

import math

from rapp_agent import Behaviour, Machine, Subsystem
from rapp_core.errors import Invalid
from rapp_core.services.context import Context, request


def machine(context: Context) -> Machine:
    """Sub-FSM: delegate the file to e_ls; a loop goes on until the next play_audio or the end of the lease."""

    def play(share: Subsystem) -> None:
        position, volume, balance = (float(request(share, name)) for name in ("position", "volume", "balance"))
        if not (math.isfinite(position) and position >= 0 and 0 <= volume <= 1 and -1 <= balance <= 1):
            raise Invalid("cannot play: position must be 0 or more, volume 0 to 1, balance -1 to 1")
        path = context.readable(request(share, "path"))
        player = context.robot.player
        player.stop()
        if request(share, "loop"):
            context.trace.send("core", "ALAudioPlayer", "playFileInLoop")
            player.loop(path, volume, balance)
        else:
            context.trace.call("core", "ALAudioPlayer", "playFileFromPosition")
            player.play(path, position, volume, balance)
            context.trace.reply("ALAudioPlayer", "core", "playFileFromPosition")

    return Machine("rapp_play_audio", {"play": Behaviour("play", play, label="delegate to e_ls")}, "play", [], ["play"])
