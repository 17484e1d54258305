#!/usr/bin/env python3
"""websockets_stream.py URL FILE  - PyPI websockets, a client that shares no code with the server.

First whatever a WebSocket client may do: text and binary frames, fragments, bytes above 0x7F in either, ping, close, vanishing,
more than it reads. Then FILE by counting characters, with reports in between.
exit 0 all as it should be; 4 error; 5 alarm; 6 timeout; 8 an answer that should not be"""
import asyncio, contextlib, sys, time
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

WINDOW, POLL, PATIENCE = 128, 0.04, 60
url, file = sys.argv[1], sys.argv[2]


def end(code, why=""):
    print("exit", code, why, flush=True)
    sys.exit(code)


class Port:
    """One connection: lines that were received, reports apart."""

    def __init__(self, socket):
        self.socket, self.begun, self.lines, self.reports = socket, "", [], []

    async def hear(self, seconds):
        with contextlib.suppress(asyncio.TimeoutError):
            text = await asyncio.wait_for(self.socket.recv(), seconds)
            if not isinstance(text, str):
                end(8, f"a binary frame: {text!r}")
            *lines, self.begun = (self.begun + text).split("\r\n")
            for line in filter(None, lines):
                (self.reports if line.startswith("<") else self.lines).append(line)

    async def report(self, state):
        """The next report with this state; asks again until it comes."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            self.reports.clear()
            await self.socket.send("?")
            while not self.reports and time.monotonic() < until:
                await self.hear(POLL)
            if self.reports and self.reports[-1].startswith(f"<{state}|"):
                return self.reports[-1]
        end(6, f"no {state}, but {self.reports}")

    async def expect(self, *lines):
        until = time.monotonic() + PATIENCE
        while len(self.lines) < len(lines) and time.monotonic() < until:
            await self.hear(POLL)
        if self.lines != list(lines):
            end(8, f"{self.lines} instead of {lines}")
        self.lines.clear()


async def fragments(*pieces):
    for piece in pieces:
        yield piece


async def override(port, percent):
    """The feed override shows in one of the next reports."""
    for _ in range(40):
        if f"|Ov:{percent}," in await port.report("Idle"):
            return
    end(8, f"no override of {percent} %")


async def frames(socket):
    port = Port(socket)
    await socket.send("\x18")
    await port.expect("Grbl 1.1h ['$' for help]")
    await socket.send("G21\n")
    await socket.send(b"G90\n")
    await socket.send(fragments("G", "21\nG9", "0\n"))
    await socket.send(fragments(b"G21", b"\n"))
    await port.expect(*["ok"] * 5)
    await socket.send("")
    await socket.send(b"")
    for more in b"\x91", "\x91", fragments(b"\x91", b"\x91"), fragments("\x91", "\x91"):
        await socket.send(more)
    await override(port, 160)
    # In the middle of a line: acts, and leaves the line as it is.
    await socket.send("G2\x901\n")
    await override(port, 100)
    await port.expect("ok")
    await asyncio.wait_for(await socket.ping(b"there?"), PATIENCE)
    await socket.close()
    if socket.close_code != 1000:
        end(8, f"closed with {socket.close_code}")


async def flood(socket):
    """More than the machine takes and nothing read; then gone without a word, in mid-line."""
    with contextlib.suppress(asyncio.TimeoutError):
        await asyncio.wait_for(pour(socket), 2)
    socket.transport.abort()


async def pour(socket):
    while True:
        await socket.send("(" + "no answer needed " * 200 + ")\n$G\nG0X")


async def stream(port):
    waiting = [line.strip() + "\n" for line in open(file) if line.strip()]
    on_the_way, next_poll = [], time.monotonic()
    until = time.monotonic() + 150
    while waiting or on_the_way:
        if time.monotonic() > until:
            end(6, f"{len(waiting)} lines left")
        while waiting and sum(map(len, on_the_way)) + len(waiting[0]) <= WINDOW:
            on_the_way.append(waiting.pop(0))
            await port.socket.send(on_the_way[-1])
        if time.monotonic() >= next_poll:
            await port.socket.send("?")
            next_poll += POLL
        await port.hear(POLL)
        for line in port.lines:
            if line.startswith("error"):
                end(4, f"{line} to {on_the_way[:1]}")
            if line.startswith("ALARM"):
                end(5, line)
            if line == "ok":
                on_the_way.pop(0)
        port.lines.clear()
    return await port.report("Idle")


async def free_line():
    """Connects once the line is free: what the flood has sent is still being read, 128 KB a second."""
    until = time.monotonic() + 100
    while True:
        try:
            return await connect(url, subprotocols=["arduino"])
        except InvalidStatus:
            if time.monotonic() > until:
                raise
            await asyncio.sleep(0.1)


async def main():
    async with connect(url) as socket:
        await frames(socket)
    async with connect(url, max_queue=None) as socket:
        await flood(socket)
    async with await free_line() as socket:
        if socket.subprotocol != "arduino":
            end(8, f"subprotocol {socket.subprotocol}")
        port = Port(socket)
        # What the flood has left is still being answered.
        await socket.send("\x18")
        while "Grbl 1.1h ['$' for help]" not in port.lines:
            await port.hear(PATIENCE)
        await port.report("Idle")
        port.lines.clear()
        print("done:", await stream(port))
    end(0)


asyncio.run(asyncio.wait_for(main(), 200))
