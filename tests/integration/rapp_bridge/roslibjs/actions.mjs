// actionlib goals: one that ends, one that is cancelled.
import { ROSLIB, assert, bounded, story } from "./story.mjs";

const SUCCEEDED = 3;
const PREEMPTED = 2;

await story(async (ros, statuses) => {
  const client = new ROSLIB.ActionClient({ ros, serverName: "/workshop/count", actionName: "actionlib/TestAction" });
  const begin = (number) => {
    const goal = new ROSLIB.Goal({ actionClient: client, goalMessage: { goal: number } });
    const feedback = [];
    goal.on("feedback", (message) => feedback.push(message.feedback));
    // The status may come after the result.
    const became = (status) =>
      bounded(new Promise((resolve) => goal.on("status", (message) => message.status === status && resolve())), `status ${status}`);
    const result = bounded(new Promise((resolve) => goal.on("result", resolve)), "result");
    goal.send();
    return { goal, feedback, result, became };
  };

  const short = begin(5);
  await Promise.all([short.result, short.became(SUCCEEDED)]);
  assert.equal((await short.result).result, 5);
  assert.deepEqual(short.feedback, [1, 2, 3, 4, 5]);

  const long = begin(1_000_000);
  await bounded(new Promise((resolve) => long.goal.on("feedback", resolve)), "feedback");
  const preempted = long.became(PREEMPTED);
  long.goal.cancel();
  assert.ok((await long.result).result < 1_000_000);
  await preempted;
  client.dispose();
  assert.deepEqual(statuses, []);
});
