// The core services that a RApp calls by name (rapp_core/services/table.py): parameters with their defaults, in Python's order.
//
// `ask` makes the request's fields of the parameters, `give` the function's value of the response.
"use strict";

const { call } = require("./core.js");
const { Invalid } = require("./errors.js");

const NEEDED = undefined;

const SERVICES = {
  communication: {
    textToSpeech: { service: "rapp_say", parameters: { text: NEEDED, language: "en" } },
    wordSpotting: {
      service: "rapp_recognize",
      parameters: { dictionary: NEEDED, timeout: 0 },
      give: (response) => response.word,
    },
    captureAudio: {
      service: "rapp_record",
      parameters: { time: NEEDED },
      ask: ({ time }) => ({ duration: time }),
      give: (response) => response.path,
    },
    captureAudioUntilSilence: {
      service: "rapp_record_until_silence",
      parameters: { path: "", waitingTime: 2, microphoneEnergy: 1700 },
      ask: (given) => ({ path: given.path, waiting_time: given.waitingTime, microphone_energy: given.microphoneEnergy }),
      give: (response) => response.path,
    },
    playAudio: {
      service: "rapp_play_audio",
      parameters: { path: NEEDED, position: 0, volume: 1, balance: 0, loop: false },
    },
  },
  navigation: {
    moveTo: { service: "rapp_move_to", parameters: { x: NEEDED, y: NEEDED, theta: NEEDED } },
    moveVel: {
      service: "rapp_move_vel",
      parameters: { x: NEEDED, y: NEEDED, theta: NEEDED },
      give: (response) => response.message,
    },
    moveStop: { service: "rapp_move_stop", parameters: {}, give: (response) => response.message },
    moveJoint: {
      service: "rapp_move_joint",
      parameters: { joints: NEEDED, angles: NEEDED, speed: 0 },
      ask: ({ joints, angles, speed }) => ({ joints: [joints].flat(), angles: [angles].flat(), speed }),
    },
    takePredefinedPosture: { service: "rapp_take_predefined_posture", parameters: { posture: NEEDED, speed: 0 } },
    lookAtPoint: { service: "rapp_look_at_point", parameters: { x: NEEDED, y: NEEDED, z: NEEDED } },
    rest: { service: "rapp_rest", parameters: { posture: "" } },
    moveAlongPath: {
      service: "rapp_move_along_path",
      parameters: { path: NEEDED },
      ask: ({ path }) => ({ poses: path.map((pose) => ({ header: { frame_id: pose.frame ?? "map" }, pose: poseMessage(pose) })) }),
    },
    setGlobalPose: {
      service: "rapp_set_global_pose",
      parameters: { pose: NEEDED },
      ask: ({ pose }) => ({ pose: poseMessage(pose) }),
    },
    getRobotPose: {
      service: "rapp_get_robot_pose",
      parameters: {},
      give: ({ pose }) => {
        const { position, orientation } = pose.pose;
        return { x: position.x, y: position.y, theta: 2 * Math.atan2(orientation.z, orientation.w), frame: pose.header.frame_id };
      },
    },
    getTransform: {
      service: "rapp_get_transform",
      parameters: { name: NEEDED, space: NEEDED },
      give: ({ transform }) => [0, 4, 8, 12].map((start) => transform.slice(start, start + 4)),
    },
  },
  vision: {
    captureImage: {
      service: "rapp_capture_image",
      parameters: { cameraId: "top", cameraResolution: 2 },
      ask: (given) => ({ camera: given.cameraId, resolution: given.cameraResolution }),
      give: ({ frame }) => ({ width: frame.width, height: frame.height, data: Buffer.from(frame.data, "base64") }),
    },
    setCameraParam: {
      service: "rapp_set_camera_param",
      parameters: { cameraId: NEEDED, cameraParameterId: NEEDED, newValue: NEEDED },
      ask: (given) => ({ camera: given.cameraId, parameter: given.cameraParameterId, value: given.newValue }),
    },
    setCameraParams: {
      service: "rapp_set_camera_params",
      parameters: { cameraId: NEEDED, cameraParameterId: NEEDED, newValue: NEEDED },
      ask: (given) => ({ camera: given.cameraId, parameters: given.cameraParameterId, values: given.newValue }),
      give: (response) => response.accepted,
    },
  },
  keepsakes: {
    keep: {
      service: "rapp_keep",
      parameters: { name: NEEDED, data: NEEDED },
      ask: ({ name, data }) => ({ name, data: Buffer.from(data).toString("base64") }),
      give: (response) => response.path,
    },
  },
};

/** The functions of one module of the table. */
function verbs(rows) {
  return Object.fromEntries(Object.entries(rows).map(([name, row]) => [name, verb(name, row)]));
}

function verb(name, { service, parameters, ask = (given) => given, give = () => undefined }) {
  return async (...values) => {
    const given = {};
    for (const [index, [parameter, standard]] of Object.entries(parameters).entries()) {
      given[parameter] = values[index] ?? standard;
      if (given[parameter] === NEEDED) {
        throw new Invalid(`cannot call ${name}: ${parameter} is missing`);
      }
    }
    return give(await call(service, fields(name, ask, given)));
  };
}

function fields(name, ask, given) {
  try {
    return ask(given);
  } catch (error) {
    throw new Invalid(`cannot call ${name}: ${error.message}; give values of the types its description names`);
  }
}

/** geometry_msgs/Pose of a place on the ground: x and y in m, theta in rad, anticlockwise. */
function poseMessage({ x, y, theta = 0 }) {
  return { position: { x, y, z: 0 }, orientation: { x: 0, y: 0, z: Math.sin(theta / 2), w: Math.cos(theta / 2) } };
}

module.exports = { SERVICES, verbs };
