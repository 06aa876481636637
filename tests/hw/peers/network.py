"""Peers on a TCP port: what a network instrument's own program would be."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def served(peer) -> Iterator[str]:
    """`host:number` at which a peer answers, one connection after the other."""
    listener = socket.create_server(("127.0.0.1", 0))
    listener.settimeout(0.1)
    over = threading.Event()

    def run() -> None:
        while not over.is_set():
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            with connection:
                connection.settimeout(0.1)
                while not over.is_set():
                    try:
                        data = connection.recv(4096)
                    except TimeoutError:
                        continue
                    except OSError:
                        break
                    if not data:
                        break
                    try:
                        for delay, reply in peer.hear(data):
                            time.sleep(min(delay, 0.005))
                            connection.sendall(reply)
                    except OSError:  # it was left in the middle of an answer
                        break

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield f"127.0.0.1:{listener.getsockname()[1]}"
    finally:
        over.set()
        thread.join(5.0)
        listener.close()
