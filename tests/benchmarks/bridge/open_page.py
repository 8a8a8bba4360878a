"""A page of the live view that is open, without a browser: it takes all that comes, until its input ends.

Usage: open_page.py URL

Prints how many messages came.
"""

import asyncio
import json
import sys

import aiohttp


async def look(url: str) -> int:
    """Be open."""
    base = url.partition("/?")[0]
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    count = 0
    async with (
        aiohttp.ClientSession() as session,
        session.ws_connect(f"{base}/stream", headers={"Origin": base}, max_msg_size=2**26) as page,
    ):
        while True:
            coming = asyncio.ensure_future(page.receive())
            await asyncio.wait((coming, ended), return_when=asyncio.FIRST_COMPLETED)
            if ended.done():
                coming.cancel()
                return count
            message = coming.result()
            if message.type is not aiohttp.WSMsgType.TEXT:
                raise ConnectionError(f"the stream has ended: {message}")
            json.loads(message.data)
            count += 1


if __name__ == "__main__":
    sys.stdout.write(f"{asyncio.run(look(sys.argv[1]))}\n")
