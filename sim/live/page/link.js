// The socket: a code for a token, a token for a session, messages in order. What breaks is opened again.
import { PROTOCOL, decode, encodeAck } from "./protocol.js";

const KEY = "phyxel-token";
/** Time (ms) before the first and the later attempts to open the session again. */
const RETRY = [250, 500, 1000, 2000];
/** How a server that ends closes its sockets: "going away" (RFC 6455, section 7.4.1). */
const ENDED = 1001;
const WORDS = {
  stale: "This address is not good any more. Press Enter in the terminal for another one.",
  other: "phyxel live was started again. Open the address that it printed.",
  ended: "The session has ended. Start phyxel live again.",
  lost: "The connection is lost. Trying again …",
};

/** The session's token for a code or for the token itself; null where the server knows neither. Throws where there is none. */
async function tokenFor(secret) {
  const answer = await fetch(`/token?${encodeURIComponent(secret)}`, { cache: "no-store" });
  return answer.ok ? answer.text() : null;
}

export class Link {
  constructor(handlers) {
    this.handlers = handlers;
    this.socket = null;
    this.client = 0;
    this.sequence = 0;
    this.sent = new Map();
  }

  /** Opens the session, and again whenever it breaks, until it ends or this page may not come in. */
  async open() {
    for (let attempt = 0; ; attempt += 1) {
      try {
        const token = await this.enter();
        if (!token) {
          return;
        }
        if (await this.session(token, () => (attempt = 0))) {
          this.handlers.closed(WORDS.ended);
          return;
        }
      } catch {
        // There is no server: it may come back.
      }
      this.handlers.lost(WORDS.lost);
      await new Promise((done) => setTimeout(done, RETRY[Math.min(attempt, RETRY.length - 1)]));
    }
  }

  /** The session's token: for the code in the address, or the one that this tab has; says so where there is none. */
  async enter() {
    const code = location.hash.slice(1);
    const known = sessionStorage.getItem(KEY);
    const token = (code && (await tokenFor(code))) || (known && (await tokenFor(known)));
    if (code) {
      // The code is good once: it has no business in the address any more.
      history.replaceState(null, "", location.pathname);
    }
    if (!token) {
      this.handlers.closed(known && !code ? WORDS.other : WORDS.stale);
      return null;
    }
    sessionStorage.setItem(KEY, token);
    return token;
  }

  /** One connection, until it closes; whether the session has ended by then. */
  session(token, opened) {
    return new Promise((done) => {
      const socket = new WebSocket(`ws://${location.host}/session`, [PROTOCOL, `token.${token}`]);
      socket.binaryType = "arraybuffer";
      socket.onopen = opened;
      socket.onmessage = (event) => this.receive(event.data);
      socket.onclose = (event) => {
        this.socket = null;
        this.sent.clear();
        done(event.code === ENDED);
      };
      this.socket = socket;
    });
  }

  receive(data) {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      if (told.type === "hello") {
        this.client = told.client;
      }
      this.handlers.told(told);
      return;
    }
    const message = decode(data);
    if (message) {
      this.handlers.message(message);
    }
  }

  /** Bytes that were sent and have not left yet. */
  get waiting() {
    return this.socket?.bufferedAmount ?? 0;
  }

  /** Asks for something in JSON. */
  ask(control) {
    this.socket?.readyState === WebSocket.OPEN && this.socket.send(JSON.stringify(control));
  }

  /** Sends what a user does; `encode` gets its sequence number. */
  hand(encode, stamp = performance.now()) {
    if (this.socket?.readyState !== WebSocket.OPEN) {
      return;
    }
    this.sequence = (this.sequence + 1) >>> 0;
    this.sent.set(this.sequence, stamp);
    this.socket.send(encode(this.sequence));
  }

  send(buffer) {
    this.socket?.readyState === WebSocket.OPEN && this.socket.send(buffer);
  }

  /** When (ms) the newest event of a hand that a state contains was; null for none. */
  stampOf(state) {
    let newest = null;
    const seen = state.seen[this.client];
    for (const [sequence, stamp] of this.sent) {
      if (sequence <= seen) {
        newest = stamp;
        this.sent.delete(sequence);
      }
    }
    return newest;
  }

  acknowledge(state) {
    this.send(encodeAck(state.number));
  }
}
