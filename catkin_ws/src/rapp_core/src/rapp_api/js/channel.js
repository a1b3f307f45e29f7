// The way to whoever has started this process: JSON objects, one per line.
"use strict";

const net = require("node:net");

class Channel {
  #socket;
  #rest = "";

  /** `fd`: descriptor of a socket; `take` gets each message, `lost` is called at the end. */
  constructor(fd, take, lost) {
    this.#socket = new net.Socket({ fd, readable: true, writable: true });
    this.#socket.setEncoding("utf8");
    this.#socket.on("data", (text) => {
      const lines = (this.#rest + text).split("\n");
      this.#rest = lines.pop();
      lines.forEach((line) => take(JSON.parse(line)));
    });
    this.#socket.on("close", lost);
    this.#socket.on("error", lost);
  }

  /** Send a message; `sent` is called when it is on its way. */
  send(message, sent = undefined) {
    this.#socket.write(`${JSON.stringify(message)}\n`, sent);
  }
}

module.exports = { Channel };
