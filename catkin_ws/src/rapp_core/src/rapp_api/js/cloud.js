// Calls that leave the robot: HOP services of repository and cloud agent, and mail (deliverable sections 3, 4.2).
"use strict";

const fs = require("node:fs");
const path = require("node:path");
const core = require("./core.js");
const { Invalid, Refused } = require("./errors.js");

const OURS = "/rapp/"; // package and private folder: only this process sees what is in there

/** A file to send as an argument of a call. */
class File {
  constructor(name) {
    this.path = path.resolve(name);
  }
}

/** Call a HOP service of the repository agent; gives its JSON result. `timeout` in s, 0: the core agent's own. */
function call(service, args = {}, timeout = 0) {
  return ask(service, args, timeout, false);
}

/** As `call`, of this RApp's own cloud agent. */
function callAgent(service, args = {}, timeout = 0) {
  return ask(service, args, timeout, true);
}

/** Kill this RApp's cloud agent (deliverable section 3.2); gives whether there was one. Done by itself at the RApp's end. */
async function stopAgent() {
  return (await core.call("rapp_stop_cloud_agent", {})).stopped;
}

/**
 * Send a mail; gives "delivered", or "kept" or "locked" when it will be sent later, or "unknown".
 * `attachment`: path of a recording of this run.
 */
async function sendMail(recipients, subject, body, attachment = "") {
  return (await core.call("rapp_send_mail", { recipients, subject, body, attachment })).state;
}

async function ask(service, args, timeout, agent) {
  const values = {};
  const files = [];
  for (const [name, value] of Object.entries(args)) {
    if (!(value instanceof File)) {
      values[name] = value;
    } else if (value.path.startsWith(OURS)) {
      files.push({ parameter: name, name: path.basename(value.path), data: content(service, value.path) });
    } else {
      values[name] = { file: value.path };
    }
  }
  const response = await core.call("rapp_cloud_call", { service, arguments: text(service, values), timeout, agent, files });
  return JSON.parse(response.result);
}

function text(service, values) {
  try {
    return JSON.stringify(values);
  } catch (error) {
    throw new Invalid(`cannot call ${service}: its arguments are not JSON: ${error.message}; give texts, numbers, lists`);
  }
}

function content(service, name) {
  try {
    return fs.readFileSync(name, "base64");
  } catch (error) {
    throw new Refused(`cannot call ${service}: the file ${name} cannot be read: ${error.message}`);
  }
}

module.exports = { File, call, callAgent, sendMail, stopAgent };
