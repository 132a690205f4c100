// Buttons, sliders, figures and messages.
import { Plot } from "./plot.js";
import { GRIP } from "./protocol.js";

const get = (id) => document.getElementById(id);
const SOFTEST = 500;
const STIFFEST = 100000;
const toModulus = (share) => SOFTEST * (STIFFEST / SOFTEST) ** (share / 100);
const toShare = (modulus) => (100 * Math.log(modulus / SOFTEST)) / Math.log(STIFFEST / SOFTEST);
const kilo = (pascals) => `${(pascals / 1000).toPrecision(2)} kPa`;
const HINTS = {
  cut: "<b>Drag across the surface</b> to cut · <b>right drag</b> turns · <b>wheel</b> zooms · <b>Shift + wheel</b> sets the depth",
  through: "<b>Draw a line across the organ</b> to slice all the way through · <b>right drag</b> turns",
  press: "<b>Hold and drag</b> to press with the probe · <b>wheel while pressing</b> goes deeper",
  grab: "<b>Drag a patch</b> of the surface to pull it · <b>right drag</b> turns",
};

export class Panel {
  constructor(stage) {
    this.stage = stage;
    this.plot = new Plot(get("plot"));
    this.playing = true;
    this.latencies = [];
    this.frames = [];
    this.force = 0;
    const { link } = stage;
    const click = (id, action) => get(id).addEventListener("click", action);
    this.actions = {
      play: () => link.ask({ do: this.playing ? "pause" : "play" }),
      step: () => link.ask({ do: "step", steps: 1 }),
      undo: () => link.ask({ do: "undo" }),
      reset: () => link.ask({ do: "reset" }),
      save: () => link.ask({ do: "save" }),
      picture: () => stage.savePicture(),
      home: () => stage.home(),
      invite: () => link.ask({ do: "invite" }),
    };
    Object.entries(this.actions).forEach(([id, action]) => click(id, action));
    document.querySelectorAll("[data-mode]").forEach((button) => button.addEventListener("click", () => this.choose(button.dataset.mode)));
    get("scenes").addEventListener("change", (event) => {
      this.curtain("Building the scene …");
      link.ask({ do: "scene", name: event.target.value });
    });
    get("depth").addEventListener("input", (event) => stage.hands.setDepth(event.target.value / 100));
    const slide = (id, show, key, live) => {
      const input = get(id);
      const value = () => (id === "stiffness" ? toModulus(+input.value) : +input.value);
      input.addEventListener("input", () => {
        get(`${id}-value`).textContent = show(value());
        live && link.ask({ do: "set", [key]: value() });
      });
      input.addEventListener("change", () => {
        if (!live) {
          this.curtain("Building the tissue …");
          link.ask({ do: "set", [key]: value() });
        }
        input.blur();
      });
      return (now) => {
        if (document.activeElement !== input) {
          input.value = id === "stiffness" ? toShare(now) : now;
          get(`${id}-value`).textContent = show(now);
        }
      };
    };
    this.sliders = [slide("gravity", (x) => `${x.toFixed(1)} m/s²`, "gravity", true), slide("damping", (x) => `${x.toFixed(1)} 1/s`, "damping", true), slide("stiffness", kilo, "stiffness", false)];
    addEventListener("keydown", (event) => this.key(event));
    this.hint();
  }

  key(event) {
    if (event.target.matches?.("select, input")) {
      return;
    }
    const control = event.ctrlKey || event.metaKey;
    const modes = { 1: "cut", 2: "through", 3: "press", 4: "grab" };
    const ids = control ? { z: "undo", s: "save" } : { " ": "play", ".": "step", r: "reset", p: "picture", h: "home" };
    if (!control && modes[event.key]) {
      this.choose(modes[event.key]);
    } else if (ids[event.key]) {
      event.preventDefault();
      this.actions[ids[event.key]]();
    }
  }

  choose(mode) {
    document.querySelectorAll("[data-mode]").forEach((button) => button.classList.toggle("chosen", button.dataset.mode === mode));
    this.stage.hands.setMode(mode);
    this.hint();
  }

