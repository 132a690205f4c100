// A camera that turns about a point. World: z is up, -y is the front.

const FIELD_OF_VIEW = 28;

export const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
export const sub = (a, b) => add(a, b, -1);
export const scale = (a, s) => [s * a[0], s * a[1], s * a[2]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => scale(a, 1 / (length(a) || 1));
export const mix = (a, b, t) => add(scale(a, 1 - t), b, t);

export class Camera {
  constructor() {
    this.target = [0, 0, 0];
    this.azimuth = 0.3;
    this.elevation = 0.5;
    this.distance = 1;
    this.focal = 0.5 / Math.tan((0.5 * FIELD_OF_VIEW * Math.PI) / 180);
  }

  get fieldOfView() {
    return FIELD_OF_VIEW;
  }

  /** Shows the box from low to high whole; angles in degrees. */
  frame(low, high, [azimuth, elevation, zoom], aspect) {
    this.azimuth = (azimuth * Math.PI) / 180;
    this.elevation = (elevation * Math.PI) / 180;
    this.target = mix(low, high, 0.5);
    const { right, up, forward } = this.axes();
    const room = (0.5 / this.focal) * 0.88;
    let distance = 0;
    for (let k = 0; k < 8; k += 1) {
      const corner = sub([0, 1, 2].map((i) => (k >> i & 1 ? high[i] : low[i])), this.target);
      const side = Math.max(Math.abs(dot(corner, right)) / aspect, Math.abs(dot(corner, up)));
      distance = Math.max(distance, side / room - dot(corner, forward));
    }
    this.distance = distance / zoom;
    this.least = 0.15 * this.distance;
    this.most = 4 * this.distance;
  }

  axes() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const forward = [-sa * ce, ca * ce, -se];
    const right = [ca, sa, 0];
    return { right, up: cross(right, forward), forward };
  }

  get eye() {
    return add(this.target, this.axes().forward, -this.distance);
  }

  turn(dx, dy) {
    this.azimuth -= dx;
    this.elevation = Math.max(-1.5, Math.min(1.5, this.elevation + dy));
  }

  zoom(factor) {
    this.distance = Math.max(this.least, Math.min(this.most, this.distance * factor));
  }

  pan(dx, dy) {
    const { right, up } = this.axes();
    const size = this.distance / this.focal;
    this.target = add(add(this.target, right, -dx * size), up, dy * size);
  }

  /** Direction (not unit: 1 along the view) through a position of the picture; x and y in heights from its middle, y down. */
  ray(x, y) {
    const { right, up, forward } = this.axes();
    return add(add(forward, right, x / this.focal), up, -y / this.focal);
  }

  /** Place of a world point in the picture, in heights from its middle (y down), and its depth. */
  project(point) {
    const { right, up, forward } = this.axes();
    const arm = sub(point, this.eye);
    const depth = dot(arm, forward);
    return [(this.focal * dot(arm, right)) / depth, (-this.focal * dot(arm, up)) / depth, depth];
  }

  /** The world point at a position and a depth. */
  point(x, y, depth) {
    return add(this.eye, this.ray(x, y), depth);
  }
}
