"""Checks and times a folder of jobs on the workers of a Dask cluster, and writes a table.

    pip install leadscrew "dask[distributed]"
    python examples/folder_on_dask.py jobs/ --machine router.toml > jobs.csv
    python examples/folder_on_dask.py jobs/ --scheduler tcp://desk:8786

Without `--scheduler`, two workers run on this computer. The jobs go to the workers as text, and so
does the machine file: the workers need `leadscrew`, but none of the folders.
"""

from __future__ import annotations

import argparse
import csv
import pathlib
import sys
import tempfile
from typing import Iterator, Optional

from dask.distributed import Client, LocalCluster

import leadscrew

ENDINGS = {".nc", ".gcode", ".ngc", ".gc", ".g", ".tap", ".cnc"}
COLUMNS = ["job", "lines", "errors", "warnings", "seconds", "motion_seconds", "first_error"]


def look(name: str, text: bytes, machine: Optional[str]) -> dict[str, object]:
    """One row of the table. Runs on a worker."""
    with tempfile.TemporaryDirectory() as folder:
        file = None
        if machine is not None:
            file = pathlib.Path(folder) / "machine.toml"
            file.write_text(machine, encoding="utf-8")
        try:
            found = leadscrew.check(text, file, time=True)
        except leadscrew.LeadscrewError as error:
            return {"job": name, "first_error": str(error).splitlines()[0]}
    first = found["errors"][0] if found["errors"] else None
    time = found.get("time")
    return {
        "job": name,
        "lines": found["lines"],
        "errors": found["error_count"],
        "warnings": found["warning_count"],
        "seconds": time and round(time["job_seconds"], 3),
        "motion_seconds": time and round(time["motion_seconds"], 6),
        "first_error": first and f"line {first['line']}: {first['message']}",
    }


def jobs_of(folder: pathlib.Path) -> list[pathlib.Path]:
    """The jobs in a folder and in those inside it, by name."""
    return sorted(path for path in folder.rglob("*") if path.suffix.lower() in ENDINGS and path.is_file())


def rows(client: Client, folder: pathlib.Path, machine: Optional[str]) -> Iterator[dict[str, object]]:
    """The rows of all jobs, in the order of their names."""
    futures = [client.submit(look, str(path.relative_to(folder)), path.read_bytes(), machine, pure=False) for path in jobs_of(folder)]
    for future in futures:
        yield future.result()


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--machine", type=pathlib.Path)
    options.add_argument("--scheduler", help="address of a cluster that runs already")
    args = options.parse_args()
    machine = args.machine.read_text(encoding="utf-8") if args.machine else None
    table = csv.DictWriter(sys.stdout, COLUMNS)
    table.writeheader()
    if args.scheduler:
        with Client(args.scheduler) as client:
            table.writerows(rows(client, args.folder, machine))
    else:
        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
            table.writerows(rows(client, args.folder, machine))


if __name__ == "__main__":
    main()
