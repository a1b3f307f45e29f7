// What can go wrong for a RApp, split by what its author does next.
"use strict";

class RappError extends Error {
  get name() {
    return this.constructor.name;
  }
}

/** A rule forbids it (permission, lease, limit): do not retry. */
class Refused extends RappError {}

/** Core agent, robot or cloud do not answer: try later, or tell the person. */
class Unreachable extends RappError {}

/** What was given is off: correct the call. */
class Invalid extends RappError {}

/** The other side failed in a way of its own: report it. */
class Bug extends RappError {}

/** The class of each word that comes from the core agent. */
const KINDS = { refused: Refused, unreachable: Unreachable, invalid: Invalid, bug: Bug };

module.exports = { Bug, Invalid, KINDS, RappError, Refused, Unreachable };
