"""rapp_capture_image, rapp_set_camera_param, rapp_set_camera_params: the vision functions of the deliverable (section 4.5.3)."""

from rapp_agent import Behaviour, Machine, Subsystem
from rapp_core.errors import Invalid, Refused
from rapp_core.services.context import Context, reply, request

CAMERAS = ("top", "bottom")
"""By their numbers."""
RESOLUTIONS = {0: "QQVGA", 1: "QVGA", 2: "VGA", 3: "4VGA"}
MOST = 100  # parameters at a time


def machine(context: Context) -> Machine:
    """Sub-FSM: delegate to r_cam."""

    def capture(share: Subsystem) -> None:
        camera, resolution = request(share, "camera"), request(share, "resolution")
        if camera not in CAMERAS:
            raise Invalid(f"cannot use camera {camera!r}: known are {', '.join(CAMERAS)}")
        if resolution not in RESOLUTIONS:
            known = ", ".join(f"{number} {name}" for number, name in RESOLUTIONS.items())
            raise Invalid(f"cannot use resolution {resolution}: known are {known}")
        context.trace.call("core", "ALVideoDevice", "getImageRemote")
        reply(share, frame=context.robot.camera.capture(camera, resolution))
        context.trace.reply("ALVideoDevice", "core", "getImageRemote")

    return Machine("rapp_capture_image", {"capture": Behaviour("capture", capture, label="capture")}, "capture", [], ["capture"])


def param_machine(context: Context) -> Machine:
    """Sub-FSM: set one parameter."""

    def change(share: Subsystem) -> None:
        context.robot.camera.set_parameter(_camera(share), request(share, "parameter"), request(share, "value"))

    return Machine("rapp_set_camera_param", {"set": Behaviour("set", change, label="setParameter")}, "set", [], ["set"])


def params_machine(context: Context) -> Machine:
    """Sub-FSM: set parameters one after another; the reply tells of each whether the camera took it."""

    def change(share: Subsystem) -> None:
        camera, parameters, values = _camera(share), list(request(share, "parameters")), list(request(share, "values"))
        if len(parameters) != len(values) or not 1 <= len(parameters) <= MOST:
            raise Invalid(f"cannot set parameters: name 1 to {MOST}, and give one value for each")
        accepted, reasons = [], []
        for parameter, value in zip(parameters, values, strict=True):
            try:
                context.robot.camera.set_parameter(camera, parameter, value)
                accepted.append(True)
            except Refused as error:
                accepted.append(False)
                reasons.append(str(error))
        reply(share, accepted=accepted, message="\n".join(reasons))

    return Machine("rapp_set_camera_params", {"set": Behaviour("set", change, label="setParameter")}, "set", [], ["set"])


def _camera(share: Subsystem) -> str:
    number = request(share, "camera")
    if number not in range(len(CAMERAS)):
        raise Invalid(f"cannot use camera {number}: known are 0 top, 1 bottom")
    return CAMERAS[number]
