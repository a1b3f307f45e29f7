// The core agent of this process, and what its answers mean.
"use strict";

const { Bug, Invalid, KINDS, Refused, Unreachable } = require("./errors.js");

const REFUSAL = /refused: (cannot .*)/s; // the gate's
const OFF = /^cannot (fill|use|call with|serve the message)/; // rosbridge's words for what the caller has given

let asking = null;

/** Let this process ask with `ask(service, fields)`, which gives a promise of the response's fields, or throws rosbridge's text. */
function use(ask) {
  asking = ask;
}

/** Call a core service; gives its response. Rejects with a RappError. */
async function call(service, fields) {
  if (asking === null) {
    throw new Bug("cannot reach a core agent: this program was not started by one; give core.use a double to try it by itself");
  }
  const response = await asked(service, fields);
  if (!response.success) {
    throw new (KINDS[response.error] ?? Refused)(response.message);
  }
  return response;
}

async function asked(service, fields) {
  try {
    return await asking(service, fields);
  } catch (error) {
    Error.captureStackTrace(error, asked); // the RApp's line, not where the answer came in
    throw error;
  }
}

/** The error that rosbridge's text for a call that failed means. */
function failure(service, text) {
  const refusal = REFUSAL.exec(text);
  if (refusal !== null) {
    return new Refused(refusal[1].replace(/; see that its node runs$/, ""));
  }
  if (OFF.test(text)) {
    return new Invalid(`cannot call ${service}: ${text}; give values of the types its description names`);
  }
  return new Unreachable(`cannot reach the core agent's service ${service}: ${text}; try again later`);
}

module.exports = { call, failure, use };
