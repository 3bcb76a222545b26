"""The folder of a study: each finished case is one file, and what is there already is not measured again.

OUT/
  cases/<case>.json         figures of one finished case, and what it was made with; its model: <case>.model.json
  work/<case>/              installation of a case under way; gone when all cases of its print have ended
  study.json, study.csv     the table
  study.png                 charts as in Fig. 13
"""

from __future__ import annotations

import csv
import io
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from paxel_design.study.cases import Case, Study, cases_of
from paxel_design.study.measuring import measure_case
from paxel_design.workers import Task, Tell, run_tasks
from paxel_runtime.errors import InputError, InstallationError, UsageError
from paxel_runtime.settings import Settings
from paxel_runtime.storage import file_sha256, read_json, write_atomically, write_json, write_text

__all__ = ["COLUMNS", "default_jobs", "run_study"]

Progress = Callable[[str, int, int], None]

JOB_BYTES = 10**9
"""Memory that one job may need at the default frame, with some to spare (measured: 0.42 GB)."""

_SHOWN = 3
"""Cases under way that are named."""

COLUMNS: dict[str, tuple[str | int, ...]] = {
    "layout": ("layout",),
    "angle_deg": ("angle_deg",),
    "dot_size_mm": ("dot_size_mm",),
    "clusters": ("clusters",),
    "L_pattern_low": ("lightness", "rectangle", "L_pattern", 0),
    "L_pattern_high": ("lightness", "rectangle", "L_pattern", 1),
    "L_white_low": ("lightness", "rectangle", "L_white", 0),
    "L_white_high": ("lightness", "rectangle", "L_white", 1),
    "rectangle_area": ("lightness", "rectangle_area"),
    "lightness_area": ("lightness", "area"),
    "hue_180_area_any": ("hue", "area_any"),
    "hue_180_area_all": ("hue", "area_all"),
    "pair_volume_pattern": ("dual_image", "volume_pattern"),
    "pair_volume_white": ("dual_image", "volume_white"),
    **{
        f"{model}{surface}_{figure}": ("prediction", *(["linear"] if model else []), surface, figure)
        for model in ("", "linear_")
        for surface in ("pattern", "white")
        for figure in ("dE00_mean", "dE00_p95", "dE00_max")
    },
    "ghosting_pattern_percent": ("ghosting_percent", "pattern"),
    "ghosting_white_percent": ("ghosting_percent", "white"),
    "seconds": ("seconds",),
    "error": ("error",),
}
"""Columns of ``study.csv``, and where each stands in a case of ``study.json``; what a case has not stays empty."""


