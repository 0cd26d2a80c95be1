"""Connections to Dask's processes, as another user of the machine would try them."""

from __future__ import annotations

import asyncio

import psutil
from distributed.comm import connect
from distributed.security import Security


def listening_ports(of: int) -> list[int]:
    """Ports on which a process's children and their children listen."""
    family = [psutil.Process(of), *psutil.Process(of).children(recursive=True)]
    return [
        place.laddr.port
        for process in family
        for place in process.net_connections("tcp")
        if place.status == psutil.CONN_LISTEN
    ]


async def greeted(address: str, security: Security) -> None:
    """Connect as Dask's processes do: both ends say which protocol they speak."""
    arguments = security.get_connection_args("client")
    async with asyncio.timeout(5):
        comm = await connect(address, timeout=3, **arguments)
        comm.abort()
