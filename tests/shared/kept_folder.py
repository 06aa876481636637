"""A folder with a bench's home in it, filled once for the tests of a file and put back as it was for each of them."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class KeptFolder:
    """place: always the same, as stores name files by their path; kept: what it held when it was filled."""

    place: Path
    kept: Path

    @classmethod
    def filled(cls, folders: pytest.TempPathFactory, fill: Callable[[Path], object], **more: str) -> "KeptFolder":
        """Call `fill` with an empty folder; its `home` is the bench's, with the passphrase that every test has. more:
        of its environment."""
        place = folders.mktemp("place")
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("ACCEPT_HOME", str(place / "home"))
            patch.setenv("ACCEPT_PASSPHRASE", "correct horse")
            patch.setenv("ACCEPT_OPERATOR", "Test Technician")
            for name, value in more.items():
                patch.setenv(name, value)
            fill(place)
        return cls(place, Path(shutil.copytree(place, place.with_name(f"{place.name}-kept"), symlinks=True)))

    def put_back(self, monkeypatch: pytest.MonkeyPatch) -> Path:
        """Return the folder as it was filled, with its bench as this test's."""
        shutil.rmtree(self.place)
        shutil.copytree(self.kept, self.place, symlinks=True)
        monkeypatch.setenv("ACCEPT_HOME", str(self.place / "home"))
        return self.place


def kept(fill: Callable[[Path], object], **more: str) -> Callable[..., KeptFolder]:
    """Return a fixture of a folder that is filled once for the tests of a file. more: of the environment meanwhile."""

    @pytest.fixture(scope="module")
    def folder(tmp_path_factory: pytest.TempPathFactory) -> KeptFolder:
        return KeptFolder.filled(tmp_path_factory, fill, **more)

    return folder
