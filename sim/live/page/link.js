// The socket: a code for a token, a token for a session, messages in order.
import { PROTOCOL, decode, encodeAck } from "./protocol.js";

const KEY = "phyxel-token";

/** The session's token: for the code in the address, or the one this tab has. */
async function tokenOf() {
  const code = location.hash.slice(1);
  if (code) {
    // The code is good once: it has no business in the address any more.
    history.replaceState(null, "", location.pathname);
    const answer = await fetch(`/token?${encodeURIComponent(code)}`, { cache: "no-store" });
    if (answer.ok) {
      sessionStorage.setItem(KEY, await answer.text());
    }
  }
  return sessionStorage.getItem(KEY);
}

export class Link {
  constructor(handlers) {
    this.handlers = handlers;
    this.socket = null;
    this.client = 0;
    this.sequence = 0;
    this.sent = new Map();
  }

  async open() {
    const token = await tokenOf();
    if (!token) {
      this.handlers.closed("This address is not good any more. Press Enter in the terminal for another one.");
      return;
    }
    const socket = new WebSocket(`ws://${location.host}/session`, [PROTOCOL, `token.${token}`]);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => this.receive(event.data);
    let opened = false;
    socket.onopen = () => {
      opened = true;
      this.handlers.opened();
    };
    socket.onclose = () => {
      this.socket = null;
      if (!opened) {
        sessionStorage.removeItem(KEY);
      }
      this.handlers.closed(opened ? "The session has ended. Start phyxel live again." : "The session is not there, or is another one by now.");
    };
    this.socket = socket;
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

  /** Asks for something in JSON. */
  ask(control) {
    this.socket?.readyState === WebSocket.OPEN && this.socket.send(JSON.stringify(control));
  }

  /** Sends what a hand does; `encode` gets its sequence number. */
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

  /** Milliseconds since the newest event of a hand that a drawn state contains; null for none. */
  latency(state) {
    let newest = null;
    const seen = state.seen[this.client];
    for (const [sequence, stamp] of this.sent) {
      if (sequence <= seen) {
        newest = stamp;
        this.sent.delete(sequence);
      }
    }
    return newest === null ? null : performance.now() - newest;
  }

  acknowledge(state) {
    this.send(encodeAck(state.number));
  }
}
