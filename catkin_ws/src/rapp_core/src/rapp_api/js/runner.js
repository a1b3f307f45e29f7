// The process of a RApp in JavaScript, from "activate" to "gone"; started in the sandbox by rapp_api/javascript.py.
"use strict";

const path = require("node:path");
const { pathToFileURL } = require("node:url");
const { DynamicAgent, reason, words } = require("./agent.js");
const { Bridge } = require("./bridge.js");
const { Channel } = require("./channel.js");
const cloud = require("./cloud.js");
const core = require("./core.js");
const { Invalid } = require("./errors.js");

const BEAT = 100; // ms between two signs that the event loop turns
const DISMANTLE = 30_000; // ms from "terminate" for the core agent to ask for dismantling; without it this ends anyway
const LONGEST_DETAIL = 500; // characters

const channel = new Channel(Number(process.env.RAPP_CHANNEL_FD), take, () => process.exit(1));
delete process.env.RAPP_CHANNEL_FD;
let order = null;
let agent = null;
let ended = false;

let fail;
const failed = new Promise((_, reject) => {
  fail = reject;
});
failed.catch(() => {}); // before and after the agent's run nobody else waits for it
process.on("uncaughtException", (error) => { // a promise that nobody waits for comes here too
  console.error("the RApp has failed where nobody waits for it", error);
  fail(reason(error));
});

function take(message) {
  if (message.type === "activate") {
    order = message;
    setInterval(() => channel.send({ type: "heartbeat" }), BEAT);
    be().catch((error) => terminate(reason(error)));
  } else if (message.type === "dismantle") {
    dismantle();
  }
}

async function be() {
  const bridge = new Bridge();
  await bridge.connect(order.bridge);
  core.use((service, fields) => bridge.call(service, fields));
  const Agent = await load(path.join(order.package, order.entry));
  agent = new Agent(order.parameters);
  await agent.run(() => channel.send({ type: "first_word", name: Agent.name }), terminate, tell, failed);
}

/** The class that the entry file exports, from CommonJS or as an ES module's default. */
async function load(entry) {
  const loaded = await import(pathToFileURL(entry).href);
  if (!(loaded.default?.prototype instanceof DynamicAgent)) {
    throw new Invalid(`cannot run ${path.basename(entry)}: export one class derived from DynamicAgent (module.exports = ...)`);
  }
  return loaded.default;
}

function tell(event) {
  channel.send({ ...event, type: "state", detail: event.detail.slice(0, LONGEST_DETAIL) });
}

/** Fig. 3, s5; the first end is the one that counts. */
function terminate(error) {
  if (ended) {
    return;
  }
  ended = true;
  const detail = error ? words(error).slice(0, LONGEST_DETAIL) : "";
  channel.send({ type: "terminate", outcome: error ? "failed" : "done", detail });
  if (error) {
    console.error("the RApp has failed", error);
  }
  setTimeout(leave, DISMANTLE);
}

/** The cloud agent goes last: what the RApp does in `dismantle` may need it. */
async function dismantle() {
  try {
    await agent?.dismantle();
  } catch (error) {
    console.error("the RApp could not stop what it has started", error);
  }
  try {
    await (order?.cloud_agent && cloud.stopAgent());
  } catch (error) {
    console.error(`${error.message}; the core agent sees to it`);
  }
  leave();
}

function leave() {
  channel.send({ type: "gone" }, () => process.exit(0));
}
