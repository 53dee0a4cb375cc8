"""Draws plots for papers of what `telesplat report` measured: reads the page's data from its input, writes PNG files.

usage: python3 plots.py FOLDER < data.json
  Prints the names of the files, one a line. Exit code: 0 done, 1 matplotlib is missing or something cannot be written.
"""
import json
import os
import sys

HERTZ = (60, 72, 90)
COLOURS = ("#2563c9", "#d9730d", "#14866d", "#b5368a", "#7a55c7", "#0e8aa8", "#8f6a00", "#c43c3c")
SPAN_HUES = {"display frame": 214, "wait for update": 45, "view update": 262, "view": 280, "decode": 178, "insert": 150,
             "pack": 22, "plan": 330, "settle": 55, "sample": 128, "encode": 90, "add chunks": 195, "lease": 240}
SHADES = {"network": ("Blues", 0.35, 0.9), "queue": ("Oranges", 0.3, 0.8), "work": ("Greens", 0.3, 0.9)}


def fail(why):
    print(why, file=sys.stderr)
    sys.exit(1)


try:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.colors import hsv_to_rgb
except ImportError as error:
    fail(f"Python's matplotlib is not installed ({error}); Debian has it as python3-matplotlib")

pyplot.rcParams.update({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "savefig.dpi": 200})


def colour(i):
    return COLOURS[i % len(COLOURS)]


def plain(text):
    """A name as text: matplotlib takes what stands between dollars for mathematics."""
    return text.replace("$", r"\$")


def series(run, name):
    return run["series"].get(name) or []


def over_time(runs, name, label, log=False, lines=False):
    """A figure of one series of all runs; None if no run has it."""
    if not any(series(run, name) for run in runs):
        return None
    figure, axis = pyplot.subplots(figsize=(6.4, 2.8))
    for i, run in enumerate(runs):
        for k, s in enumerate(series(run, name)):
            axis.plot(s["t"], [float("nan") if v is None else v for v in s["v"]], linewidth=0.8, color=colour(i),
                      alpha=1 - 0.25 * min(k, 3), label=plain(run["name"]) if k == 0 else None)
    if lines:
        near = axis.get_ylim()[1] > 60  # too near for a label each
        for hz in HERTZ:
            axis.axhline(1000 / hz, color="#888888", linewidth=0.7, linestyle="--")
            text = f"{hz} Hz" if not near else "60/72/90 Hz" if hz == 72 else ""
            axis.text(1.005, 1000 / hz, text, transform=axis.get_yaxis_transform(), fontsize=7, va="center")
    axis.set_xlabel("time, s")
    axis.set_ylabel(label)
    if log:
        axis.set_yscale("log")
    else:
        axis.set_ylim(bottom=0)
    if len(runs) > 1:
        axis.legend(fontsize=7)
    return figure


def cumulative(runs):
    known = [(i, run) for i, run in enumerate(runs) if run["spreads"].get("inter_frame_ms")]
    if not known:
        return None
    figure, axis = pyplot.subplots(figsize=(4.2, 3.2))
    for i, run in known:
        points = run["spreads"]["inter_frame_ms"]["quantiles"]
        axis.plot([p[0] for p in points], [100 * p[1] for p in points], color=colour(i), label=plain(run["name"]))
    for hz in HERTZ:
        axis.axvline(1000 / hz, color="#888888", linewidth=0.7, linestyle="--")
    axis.set_xscale("log")
    axis.set_xlabel("inter-frame delay, ms (dashed: 90, 72 and 60 Hz)")
    axis.set_ylabel("frames at most as slow, %")
    axis.set_ylim(0, 100)
    if len(runs) > 1:
        axis.legend(fontsize=7)
    return figure


def stage_colours(stages):
    out = []
    for stage in stages:
        alike = [s["key"] for s in stages if s["group"] == stage["group"]]
        name, low, high = SHADES.get(stage["group"], ("Greys", 0.3, 0.8))
        share = alike.index(stage["key"]) / max(1, len(alike) - 1)
        out.append(pyplot.get_cmap(name)(low + share * (high - low)))
    return out


