// All that a RApp in JavaScript imports on the robot: the verbs of Python's rapp_api, as functions that give promises.
"use strict";

const { DynamicAgent } = require("./agent.js");
const cloud = require("./cloud.js");
const core = require("./core.js");
const { Bug, Invalid, RappError, Refused, Unreachable } = require("./errors.js");
const { SERVICES, verbs } = require("./services.js");

const communication = { ...verbs(SERVICES.communication), EMPTY: "Empty" };
const navigation = { ...verbs(SERVICES.navigation), TORSO: 0, WORLD: 1, ROBOT: 2 };
const vision = { ...verbs(SERVICES.vision), QQVGA: 0, QVGA: 1, VGA: 2, QUAD_VGA: 3, TOP: 0, BOTTOM: 1 };
const keepsakes = verbs(SERVICES.keepsakes);

module.exports = {
  Bug,
  DynamicAgent,
  Invalid,
  RappError,
  Refused,
  Unreachable,
  cloud,
  communication,
  core,
  keepsakes,
  navigation,
  vision,
};
