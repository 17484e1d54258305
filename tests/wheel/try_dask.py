"""Runs the example that checks and times a folder on Dask, with two local workers, and compares its table with what the command line
says of each job. Run by `.ci/run wheel`; Dask comes from PyPI."""

import csv
import io
import pathlib
import subprocess
import sys
import tempfile
import unittest

import leadscrew

PROJECT = pathlib.Path(__file__).parents[2]
EXAMPLE = PROJECT / "examples" / "folder_on_dask.py"
MACHINE = PROJECT / "examples" / "machines" / "router.toml"


def table(*words: object) -> list:
    done = subprocess.run([sys.executable, EXAMPLE, *map(str, words)], capture_output=True, text=True, check=True, timeout=600)
    return list(csv.DictReader(io.StringIO(done.stdout)))


class OnDask(unittest.TestCase):
    def test_a_folder_becomes_a_table_in_the_order_of_its_names(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "inside").mkdir()
            for k in range(12):
                (folder / f"{k:02}.nc").write_text(f"G21 G90\nG1 X{k + 1} F600\nG1 X0\n")
            (folder / "inside" / "bad.nc").write_text("G21\nG77\n")
            (folder / "inside" / "empty.nc").write_text("")
            (folder / "notes.txt").write_text("no job")
            rows = table(folder, "--machine", MACHINE)
            self.assertEqual([row["job"] for row in rows], [f"{k:02}.nc" for k in range(12)] + ["inside/bad.nc", "inside/empty.nc"])
            for row in rows[:12]:
                run = leadscrew.run(folder / row["job"], MACHINE)
                self.assertAlmostEqual(float(row["motion_seconds"]), run["motion_seconds"], delta=1e-6)
                self.assertEqual((row["lines"], row["errors"], row["first_error"]), ("3", "0", ""))
            bad, empty = rows[12:]
            self.assertEqual((bad["errors"], bad["seconds"]), ("1", ""))
            self.assertRegex(bad["first_error"], "^line 2: ")
            self.assertRegex(empty["first_error"], "empty")


if __name__ == "__main__":
    unittest.main()
