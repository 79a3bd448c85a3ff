#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Passes connections on, and what is sent on them later: a long way between two machines. Kernels can delay packets too
(tc netem), but not all of them.

    relay.py DELAY_FILE ADDRESS PORT=HOST:PORT...

DELAY_FILE holds the seconds from one end to the other, now; what was sent before is on its way as it was. Bytes keep
their order, and any number is on the way. A connection that is not taken at the other end within 2 s, or not confirmed
within 5 s, ends at this one too.
"""

import asyncio
import pathlib
import socket
import sys

DELAY = pathlib.Path(sys.argv[1])


async def pass_on(reader, writer):
    """Until the end of what is sent, which arrives as late."""
    loop = asyncio.get_running_loop()
    on_the_way = asyncio.Queue()

    async def send():
        while True:
            due, data = await on_the_way.get()
            await asyncio.sleep(due - loop.time())
            if not data:
                return
            writer.write(data)
            await writer.drain()

    sending = asyncio.create_task(send())
    due = 0.0
    try:
        while True:
            data = await reader.read(1 << 16)
            due = max(due, loop.time() + float(DELAY.read_text() or 0))
            on_the_way.put_nowait((due, data))
            if not data:
                break
        await sending
    finally:
        sending.cancel()


def relay(host, port):
    async def connected(reader, writer):
        ends = [writer]
        try:
            there = await asyncio.wait_for(asyncio.open_connection(host, port), 2)
            ends.append(there[1])
            for end in ends:
                end.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 5000)
            ways = [asyncio.create_task(pass_on(reader, there[1])), asyncio.create_task(pass_on(there[0], writer))]
            # Neither a database nor gRPC closes one way alone.
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
        except (OSError, asyncio.TimeoutError):
            pass
        finally:
            for end in ends:
                end.close()

    return connected


async def main():
    servers = []
    for way in sys.argv[3:]:
        port, _, target = way.partition("=")
        host, _, target_port = target.rpartition(":")
        servers.append(await asyncio.start_server(relay(host, int(target_port)), sys.argv[2], int(port)))
    print("relay ready", flush=True)
    await asyncio.gather(*(server.serve_forever() for server in servers))


asyncio.run(main())
