#!/usr/bin/env python3
"""Prints what a run of porthole_bench shows, as ratios beside what is wanted of them.

    scripts/bench_table.py FILE.json [--markdown]

FILE is what --benchmark_out wrote. Times are medians over the repetitions: of all threads' CPU time where threads
do not matter, of wall time for jobs, instances and threads. A row whose yardstick was not run is left out.
"""

import argparse
import collections
import json
import operator
import re
import statistics
import sys

# One benchmark: medians in seconds and the medians of its counters; `error` if it failed.
Result = collections.namedtuple("Result", "cpu wall counters error", defaults=({}, None))

# One figure of a row: its value as text, its unit. `wanted` is (">=" or "<=", bar) for the value; `aim` is beyond
# the bar and only told.
Figure = collections.namedtuple("Figure", "number unit value wanted aim", defaults=("", None, None, None))

Row = collections.namedtuple("Row", "what figures failed", defaults=(False,))

COMPARE = {">=": operator.ge, "<=": operator.le}
NOT_COUNTERS = {"family_index", "per_family_instance_index", "repetitions", "repetition_index", "threads", "iterations",
                "real_time", "cpu_time"}


def read_results(report):
    """Name, without Google Benchmark's endings, to Result."""
    runs = collections.defaultdict(list)
    for entry in sorted(report["benchmarks"], key=lambda e: e.get("family_index", 0)):
        if entry.get("run_type") != "aggregate":
            name = re.sub(r"(/(process_time|real_time|manual_time|repeats:\d+))+$", "", entry["run_name"])
            runs[name].append(entry)
    results = {}
    for name, entries in runs.items():
        failed = [e for e in entries if e.get("error_occurred")]
        if failed:
            results[name] = Result(None, None, {}, failed[0].get("error_message", "failed"))
            continue
        unit = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1}[entries[0]["time_unit"]]
        median = lambda key: statistics.median(e[key] for e in entries)
        counters = {key: median(key) for key, value in entries[0].items()
                    if key not in NOT_COUNTERS and isinstance(value, (int, float)) and not isinstance(value, bool)}
        results[name] = Result(unit * median("cpu_time"), unit * median("real_time"), counters)
    return results


def times(value, wanted=None, aim=None):
    return Figure(f"{value:.3g}" if value < 100 else f"{value:.0f}", "x", value, wanted, aim)


def share(value, wanted=None, aim=None):
    return Figure(f"{value:.2f}", "", value, wanted, aim)


def counter(result, name, digits, unit, wanted=None):
    return Figure(f"{result.counters[name]:.{digits}f}", unit, result.counters[name], wanted)


