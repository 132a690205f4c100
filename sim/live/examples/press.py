#!/usr/bin/env python3
"""A client of phyxel.1 with nothing but Python's own library: presses a probe and prints the force.

python3 press.py 'http://127.0.0.1:8765/#CODE'
"""
import base64, json, math, os, socket, struct, sys, time, urllib.parse, urllib.request


class Session:
    def __init__(self, url):
        parts = urllib.parse.urlsplit(url)
        with urllib.request.urlopen(f"http://{parts.netloc}/token?{parts.fragment}") as answer:
            token = answer.read().decode()
        self.socket = socket.create_connection((parts.hostname, parts.port))
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
    low, high, settling = None, None, True
    while settling:
        told = session.read()
        if isinstance(told, dict):
            low, high = told.get("low", low), told.get("high", high)
            settling = told.get("settling", settling)
        elif struct.unpack_from("<H", told)[0] == 4:
            session.acknowledge(told)
    middle = [(a + b) / 2 for a, b in zip(low, high)]
    size = high[2] - low[2]
    begun, last, sequence, peak = time.time(), 0.0, 0, 0.0
    while (now := time.time() - begun) < 4.0:
        if now - last > 1 / 60:
            last, sequence = now, sequence + 1
            height = 0.6 - 0.7 * math.sin(math.pi * now / 4)
            session.pose(sequence, 0 if sequence == 1 else 1, [middle[0], middle[1], middle[2] + height * size])
        message = session.read()
        if not isinstance(message, bytes):
            continue
        kind, start = struct.unpack_from("<HH", message)
        if kind == 4:
            session.acknowledge(message)
        elif kind == 5:
            for k in range(struct.unpack_from("<I", message, 12)[0]):
                moment, x, y, z, depth = struct.unpack_from("<d4f", message, start + 24 * k)
                peak = max(peak, math.sqrt(x * x + y * y + z * z))
            print(f"{moment:8.3f} s  {math.sqrt(x * x + y * y + z * z):7.3f} N  {1000 * depth:5.2f} mm deep")
    session.pose(sequence + 1, 2, middle)
    print(f"largest force {peak:.3f} N")


main()