def stacked(runs):
    known = [run for run in runs if run.get("stages") and run["stages"]["t"]]
    if not known:
        return None
    figure, axes = pyplot.subplots(len(known), 1, figsize=(7.2, 3.2 * len(known)), sharex=True, sharey=True,
                                   squeeze=False)
    for axis, run in zip(axes[:, 0], known):
        stages = run["stages"]["stages"]
        values = [[max(0, v or 0) for v in stage["v"]] for stage in stages]
        axis.stackplot(run["stages"]["t"], values, colors=stage_colours(stages), labels=[s["label"] for s in stages])
        axis.set_ylabel("update, ms")
        if len(known) > 1:
            axis.set_title(plain(run["name"]), fontsize=9)
    axes[-1, 0].set_xlabel("time of the request, s")
    axes[0, 0].legend(*(list(reversed(x)) for x in axes[0, 0].get_legend_handles_labels()), fontsize=6,
                      loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def spans(trace):
    """(lane, name, begin, duration) of all events, in ms."""
    begin, out = 0, []
    for lane, name, step, duration in zip(trace["lane"], trace["name"], trace["begin"], trace["duration"]):
        begin += step
        out.append((lane, trace["names"][name], begin / 1e3, duration / 1e3))
    return out


def first_view(trace, events):
    window = trace["windows"][len(trace["windows"]) // 2]
    middle = (window[0] + window[1]) / 2e3
    updates = [e for e in events if e[1] == "view update" and window[0] / 1e3 <= e[2] <= window[1] / 1e3]
    if not updates:
        return middle - 200, middle + 200
    nearest = min(updates, key=lambda e: abs(e[2] - middle))
    length = max(80, min(900, 2.2 * nearest[3]))
    return nearest[2] - 0.12 * length, nearest[2] + 0.88 * length


def span_colour(name):
    """One colour a name, in all timelines, as in the page."""
    hue = SPAN_HUES.get(name, sum(map(ord, name)) * 31 % 360)
    return hsv_to_rgb(((hue % 360) / 360, 0.55, 0.82))


def timeline(run):
    trace = run.get("trace") or {}
    if not trace.get("begin"):
        return None
    events = spans(trace)
    low, high = first_view(trace, events)
    events = [e for e in events if e[2] < high and e[2] + e[3] > low]
    order = ("viewer", "packer", "sampler", "data", "master", "")
    lanes = sorted({e[0] for e in events},
                   key=lambda i: (order.index(trace["lanes"][i]["role"]), trace["lanes"][i]["process"],
                                  ("display", "update", "receive", "epochs", "").index(trace["lanes"][i]["lane"])
                                  if trace["lanes"][i]["lane"] in ("display", "update", "receive", "epochs") else 9, i))
    if not lanes:
        return None
    figure, axis = pyplot.subplots(figsize=(7.2, 0.6 + 0.34 * len(lanes)))
    names = sorted({e[1] for e in events})
    paint = {name: span_colour(name) for name in names}
    for place, lane in enumerate(lanes):
        for name in names:
            bars = [(e[2], max(e[3], (high - low) / 2000)) for e in events if e[0] == lane and e[1] == name]
            axis.broken_barh(bars, (place - 0.38, 0.76), facecolors=paint[name], edgecolor="white", linewidth=0.3)
    axis.set_yticks(range(len(lanes)))
    axis.set_yticklabels([plain(" ".join(filter(None, (trace["lanes"][i]["process"], trace["lanes"][i]["lane"]))))
                          for i in lanes], fontsize=7)
    axis.invert_yaxis()
    axis.set_xlim(low, high)
    axis.set_xlabel("time, ms")
    axis.legend([pyplot.Rectangle((0, 0), 1, 1, color=paint[n]) for n in names], [plain(n) for n in names], fontsize=6,
                loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def main(folder):
    runs = json.load(sys.stdin)["runs"]
    figures = {
        "motion-to-photon": over_time(runs, "motion_to_photon_ms", "motion to photon, ms"),
        "inter-frame-delay": over_time(runs, "inter_frame_ms", "inter-frame delay, ms", lines=True),
        "inter-frame-delay-cdf": cumulative(runs),
        "stages": stacked(runs),
        "update-age": over_time(runs, "update_age_ms", "update age, ms"),
        "view-update-latency": over_time(runs, "latency_ms", "view update latency, ms"),
    }
    for i, run in enumerate(runs, 1):
        figures["timeline" if len(runs) == 1 else f"timeline-{i}"] = timeline(run)
    for name, figure in figures.items():
        if figure is None:
            continue
        try:
            figure.savefig(os.path.join(folder, name + ".png"), bbox_inches="tight")
        except OSError as error:
            fail(f"{folder}: {error}")
        print(name + ".png", flush=True)


main(sys.argv[1])
