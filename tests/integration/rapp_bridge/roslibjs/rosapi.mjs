// Every question that roslib asks of rosapi.
import { ask, assert, ROSLIB, story } from "./story.mjs";

await story(async (ros, statuses) => {
  const get = (name, ...words) => ask((done, failed) => ros[name](...words, done, failed), name);
  const topics = await get("getTopics");
  assert.equal(topics.types[topics.topics.indexOf("/workshop/image")], "sensor_msgs/Image");
  assert.ok((await get("getTopicsForType", "sensor_msgs/LaserScan")).includes("/workshop/scan"));
  const raw = await get("getTopicsAndRawTypes");
  assert.match(raw.typedefs_full_text[raw.topics.indexOf("/workshop/image")], /uint32 height[^]*MSG: std_msgs\/Header/);
  assert.equal(await get("getTopicType", "/workshop/text"), "std_msgs/String");
  const topic = new ROSLIB.Topic({ ros, name: "/workshop/image", messageType: "sensor_msgs/Image" });
  assert.deepEqual(await ask((done, failed) => topic.getPublishers(done, failed), "publishers"), ["/workshop"]);

  assert.ok((await get("getServices")).includes("/say"));
  assert.ok((await get("getServicesForType", "rapp_msgs/Say")).includes("/say"));
  assert.equal(await get("getServiceType", "/say"), "rapp_msgs/Say");
  const request = await get("getServiceRequestDetails", "rapp_msgs/Say");
  assert.deepEqual(request.typedefs[0].fieldnames, ["text", "language"]);
  const response = await get("getServiceResponseDetails", "rapp_msgs/Say");
  assert.deepEqual(response.typedefs[0].fieldtypes, ["bool", "string", "string"]);

  assert.ok((await get("getNodes")).includes("/workshop"));
  const details = await get("getNodeDetails", "/workshop");
  assert.ok(details.publishing.includes("/workshop/out"));
  assert.ok(details.subscribing.includes("/workshop/in"));
  assert.ok(details.services.includes("/workshop/get_loggers"));
  assert.ok((await get("getActionServers")).includes("/workshop/count"));
  assert.ok((await get("getParams")).includes("/workshop/size"));

  const typedefs = await get("getMessageDetails", "geometry_msgs/PoseStamped");
  const decoded = ros.decodeTypeDefs(typedefs);
  assert.deepEqual(Object.keys(decoded), ["header", "pose"]);
  assert.equal(decoded.pose.position.x, "float64");
  assert.deepEqual(statuses, []);
});
