"""Attocube IDS3010 by the maker's published MATLAB clients: JSON-RPC, lengths in picometres; every result begins with
its warning."""

import json
from collections.abc import Callable, Sequence
from typing import Any

from tests.hw.apart.wires import Peer, set_to


class Ids3010(Peer):
    """Axis 0 sees `truth`; requests are JSON objects, with or without a line end behind."""

    def __init__(self) -> None:
        super().__init__()
        self.serial, self.pass_mode, self.contrast, self.warning = "L0140001", 0, 800, 0
        self.mode, self.reference, self.average = "measurement running", 150.0, 0
        self.shape: Callable[[dict[str, Any]], Any] = dict
        self.scale = 1.0

    def power_cycle(self) -> None:
        super().power_cycle()
        self.mode = "system idle"

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        """Take whole JSON objects from the stream."""
        self._heard += data
        answers: list[tuple[float, bytes]] = []
        decoder = json.JSONDecoder()
        while text := self._heard.decode("latin-1").lstrip():
            try:
                request, end = decoder.raw_decode(text)
            except ValueError:
                break
            self._heard = text[end:].encode("latin-1")
            answers += [] if self.silent else [(0.0, a) for a in self.reply(request)]
        return answers

    def reply(self, request: dict[str, Any]) -> Sequence[bytes]:
        """Return the reply to a request."""
        result = self.result(request.get("method", ""), request.get("params", []))
        said: dict[str, Any] = {"jsonrpc": "2.0", "id": request.get("id")}
        if result is None:
            said["error"] = {"code": -32601, "message": "Method not found"}
        else:
            said["result"] = result
        return [json.dumps(self.shape(said)).encode() + b"\r\n"]

    def result(self, method: str, params: Sequence[Any]) -> list[Any] | None:
        """Return the result of a method, None if there is no such method."""
        axis = params[0] if params else 0
        position = [self.truth * self.scale + self.reference if a == 0 else 0.3 for a in range(3)]
        running = self.mode == "measurement running"
        error = [self.warning] if running else [7]
        picometres = [round(p * 1e12) for p in position]
        zero = round(self.reference * 1e12)
        name = method.removeprefix("com.attocube.")
        results: dict[str, list[Any]] = {
            "ids.displacement.getAbsolutePosition": [*error, picometres[axis]],
            "ids.displacement.getAbsolutePositions": [*error, *picometres],
            "ids.displacement.getAxisDisplacement": [*error, picometres[axis] - zero],
            "ids.displacement.getAxesDisplacement": [*error, *(p - zero for p in picometres)],
            "ids.displacement.getReferencePosition": [*error, zero],
            "ids.displacement.getReferencePositions": [*error, zero, zero, zero],
            "ids.displacement.getAxisSignalQuality": [*error, self.contrast, 20],
            "ids.displacement.getSignalQuality": [*error, self.contrast, 20],
            "ids.displacement.getMeasurementEnabled": [0, running],
            "ids.displacement.getAverageN": [0, self.average],
            "ids.axis.getPassMode": [0, self.pass_mode],
            "ids.axis.getMasterAxis": [0, 0],
            "ids.system.getCurrentMode": [0, self.mode],
            "ids.system.getInitMode": [0, 0],
            "ids.system.getDeviceType": [0, "IDS3010"],
            "ids.system.getFpgaVersion": [0, "1.7.0"],
            "ids.system.getSystemError": [0],
            "system.getSerialNumber": [0, self.serial],
            "system.getDeviceName": [0, "IDS3010"],
            "system.getFirmwareVersion": [0, "1.8.1"],
            "system.about.getInstalledPackages": [0, ""],
        }
        return results.get(name)

    def unasked(self) -> bytes:
        return b"{}\r\n"

    def reset(self) -> None:
        """Reset the axis: its zero is here now."""
        self.reference += self.truth + 1e-6

    def panel(self) -> dict[str, Callable[[], None]]:
        modes = ("system idle", "measurement starting", "optics alignment running")
        shapes: dict[str, Callable[[dict[str, Any]], Any]] = {
            "a list": lambda r: [r],
            "no result": lambda r: {k: v for k, v in r.items() if k != "result"},
            "result a number": lambda r: r | {"result": 0},
            "result empty": lambda r: r | {"result": []},
            "result without value": lambda r: r | {"result": r.get("result", [0])[:1]},
            "values as text": lambda r: r | {"result": [str(x) for x in r.get("result", [])]},
            "value NaN": lambda r: r | {"result": [0] + [float("nan")] * (len(r.get("result", [0])) - 1)},
            "value null": lambda r: r | {"result": [0] + [None] * (len(r.get("result", [0])) - 1)},
            "another id": lambda r: r | {"id": 999_999_999},
            "no id": lambda r: {k: v for k, v in r.items() if k != "id"},
            "error beside the result": lambda r: r | {"error": {"code": -1, "message": "busy"}},
        }
        return (
            {f"mode {m}": set_to(self, mode=m) for m in modes}
            | {f"JSON: {n}": set_to(self, shape=s) for n, s in shapes.items()}
            | {f"error {n}": set_to(self, warning=n) for n in (1, 9, 14)}
            | {
                "pass mode dual": set_to(self, pass_mode=1),
                "beam lost": set_to(self, contrast=3),
                "averaging over 0.67 s": set_to(self, average=24),
                "axis reset": self.reset,
                "another serial number": set_to(self, serial="L0149999"),
                "power off and on": self.power_cycle,
                "stuck": set_to(self, silent=True),
            }
        )

    def untold(self) -> dict[str, Callable[[], None]]:
        return {"refractive index of another day": set_to(self, scale=1.02)}
