// phyxel.1: binary messages to and from the server. Needs no page: node can run it too.
// Layouts are written down in PROTOCOL.md. All numbers are little endian.

export const PROTOCOL = "phyxel.1";
export const Kind = { NODES: 1, SKIN: 2, CLIPS: 3, STATE: 4, FORCE: 5, ACK: 16, POSE: 17, EDGE: 18, GRIP: 19, MESH: 20 };
export const Phase = { BEGIN: 0, MOVE: 1, END: 2 };
/** The grip, instead of a tool's index. */
export const GRIP = 0xffffffff;
export const MAX_CLIENTS = 8;

/** Understands a message; null for kinds that are not known. Arrays are views of the message. */
export function decode(buffer) {
  const view = new DataView(buffer);
  const kind = view.getUint16(0, true);
  const start = view.getUint16(2, true);
  const epoch = view.getUint32(4, true);
  const u32 = (at) => view.getUint32(at, true);
  const f32 = (at) => view.getFloat32(at, true);
  const f64 = (at) => view.getFloat64(at, true);
  const floats = (at, count) => new Float32Array(buffer, at, count);
  switch (kind) {
    case Kind.NODES: {
      const count = u32(12);
      return { kind, epoch, body: u32(8), count, rest: floats(start, 3 * count) };
    }
    case Kind.SKIN: {
      const [body, first, count, stride] = [u32(8), u32(12), u32(16), u32(20)];
      return { kind, epoch, body, first, count, stride, numbers: floats(start, count * (16 + 4 * stride)) };
    }
    case Kind.CLIPS: {
      const clips = [];
      let at = start;
      for (let k = u32(12); k > 0; k -= 1) {
        const [surfel, edges, walls] = [u32(at), u32(at + 4), u32(at + 8)];
        const anchor = floats(at + 12, 2);
        at += 20;
        clips.push({ surfel, anchor, edges: floats(at, 3 * edges), walls: floats(at + 12 * edges, 4 * walls) });
        at += 12 * edges + 16 * walls;
      }
      return { kind, epoch, body: u32(8), clips };
    }
    case Kind.STATE: {
      const state = { kind, epoch, bytes: buffer.byteLength, number: u32(8), step: Number(view.getBigUint64(16, true)), time: f64(24), stepSize: f64(32) };
      state.seen = Array.from({ length: MAX_CLIENTS }, (_, k) => u32(40 + 4 * k));
      [state.kinetic, state.elastic, state.balance] = floats(72, 3);
      state.grip = Array.from(floats(84, 3));
      const [bodies, tools, points] = [u32(12), u32(96), u32(100)];
      state.values = start > 104 ? u32(104) : 0;
      const quantities = [1, 2].filter((bit) => state.values & bit).length;
      let at = start;
      state.tools = [];
      for (let k = 0; k < tools; k += 1, at += 56) {
        const n = Array.from(floats(at, 14));
        state.tools.push({ position: n.slice(0, 3), rotation: n.slice(3, 7), force: n.slice(7, 10), torque: n.slice(10, 13), penetration: n[13] });
      }
      state.blade = floats(at, 3 * points);
      at += 12 * points;
      state.bodies = [];
      for (let k = 0; k < bodies; k += 1) {
        const count = u32(at);
        const positions = floats(at + 4, 3 * count);
        at += 4 + 12 * count;
        const gradients = new Uint16Array(buffer, at, 9 * count);
        at += Math.ceil((18 * count) / 4) * 4;
        const values = Array.from({ length: quantities }, (_, k) => floats(at + 4 * k * count, count));
        at += 4 * quantities * count;
        state.bodies.push({ count, positions, gradients, values });
      }
      return state;
    }
    case Kind.FORCE: {
      const samples = [];
      for (let k = 0, at = start; k < u32(12); k += 1, at += 24) {
        samples.push({ time: f64(at), force: [f32(at + 8), f32(at + 12), f32(at + 16)], penetration: f32(at + 20) });
      }
      return { kind, epoch, hand: u32(8), samples };
    }
    default:
      return null;
  }
}

/** The value of a half-precision number. */
export function halfValue(bits) {
  const exponent = (bits >> 10) & 31;
  const part = bits & 1023;
  const size = exponent === 0 ? part * 2 ** -24 : exponent === 31 ? (part ? NaN : Infinity) : (1 + part / 1024) * 2 ** (exponent - 15);
  return bits & 0x8000 ? -size : size;
}

function message(kind, head, tail = 0) {
  const buffer = new ArrayBuffer(head + tail);
  const view = new DataView(buffer);
  view.setUint16(0, kind, true);
  view.setUint16(2, head, true);
  return view;
}

const put = (view, at, numbers) => numbers.forEach((x, k) => view.setFloat64(at + 8 * k, x, true));

/** The state of this number was drawn. */
export function encodeAck(number) {
  const view = message(Kind.ACK, 12);
  view.setUint32(8, number, true);
  return view.buffer;
}

/** A tool's place (m) and rotation (unit quaternion x, y, z, w). */
export function encodePose(sequence, phase, tool, position, rotation) {
  const view = message(Kind.POSE, 80);
  [sequence, phase, tool].forEach((x, k) => view.setUint32(8 + 4 * k, x, true));
  put(view, 24, [...position, ...rotation]);
  return view.buffer;
}

/** A blade's edge: points (m). */
export function encodeEdge(sequence, phase, points) {
  const view = message(Kind.EDGE, 24, 24 * points.length);
  [sequence, phase, points.length].forEach((x, k) => view.setUint32(8 + 4 * k, x, true));
  put(view, 24, points.flat());
  return view.buffer;
}

/** A grip at a position (m) within a radius (m). */
export function encodeGrip(sequence, phase, position, radius) {
  const view = message(Kind.GRIP, 48);
  view.setUint32(8, sequence, true);
  view.setUint32(12, phase, true);
  put(view, 16, [...position, radius]);
  return view.buffer;
}

/** A piece (Uint8Array) of a mesh file whose name ends with up to four letters. */
export function encodeMesh(total, offset, extension, piece) {
  const view = message(Kind.MESH, 20, piece.length);
  view.setUint32(8, total, true);
  view.setUint32(12, offset, true);
  [...extension.toLowerCase().slice(0, 4)].forEach((c, k) => view.setUint8(16 + k, c.charCodeAt(0)));
  new Uint8Array(view.buffer).set(piece, 20);
  return view.buffer;
}
