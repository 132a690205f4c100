// From pointers to hands: where a blade's edge, a probe or a grip is in the world.
import { add, cross, length, mix, scale, sub, unit } from "./camera.js";
import { Phase, encodeEdge, encodeGrip, encodePose } from "./protocol.js";

/** Share of the view's ray in the direction of a blade; the rest is the inward normal. */
const ALONG_VIEW = 0.6;
/** Distance (bodies' diagonals) by which an edge stands out of the surface. */
const STANDS_OUT = 0.03;
const POINTS = 4;

export class Hands {
  constructor(stage) {
    this.stage = stage;
    this.mode = "cut";
    this.depth = 0.12;
    this.active = null;
    this.pointers = new Map();
    this.tool = 0;
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => this.up(event));
    }
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("blur", () => this.place(null));
  }

  /** Depth (m) of a blade's tip below the surface. */
  get reach() {
    return this.depth * this.stage.size;
  }

  setMode(mode) {
    this.cancel();
    this.mode = mode;
    this.stage.touch();
  }

  cancel() {
    if (this.active?.kind === "hand") {
      this.finish(this.active, this.active.last, performance.now());
    }
    this.active = null;
  }

  down(event) {
    const { stage } = this;
    stage.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.pointers.size === 2) {
      // Two fingers: the view, whatever the first did.
      this.cancel();
      this.active = { kind: "pinch" };
      return;
    }
    if (event.button === 2 || event.button === 1 || event.altKey || this.mode === "view") {
      this.active = { kind: event.button === 1 || event.shiftKey ? "pan" : "turn" };
      return;
    }
    if (stage.past.shown) {
      // What was cannot be changed: back to what is.
      stage.lookBack(stage.past.now);
      return;
    }
    this.place(null);
    const found = stage.surface(event.offsetX, event.offsetY);
    const hand = { kind: "hand", mode: this.mode, pointer: event.pointerId, start: [event.offsetX, event.offsetY], found, pressure: event.pressure };
    if (this.mode === "through") {
      hand.last = hand.start;
      this.active = hand;
      stage.touch();
      return;
    }
    if (!found && this.mode !== "cut") {
      // Nothing to press or to pull: the view turns.
      this.active = { kind: "turn" };
      return;
    }
    this.active = hand;
    hand.last = hand.start;
    this.lead(hand, Phase.BEGIN, event);
  }

  /** Puts the cross that keys move somewhere, or away. */
  place(at) {
    this.cross = at;
    document.getElementById("cross").setAttribute("transform", at ? `translate(${at})` : "translate(-99)");
  }

  /** Arrow keys move a cross; Enter marks a position, and a second one cuts from there to here. */
  key(event) {
    const { canvas } = this.stage;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (way) {
      event.preventDefault();
      const step = event.shiftKey ? 1 : 10;
      const [x, y] = this.cross ?? [canvas.clientWidth / 2, canvas.clientHeight / 2];
      this.place([x + step * way[0], y + step * way[1]]);
    } else if (event.key === "Escape") {
      this.marked = null;
      this.place(null);
    } else if (event.key === "Enter" && this.cross && (this.mode === "cut" || this.mode === "through")) {
      if (this.marked) {
        this.cutBetween(this.marked, this.cross);
      }
      this.marked = this.marked ? null : this.cross;
    }
    this.stage.touch();
  }

  /** Cuts along a line of the picture, as a pointer that is dragged along it does. */
  cutBetween(from, to) {
    const stamp = performance.now();
    const hand = { kind: "hand", mode: this.mode, start: from, found: this.stage.surface(...from) };
    const count = this.mode === "cut" ? 24 : 0;
    for (let k = 0; k <= count; k += 1) {
      const [offsetX, offsetY] = [0, 1].map((i) => from[i] + (k / Math.max(count, 1)) * (to[i] - from[i]));
      count && this.lead(hand, k ? Phase.MOVE : Phase.BEGIN, { offsetX, offsetY, timeStamp: stamp });
    }
    this.finish(hand, to, stamp);
  }

  moved(event) {
    const { stage } = this;
    const before = this.pointers.get(event.pointerId);
    const now = [event.offsetX, event.offsetY];
    if (!before) {
      return;
    }
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    const { active } = this;
    if (active?.kind === "pinch") {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const apart = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]);
        stage.camera.zoom(apart(before) / Math.max(apart(now), 1));
        stage.camera.turn((0.5 * dx) / stage.height * Math.PI, (0.5 * dy) / stage.height * Math.PI);
        stage.touch();
      }
    } else if (active?.kind === "turn") {
      stage.camera.turn((dx / stage.height) * Math.PI, (dy / stage.height) * Math.PI);
      stage.touch();
    } else if (active?.kind === "pan") {
      stage.camera.pan(dx / stage.height, dy / stage.height);
      stage.touch();
    } else if (active?.kind === "hand" && active.pointer === event.pointerId) {
      active.pressure = event.pressure;
      if (active.mode !== "through") {
        // All samples that the browser has coalesced: a fast stroke keeps its shape.
        const samples = event.getCoalescedEvents?.() ?? [];
        (samples.length ? samples : [event]).forEach((sample) => this.lead(active, Phase.MOVE, sample));
      }
      active.last = now;
      stage.touch();
    }
    this.pointers.set(event.pointerId, now);
  }

  up(event) {
    const { active } = this;
    this.pointers.delete(event.pointerId);
    if (active?.kind === "pinch" && this.pointers.size > 0) {
      return;
    }
    if (active?.kind === "hand" && active.pointer === event.pointerId) {
      this.finish(active, [event.offsetX, event.offsetY], event.timeStamp);
    }
    this.active = null;
    this.stage.touch();
  }

  wheel(event) {
    event.preventDefault();
    const step = Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 100);
    if (event.shiftKey || this.active?.kind === "hand") {
      this.setDepth(this.depth * Math.exp(-0.002 * step));
      this.active?.mode === "press" && this.lead(this.active, Phase.MOVE, event);
    } else {
      this.stage.camera.zoom(Math.exp(0.0015 * step));
    }
    this.stage.touch();
  }

  setDepth(depth) {
    this.depth = Math.max(0.02, Math.min(0.6, depth));
    this.stage.depthChanged(this.depth);
  }

  /** Moves what the hand holds to where the pointer is. */
  lead(hand, phase, event) {
    const { stage } = this;
    const at = [event.offsetX, event.offsetY];
    const stamp = event.timeStamp || performance.now();
    switch (hand.mode) {
      case "cut": {
        if (!hand.found) {
          // In the air: the blade waits, and begins from there where it comes to the surface.
          hand.found = stage.surface(...at);
          if (!hand.found) {
            hand.last = at;
            return;
          }
          const outside = this.edgeAt(hand, hand.last);
          stage.link.hand((sequence) => encodeEdge(sequence, Phase.BEGIN, outside), stamp);
          hand.edge = outside;
          phase = Phase.MOVE;
        }
        const edge = this.edgeAt(hand, at);
        if (phase !== Phase.BEGIN && hand.edge && length(sub(edge[0], hand.edge[0])) < 1e-5) {
          return;
        }
        hand.ahead = hand.edge ? sub(edge[0], hand.edge[0]) : hand.ahead;
        hand.edge = edge;
        stage.link.hand((sequence) => encodeEdge(sequence, phase, edge), stamp);
        break;
      }
      case "press": {
        const place = this.probeAt(hand, at);
        hand.place = place;
        if (phase === Phase.BEGIN) {
          // It is put down outside and moved in from there.
          const outside = add(hand.rest.point, hand.rest.inward, -1.1 * stage.probeRadius);
          stage.link.hand((sequence) => encodePose(sequence, Phase.BEGIN, this.tool, outside, [0, 0, 0, 1]), stamp);
          phase = Phase.MOVE;
        }
        stage.link.hand((sequence) => encodePose(sequence, phase, this.tool, place, [0, 0, 0, 1]), stamp);
        break;
      }
      case "grab": {
        hand.point ??= hand.found.point;
        const place = stage.onPlane(at, hand.point);
        hand.place = place;
        stage.link.hand((sequence) => encodeGrip(sequence, phase, place, 0.09 * stage.size), stamp);
        break;
      }
    }
  }

  finish(hand, at, stamp) {
    const { stage } = this;
    if (hand.mode === "cut" && hand.edge) {
      stage.link.hand((sequence) => encodeEdge(sequence, Phase.END, []), stamp);
    } else if (hand.mode === "press" && hand.place) {
      stage.link.hand((sequence) => encodePose(sequence, Phase.END, this.tool, hand.place, [0, 0, 0, 1]), stamp);
    } else if (hand.mode === "grab" && hand.place) {
      stage.link.hand((sequence) => encodeGrip(sequence, Phase.END, hand.place, 0), stamp);
    } else if (hand.mode === "through") {
      this.sweep(hand.start, at, stamp);
    }
  }

  /** The edge of a blade under a pointer: from outside the surface into the body. */
  edgeAt(hand, at) {
    const { stage } = this;
    const found = stage.surface(...at);
    const depth = found ? found.depth : hand.found.depth;
    const point = stage.point(at, depth);
    const ray = unit(stage.ray(at));
    const inward = found ? scale(found.normal, -1) : (hand.inward ?? ray);
    // Normals of single positions shake; a hand does not.
    const smooth = hand.inward ? unit(mix(hand.inward, inward, 0.25)) : inward;
    hand.inward = smooth;
    const way = unit(mix(smooth, ray, ALONG_VIEW));
    hand.found = { ...hand.found, depth };
    const pen = hand.pressure > 0 && hand.pressure !== 0.5 && hand.pressure < 1 ? 0.4 + 1.2 * hand.pressure : 1;
    const out = add(point, way, -STANDS_OUT * stage.size);
    const tip = add(point, way, this.reach * pen);
    return Array.from({ length: POINTS }, (_, k) => mix(out, tip, k / (POINTS - 1)));
  }

  /** Where a probe is under a pointer: against the surface, the deeper the longer it is dragged in with the wheel. */
  probeAt(hand, at) {
    const { stage } = this;
    hand.rest ??= stage.rest(hand.found);
    const shift = sub(stage.onPlane(at, hand.rest.point), hand.rest.point);
    // Pressed in from the first moment, by the depth that is set, and moved sideways with the pointer.
    const place = add(hand.rest.point, shift);
    return add(place, hand.rest.inward, stage.probeRadius * -1 + 0.35 * this.reach);
  }

  /** A line across the picture: the rays through it sweep a cut. */
  sweep(from, to, stamp) {
    const { stage } = this;
    if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 4) {
      return;
    }
    const [near, far] = stage.depths();
    const edge = (share) => {
      const at = [0, 1].map((k) => from[k] + share * (to[k] - from[k]));
      return Array.from({ length: POINTS }, (_, k) => stage.point(at, near + ((far - near) * k) / (POINTS - 1)));
    };
    stage.link.hand((sequence) => encodeEdge(sequence, Phase.BEGIN, edge(0)), stamp);
    for (let k = 1; k <= 8; k += 1) {
      stage.link.hand((sequence) => encodeEdge(sequence, Phase.MOVE, edge(k / 8)), stamp);
    }
    stage.link.hand((sequence) => encodeEdge(sequence, Phase.END, []), stamp);
  }

  /** What is drawn of the hand itself, at once. */
  drawn() {
    const { stage, active } = this;
    const tools = [];
    if (active?.kind === "hand" && active.edge) {
      tools.push(...stage.tools.knife(active.edge, active.ahead ?? cross(unit(stage.ray(active.last)), [0, 0, 1])));
    } else if (active?.kind === "hand" && active.mode === "grab" && active.place) {
      tools.push(stage.tools.mark(active.place, 0.012 * stage.size, [0.1, 0.5, 0.55]));
    } else if (active?.kind === "hand" && active.mode === "press" && active.place) {
      tools.push(stage.tools.at(this.tool, active.place, [0, 0, 0, 1], { color: [0.55, 0.42, 0.2], hidden: 0.3 }));
    }
    return tools;
  }
}
