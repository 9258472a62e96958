"""What tests of pages share."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import gzip
import json
import secrets
from collections.abc import AsyncIterator, Callable
from typing import Any

import numpy as np

from splinefeed.reports.detail import BLOCK, GAP

#: What a page waits for is there long before, however busy the machine is, ms.
PATIENCE = 400_000


@contextlib.asynccontextmanager
async def new_tab(port: int, cookie: str) -> AsyncIterator[Any]:
    """The socket of a tab that has said hello; it is closed when the block ends."""
    from tornado.httpclient import HTTPRequest
    from tornado.websocket import websocket_connect

    headers = {"Cookie": cookie, "Origin": f"http://127.0.0.1:{port}"}
    connection = await websocket_connect(HTTPRequest(f"ws://127.0.0.1:{port}/socket", headers=headers))
    try:
        await connection.write_message(json.dumps({"do": "hello", "tab": secrets.token_hex(8)}))
        yield connection
    finally:
        connection.close()  # asks the other side to close; after 5 s the socket closes without it
        while await asyncio.wait_for(connection.read_message(), 20.0) is not None:
            pass


def rest(page: Any, action: Callable[[], object]) -> None:
    """Do what changes the settings, and wait until the final result of that is shown."""
    page.evaluate("document.body.dataset.shown = 'waiting'")
    action()
    page.wait_for_selector("body[data-shown=final]")


def value(page: Any, key: str) -> float:
    """A number of the cards, as it was sent."""
    return float(page.get_attribute(f'#cards dd[data-key="{key}"]', "data-value"))


def taken(store_text: str, series: list[dict[str, Any]], number: int) -> np.ndarray:
    """The values of a series, as zoom.js takes them."""
    data, said = gzip.decompress(base64.b64decode(store_text)), series[number]
    n, at = said["n"], said["at"]
    if "unit" in said:
        planes = np.frombuffer(data, np.uint8, 4 * n, at).reshape(4, n).astype(np.int64)
        return said["from"] + said["unit"] * np.cumsum(np.array([1, 256, 65536, 16777216]) @ planes)
    blocks = -(-n // BLOCK)
    low, step = np.frombuffer(data, "<f8", 2 * blocks, at).reshape(2, blocks).repeat(BLOCK, axis=1)[:, :n]
    planes = np.frombuffer(data, np.uint8, 2 * n, at + 16 * blocks).reshape(2, n).astype(np.int64)
    codes = np.cumsum(planes[0] + 256 * planes[1]) % 65536
    return np.where(codes == GAP, np.nan, low + step * codes)
