"""What tools/lab/soak leaves: a picture, a page, a verdict."""
import base64
import html
import json
import os
import sys


def draw(verdict, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(4, 1, figsize=(11, 11), sharex=True)
    by_name = {}
    for t, name, pid, guest, mb, descriptors, threads, fps, gap in verdict["samples"]:
        if not guest:
            by_name.setdefault(name, []).append((t / 60, mb, descriptors, threads, fps))
    for number, (name, rows) in enumerate(sorted(by_name.items())):
        for axis, column in zip(axes, (1, 2, 3)):
            axis.plot([r[0] for r in rows], [r[column] for r in rows], color=f"C{number}", label=name, linewidth=1)
    frames = [(r[0], r[4]) for r in by_name.get("viewer-1", []) if r[4] != ""]
    axes[3].plot([f[0] for f in frames], [f[1] for f in frames], color="C0", linewidth=1)
    titles = ("resident memory, MB", "descriptors", "threads", "frames a second of viewer-1; lines: kill -9")
    for axis, title in zip(axes, titles):
        axis.set_title(title, fontsize=10)
        axis.grid(alpha=0.3)
        axis.set_ylim(bottom=0)
    for t, what in verdict["events"]:
        if what.startswith("kill"):
            axes[3].axvline(t / 60, color="C3" if what.endswith("master") else "0.75", linewidth=0.6)
    axes[0].legend(fontsize=8, ncol=4)
    axes[3].set_xlabel("minutes")
    figure.suptitle(f"{verdict['scene']}: {verdict['minutes']:.1f} minutes, {verdict['happenings']} happenings")
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    pyplot.close(figure)


def table(verdict):
    mark = lambda ok: "ok" if ok else "FAILED"
    return [(what, measured, demanded, mark(ok)) for what, measured, demanded, ok in verdict["rows"]]


def text(verdict):
    rows = table(verdict)
    widths = [max(len(r[c]) for r in rows) for c in range(4)]
    lines = [f"{verdict['scene']}, {verdict['minutes']:.1f} minutes, {verdict['happenings']} happenings"]
    lines += ["  " + "  ".join(cell.ljust(w) for cell, w in zip(r, widths)).rstrip() for r in rows]
    return "\n".join(lines + ["  " + p for p in verdict["problems"]])


def report(options, verdicts, interrupted):
    """Writes it all. Returns the exit code."""
    ok = bool(verdicts) and all(v["ok"] for v in verdicts)
    parts = []
    for v in verdicts:
        picture = os.path.join(v["folder"], "soak.png")
        try:
            draw(v, picture)
            with open(picture, "rb") as file:
                shown = f'<img src="data:image/png;base64,{base64.b64encode(file.read()).decode()}" width="100%">'
        except ImportError:
            shown = "<p>No picture: python3-matplotlib is not installed (tools/setup --developer installs it).</p>"
            print("soak: no picture: tools/setup --developer installs python3-matplotlib", file=sys.stderr)
        rows = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in r) + "</tr>" for r in table(v))
        events = "\n".join(f"{t:8.1f} s  {what}" for t, what in v["events"])
        problems = "".join(f"<li>{html.escape(p)}</li>" for p in v["problems"])
        parts.append(f"<h2>{html.escape(v['scene'])}</h2><table><tr><th>measure</th><th>measured</th><th>demanded</th>"
                     f"<th></th></tr>{rows}</table><ul>{problems}</ul>{shown}<details><summary>What happened</summary>"
                     f"<pre>{html.escape(events)}</pre></details>")
    head = ("<!doctype html><meta charset=utf-8><title>Soak</title><style>body{font:15px sans-serif;max-width:60em;"
            "margin:2em auto}td,th{text-align:left;padding:.15em 1em .15em 0;border-bottom:1px solid #ccc}</style>")
    said = "all is as it was" if ok else "something is not as it was"
    told = (f"<h1>Soak: {said}</h1><p>Seed {options.seed}. All processes ran on one machine, over its loopback; heads "
            "followed recorded circles; what happened was drawn from the seed.</p>")
    with open(os.path.join(options.out, "soak.html"), "w") as file:
        file.write(head + told + "".join(parts))
    with open(os.path.join(options.out, "verdict.json"), "w") as file:
        keep = ("scene", "minutes", "happenings", "problems", "ok")
        json.dump({"seed": options.seed, "ok": ok, "scenes": [
            {**{k: v[k] for k in keep},
             "measures": [{"what": r[0], "measured": r[1], "demanded": r[2], "ok": r[3]} for r in v["rows"]]}
            for v in verdicts]}, file, indent=2)
    for v in verdicts:
        print(text(v))
    print(f"soak: {said}{', but it was interrupted' if interrupted else ''}; {options.out}/soak.html")
    return 130 if interrupted else 0 if ok else 1
