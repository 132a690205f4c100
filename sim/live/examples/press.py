#!/usr/bin/env python3
"""A client of phyxel.1 with nothing but Python's own library: a hand that presses a probe with a force, and feels it.

python3 press.py 'http://127.0.0.1:8765/#CODE'
"""
import base64, json, math, os, socket, struct, sys, time, urllib.parse, urllib.request

# The force (N) that the hand presses with.
WANTED = 1.0


class Session:
    def __init__(self, url):
        parts = urllib.parse.urlsplit(url)
        with urllib.request.urlopen(f"http://{parts.netloc}/token?{parts.fragment}") as answer:
            token = answer.read().decode()
        self.socket = socket.create_connection((parts.hostname, parts.port))
        # Small messages are not to wait for each other.
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            f"GET /session HTTP/1.1\r\nHost: {parts.netloc}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
            f"Sec-WebSocket-Protocol: phyxel.1, token.{token}\r\n\r\n".encode()
        )
        self.file = self.socket.makefile("rb")
        if b" 101 " not in self.file.readline():
            raise SystemExit("the server does not let us in")
        while self.file.readline() != b"\r\n":
            pass

    def send(self, data, opcode=2):
        head = bytes([0x80 | opcode])
        size = len(data)
        head += bytes([0x80 | size]) if size < 126 else bytes([0x80 | 126]) + struct.pack(">H", size)
        mask = os.urandom(4)
        self.socket.sendall(head + mask + bytes(b ^ mask[k % 4] for k, b in enumerate(data)))

    def read(self):
        """The next message: text as JSON, binary as bytes."""
        while True:
            first, second = self.file.read(2)
            size = second & 127
            if size > 125:
                size = struct.unpack(">H" if size == 126 else ">Q", self.file.read(2 if size == 126 else 8))[0]
            data = self.file.read(size)
            opcode = first & 15
            if opcode == 1:
                return json.loads(data)
            if opcode == 2:
                return data
            if opcode == 8:
                raise SystemExit("the server has ended")
            if opcode == 9:
                self.send(data, 10)

    def pose(self, sequence, phase, place):
        self.send(struct.pack("<HHIIIII7d", 17, 80, 0, sequence, phase, 0, 0, *place, 0, 0, 0, 1))

    def acknowledge(self, state):
        self.send(struct.pack("<HHI", 16, 12, 0) + state[8:12])


def main():
    session = Session(sys.argv[1])
    client, low, high, settling = 0, None, None, True
    while settling:
        told = session.read()
        if isinstance(told, dict):
            client = told.get("client", client)
            low, high = told.get("low", low), told.get("high", high)
            settling = told.get("settling", settling)
        elif struct.unpack_from("<H", told)[0] == 4:
            session.acknowledge(told)
    x, y, height = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, high[2] + 0.2 * (high[2] - low[2])
    begun = last = time.time()
    sequence, force, peak = 0, 0.0, 0.0
    while (now := time.time()) - begun < 4.0:
        # A hand that pushes with WANTED: the less it feels the faster it goes on (m/s for a newton).
        height -= 0.05 * (WANTED - force) * min(now - last, 0.02)
        last, sequence = now, sequence + 1
        session.pose(sequence, 0 if sequence == 1 else 1, [x, y, height])
        # The loop is closed by the first state that has this pose in it.
        seen = 0
        while seen < sequence:
            message = session.read()
            if isinstance(message, bytes) and struct.unpack_from("<H", message)[0] == 4:
                session.acknowledge(message)
                seen = struct.unpack_from("<I", message, 40 + 4 * client)[0]
                tool = struct.unpack_from("<14f", message, struct.unpack_from("<H", message, 2)[0])
                force = math.hypot(*tool[7:10])
        peak = max(peak, force)
        if sequence % 100 == 0:
            print(f"{now - begun:6.3f} s  {force:7.3f} N  {1000 * tool[13]:5.2f} mm deep")
    session.pose(sequence + 1, 2, [x, y, height])
    print(f"largest force {peak:.3f} N; the loop was closed {sequence / (last - begun):.0f} times a second")


main()
