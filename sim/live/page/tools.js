// Meshes of tools and blades.
import { add, cross, dot, length, scale, sub, unit } from "./camera.js";

const STEEL = [0.34, 0.36, 0.39];
const GRIP_COLOR = [0.02, 0.09, 0.11];

function meshOf(gl, triangles) {
  const numbers = new Float32Array(triangles.flat(2));
  const buffer = gl.createBuffer();
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
  for (const k of [0, 1]) {
    gl.enableVertexAttribArray(k);
    gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
  }
  gl.bindVertexArray(null);
  return { array, buffer, count: numbers.length / 6 };
}

/** A capsule from a to b; a ball where they are one point. */
function capsule(a, b, radius) {
  const axis = length(sub(b, a)) > 0 ? unit(sub(b, a)) : [0, 0, 1];
  const u = unit(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const v = cross(axis, u);
  const rings = [];
  for (let k = -12; k <= 12; k += 1) {
    const angle = (k / 12) * (Math.PI / 2);
    const centers = k === 0 ? [a, b] : [k < 0 ? a : b];
    centers.forEach((center) => rings.push({ center, angle }));
  }
  const vertex = ({ center, angle }, s) => {
    const turn = (2 * Math.PI * s) / 32;
    const out = add(add(scale(u, Math.cos(turn) * Math.cos(angle)), v, Math.sin(turn) * Math.cos(angle)), axis, Math.sin(angle));
    return [add(center, out, radius), out];
  };
  const triangles = [];
  for (let k = 0; k + 1 < rings.length; k += 1) {
    for (let s = 0; s < 32; s += 1) {
      const [p, q, r, t] = [vertex(rings[k], s), vertex(rings[k], s + 1), vertex(rings[k + 1], s), vertex(rings[k + 1], s + 1)];
      triangles.push(p, q, r, q, t, r);
    }
  }
  return triangles;
}

const flat = (a, b, c) => {
  const n = unit(cross(sub(b, a), sub(c, a)));
  return [[a, n], [b, n], [c, n]];
};

function box(size) {
  const triangles = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [-0.5, 0.5]) {
      const corner = (a, b) => {
        const p = [0, 0, 0];
        p[axis] = side * size[axis];
        p[(axis + 1) % 3] = a * size[(axis + 1) % 3];
        p[(axis + 2) % 3] = b * size[(axis + 2) % 3];
        return p;
      };
      const [p, q, r, s] = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
      triangles.push(...flat(p, q, r), ...flat(p, r, s));
    }
  }
  return triangles;
}

/** A piece of a plane through the origin; what it is made of lies behind its normal. */
export function slab(size, normal) {
  const n = unit(normal);
  const u = unit(cross(n, Math.abs(n[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const v = cross(n, u);
  const turned = ([x, y, z]) => add(add(scale(u, x), v, y), n, z);
  return box([size, size, 0.02 * size]).map(([p, out]) => [turned([p[0], p[1], p[2] - 0.01 * size]), turned(out)]);
}

/** Tools of a scene, and a blade along an edge. */
export class Tools {
  constructor(gl, scene) {
    this.gl = gl;
    this.size = length(sub(scene.high, scene.low));
    this.tools = scene.tools.map((tool) => {
      const [a, b] = tool.points;
      const parts = { sphere: () => capsule([0, 0, 0], [0, 0, 0], tool.radius), capsule: () => capsule(a, b, tool.radius), box: () => box(a), plane: () => slab(this.size, a) };
      return meshOf(gl, parts[tool.shape]());
    });
    this.ball = meshOf(gl, capsule([0, 0, 0], [0, 0, 0], 1));
    this.blade = null;
    this.key = "";
  }

  /** A tool at a position. */
  at(index, place, turn, look = {}) {
    return { mesh: this.tools[index], place, turn, color: STEEL, ...look };
  }

  /** A small ball. */
  mark(place, radius, color, opacity = 1) {
    if (this.markSize !== radius) {
      this.markSize = radius;
      this.ball = meshOf(this.gl, capsule([0, 0, 0], [0, 0, 0], radius));
    }
    return { mesh: this.ball, place, turn: [0, 0, 0, 1], color, opacity, hidden: 0.5 * opacity, specular: 0.3 };
  }

  /** A knife along an edge, from its heel outside to its tip; \`ahead\` is where it goes. */
  knife(edge, ahead) {
    const [heel, tip] = [edge[0], edge[edge.length - 1]];
    const along = unit(sub(heel, tip));
    const size = length(sub(heel, tip));
    const width = Math.min(0.3 * size, 0.05 * this.size);
    let back = sub(scale(along, dot(ahead, along)), ahead);
    back = length(back) > 1e-9 ? unit(back) : unit(cross(along, Math.abs(along[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
    const side = cross(along, back);
    const half = 0.07 * width;
    const section = (point, slant) => {
      const spine = add(add(point, back, width), along, slant);
      return [point, add(spine, side, half), add(spine, side, -half)];
    };
    const rows = edge.map((point, k) => section(point, k === edge.length - 1 ? width : 0));
    const triangles = [];
    for (let k = 0; k + 1 < rows.length; k += 1) {
      for (let i = 0; i < 3; i += 1) {
        const j = (i + 1) % 3;
        triangles.push(...flat(rows[k][i], rows[k][j], rows[k + 1][i]), ...flat(rows[k][j], rows[k + 1][j], rows[k + 1][i]));
      }
    }
    triangles.push(...flat(...rows[0]), ...flat(...rows[rows.length - 1]));
    this.drop();
    // Held at a slant, as a pencil is.
    const lean = unit(add(along, back, 0.9));
    const grip = add(heel, back, 0.5 * width);
    this.blade = meshOf(this.gl, triangles);
    this.handle = meshOf(this.gl, capsule(add(grip, lean, 0.2 * width), add(grip, lean, 0.3 * this.size), 0.24 * width));
    const still = { place: [0, 0, 0], turn: [0, 0, 0, 1] };
    return [{ mesh: this.blade, ...still, color: STEEL, hidden: 0.3 }, { mesh: this.handle, ...still, color: GRIP_COLOR, specular: 0.4 }];
  }

  drop() {
    for (const mesh of [this.blade, this.handle]) {
      if (mesh) {
        this.gl.deleteBuffer(mesh.buffer);
        this.gl.deleteVertexArray(mesh.array);
      }
    }
  }
}
