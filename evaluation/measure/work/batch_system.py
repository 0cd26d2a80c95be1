"""Workers as jobs of a batch system (SLURM and its like), by Dask-jobqueue.

The file has the number of jobs, and Dask-jobqueue's own configuration for one system:

    jobs: 8
    jobqueue:
      slurm:
        cores: 4
        processes: 4
        memory: 16GB
        walltime: "02:00:00"
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any, cast

from distributed import SpecCluster
from distributed.security import Security
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from airground.errors import InputError, RecordingError
from airground.io.input_files import SETTINGS_LIMIT, check_file
from airground.io.sensor_file import read_mapping

CLASSES = {
    "slurm": "SLURMCluster",
    "pbs": "PBSCluster",
    "sge": "SGECluster",
    "lsf": "LSFCluster",
    "oar": "OARCluster",
    "htcondor": "HTCondorCluster",
    "moab": "MoabCluster",
    "local": "LocalCluster",
}
"""Systems that Dask-jobqueue knows; `local` runs the jobs on this machine, to test a file."""

WORKERS_MAY_RENDER = "DASK_DISTRIBUTED__WORKER__DAEMON=False"
"""A worker starts processes that render images, which a daemon may not."""

NO_DASHBOARD = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
"""No access from other machines, and a free port, so that two runs do not conflict."""


class Jobs(BaseModel):
    """Contents of the file. Dask-jobqueue checks the entries of the system."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    jobs: int = Field(ge=1)
    jobqueue: dict[str, dict[str, Any]] = Field(min_length=1, max_length=1)


def batch_cluster(file: Path, keys: Path) -> SpecCluster:
    """Start the jobs that a file describes.

    Args:
        file: The description.
        keys: Folder for the key of this run, which the jobs read and only this user can.

    Raises:
        InputError: The file is invalid, or Dask-jobqueue is not installed or fails.
    """
    jobs = read_jobs(file)
    ((system, options),) = jobs.jobqueue.items()
    try:
        module = importlib.import_module(f"dask_jobqueue.{system}")
    except ImportError:
        raise InputError(
            f"--cluster {file}: Dask-jobqueue is not installed (pip install dask-jobqueue)"
        ) from None
    if options.get("cores") != options.get("processes"):
        raise InputError(f"--cluster {file}: cores and processes must be the same number")
    try:
        python = f"env {WORKERS_MAY_RENDER} {options.pop('python', sys.executable)}"
        scheduler = {**NO_DASHBOARD, **options.pop("scheduler_options", {})}
        kind = getattr(module, CLASSES[system])
        cluster = kind(**_encrypted(options, keys), python=python, scheduler_options=scheduler)
        cluster.scale(jobs=jobs.jobs)
    except (TypeError, ValueError, RuntimeError, OSError) as error:
        raise InputError(f"--cluster {file}: {system}: {error}") from None
    return cast(SpecCluster, cluster)


def _encrypted(options: dict[str, Any], keys: Path) -> dict[str, Any]:
    """With TLS by a key of this run, unless the file names a protocol of its own."""
    if "protocol" in options:
        return options
    own = {"protocol": "tls://", "security": Security.temporary()}
    return {"shared_temp_directory": str(keys.resolve())} | options | own


def read_jobs(file: Path) -> Jobs:
    """Read the description of jobs.

    Raises:
        InputError: The file cannot be read, or an entry is invalid.
    """
    try:
        check_file(file, SETTINGS_LIMIT)
        jobs = Jobs.model_validate(read_mapping(file))
    except OSError as error:
        raise InputError(f"--cluster {file}: {error.strerror}") from None
    except RecordingError as error:
        raise InputError(f"--cluster {error}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise InputError(f"--cluster {file}: {where}: {first['msg']}") from None
    (system,) = jobs.jobqueue
    if system not in CLASSES:
        known = ", ".join(CLASSES)
        raise InputError(f"--cluster {file}: unknown system {system!r}; known: {known}")
    return jobs
