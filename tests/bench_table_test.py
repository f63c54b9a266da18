#!/usr/bin/env python3
"""scripts/bench_table.py: from a run's JSON to ratios, bars and verdicts."""
import importlib.util
import pathlib
import sys
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "scripts/bench_table.py"
sys.dont_write_bytecode = True # leave no cache beside the scripts
spec = importlib.util.spec_from_file_location("bench_table", SCRIPT)
bench_table = importlib.util.module_from_spec(spec)
spec.loader.exec_module(bench_table)


def runs(name, cpu_ms, real_ms=None, family=0, **counters):
    """The repetitions of one benchmark and an aggregate, as Google Benchmark writes them."""
    real_ms = real_ms or cpu_ms
    common = {"run_name": name, "time_unit": "ms", "family_index": family, "repetitions": len(cpu_ms), **counters}
    return [{**common, "run_type": "iteration", "cpu_time": c, "real_time": r} for c, r in zip(cpu_ms, real_ms)] + [
        {**common, "run_type": "aggregate", "aggregate_name": "cv", "cpu_time": 0.1, "real_time": 0.1}]


def rows(*benchmarks):
    """Title to rows, of a report of these benchmarks."""
    report = {"benchmarks": [entry for b in benchmarks for entry in b]}
    return dict(bench_table.Table(bench_table.read_results(report)).sections())


def only_row(*benchmarks):
    (section,) = rows(*benchmarks).values()
    (row,) = section
    return row


class BenchTable(unittest.TestCase):
    def test_a_ratio_is_one_of_medians(self):
        row = only_row(runs("primary/body/bare/process_time", [9, 500, 8]),
                       runs("primary/body/ids/process_time", [10, 1, 700]))
        self.assertAlmostEqual(row.figures[0].value, 0.9)
        self.assertEqual(bench_table.verdict(row), "met")

    def test_below_the_bar_is_not_met(self):
        row = only_row(runs("primary/body/bare", [8.9]), runs("primary/body/ids", [10]))
        self.assertEqual(bench_table.verdict(row), "NOT met")

    def test_without_a_bar_there_is_no_verdict(self):
        row = only_row(runs("primary/balls/bare", [1]), runs("primary/balls/ids", [10]))
        self.assertEqual((bench_table.verdict(row), bench_table.wanted_text(row)), ("", ""))

    def test_without_its_yardstick_a_row_is_left_out(self):
        self.assertEqual(rows(runs("primary/body/ids", [10])), {})

    def test_rows_come_in_the_order_of_registration(self):
        table = rows(runs("primary/worm/bare", [1], family=2), runs("primary/worm/ids", [1], family=3),
                     runs("primary/body/bare", [1], family=0), runs("primary/body/ids", [1], family=1))
        self.assertEqual([row.what for row in next(iter(table.values()))], ["body", "worm"])

    def test_speed_alone_does_not_meet_a_bar_of_quality(self):
        def refined(**counters):
            good = {"dB": 50, "wrong_ids_%": 0, "missed": 0, "traced_%": 5}
            return only_row(runs("refine/spheres/1080p/1/full", [50]),
                            runs("refine/spheres/1080p/1/adaptive", [10], **{**good, **counters}))
        self.assertEqual(refined().figures[0].value, 5)
        self.assertEqual(bench_table.verdict(refined()), "met")
        for bad in ({"dB": 44}, {"wrong_ids_%": 0.002}, {"missed": 1}):
            self.assertEqual(bench_table.verdict(refined(**bad)), "NOT met", bad)

    def test_antialiasing_is_the_cheapest_of_at_least_the_quality(self):
        row = only_row(runs("antialias/body/uniform:16", [100], dB=50),
                       runs("antialias/body/edges:8", [10], dB=49), runs("antialias/body/edges:16", [30], dB=51),
                       runs("antialias/body/edges:32", [40], dB=53))
        self.assertEqual(row.figures[0].value, 0.3)
        self.assertEqual(bench_table.verdict(row), "met")

    def test_antialiasing_is_by_any_refinement(self):
        row = only_row(runs("antialias/body/uniform:16", [100], dB=50), runs("antialias/body/edges:16", [30], dB=51),
                       runs("antialias/body/adaptive:32", [20], dB=50))
        self.assertAlmostEqual(row.figures[0].value, 0.2)

    def test_antialiasing_that_is_never_as_good_is_not_met(self):
        row = only_row(runs("antialias/body/uniform:16", [100], dB=50), runs("antialias/body/edges:8", [10], dB=49))
        self.assertEqual(bench_table.verdict(row), "NOT met")

    def test_contours_are_judged_by_the_number_of_targets(self):
        def found(count, paper_ms, **counters):
            good = {"complete": 1, "missed": 0, "false": 0, "pixels": 100}
            return only_row(runs(f"contours/body/{count}/paper_flat", [paper_ms]),
                            runs(f"contours/body/{count}/exact", [1], **{**good, **counters}))
        self.assertEqual(bench_table.verdict(found(100, 13)), "met")
        self.assertEqual(bench_table.verdict(found(1, 13)), "NOT met")
        self.assertEqual(bench_table.verdict(found(100, 13, missed=1, complete=0.99)), "NOT met")

    def test_what_is_wanted_is_written_with_its_unit(self):
        counters = {"dB": 50, "wrong_ids_%": 0, "missed": 0, "traced_%": 5}
        row = only_row(runs("refine/spheres/1080p/1/full", [50]),
                       runs("refine/spheres/1080p/1/adaptive", [10], **counters))
        self.assertEqual(bench_table.wanted_text(row),
                         ">= 4x (aim 6), >= 45 dB, <= 0.001 % wrong ids, 0 parts missed")

    def test_jobs_are_judged_by_wall_time(self):
        counters = {"cpu_s": 2, "peak_MB": 200, "triangles": 5e5, "bytes_per_triangle": 300, "load_s": 0.25}
        table = rows(runs("job/assembly/reveal/process_time/manual_time", [5000], [1100], **counters))
        self.assertEqual([bench_table.verdict(row) for row in table["Whole jobs, file to PNG"]], ["met"])
        (stages,) = table["Where the wall time of a job goes"]
        self.assertEqual([figure.number + figure.unit for figure in stages.figures], ["load 0.25 s"])

    def test_threads_are_judged_by_wall_time(self):
        row = only_row(runs("threads/body/frame/1/process_time/real_time", [10], [10]),
                       runs("threads/body/frame/2/process_time/real_time", [11], [5]))
        self.assertEqual(row.figures[0].value, 2)

    def test_a_benchmark_that_failed_is_told(self):
        failed = [{"run_name": "job/assembly/reveal", "run_type": "iteration", "error_occurred": True,
                   "error_message": "the program ended with status 256"}]
        row = only_row(failed)
        self.assertEqual(row.what, "job/assembly/reveal")
        self.assertEqual(bench_table.verdict(row), "FAILED")

    def test_both_forms_hold_every_cell(self):
        sections = [("Title", [only_row(runs("primary/body/bare", [9]), runs("primary/body/ids", [10]))])]
        markdown = "\n".join(bench_table.lines_of(sections, True))
        self.assertIn("### Title", markdown)
        self.assertIn("| body | 0.90 | >= 0.9 | met |", markdown)
        self.assertRegex("\n".join(bench_table.lines_of(sections, False)), r"body +0\.90 +>= 0\.9 +met")


if __name__ == "__main__":
    unittest.main()
