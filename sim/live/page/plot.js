// The curve of a force over time.

const SPAN = 4;

export class Plot {
  constructor(canvas) {
    this.canvas = canvas;
    this.samples = [];
    this.peak = 0;
  }

  clear() {
    this.samples = [];
    this.peak = 0;
  }

  /** Adds samples in order of time. */
  add(samples) {
    for (const { time, force } of samples) {
      const size = Math.hypot(...force);
      this.samples.push([time, size]);
      this.peak = Math.max(this.peak, size);
    }
  }

  draw(now) {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (width === 0) {
      return;
    }
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const from = now - SPAN;
    let gone = 0;
    while (gone < this.samples.length && this.samples[gone][0] < from) {
      gone += 1;
    }
    this.samples.splice(0, gone);
    const largest = Math.max(0.5, ...this.samples.map((sample) => sample[1]));
    const top = 10 ** Math.ceil(Math.log10(largest)) * ([0.1, 0.2, 0.5, 1].find((s) => s * 10 ** Math.ceil(Math.log10(largest)) >= largest) ?? 1);
    const [left, floor] = [2, height - 14];
    const x = (time) => left + ((time - from) / SPAN) * (width - left - 2);
    const y = (size) => floor - (size / top) * (floor - 12);
    context.font = "10px system-ui, sans-serif";
    const look = getComputedStyle(canvas);
    const color = (name) => look.getPropertyValue(name);
    context.strokeStyle = color("--line");
    context.fillStyle = color("--faint");
    context.lineWidth = 1;
    for (const share of [0, 0.5, 1]) {
      const row = Math.round(y(share * top)) + 0.5;
      context.beginPath();
      context.moveTo(left, row);
      context.lineTo(width - 2, row);
      context.stroke();
      share > 0 && context.fillText(`${+(share * top).toPrecision(2)} N`, left + 2, row - 3);
    }
    context.fillText(`${SPAN} s`, left + 2, height - 3);
    context.textAlign = "right";
    context.fillText("now", width - 4, height - 3);
    context.textAlign = "left";
    if (this.samples.length < 2) {
      return;
    }
    // The largest of each column of pixels: thousands of corners take longer than the body does.
    const columns = [];
    for (const [time, size] of this.samples) {
      const column = Math.round(x(time));
      columns[column] = Math.max(columns[column] ?? 0, size);
    }
    context.beginPath();
    columns.forEach((size, column) => context.lineTo(column, y(size)));
    context.strokeStyle = color("--warm");
    context.lineWidth = 1.5;
    context.stroke();
    context.lineTo(x(this.samples[this.samples.length - 1][0]), floor);
    context.lineTo(x(this.samples[0][0]), floor);
    context.fillStyle = color("--chosen");
    context.fill();
  }
}