def run_study(
    study: Study,
    out: Path,
    *,
    jobs: int = 0,
    force: bool = False,
    keep: bool = False,
    progress: Progress = lambda message, done, total: None,
    say: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Measure what is missing of a study, and write its table and charts.

    An exception, Ctrl-C too, loses at most the cases under way; the next call goes on with their pictures. A script
    that calls this with several jobs needs ``if __name__ == "__main__"``, as its processes import it.

    Parameters
    ----------
    study : Study
    out : Path
        Folder of the study.
    jobs : int
        Processes side by side; 0: as many as cores and memory allow.
    force : bool
        Measure every case anew.
    keep : bool
        Leave the installations of the cases in ``work/``.
    progress, say : callable, optional
        Told what runs now, and how each case ended.

    Returns
    -------
    dict
        ``study.json``: ``cases`` with the figures of each, or its ``error``; ``failed`` says how many.

    Raises
    ------
    UsageError, SettingsError
        If the study cannot be made as asked; nothing is written then.
    """
    if jobs < 0:
        raise UsageError(f"--jobs must be >= 0, got {jobs}")
    cases = cases_of(study)
    _check_folder(out)
    made_from = {case: _made_from(settings, study.ghosting) for case, settings in cases.items()}
    missing = [case for case in cases if force or _finished(out, case, made_from[case]) is None]
    (out / "cases").mkdir(parents=True, exist_ok=True)
    jobs = jobs or default_jobs()
    tasks = [
        Task(
            turn.case.name,
            partial(_measure, out, turn.case, cases[turn.case], turn.sibling, made_from[turn.case]),
            turn.after.name if turn.after else "",
        )
        for turn in _in_order(out, list(cases), missing, jobs)
    ]
    by_name = {case.name: case for case in cases}
    left, errors, labels = list(missing), dict[str, str](), _labels(list(cases))

    def telling(running: Mapping[str, tuple[str, float]]) -> None:
        share = len(cases) - len(left) + sum(share for _, share in running.values())
        now = [f"{labels[by_name[name]]} {what.partition(',')[0]}" for name, (what, _) in running.items()]
        more = [f"{len(now) - _SHOWN} more"] if len(now) > _SHOWN else []
        progress(", ".join([*now[:_SHOWN], *more]), round(100 * share), 100 * len(cases))

    if len(missing) < len(cases):
        say(f"{len(cases) - len(missing)} of {len(cases)} cases are there already")
    for outcome in run_tasks(tasks, jobs, telling):
        case = by_name[outcome.name]
        left.remove(case)
        if outcome.error:
            errors[case.name] = outcome.error
        say(f"{case.name}: {'failed' if outcome.error else 'finished'}; {len(left)} to go")
        if not keep and not any(other.print_name == case.print_name for other in left):
            for done in (other for other in cases if other.print_name == case.print_name):
                shutil.rmtree(out / "work" / done.name, ignore_errors=True)
    if not keep:
        shutil.rmtree(out / "work", ignore_errors=True)
    figures = {}
    for case in cases:
        found = None if case.name in errors else _finished(out, case, made_from[case])
        if found is None:
            errors.setdefault(case.name, "its file was taken away; run the study again")
        else:
            figures[case] = found
    return _write(study, out, list(cases), figures, errors)


def _labels(cases: Sequence[Case]) -> dict[Case, str]:
    """Each case in few words: dot size, K, and layout and angle where there are several."""
    layouts, angles = len({case.layout for case in cases}) > 1, len({case.angle_deg for case in cases}) > 1
    return {
        case: (f"{case.layout} " if layouts else "")
        + (f"{case.angle_deg:.4g}° " if angles else "")
        + f"{case.dot_size_mm:g} mm K {case.clusters}"
        for case in cases
    }


def default_jobs() -> int:
    """As many processes as cores, and no more than memory allows."""
    cores = os.cpu_count() or 1
    try:
        memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not on Windows
        return cores
    return max(1, min(cores, memory // JOB_BYTES))


def _check_folder(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(f"{out} is a file, and a study needs a folder; choose another name")
    if (out / "paxel.toml").exists():
        raise UsageError(f"{out} is an installation; a study needs a folder of its own, such as {out}-study")


def _made_from(settings: Settings, ghosting: bool) -> dict[str, Any]:
    """What a case is made from, as its file holds it."""
    files = {key: Path(name) for key, name in settings.files(*type(settings).model_fields).items()}
    for key, path in files.items():
        if not (path.is_absolute() and path.is_file()):
            raise InputError(f"--set {key} must be the whole path of a file, as a study has many folders; got {path}")
    return {
        "settings": settings.values(),
        "files": {key: file_sha256(path) for key, path in files.items()},
        "ghosting": ghosting,
    }


def _finished(out: Path, case: Case, made_from: Mapping[str, Any]) -> dict[str, Any] | None:
    """The figures of a case, if they are there and were made with the same settings."""
    try:
        record = read_json(out / "cases" / f"{case.name}.json")
    except InstallationError:  # missing, or damaged: measured again
        return None
    then = record.get("made_from", {})
    return record.get("figures") if then in (made_from, {**made_from, "ghosting": True}) else None


def _in_order(out: Path, cases: Sequence[Case], missing: Sequence[Case], jobs: int) -> Iterator[_Turn]:
    """The missing cases in turn: of each print one goes first and takes the pictures that the others take over.

    Only so many prints are opened at a time as keep every job busy: their pictures need room on the disk.
    """
    prints: dict[str, list[Case]] = {}
    for case in missing:
        prints.setdefault(case.print_name, []).append(case)
    groups = list(prints.values())
    for start in range(0, len(groups), jobs + 1):
        opened = groups[start : start + jobs + 1]
        for first, *_ in opened:
            earlier = (c for c in cases if c.print_name == first.print_name and c != first)
            kept = next((c for c in earlier if (out / "work" / c.name / "captures").is_dir()), None)
            yield _Turn(first, kept, None)
        yield from (_Turn(other, first, first) for first, *others in opened for other in others)


class _Turn(NamedTuple):
    """A case, the one whose pictures it takes over, and the one that it waits for."""

    case: Case
    sibling: Case | None
    after: Case | None


def _measure(
    out: Path, case: Case, settings: Settings, sibling: Case | None, made_from: dict[str, Any], tell: Tell
) -> None:
    """Measure one case in ``work/`` and write its file, the last thing of all; runs in a process of its own."""
    folder = out / "work" / case.name
    before = out / "work" / sibling.name if sibling else None
    figures = measure_case(folder, settings, tell, sibling=before, ghosting=made_from["ghosting"])
    finished = out / "cases"
    model = folder / "calibration" / "model.json"
    write_atomically(finished / f"{case.name}.model.json", lambda to: shutil.copyfile(model, to))
    write_json(finished / f"{case.name}.json", {"case": asdict(case), "made_from": made_from, "figures": figures})


def _write(
    study: Study, out: Path, cases: Sequence[Case], figures: Mapping[Case, dict[str, Any]], errors: Mapping[str, str]
) -> dict[str, Any]:
    """Write ``study.json``, ``study.csv`` and ``study.png``; returns the record."""
    from paxel_design.study.figures import write_study_figure  # matplotlib is heavy

    rows = [asdict(case) | ({"error": errors[case.name]} if case.name in errors else _row(figures[case]))
            for case in cases]  # fmt: skip
    record = {
        "study": asdict(study),
        "measured_on": ", ".join(dict.fromkeys(f["measured_on"] for f in figures.values())),
        "failed": len(errors),
        "cases": rows,
    }
    write_json(out / "study.json", record)
    write_text(out / "study.csv", _table(rows))
    if figures:
        write_atomically(out / "study.png", lambda to: write_study_figure(to, figures))
    return record


def _row(figures: Mapping[str, Any]) -> dict[str, Any]:
    """The figures of a case without its curves; with the area of the lightness rectangle."""
    row = {key: value for key, value in figures.items() if key not in ("measured_on", "shared_pictures")}
    if row["lightness"] is not None:
        rectangle = row["lightness"]["rectangle"]
        ranges = [high - low for low, high in rectangle.values()]
        row["lightness"] = {
            "area": row["lightness"]["area"],
            "rectangle": rectangle,
            "rectangle_area": ranges[0] * ranges[1],
        }
    if row["hue"] is not None:
        row["hue"] = {key: row["hue"][key] for key in ("angle_deg", "area_any", "area_all")}
    return row


def _table(rows: Sequence[Mapping[str, Any]]) -> str:
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    table.writerows([_cell(row, path) for path in COLUMNS.values()] for row in rows)
    return text.getvalue()


def _cell(row: Any, path: Sequence[str | int]) -> str:
    for key in path:
        row = row.get(key) if isinstance(row, Mapping) else row[key] if row is not None else None
    return "" if row is None else f"{row:.6g}" if isinstance(row, float) else str(row)
