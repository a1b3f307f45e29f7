// Service calls over rosbridge (protocol v2, section 3.4.6).
"use strict";

const { WebSocket } = require("ws"); // Debian's node-ws
const { failure } = require("./core.js");
const { Refused, Unreachable } = require("./errors.js");

const LONGEST_CALL = 3600; // s; longer than any service takes: recording and listening end after 300 s
const LARGEST = 64 * 1024 * 1024; // bytes of one message
const LARGEST_CALL = 21 * 1024 * 1024; // characters; what the gate passes on (16 MiB), as base64
const PERIOD = 1000; // ms between two looks whether rosbridge answers
const MISSED = 10; // looks without a sign of it: it is gone

class Bridge {
  #socket = null;
  #open = new Map(); // calls without an answer, by id
  #count = 0;
  #missed = 0;

  /** Connect; rejects with Unreachable. */
  connect(url) {
    this.#socket = new WebSocket(url, { maxPayload: LARGEST, perMessageDeflate: false });
    this.#socket.on("message", (data) => this.#take(JSON.parse(data)));
    this.#socket.on("close", () => this.#lost());
    this.#socket.on("pong", () => (this.#missed = 0));
    setInterval(() => this.#look(), PERIOD).unref();
    return new Promise((resolve, reject) => {
      this.#socket.once("open", resolve);
      this.#socket.on("error", (error) => reject(new Unreachable(`cannot reach rosbridge at ${url}: ${error.message}`)));
    });
  }

  /** Call a ROS service; gives its response. Rejects with a RappError. */
  call(service, args) {
    if (this.#socket?.readyState !== WebSocket.OPEN) {
      return Promise.reject(new Unreachable(`cannot call ${service}: rosbridge is gone`));
    }
    const id = `rapp_api:${(this.#count += 1)}`;
    const frame = JSON.stringify({ op: "call_service", id, service, args, timeout: LONGEST_CALL });
    if (frame.length > LARGEST_CALL) {
      return Promise.reject(new Refused(`cannot call ${service}: more than 16 MiB at once; send smaller files`));
    }
    return new Promise((resolve, reject) => {
      this.#open.set(id, { service, resolve, reject });
      this.#socket.send(frame);
    });
  }

  #look() {
    if (this.#socket.readyState !== WebSocket.OPEN) {
      return;
    }
    if ((this.#missed += 1) > MISSED) {
      this.#socket.terminate();
    } else {
      this.#socket.ping();
    }
  }

  #take(message) {
    this.#missed = 0;
    const call = this.#open.get(message.id);
    if (message.op !== "service_response" || call === undefined) {
      return;
    }
    this.#open.delete(message.id);
    if (message.result) {
      call.resolve(message.values);
    } else {
      call.reject(failure(call.service, String(message.values)));
    }
  }

  #lost() {
    for (const { service, reject } of this.#open.values()) {
      reject(new Unreachable(`cannot wait for ${service}: rosbridge has gone`));
    }
    this.#open.clear();
  }
}

module.exports = { Bridge };