  hint() {
    const hint = get("hint");
    // Words of this file only.
    hint.innerHTML = HINTS[this.stage.hands.mode];
    hint.classList.remove("gone");
    clearTimeout(this.hinting);
    this.hinting = setTimeout(() => hint.classList.add("gone"), 9000);
  }

  scene(scene) {
    const list = get("scenes");
    list.replaceChildren(...scene.scenes.map(([name, summary]) => {
      const option = new Option(name, name, name === scene.name, name === scene.name);
      option.title = summary;
      return option;
    }));
    get("description").textContent = scene.description;
    this.depth(this.stage.hands.depth);
    this.plot.clear();
    this.curtain(null);
  }

  depth(share) {
    get("depth").value = Math.round(100 * share);
    get("depth-value").textContent = `${(1000 * share * this.stage.size).toFixed(0)} mm`;
  }

  /** Words over everything; none takes them away. */
  curtain(text) {
    get("curtain").classList.toggle("gone", !text);
    if (text) {
      get("curtain-text").textContent = text;
    }
  }

  note(text, bad = false) {
    const line = document.createElement("p");
    line.textContent = text;
    line.classList.toggle("bad", bad);
    get("notes").append(line);
    setTimeout(() => line.remove(), bad ? 9000 : 5000);
  }

  stats(stats) {
    this.playing = stats.playing;
    get("play-icon").setAttribute("d", stats.playing ? "M8 5v14M16 5v14" : "M7 4v16l13-8z");
    get("undo").disabled = stats.undo === 0;
    get("undo-count").textContent = stats.undo || "";
    this.sliders.forEach((show, k) => show(stats.values[k]));
    this.last = stats;
    this.show();
  }

  /** Takes a drawn frame into account. */
  drawn(latency) {
    const now = performance.now();
    this.frames.push(now);
    while (this.frames[0] < now - 1000) {
      this.frames.shift();
    }
    if (latency !== null) {
      this.latencies.push(latency);
      this.latencies.splice(0, this.latencies.length - 400);
    }
  }

  /** Figure below which a share of the latencies lies (ms). */
  latency(share) {
    const sorted = [...this.latencies].sort((a, b) => a - b);
    return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : null;
  }

  show() {
    const s = this.last;
    if (!s) {
      return;
    }
    const p95 = this.latency(0.95);
    const pace = s.settling ? "coming to rest" : !s.playing ? "paused" : `${s.real_time.toFixed(2)} ×`;
    const rows = [
      ["Real time", pace, s.playing && !s.settling ? (s.real_time > 0.9 ? "good" : "bad") : ""],
      ["Simulated", `${this.stage.time.toFixed(2)} s`],
      ["Step", `${(1000 * this.stage.stepSize).toFixed(2)} ms in ${s.step_ms.toFixed(2)} ms`],
      ["Nodes · surfels", `${s.nodes} · ${s.surfels}`],
      ["Severed pairs", s.severed],
      ["Strokes", s.strokes],
      ["Frames", `${this.frames.length} /s`],
      ["Hand to picture", p95 === null ? "–" : `${p95.toFixed(0)} ms (p95)`],
      ["Slipped", `${s.slipped.toFixed(1)} s`],
      ["Energy balance", s.balance.toExponential(1), Math.abs(s.balance) < 0.02 ? "good" : "bad"],
      ["Blade path", `${(100 * s.path[0]).toFixed(1)} cm`],
      ["Probe path", `${(100 * s.path[1]).toFixed(1)} cm`],
      ["Peak force", `${s.peak[0].toFixed(2)} · ${s.peak[1].toFixed(2)} N`],
    ];
    get("figures").replaceChildren(...rows.flatMap(([name, value, kind]) => {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = name;
      dd.textContent = value;
      kind && dd.classList.add(kind);
      return [dt, dd];
    }));
  }

  forces({ hand, samples }) {
    if (hand === GRIP || hand === this.stage.hands.tool) {
      this.plot.add(samples);
    }
  }

  now(force) {
    this.force = force;
    get("force").textContent = `${force.toFixed(2)} N`;
    this.plot.draw(this.stage.time);
  }
}