class Table:
    """The rows of each section, from whatever was run."""

    def __init__(self, results):
        self.results = results

    def named(self, pattern):
        """Matches of the names of benchmarks that did not fail, in the order in which they ran."""
        matches = (re.fullmatch(pattern, name) for name in self.results)
        return [m for m in matches if m and not self.results[m[0]].error]

    def get(self, name):
        result = self.results.get(name)
        return result if result and not result.error else None

    def primary(self):
        for m in self.named(r"primary/(\w+)/ids"):
            if bare := self.get(f"primary/{m[1]}/bare"):
                wanted = (">=", 0.9) if m[1] in ("assembly", "body", "worm") else None
                yield Row(m[1], [share(bare.cpu / self.get(m[0]).cpu, wanted)])

    def refine(self):
        for m in self.named(r"refine/(\w+)/(\w+)/(\d+)/adaptive"):
            scene, size, samples = m[1], m[2], int(m[3])
            found, full = self.get(m[0]), self.get(f"refine/{scene}/{size}/{samples}/full")
            if not full:
                continue
            wanted = aim = None
            if (size, samples) == ("1080p", 1):
                wanted, aim = {"spheres": ((">=", 4), 6), "assembly": ((">=", 1.2), 1.5)}.get(
                    scene, ((">=", 0.95), None))
            elif (size, scene, samples) == ("4K", "assembly", 1):
                aim = 2
            yield Row(f"{scene}, {size}, {samples} sample{'s' if samples > 1 else ''}", [
                times(full.cpu / found.cpu, wanted, aim),
                counter(found, "dB", 1, " dB", (">=", 45)),
                counter(found, "wrong_ids_%", 4, " % wrong ids", ("<=", 0.001)),
                counter(found, "missed", 0, " parts missed", ("<=", 0)),
                counter(found, "traced_%", 0, " % traced"),
            ])

    def antialias(self):
        for m in self.named(r"antialias/(\w+)/uniform:16"):
            uniform = self.get(m[0])
            edges = [(self.get(e[0]), f"{e[2]} samples" + (", adaptive" if e[1] == "adaptive" else ""))
                     for e in self.named(rf"antialias/{m[1]}/(edges|adaptive):(\d+)")]
            good = [e for e in edges if e[0].counters["dB"] >= uniform.counters["dB"]]
            if good:
                best, samples = min(good, key=lambda e: e[0].cpu)
                note = f"{best.counters['dB']:.1f} dB with {samples}, uniform {uniform.counters['dB']:.1f} dB"
                yield Row(m[1], [share(best.cpu / uniform.cpu, ("<=", 0.35)), Figure(note)])
            elif edges:
                best, samples = max(edges, key=lambda e: e[0].counters["dB"])
                note = (f"at most {best.counters['dB']:.1f} dB, with {samples}, in "
                        f"{best.cpu / uniform.cpu:.2f} of the time; uniform {uniform.counters['dB']:.1f} dB")
                yield Row(m[1], [Figure("none is as good", "", float("inf"), ("<=", 0.35)), Figure(note)])

    def contours(self):
        bars = {"exact": {"1": 80, "10": 12, "100": 3}, "fast": {"1": 100, "10": 20, "100": 4}}
        for m in self.named(r"contours/(\w+)/(\d+)/(exact|fast)"):
            scene, count, method = m.groups()
            found = self.get(m[0])
            flat, instances = (self.get(f"contours/{scene}/{count}/{p}") for p in ("paper_flat", "paper"))
            if not flat:
                continue
            exact = method == "exact"
            figures = [times(flat.cpu / found.cpu, (">=", bars[method][count])),
                       counter(found, "missed", 0, " px missed", ("<=", 0) if exact else None),
                       counter(found, "false", 0, " px false", ("<=", 0) if exact else None),
                       Figure(f"of {found.counters['pixels']:.0f}")]
            if instances:
                figures.append(Figure(f"{instances.cpu / found.cpu:.3g}", "x against masked instances"))
            yield Row(f"{scene}, {count} target{'s' if count != '1' else ''}, {method}", figures)

    def cut(self):
        looks = (("", ""), ("_one_sample", ", both with one sample a pixel and no lines"))
        for thing, yardstick, text, bar in (
            ("cutaway", "absent", "a cutaway, against the removed geometry truly absent", 1.15),
            ("hole_capped", "hole_uncapped", "the hole with caps, against without", 1.1),
        ):
            for suffix, look in looks:
                for m in self.named(rf"cut/(\w+)/{thing}{suffix}"):
                    if by := self.get(f"cut/{m[1]}/{yardstick}{suffix}"):
                        yield Row(f"{m[1]}: {text}{look}", [times(self.get(m[0]).cpu / by.cpu, ("<=", bar))])

    def jobs(self):
        bars = {"assembly": (("<=", 1.2), 0.8), "assembly10x": (("<=", 6), 4)}
        for m in self.named(r"job/(\w+)/(\w+)"):
            job = self.get(m[0])
            wanted, aim = bars.get(m[1], (None, None)) if m[2] == "reveal" else (None, None)
            memory = ("<=", 100) if m[1] in ("assembly10x", "cortex") else None
            yield Row(f"{m[1]}, {m[2]}, {job.counters['triangles'] / 1e3:,.0f} thousand triangles", [
                Figure(f"{job.wall:.2f}", " s", job.wall, wanted, aim),
                counter(job, "cpu_s", 2, " s CPU"),
                counter(job, "peak_MB", 0, " MB"),
                counter(job, "bytes_per_triangle", 0, " bytes a triangle", memory),
            ])

    def job_stages(self):
        for m in self.named(r"job/(\w+)/(\w+)"):
            counters = self.get(m[0]).counters
            yield Row(f"{m[1]}, {m[2]}", [Figure(f"{stage} {counters[stage + '_s']:.2f}", " s")
                                          for stage in ("load", "build", "plan", "render", "write")
                                          if stage + "_s" in counters])

    def instances(self):
        one = self.get("instances/1/frame")
        for name, what, wanted in (("frame", "a frame as the command line draws it", ("<=", 1.5)),
                                   ("rough_frame", "one sample a pixel", ("<=", 1.5)),
                                   ("direct_frame", "one sample a pixel, no ambient occlusion", None)):
            if frame := self.get(f"instances/1000/{name}"):
                figures = [Figure(f"{frame.wall:.2f}", " s", frame.wall, wanted)]
                if one and name == "frame":
                    figures.append(Figure(f"{frame.wall / one.wall:.2g}", "x a single placement"))
                yield Row(what, figures)

    def threads(self):
        for m in self.named(r"threads/(\w+)/(\w+)/2"):
            if one := self.get(f"threads/{m[1]}/{m[2]}/1"):
                yield Row(f"{m[1]}, {m[2]}", [times(one.wall / self.get(m[0]).wall, None, 1.9)])

    def failed(self):
        for name, result in self.results.items():
            if result.error:
                yield Row(name, [Figure(result.error)], True)

    def sections(self):
        """(title, rows) of everything that was run."""
        named = (
            ("Nearest hits: rate, against a bare Embree loop", self.primary),
            ("Pictures with --refine adaptive: speed, against every pixel traced", self.refine),
            ("Antialiasing: time of a picture as good as 16 uniform samples, against theirs", self.antialias),
            ("Contours: speed, against the paper's method with a ray mask over everything", self.contours),
            ("The cut: time", self.cut),
            ("Whole jobs, file to PNG", self.jobs),
            ("Where the wall time of a job goes", self.job_stages),
            ("A thousand million instanced triangles", self.instances),
            ("Two threads: speed, against one", self.threads),
            ("Failed", self.failed),
        )
        return [(title, rows) for title, section in named if (rows := list(section()))]


