from .errors import DaqError


class Device:
    def __init__(self, name: str) -> None:
        self._name = name

    @property
    def product_type(self) -> str:
        if self._name != "Dev1":
            raise DaqError(f"Device identifier is invalid.\nDevice Specified: {self._name}\nStatus Code: -200220")
        return "USB-6363"

    @property
    def serial_num(self) -> int:
        return 0x01A2B3C4
