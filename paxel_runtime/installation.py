"""The folder of one installation: its stages, their files, and what is done, stale or missing.

A stage reads the stages before it and writes its own folder as a whole, with records (JSON) that hold the settings
and the files they were made from; comparing those with today's tells what is stale. How a stage computes its results
is not known here.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from paxel_runtime.errors import InstallationError, UsageError
from paxel_runtime.settings import Settings, load_settings, settings_to_toml
from paxel_runtime.storage import file_sha256, read_json, write_text

__all__ = ["STAGES", "Installation", "Stage", "StageStatus", "stage_status"]


@dataclass(frozen=True)
class Stage:
    """One step from the design to the picture.

    Attributes
    ----------
    name : str
        Also the folder's name.
    command : str
        The `paxel` command that makes it.
    record : str
        Glob of its records inside the folder.
    settings : tuple of str
        Tables of paxel.toml it depends on, or single keys of one.
    upstream : tuple of str
        Files of earlier stages it depends on, from the installation's folder; ``{stem}`` is the record's own name. With
        ``*``: whatever there is, all of it as one; those stages may be missing.
    optional : bool
        Nothing waits for it: where it was never made, nobody is told to make it.
    """

    name: str
    command: str
    record: str
    settings: tuple[str, ...]
    upstream: tuple[str, ...]
    optional: bool = False


STAGES: tuple[Stage, ...] = (
    Stage(
        "print",
        "pattern",
        "pattern.json",
        ("pattern", "colorants", "printer.dpi", "printer.ink_spread_um", "printer.page"),
        (),
    ),
    Stage(
        "captures",
        "capture",
        "exposures.json",
        (
            "printer.measured_ruler_mm",
            "projector",
            "light",
            "registration",
            "camera",
            "clusters",
            "model.second_surface",
            "model.ramps",
            "meter",
            "devices",
            "bench",
            "colorants",
        ),
        ("print/pattern.json",),
    ),
    Stage(
        "calibration",
        "calibrate",
        "calibration.json",
        (
            "model.kind",
            "model.response",
            "model.observer_deg",
            "model.correction",
            "model.camera_to_XYZ",
            "model.white",
        ),
        ("captures/exposures.json", "captures/complete.json"),
    ),
    Stage("gamut", "gamut", "*.json", (), ("calibration/model.json",)),
    Stage(
        "projection",
        "project",
        "*.json",
        ("mapping", "assembly", "viewing.distance_mm"),
        ("calibration/model.json", "calibration/clusters.png"),
    ),
    Stage(
        "preview", "preview", "*.json", ("viewing.distance_mm",), ("projection/{stem}.json", "projection/{stem}.png")
    ),
    Stage(
        "report",
        "report",
        "report.json",
        tuple(Settings.model_fields),  # it tells all of them
        (
            "calibration/model.json",
            "calibration/calibration.json",
            "calibration/clusters.png",
            "print/*.json",
            "gamut/*.json",
            "projection/*.json",
            "preview/*.json",
        ),
        optional=True,
    ),
)
"""The stages in order: the one table from which staleness, `paxel status` and its advice are made."""

State = Literal["done", "stale", "missing"]


@dataclass(frozen=True)
class StageStatus:
    """What `paxel status` tells about one stage.

    Attributes
    ----------
    stage : Stage
    state : "done" | "stale" | "missing"
    reasons : tuple of str
        Why it is not done, each with what changed.
    """

    stage: Stage
    state: State
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Installation:
    """An installation folder and its settings.

    Attributes
    ----------
    path : Path
    settings : Settings
    """

    path: Path
    settings: Settings

    @staticmethod
    def open(path: str | os.PathLike[str]) -> Installation:
        """Open an installation folder; a stage that was cut off while it was put in place is put back.

        Raises
        ------
        SettingsError
            If there is no paxel.toml, or it breaks a rule.
        """
        folder = Path(path)
        installation = Installation(folder, load_settings(folder / "paxel.toml"))
        for stage in STAGES:
            if not installation.folder(stage.name).exists():
                installation._clean_up(stage.name)
        return installation

    @staticmethod
    def create(path: str | os.PathLike[str], settings: Settings) -> Installation:
        """Start an installation folder: write its paxel.toml.

        Raises
        ------
        UsageError
            If there is a paxel.toml already, or the path is no folder.
        """
        folder = Path(path)
        toml = folder / "paxel.toml"
        if toml.exists():
            raise UsageError(f"{toml} exists already; edit it, or choose another folder")
        if folder.exists() and not folder.is_dir():
            raise UsageError(f"{folder} is a file, and an installation is a folder; choose another name")
        folder.mkdir(parents=True, exist_ok=True)
        write_text(toml, settings_to_toml(settings))
        return Installation(folder, settings)

    def folder(self, stage: str) -> Path:
        """Folder of a stage, whether it exists or not."""
        return self.path / stage

    def inputs(self, stage_name: str, stem: str = "", extra_files: Mapping[str, Path] | None = None) -> dict[str, Any]:
        """What a record of this stage is made from, as it is written into the record.

        Parameters
        ----------
        stem : str
            Name of the record without its ending, for stages with one record a result.
        extra_files : dict of name -> path
            Files from outside the installation, such as source pictures.

        Raises
        ------
        InstallationError
            If a file of an earlier stage is missing, or one that paxel.toml names.
        """
        stage = _stage(stage_name)
        files = {}
        for pattern in stage.upstream:
            name = pattern.format(stem=stem)
            path = self.path / name
            if "*" in name:
                files[name] = _all_sha256(self.path, name)
                continue
            if not path.is_file():
                raise InstallationError(f"{path} is missing; see what to run with: paxel status {self.path}")
            files[name] = file_sha256(path)
        for key, name in self.settings.files(*stage.settings).items():
            if not (self.path / name).is_file():
                raise InstallationError(f"paxel.toml: {key}: there is no file {self.path / name}; put it there")
            files[name] = file_sha256(self.path / name)
        for name, path in (extra_files or {}).items():
            files[name] = file_sha256(path)
        return {"settings": self.settings.values(*stage.settings) if stage.settings else {}, "files": files}

    def require(self, stage_name: str) -> None:
        """Check that a stage is done.

        Raises
        ------
        InstallationError
            If it is stale or missing: why, and which command makes it.
        """
        for status in self.status():
            if status.state != "done":
                raise InstallationError(
                    f"{status.stage.name} is {status.state} ({'; '.join(status.reasons)}); "
                    f"run: paxel {status.stage.command} {self.path}"
                )
            if status.stage.name == stage_name:
                return

    def status(self) -> list[StageStatus]:
        """State of every stage, in order; a stage after a stale or missing one is not done.

        An optional stage that was never made is left out.
        """
        result: list[StageStatus] = []
        states: dict[str, State] = {}
        for stage in STAGES:
            status = stage_status(self, stage)
            if stage.optional and status.state == "missing":
                continue
            before = {Path(name).parts[0] for name in stage.upstream if "*" not in name}
            behind = [name for name in before if states[name] != "done"]
            if status.state == "done" and behind:
                status = StageStatus(stage, "stale", tuple(f"{name} is {states[name]}" for name in sorted(behind)))
            states[stage.name] = status.state
            result.append(status)
        return result

    @contextmanager
    def writing(self, stage_name: str, *, keep: bool = False) -> Iterator[Path]:
        """A fresh folder to fill; put in place of the stage's folder when the block ends without an error.

        An error, Ctrl-C or a kill leaves the stage as it was.

        Parameters
        ----------
        keep : bool
            Start with the files the stage already has (hard links where the file system has them).
        """
        self._clean_up(stage_name)
        target = self.folder(stage_name)
        fresh = Path(tempfile.mkdtemp(prefix=f".{stage_name}-{os.getpid()}-", dir=self.path))
        fresh.chmod(0o755)
        try:
            if keep and target.is_dir():
                for file in target.iterdir():
                    if file.is_file():
                        _link_or_copy(file, fresh / file.name)
            yield fresh
            old = self.path / f".{stage_name}-{os.getpid()}-old"
            if target.exists():
                target.rename(old)
            try:
                fresh.rename(target)
            except BaseException:
                if old.exists():
                    old.rename(target)
                raise
            shutil.rmtree(old, ignore_errors=True)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)

    def _clean_up(self, stage_name: str) -> None:
        """Remove what a killed run of this stage left; bring back the old folder if it died while swapping."""
        for left in self.path.glob(f".{stage_name}-*"):
            pid = left.name.removeprefix(f".{stage_name}-").split("-")[0]
            if pid.isdigit() and _alive(int(pid)):
                continue
            if left.name.endswith("-old") and not self.folder(stage_name).exists():
                left.rename(self.folder(stage_name))
            else:
                shutil.rmtree(left, ignore_errors=True)


def stage_status(installation: Installation, stage: Stage) -> StageStatus:
    """State of one stage by its own records (whether earlier stages are done is `Installation.status`'s part)."""
    folder = installation.folder(stage.name)
    records = sorted(folder.glob(stage.record)) if folder.is_dir() else []
    if not records:
        return StageStatus(stage, "missing", (f"never made; paxel {stage.command} makes it",))
    if stage.name == "captures" and not (folder / "complete.json").is_file():
        return StageStatus(stage, "missing", ("not finished; paxel capture goes on where it stopped",))
    reasons: list[str] = []
    for record in records:
        try:
            made_from = read_json(record).get("inputs", {})
            today = installation.inputs(stage.name, stem=record.stem)
        except InstallationError as error:
            reasons.append(str(error))
            continue
        label = f"{record.name}: " if len(records) > 1 else ""
        reasons += [f"{label}{difference}" for difference in _differences(made_from, today)]
    return StageStatus(stage, "stale" if reasons else "done", tuple(dict.fromkeys(reasons)))


def _differences(made_from: Mapping[str, Any], today: Mapping[str, Any]) -> list[str]:
    """What changed since a record was made; files from outside are compared only when a stage is run."""
    then, now = made_from.get("settings", {}), today["settings"]
    changes = [f"{key} was {then.get(key)}, is {value}" for key, value in now.items() if then.get(key) != value]
    files = made_from.get("files", {})
    return changes + [f"{name} changed" for name, digest in today["files"].items() if files.get(name) != digest]


def _all_sha256(folder: Path, pattern: str) -> str:
    """One hash of the names and bytes of all files that match; of none, too."""
    lines = [f"{path.name} {file_sha256(path)}" for path in sorted(folder.glob(pattern)) if path.is_file()]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


def _stage(name: str) -> Stage:
    return next(stage for stage in STAGES if stage.name == name)


def _link_or_copy(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _alive(pid: int) -> bool:
    if os.name == "nt":  # os.kill would end the process there; its leftovers stay until the next start of the system
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
