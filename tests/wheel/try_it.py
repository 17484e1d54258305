"""Uses the installed package as its users do. Run by `.ci/run wheel` in a fresh virtual environment."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import typing
import unittest

import leadscrew

PROJECT = pathlib.Path(__file__).parents[2]
EXAMPLES = PROJECT / "examples"


def required(kind: type) -> set:
    """The fields that a typed answer always has."""
    return set(kind.__required_keys__)


def told_by_readme() -> float:
    """The job time of heart.nc, in seconds, that the README shows for the command line."""
    readme = (PROJECT / "README.md").read_text(encoding="utf-8")
    shown = re.search(r"job time +([0-9.]+) s", readme)
    assert shown is not None, "README.md shows no job time"
    return float(shown[1])


class Installed(unittest.TestCase):
    def test_heart_has_a_result_within_five_seconds(self) -> None:
        begun = time.monotonic()
        result = leadscrew.run(EXAMPLES / "heart.nc")
        print(f"heart.nc: {result['job_seconds']:.3f} s of machine time in {time.monotonic() - begun:.2f} s")
        self.assertAlmostEqual(result["job_seconds"], told_by_readme(), delta=0.001)
        self.assertEqual(result["errors"], [])

    def test_text_is_checked_and_each_error_has_its_line(self) -> None:
        report = leadscrew.check("G21\nG1 X10\nG77\n")
        self.assertEqual([error["line"] for error in report["errors"]], [2, 3])
        self.assertEqual([error["code"] for error in report["errors"]], [22, 20])

    def test_a_line_takes_the_time_that_physics_says(self) -> None:
        # 60 mm at 10 mm/s with ramps of 100 mm/s^2: 60/10 + 10/100.
        settings = {110: 6000, 120: 100}
        run = leadscrew.run("G1 X60 F600\n", settings=settings)
        self.assertAlmostEqual(run["job_seconds"], 6.1, delta=0.02)
        profile = leadscrew.profile(b"G1 X60 F600\n", settings=settings, line_times=True)
        self.assertAlmostEqual(profile["job_seconds"], run["job_seconds"], delta=1e-6)
        self.assertEqual(profile["limits"][0]["limit"], "feed")
        self.assertEqual([one["line"] for one in profile["line_times"]], [1])

    def test_a_check_times_a_job_as_a_run_does_and_grbl_beside_it(self) -> None:
        text, settings = "G1 X60 F600\n", {110: 6000, 120: 100}
        run = leadscrew.run(text, settings=settings, like="grbl")
        check = leadscrew.check(text, settings=settings, time=True, like="grbl")
        self.assertEqual(check["time"]["motion_seconds"], run["motion_seconds"])
        self.assertEqual(check["grbl"], run["grbl"])
        self.assertNotIn("time", leadscrew.check(text, settings=settings))

    def test_who_waits_is_told_how_far_a_job_is_and_may_end_it(self) -> None:
        text = "G1 X1 F60000\nX0\n" * 20_000
        seen: typing.List[typing.Tuple[int, int]] = []
        with tempfile.TemporaryDirectory() as folder:
            job = pathlib.Path(folder) / "job.nc"
            job.write_text(text)
            for given in (text, job):
                seen.clear()
                report = leadscrew.check(given, progress=lambda *far: seen.append(far))
                self.assertEqual(report, leadscrew.check(given))
                self.assertEqual(seen, sorted(seen))
                self.assertGreater(len(seen), 3)
                self.assertEqual(seen[-1], (len(text), len(text)))
            with self.assertRaises(leadscrew.LeadscrewError):
                leadscrew.run(job.with_name("none.nc"), progress=print)

        def stop(given: int, size: int) -> None:
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            leadscrew.run(text, progress=stop)
        ended = leadscrew.run("G77\n" + text, progress=lambda *far: None)
        self.assertEqual(ended["end"]["line"], 1)

    def test_each_way_a_job_ends_is_told(self) -> None:
        ends = {
            "G1 X1 F600\n": (None, 1),
            "G1 X1 F600\nM2\n": (None, 2),
            "G1 X1 F600\nG77\n": ("error:20", 2),
            "G1 X1 F600\nG38.2 Z-1\n": ("ALARM:5", 2),
            "G1 X1 F600\nG4 P0\n\x18\n": ("a reset", 1),
        }
        for text, (by, line) in ends.items():
            end = leadscrew.run(text)["end"]
            self.assertEqual((end["by"], end["line"]), (by, line), text)
            self.assertTrue(end["words"].startswith(f"stopped by {by}" if by else "done"), end)
        self.assertEqual(leadscrew.run("M0 (turn it)\n")["waits"], [{"line": 1, "why": "the program pauses, turn it: Resume goes on"}])

    def test_settings_come_from_a_file_too(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            listing = pathlib.Path(folder) / "settings.txt"
            listing.write_text("$110=6000\n$120=100\n")
            by_file = leadscrew.run("G1 X60 F600\n", settings=listing)
        self.assertAlmostEqual(by_file["job_seconds"], 6.1, delta=0.02)

    def test_settings_may_be_any_numbers(self) -> None:
        report = leadscrew.check("G0X1\n", settings={5: True, 12: 0.00001, 110: 6e3, 130: 1e3})
        self.assertEqual(report["errors"], [])

    def test_what_cannot_be_used_is_an_exception_with_the_programs_words(self) -> None:
        for job, settings in [(pathlib.Path("/nowhere.nc"), None), ("G0X1\n", {110: -1})]:
            with self.assertRaises(leadscrew.LeadscrewError) as raised:
                leadscrew.check(job, settings=settings)
            self.assertRegex(str(raised.exception), r"nowhere\.nc|\$110")

    def test_the_types_name_the_fields_that_come(self) -> None:
        for answer, kind in [
            (leadscrew.check("G0X1\n"), leadscrew.Check),
            (leadscrew.run("G0X1\n"), leadscrew.Run),
            (leadscrew.profile("G0X1\n"), leadscrew.Profile),
        ]:
            self.assertEqual(set(answer), required(kind), kind.__name__)
            self.assertLessEqual(set(answer), set(typing.get_type_hints(kind)))

    def test_a_name_is_not_taken_for_g_code(self) -> None:
        for name in ["job.nc", "/tmp/part.gcode", str(EXAMPLES / "heart.nc")]:
            with self.assertRaisesRegex(ValueError, r"pathlib\.Path"):
                leadscrew.check(name)
        self.assertEqual(leadscrew.check("G1X1.5F100")["errors"], [])

    def test_a_machine_is_named_by_a_path_or_a_string(self) -> None:
        machine = EXAMPLES / "machines" / "router.toml"
        for name in [machine, str(machine)]:
            self.assertEqual(leadscrew.check("M7\n", name)["errors"], [])
        self.assertIn("mist = true", leadscrew.check("M7\n")["errors"][0]["remedy"])
        self.assertIn("[axes.x]", leadscrew.new_machine("laser"))

    def test_jobs_are_made_of_other_files(self) -> None:
        made = leadscrew.import_job("drill", EXAMPLES / "machines" / "002" / "mounting.drl", depth=-1.8, feed=120, bits=[0.8, 1, 3])
        self.assertEqual(leadscrew.check(made.text, settings={30: 10000})["error_count"], 0, made)
        self.assertTrue(any("holes" in note for note in made.notes), made.notes)
        with self.assertRaisesRegex(leadscrew.LeadscrewError, "G5"):
            leadscrew.import_job("print", "G5 X1\n")
        turned = leadscrew.align("G21 G90\nG0 X10 Y0\n", [((0, 0), (5, 0)), ((10, 0), (5, 10))])
        self.assertIn("X5 Y10", turned.text)

    def test_pictures_steps_per_mm_and_recordings(self) -> None:
        for speed in [False, True]:
            self.assertTrue(leadscrew.picture("G1 X5 F300\n", speed=speed).startswith("<svg"))
        number, value = leadscrew.calibrate("x", 100, 99.2)
        self.assertEqual(number, 100)
        self.assertAlmostEqual(value, 250 * 100 / 99.2, places=3)
        case = sorted((PROJECT / "tests" / "conformance" / "cases").glob("*/*.json"))[0]
        self.assertEqual(leadscrew.replay(case)["name"], json.loads(case.read_text())["name"])

    def test_the_program_is_there_and_the_module_runs_it(self) -> None:
        words = [sys.executable, "-m", "leadscrew", "check", "--json", "-"]
        done = subprocess.run(words, input=b"G0X1\n", capture_output=True, check=True)
        self.assertEqual(json.loads(done.stdout)["errors"], [])


if __name__ == "__main__":
    unittest.main()
