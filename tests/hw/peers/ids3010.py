"""An IDS3010 by the maker's published client libraries: JSON-RPC on a line, picometres, the error number first."""

import json


class Ids3010Peer:
    """truth: displacement of axis 0 [m]; axis 1 stands elsewhere."""

    byte_s = 1e-6

    def __init__(self, serial: str = "L01234567") -> None:
        self.truth, self.serial, self.pass_mode = 0.0, serial, 0
        self.switch_on()
        self.enabled, self.contrast, self.reference_pm, self.averaging = True, 700, 12_345_678, 0
        self.panel = {
            "measurement stopped": lambda: setattr(self, "enabled", False),
            "dual pass": lambda: setattr(self, "pass_mode", 1 - self.pass_mode),
            "measurement started": lambda: setattr(self, "enabled", True),
            "reset": lambda: setattr(self, "reference_pm", self.reference_pm + 1_000),
            "beam lost": lambda: setattr(self, "contrast", 40 if self.contrast > 100 else 700),
        }

    def switch_on(self) -> None:
        """Nothing measures after power came back."""
        self.enabled, self.contrast, self._heard = False, 700, b""

    def alone(self, now: float) -> list[bytes]:
        return []

    def hear(self, data: bytes) -> list[tuple[float, bytes]]:
        *lines, self._heard = (self._heard + data).split(b"\n")
        return [(0.003, json.dumps(self._said(json.loads(line))).encode() + b"\r\n") for line in lines if line.strip()]

    def _said(self, request: dict) -> dict:
        axis = request["params"][0] if request["params"] else None
        shown = self.truth * (0.5 if self.pass_mode else 1.0) if axis == 0 else 0.2e-3
        known = {
            "com.attocube.system.getDeviceName": ["IDS3010"],
            "com.attocube.system.getSerialNumber": [self.serial],
            "com.attocube.ids.displacement.getMeasurementEnabled": [self.enabled],
            "com.attocube.ids.axis.getPassMode": [self.pass_mode],
            "com.attocube.ids.displacement.getSignalQuality": [self.contrast, 12],
            "com.attocube.ids.displacement.getAxisDisplacement": [round(shown * 1e12)],
            "com.attocube.ids.displacement.getReferencePosition": [self.reference_pm],
            "com.attocube.ids.displacement.getAverageN": [self.averaging],
        }
        if request["method"] not in known:
            return {"jsonrpc": "2.0", "error": {"code": -32601, "message": "Method not found"}, "id": request["id"]}
        if "Displacement" in request["method"] and (not self.enabled or self.contrast < 100):
            return {"jsonrpc": "2.0", "result": [6, 0], "id": request["id"]}
        return {"jsonrpc": "2.0", "result": [0, *known[request["method"]]], "id": request["id"]}
