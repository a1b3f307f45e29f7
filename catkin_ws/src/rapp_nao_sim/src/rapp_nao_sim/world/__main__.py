"""`python -m rapp_nao_sim.world --shot FILE.png`: a photograph of the simulated room."""

import argparse
import logging
import sys
from pathlib import Path

from rapp_nao_sim.world.errors import WorldError
from rapp_nao_sim.world.process import WorldClient, WorldConfig


def main() -> int:
    """Take the photograph; gives the exit status."""
    parser = argparse.ArgumentParser(prog="rapp_nao_sim.world", description="a photograph of the simulated room")
    parser.add_argument("--shot", type=Path, required=True, metavar="FILE.png", help="where to write it")
    parser.add_argument("--room", type=Path, help="room file (default: our own)")
    parser.add_argument("--posture", help="of the robot (default: the room file's)")
    parser.add_argument("--door", type=float, metavar="RAD", help="opening angle of the door")
    parser.add_argument("--lamp", type=float, metavar="LEVEL", help="from 0 to 1")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s", stream=sys.stderr)
    try:
        with WorldClient(WorldConfig(room=options.room, posture=options.posture)) as world:
            if options.door is not None:
                world.set_door(options.door)
            if options.lamp is not None:
                world.set_lamp(options.lamp)
            world.photograph(options.shot)
            print(f"the room is photographed in {options.shot}")
    except WorldError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
