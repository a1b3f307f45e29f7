// What all stories share: a connection, and promises that end.
import assert from "node:assert/strict";
import { createInterface } from "node:readline";
import * as ROSLIB from "roslib";

const PATIENCE = 20_000; // ms until a story gives up

export { assert, ROSLIB };

export function bounded(promise, what) {
  let timer;
  const late = new Promise((_, reject) => {
    timer = setTimeout(() => reject(new Error(`no ${what}`)), PATIENCE);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}

// A function of roslib that takes two callbacks, as a promise.
export function ask(call, what) {
  return bounded(new Promise((resolve, reject) => call(resolve, (error) => reject(new Error(error)))), what);
}

// The first message of a topic that passes.
export function heard(topic, passes = () => true) {
  return bounded(
    new Promise((resolve) => {
      topic.subscribe((message) => passes(message) && resolve(message));
    }),
    `message of ${topic.name}`,
  );
}

// Tell the test something, and wait until it says so.
const lines = createInterface({ input: process.stdin })[Symbol.asyncIterator]();
export async function pause(word) {
  console.log(word);
  await lines.next();
}

export async function story(tell) {
  const ros = new ROSLIB.Ros({});
  const statuses = [];
  ros.on("status", (message) => statuses.push(message));
  await ros.connect(process.argv[2]);
  await bounded(ros.isConnected ? Promise.resolve() : new Promise((resolve) => ros.on("connection", resolve)), "connection");
  try {
    await tell(ros, statuses);
  } catch (error) {
    console.error(error, statuses);
    process.exit(1);
  }
  ros.close();
  process.exit(0);
}
