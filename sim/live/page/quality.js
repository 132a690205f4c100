// How finely is drawn: coarser while pictures come slowly, fine when nothing moves.

/** Samples to a side of a pixel, from fine to coarse; below 0.6 of few and larger disks. */
const LEVELS = [2, 1, 0.7, 0.5, 0.35];
/** Time (ms) between pictures above which they get coarser, and below which finer. */
const SLOW = 45;
const FAST = 20;
/** Pictures that are looked at before a change. */
const PATIENCE = 12;
/** Time (ms) without a change after which the picture stands still. */
const STILL = 300;

export class Quality {
  constructor(software) {
    // A processor takes seconds for four samples.
    this.finest = software ? 1 : 0;
    this.level = this.finest + (software ? 2 : 0);
    this.drawn = false;
    this.forget();
    this.triedAt = 0;
    this.wait = 2000;
    this.changedAt = 0;
    this.pinned = null;
  }

  forget() {
    this.mean = (SLOW + FAST) / 2;
    this.count = 0;
  }

  /** Samples to draw with at a time (ms) which the page gets 60 times a second; null for no picture. */
  samples(now, changed) {
    const spent = now - this.now;
    this.now = now;
    // The browser calls later while the card is behind.
    if (this.drawn && spent < 1000) {
      this.mean += 0.15 * (spent - this.mean);
      this.count += 1;
    }
    this.drawn = changed;
    if (changed) {
      this.changedAt = now;
      this.adapt(now);
      this.isSharp = this.level === this.finest;
      return this.pinned ?? LEVELS[this.level];
    }
    if (this.isSharp || now - this.changedAt < STILL) {
      return null;
    }
    this.isSharp = true;
    return this.pinned ?? LEVELS[this.finest];
  }

  adapt(now) {
    if (this.count < PATIENCE) {
      return;
    }
    if (this.mean > SLOW && this.level < LEVELS.length - 1) {
      // Finer was too much: it is tried again later and later.
      this.wait = now - this.triedAt < 2 * this.wait ? Math.min(2 * this.wait, 60000) : this.wait;
      this.level += 1;
      this.forget();
    } else if (this.mean < FAST && this.level > this.finest && now - this.triedAt > this.wait) {
      this.triedAt = now;
      this.level -= 1;
      this.forget();
    }
  }
}
