// What was seen, kept in the page to be looked at again. A cut shows closed where it was not made yet.

/** Bytes of states that are kept at most: then every second one gives way, and half as many are kept from there on. */
const MOST = 96e6;
/** Least simulated time (s) between two states that are kept, at first. */
const APART = 1 / 30;

export class Past {
  constructor() {
    this.clear();
  }

  /** Forgets all; `length` (s): when a recording ends that is played. */
  clear(length = 0) {
    this.length = length;
    this.states = [];
    this.apart = APART;
    /** The state that is looked at again; null for the newest. */
    this.shown = null;
    /** When (ms) and from where (s) it is played on; null while it stands. */
    this.run = null;
  }

  keep(state) {
    const { states } = this;
    if (states.length > 0 && state.time - states[states.length - 1].time < this.apart) {
      return;
    }
    states.push(state);
    if (states.length * state.bytes > MOST) {
      this.states = states.filter((_, k) => k % 2 === 0);
      this.apart *= 2;
    }
  }

  /** Times (s) at which the bar begins and ends: since the first state, up to a recording's end. */
  get ends() {
    const { states } = this;
    return states.length ? [states[0].time, Math.max(states[states.length - 1].time, this.length)] : [0, 0];
  }

  timeOf(share) {
    const [begin, end] = this.ends;
    return begin + share * (end - begin);
  }

  /** Shows what was at a fraction of the bar; nothing where the newest is. */
  look(share) {
    this.run = null;
    this.shown = share < this.now ? this.at(this.timeOf(share)) : null;
  }

  /** The newest state up to a time (s). */
  at(time) {
    return this.states.findLast((state) => state.time <= time) ?? this.states[0];
  }

  /** Plays on from what is shown; `now` (ms). */
  play(now) {
    this.run = { now, time: this.shown.time };
  }

  /** Whether there is another state to show at a time (ms). */
  goOn(now) {
    if (!this.run) {
      return false;
    }
    const before = this.shown;
    const time = this.run.time + (now - this.run.now) / 1000;
    this.shown = time < this.states[this.states.length - 1].time ? this.at(time) : null;
    this.run = this.shown && this.run;
    return this.shown !== before;
  }

  /** Fraction of the bar at which a state is; 1 for the newest where no recording goes on. */
  shareOf(state) {
    const [begin, end] = this.ends;
    return state && end > begin ? Math.min((state.time - begin) / (end - begin), 1) : 1;
  }

  get now() {
    return this.shareOf(this.states[this.states.length - 1]);
  }

  get share() {
    return this.shown ? this.shareOf(this.shown) : this.now;
  }
}
