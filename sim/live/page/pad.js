// A second hand: a gamepad drives the probe, or the grip while its first button is held; a pointer does something else meanwhile.
import { add, scale } from "./camera.js";
import { Phase, encodeGrip, encodePose } from "./protocol.js";

/** Deflection of a stick that is none. */
const SLACK = 0.15;
/** Speed (bodies' diagonals a second) of a stick that is pushed all the way. */
const SPEED = 0.4;
/** Longest time (s) for which a stick is followed at once. */
const LONGEST = 0.05;

export class Pad {
  constructor(stage) {
    this.stage = stage;
    this.forget();
  }

  /** Nothing is in the hand. */
  forget() {
    /** Where the probe or the grip is (m); null for nowhere. */
    this.place = null;
    this.holds = false;
  }

  /** Moves by what the sticks say: the left one across the view, the right one into it; the second button lays the probe aside. */
  poll(now) {
    const pad = navigator.getGamepads?.().find((pad) => pad?.connected);
    const spent = Math.min((now - this.last) / 1000 || 0, LONGEST);
    this.last = now;
    const { stage } = this;
    if (!pad || stage.past.shown || stage.hands.active?.mode === "press") {
      return;
    }
    const [x, y, , z] = pad.axes.map((axis) => (Math.abs(axis) > SLACK ? axis : 0));
    const [grips, aside] = pad.buttons.map((button) => button.pressed);
    const { right, up, forward } = stage.camera.axes();
    if (!this.place) {
      const { canvas } = stage;
      const found = (x || y || z || grips) && stage.surface(canvas.clientWidth / 2, canvas.clientHeight / 2);
      if (!found) {
        return;
      }
      // In front of what is in the middle of the picture.
      this.place = add(found.point, forward, -2 * stage.probeRadius);
      this.pose(Phase.BEGIN);
    }
    const way = add(add(scale(right, x || 0), up, -(y || 0)), forward, -(z || 0));
    this.place = add(this.place, way, SPEED * stage.size * spent);
    if (grips && !this.holds) {
      this.pose(Phase.END);
      this.grip(Phase.BEGIN);
    } else if (!grips && this.holds) {
      this.grip(Phase.END);
      this.pose(Phase.BEGIN);
    } else if (aside && !grips) {
      this.pose(Phase.END);
      this.place = null;
    } else if (x || y || z) {
      this.holds ? this.grip(Phase.MOVE) : this.pose(Phase.MOVE);
    } else {
      return;
    }
    this.holds = Boolean(grips);
    stage.touch();
  }

  pose(phase) {
    const { stage, place } = this;
    stage.link.hand((sequence) => encodePose(sequence, phase, stage.hands.tool, place, [0, 0, 0, 1]));
  }

  grip(phase) {
    const { stage, place } = this;
    stage.link.hand((sequence) => encodeGrip(sequence, phase, place, 0.09 * stage.size));
  }
}
