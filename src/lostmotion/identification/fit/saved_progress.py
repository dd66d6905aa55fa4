"""Models that have been fitted so far, kept in a file, so that an interrupted identification continues with the next one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...atomic_writer import write_bytes
from ...version import __version__
from ..prepared_log import Prepared
from ..rig.residuals import ParameterPoint
from ..task.identification_file import Identification


class Progress:
    """Fitted models of some logs.

    path: file that keeps them; None: nothing is kept. A file of another task, of other logs or of another version is replaced.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.kept: dict[str, dict[str, Any]] = {}
        if path is not None and path.is_file():
            try:
                data = json.loads(path.read_text(encoding="utf-8"))
                self.kept = data["models"] if data["version"] == __version__ else {}
            except (ValueError, KeyError, TypeError, OSError):
                self.kept = {}  # of another program, or cut off: the work begins anew

    def of(
        self,
        task: Identification,
        logs: Sequence[Prepared],
        others: Mapping[str, tuple[ParameterPoint, list[ParameterPoint]]] | None = None,
    ) -> Models:
        """Models of these logs; ``others``: values of models of almost the same logs, by name."""
        digest = hashlib.sha256(task.model_dump_json().encode())
        for log in logs:
            digest.update(repr((log.name, log.held_out, len(log.time))).encode())
            for values in (log.time, *log.inputs.values(), *log.measured.values()):
                digest.update(values.tobytes())
        return Models(self, digest.hexdigest(), others or {})

    def finish(self) -> None:
        """Remove the file: the result is complete."""
        if self.path is not None:
            self.path.unlink(missing_ok=True)


class Models:
    """Models of one set of logs in a `Progress`."""

    def __init__(
        self, progress: Progress, key: str, others: Mapping[str, tuple[ParameterPoint, list[ParameterPoint]]]
    ) -> None:
        self._progress, self._key, self._others = progress, key, others

    def fitted(self, name: str) -> tuple[ParameterPoint, list[ParameterPoint]] | None:
        """(values found, other minima) of a model; None if it is not kept."""
        data = self._progress.kept.get(self._key, {}).get(name)
        if data is None:
            return self._others.get(name)
        return ParameterPoint(**data["point"]), [ParameterPoint(**point) for point in data["minima"]]

    def keep(self, name: str, point: ParameterPoint, minima: Sequence[ParameterPoint]) -> None:
        """Keep a model that has been fitted."""
        progress = self._progress
        if progress.path is not None:
            progress.kept.setdefault(self._key, {})[name] = {
                "point": asdict(point),
                "minima": list(map(asdict, minima)),
            }
            progress.path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(progress.path, json.dumps({"version": __version__, "models": progress.kept}).encode())