def wanted_text(row):
    parts = []
    for figure in row.figures:
        if figure.wanted:
            operation, bar = figure.wanted
            parts.append(f"{operation} {bar:g}{figure.unit}" if bar else f"0{figure.unit}")
        if figure.aim:
            aim = f"(aim {figure.aim:g})"
            parts[-1:] = [f"{parts[-1]} {aim}"] if figure.wanted else [aim]
    return ", ".join(parts)


def verdict(row):
    """What became of what is wanted; nothing where nothing is."""
    if row.failed:
        return "FAILED"
    judged = [COMPARE[f.wanted[0]](f.value, f.wanted[1]) for f in row.figures if f.wanted]
    return ("met" if all(judged) else "NOT met") if judged else ""


def lines_of(sections, markdown):
    for title, rows in sections:
        cells = [[r.what, ", ".join(f.number + f.unit for f in r.figures), wanted_text(r), verdict(r)] for r in rows]
        header = ["", "measured", "wanted", ""]
        if markdown:
            yield from ("", f"### {title}", "", "| " + " | ".join(header) + " |", "|---" * len(header) + "|")
            yield from ("| " + " | ".join(c) + " |" for c in cells)
        else:
            widths = [max(len(c[i]) for c in [header] + cells) for i in range(len(header))]
            yield from ("", title)
            for c in cells:
                yield "  " + "  ".join(text.ljust(width) for text, width in zip(c, widths)).rstrip()


def main():
    parser = argparse.ArgumentParser(description="Prints the ratios that a run of porthole_bench shows.")
    parser.add_argument("file")
    parser.add_argument("--markdown", action="store_true", help="tables for the documentation")
    arguments = parser.parse_args()
    with open(arguments.file, encoding="utf-8") as file:
        text = file.read()
    if not text:
        print("bench_table: no benchmark of that name was run", file=sys.stderr)
        return 1
    report = json.loads(text)
    sections = Table(read_results(report)).sections()
    context = report.get("context", {})
    load = ", ".join(f"{x:.1f}" for x in context.get("load_avg", []))
    print(f"{context.get('date', '?')}, {context.get('num_cpus', '?')} processors, load {load or '?'}")
    print("\n".join(lines_of(sections, arguments.markdown)))
    verdicts = [verdict(row) for _, rows in sections for row in rows]
    failed = verdicts.count("FAILED")
    print(f"\n{verdicts.count('met')} met, {verdicts.count('NOT met')} not met" + (f", {failed} FAILED" if failed else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
