// The page's decoder and encoders against the golden files. Run by `cargo test -p phyxel-live`; with
// PHYXEL_GOLDEN=write the files of clients' messages are written again.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";

const here = new URL("./golden/", import.meta.url);
// A module for the page; node wants to be told.
const source = readFileSync(new URL("../page/protocol.js", import.meta.url), "utf8");
const page = await import(`data:text/javascript;base64,${Buffer.from(source).toString("base64")}`);
const path = (name) => fileURLToPath(new URL(`${name}.bin`, here));
const read = (name) => {
  const bytes = readFileSync(path(name));
  return page.decode(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
};
const list = (numbers) => Array.from(numbers);
const { Kind, Phase } = page;

const nodes = read("nodes");
assert.deepEqual([nodes.kind, nodes.epoch, nodes.body, nodes.count], [Kind.NODES, 3, 1, 2]);
assert.deepEqual(list(nodes.rest), [0.5, 1, 1.5, 2, 2.5, 3]);

const skin = read("skin");
assert.deepEqual([skin.kind, skin.body, skin.first, skin.count, skin.stride], [Kind.SKIN, 1, 7, 2, 2]);
const f = Math.fround;
const first = [0, 0.25, -0.5, 0.125, 0, f(0.6), f(0.8), 1, 1, 2, 3, 0, 0.5, 0.25, 0.125, 0, 0, 0.75, 1.5, -1.5, 1, 0.25, -1.5, 1.5];
assert.deepEqual(list(skin.numbers.subarray(0, 24)), first);
assert.equal(skin.numbers[24], 1);
assert.equal(skin.numbers.length, 48);

const { clips } = read("clips");
assert.deepEqual(clips.map((clip) => clip.surfel), [4, 5]);
assert.deepEqual([clips[0].anchor, clips[0].edges, clips[0].walls].map(list), [[0.5, 0.25], [0, 1, 0.75], [1, 2, 3, 4, 5, 6, 7, 8]]);
assert.deepEqual([clips[1].edges.length, clips[1].walls.length], [0, 0]);

const state = read("state");
assert.deepEqual([state.number, state.step, state.time, state.stepSize], [17, 5_000_000_000, 1.25, 0.001]);
assert.deepEqual(state.seen, [1, 2, 3, 4, 5, 6, 7, 8]);
assert.deepEqual([state.kinetic, state.elastic, state.balance, ...state.grip], [0.5, 0.25, -0.125, 0.5, 0, -0.5]);
assert.deepEqual(state.tools, [{ position: [0.5, 1.5, 2.5], rotation: [0, 0, f(0.6), f(0.8)], force: [1, 2, 3], torque: [4, 5, 6], penetration: 0.0625 }]);
assert.deepEqual(list(state.blade), [0, 0.5, 1, 1, 1.5, 2]);
assert.deepEqual(state.bodies.map((body) => list(body.positions)), [[0.5, 0.25, 0.125], [1, 2, 3, 4, 5, 6]]);
assert.deepEqual(list(state.bodies[0].gradients).map(page.halfValue), [0, 0.25, 0, 0, 0, 0, 0, 0, 0.5]);
assert.equal(state.bodies[1].gradients.length, 18);
const valued = read("state-values");
assert.deepEqual([state, valued].map((one) => one.bodies.map((body) => body.values.map(list))), [[[], []], [[[1500], [250]], [[1, 2], [3, 4]]]]);
assert.deepEqual([state.values, valued.values], [0, 3]);

const force = read("force");
assert.equal(force.hand, page.GRIP);
assert.deepEqual(force.samples, [0.5, 0.75].map((time) => ({ time, force: [time, 0, -time], penetration: 0.125 })));

// A kind that is not known is left aside.
const strange = new ArrayBuffer(16);
new DataView(strange).setUint16(0, 999, true);
assert.equal(page.decode(strange), null);

const written = {
  ack: page.encodeAck(17),
  pose: page.encodePose(5, Phase.BEGIN, 2, [0.5, -0.25, 0.125], [0, 0, 1, 0]),
  edge: page.encodeEdge(6, Phase.MOVE, [[0, 0.5, 1], [1.5, 2, 2.5], [3, 3.5, 4]]),
  "edge-end": page.encodeEdge(7, Phase.END, []),
  grip: page.encodeGrip(8, Phase.BEGIN, [0.5, 1, 1.5], 0.25),
  mesh: page.encodeMesh(5, 2, "OBJ", Uint8Array.of(1, 2, 3)),
};
for (const [name, buffer] of Object.entries(written)) {
  const bytes = Buffer.from(buffer);
  if (process.env.PHYXEL_GOLDEN === "write") {
    writeFileSync(path(name), bytes);
  }
  assert.deepEqual(bytes, readFileSync(path(name)), name);
}
