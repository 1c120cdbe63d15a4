#!/usr/bin/env python3
"""Measures `tiefort serve` on loopback: 10,000 heights, a stream of requests, memory, 10,000 connections, large bodies.

    scripts/bench_serve.py TIEFORT DATABASE [--gigabytes 2] [--connections 10000]

Needs Python 3.9 and nothing else. Ends with 1 when heights take 20 ms or more, when memory grows by more than 64 MiB
over the stream, or when the service does not answer beside clients that only connect.
"""

import argparse
import array
import http.client
import json
import random
import resource
import signal
import socket
import statistics
import subprocess
import sys
import time

COUNT = 10_000


def resident_mib(pid):
    """Memory of a process in MiB."""
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        line = next(line for line in status if line.startswith("VmRSS"))
    return int(line.split()[1]) / 1024


class Service:
    def __init__(self, program, database):
        words = [program, "serve", database, "--port", "0", "--assume-datum", "EGM96"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.host = self.process.stdout.readline().strip().removeprefix("http://").rstrip("/")
        self.connection = http.client.HTTPConnection(self.host)

    def ask(self, method, path, body=None, kind="application/json", connection=None):
        connection = connection or self.connection
        connection.request(method, path, body, {"Content-Type": kind} if body else {})
        response = connection.getresponse()
        return response.status, response.read()

    def memory(self):
        return resident_mib(self.process.pid)

    def end(self):
        start = time.perf_counter()
        self.process.send_signal(signal.SIGINT)
        self.process.wait()
        return time.perf_counter() - start


def timed(times, act):
    """Milliseconds of each of some calls."""
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        act()
        spent.append(1000 * (time.perf_counter() - start))
    return spent


def told(what, spent):
    print(f"{what}: median {statistics.median(spent):.1f} ms, first {spent[0]:.1f}, worst {max(spent):.1f}")
    return statistics.median(spent)


def heights(service, area):
    random.seed(1)
    low, size = area["origin_m"], area["size_m"]
    places = [[low[axis] + random.random() * size[axis] for axis in (0, 1)] for _ in range(COUNT)]
    text = json.dumps({"positions": places})
    raw = array.array("d", [metres for place in places for metres in place]).tobytes()

    def asked(body, kind):
        status, answer = service.ask("POST", "/heights", body, kind)
        assert status == 200, answer[:500]
        return answer

    kinds = ("application/json", "application/octet-stream")
    medians = []
    for body, kind in zip((text, raw), kinds):
        medians.append(told(f"{COUNT} heights as {kind}", timed(50, lambda: asked(body, kind))))
    found = json.loads(asked(text, kinds[0]))["heights"]
    assert array.array("d", asked(raw, kinds[1])).tolist() == found, "JSON and raw numbers differ"
    lines = array.array("d")
    for one, other, low, high in zip(places, places[1:], found, found[1:]):
        far = [one[axis] + max(-5000, min(5000, other[axis] - one[axis])) for axis in (0, 1)]
        lines.extend([*one, low + 5, *far, high + 5])
        if len(lines) == 6 * 1000:
            break
    body = lines.tobytes()
    looks = timed(20, lambda: service.ask("POST", "/line-of-sight", body, kinds[1]))
    told("1000 lines of sight of up to 7 km as raw numbers", looks)
    return max(medians), raw


def tiles(service):
    """What a globe asks for first, and every tile of the finest level."""
    told("layer.json", timed(3, lambda: service.ask("GET", "/layer.json")))
    told("tileset.json", timed(3, lambda: service.ask("GET", "/tileset.json")))
    layer = json.loads(service.ask("GET", "/layer.json")[1])
    level, [range_] = layer["maxzoom"], layer["available"][-1]
    names = [
        f"/{level}/{col}/{row}.terrain"
        for col in range(range_["startX"], range_["endX"] + 1)
        for row in range(range_["startY"], range_["endY"] + 1)
    ]
    spent = [timed(1, lambda: service.ask("GET", name))[0] for name in names]
    told(f"{len(names)} tiles of level {level}, each", spent)
    return names


def stream(service, raw, names, gigabytes):
    """Requests until so much was sent and received; memory before and after."""
    warm = 2 * len(names)
    sent = asked = 0
    before = None
    start = time.perf_counter()
    while sent < gigabytes * 2**30:
        name = names[asked % len(names)]
        for method, path, body in (("POST", "/heights", raw), ("GET", name, None), ("GET", "/modules", None)):
            status, answer = service.ask(method, path, body, "application/octet-stream")
            assert status == 200, (path, answer[:200])
            sent += len(body or b"") + len(answer)
        asked += 1
        if asked == warm:
            before, sent, start = service.memory(), 0, time.perf_counter()
    after = service.memory()
    seconds = time.perf_counter() - start
    print(f"{gigabytes} GB of requests in {seconds:.0f} s ({3 * (asked - warm)} requests): "
          f"memory {before:.0f} MiB before, {after:.0f} MiB after")
    return after - before


def crowd(service, count):
    """Clients that connect and send half a request."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    host, port = service.host.rsplit(":", 1)
    clients = []
    before = service.memory()
    start = time.perf_counter()
    for _ in range(count):
        try:
            client = socket.create_connection((host, int(port)), timeout=10)
            client.sendall(b"GET / HTTP/1.1\r\nHost: ")
            clients.append(client)
        except OSError:
            break
    spent = time.perf_counter() - start
    other = http.client.HTTPConnection(service.host, timeout=30)
    answer = timed(1, lambda: service.ask("GET", "/databases.json", connection=other))
    print(f"{len(clients)} connections in {spent:.1f} s: another is answered after {answer[0]:.0f} ms, "
          f"memory {before:.0f} to {service.memory():.0f} MiB")
    for client in clients:
        client.close()
    return answer[0] < 2000


def large_body(service):
    """A body of 1 GB, told before and sent without being told."""
    host, port = service.host.rsplit(":", 1)
    before = service.memory()
    for head in (b"Content-Length: 1073741824", b"Transfer-Encoding: chunked"):
        with socket.create_connection((host, int(port)), timeout=30) as client:
            client.sendall(b"POST /heights HTTP/1.1\r\nHost: " + service.host.encode() + b"\r\n" + head + b"\r\n\r\n")
            sent = 0
            piece = b"100000\r\n" + bytes(2**20) + b"\r\n"
            try:
                while sent < 2**30:
                    client.sendall(piece)
                    sent += len(piece)
            except OSError:
                pass
            try:
                answer = client.recv(64).split(b"\r\n")[0].decode()
            except OSError:
                answer = "connection ended"
            print(f"1 GB as {head.decode()}: {answer or 'connection ended'} after {sent / 2**20:.0f} MiB, "
                  f"memory {before:.0f} to {service.memory():.0f} MiB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("database")
    parser.add_argument("--gigabytes", type=float, default=2)
    parser.add_argument("--connections", type=int, default=10_000)
    arguments = parser.parse_args()
    service = Service(arguments.program, arguments.database)
    faults = []
    try:
        area = json.loads(service.ask("GET", "/databases.json")[1])["databases"][0]
        print(f"{area['load_modules'][0]} x {area['load_modules'][1]} load modules, {area['triangles']} triangles; "
              f"memory {service.memory():.0f} MiB at the start")
        slowest, raw = heights(service, area)
        print(f"memory {service.memory():.0f} MiB with all load modules held")
        if 20 <= slowest:
            faults.append(f"{COUNT} heights take {slowest:.1f} ms")
        names = tiles(service)
        print(f"memory {service.memory():.0f} MiB with the area on the globe")
        grown = stream(service, raw, names, arguments.gigabytes)
        if 64 < grown:
            faults.append(f"memory grew by {grown:.0f} MiB")
        large_body(service)
        if not crowd(service, arguments.connections):
            faults.append("no answer beside a crowd")
        print(f"SIGINT ends it after {service.end():.2f} s")
    finally:
        service.process.kill()
    for fault in faults:
        print(f"WRONG {fault}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
