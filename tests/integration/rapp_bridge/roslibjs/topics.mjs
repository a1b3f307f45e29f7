// Topics both ways, in every compression, and in fragments.
import { ROSLIB, assert, bounded, heard, story } from "./story.mjs";

const IMAGE = { name: "/workshop/image", messageType: "sensor_msgs/Image" };
const SCAN = { name: "/workshop/scan", messageType: "sensor_msgs/LaserScan" };
const PIXELS = Array.from({ length: 96 }, (_, index) => index);

await story(async (ros, statuses) => {
  for (const compression of ["none", "png", "cbor"]) {
    const topic = new ROSLIB.Topic({ ros, ...IMAGE, compression });
    const image = await heard(topic);
    assert.equal(image.encoding, "rgb8");
    const data = typeof image.data === "string" ? Buffer.from(image.data, "base64") : image.data;
    assert.deepEqual(Array.from(data), PIXELS, compression);
    topic.unsubscribe();

    const scan = await heard(new ROSLIB.Topic({ ros, ...SCAN, compression }));
    assert.equal(scan.header.frame_id, "laser");
    const far = compression === "cbor" ? Infinity : null;
    assert.deepEqual(Array.from(scan.ranges), [0.5, 1.5, far], compression);
  }

  const raw = await heard(new ROSLIB.Topic({ ros, name: "/workshop/text", messageType: "std_msgs/String", compression: "cbor-raw" }));
  assert.ok(raw.secs > 0);
  assert.deepEqual(Buffer.from(raw.bytes), Buffer.concat([Buffer.from([4, 0, 0, 0]), Buffer.from("kept")]));

  // roslib asks for no fragments itself, but puts them together.
  const pieces = bounded(new Promise((resolve) => ros.on("/workshop/long", resolve)), "message in fragments");
  ros.callOnConnection({ op: "subscribe", id: "small", topic: "/workshop/long", type: "std_msgs/String", fragment_size: 100 });
  assert.equal((await pieces).msg.data, "0123456789".repeat(200));

  const speaker = new ROSLIB.Topic({ ros, name: "/workshop/in", messageType: "std_msgs/String" });
  const listener = new ROSLIB.Topic({ ros, name: "/workshop/out", messageType: "std_msgs/String", throttle_rate: 1, queue_length: 10 });
  const echoed = heard(listener, (message) => message.data === "über");
  speaker.advertise();
  const speaking = setInterval(() => speaker.publish({ data: "über" }), 100);
  await echoed;
  clearInterval(speaking);
  speaker.unadvertise();

  // A page that is wrong is told so.
  assert.deepEqual(statuses, []);
  const told = bounded(new Promise((resolve) => ros.on("status:wrong", resolve)), "status");
  ros.callOnConnection({ op: "publish", id: "wrong", topic: "/workshop/text", msg: { data: 3 } });
  assert.match((await told).msg, /a string is needed/);
});
