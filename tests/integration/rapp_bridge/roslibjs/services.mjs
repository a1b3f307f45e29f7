// Services both ways, and parameters.
import { ROSLIB, ask, assert, pause, story } from "./story.mjs";

await story(async (ros, statuses) => {
  const say = new ROSLIB.Service({ ros, name: "/say", serviceType: "rapp_msgs/Say" });
  const call = (service, request, seconds) => ask((done, failed) => service.callService(request, done, failed, seconds), "answer");
  assert.equal((await call(say, { text: "hi" })).message, "hi");
  await assert.rejects(call(say, { text: "fail" }), /no voice/);
  await assert.rejects(call(say, { volume: 1 }), /no field volume/);
  const nowhere = new ROSLIB.Service({ ros, name: "/nowhere", serviceType: "rapp_msgs/Say" });
  await assert.rejects(call(nowhere, {}), /no such service/);

  const loud = new ROSLIB.Service({ ros, name: "/from_roslibjs", serviceType: "rapp_msgs/Say" });
  await loud.advertise((request, response) => {
    response.success = true;
    response.message = request.text.toUpperCase();
    return request.text !== "false";
  });
  const later = new ROSLIB.Service({ ros, name: "/from_roslibjs_later", serviceType: "rapp_msgs/Say" });
  await later.advertiseAsync(async (request) => {
    await new Promise((resolve) => setTimeout(resolve, 50));
    if (request.text === "throw") throw new Error("out of breath");
    return { success: true, message: `${request.text} later` };
  });
  // A relative name is the same service, and a client may call what a client offers.
  assert.equal((await call(new ROSLIB.Service({ ros, name: "from_roslibjs" }), { text: "self" })).message, "SELF");
  await pause("offering");
  await loud.unadvertise();
  await later.unadvertise();
  await assert.rejects(call(loud, { text: "x" }), /no such service|has left/);

  const param = new ROSLIB.Param({ ros, name: "/from_roslibjs/param" });
  const value = { text: "ü", list: [1, 2.5, true], nested: { a: "b" } };
  await ask((done, failed) => param.set(value, done, failed), "setting");
  assert.deepEqual(await ask((done, failed) => param.get(done, failed), "parameter"), value);
  await ask((done, failed) => param.delete(done, failed), "deletion");
  assert.equal(await ask((done, failed) => param.get(done, failed), "parameter"), null);
  assert.deepEqual(statuses, []);
});
