"""What tools/lab/soak measures of a session, and what it demands."""
import csv
import os
import statistics

GROWTH = 0.05  # allowed share of memory growth after the warm-up
SAMPLE_S = 3  # from one sample of all processes to the next
SLACK_MB = 4  # smaller growth is that of single buffers
MOST_GAP_MS = 500  # between two displayed frames
OUTAGE_S = (3, 8)  # before and after a master's death: the record lacks rows that the master had not written


def value(status, name, key):
    for p in status.get("processes", []):
        if p["name"] == name and p["alive"]:
            return p.get("values", {}).get(key, 0)
    return 0


def rate(status, name, key):
    for p in status.get("processes", []):
        if p["name"] == name and p["alive"]:
            return p.get("rates", {}).get(key, "")
    return ""


def of_process(pid):
    """Resident MB, descriptors, threads, those of its children included (telesplat-import); None: it is gone."""
    try:
        with open(f"/proc/{pid}/status") as file:
            fields = dict(line.split(":", 1) for line in file if ":" in line)
        mb = int(fields["VmRSS"].split()[0]) / 1024
        return round(mb, 2), len(os.listdir(f"/proc/{pid}/fd")), int(fields["Threads"])
    except (OSError, KeyError, ValueError):
        return None


def left_behind(folder):
    """(pid, command line) of processes that have to do with the folder."""
    out = []
    for entry in os.listdir("/proc"):
        if not entry.isdigit() or int(entry) == os.getpid():
            continue
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as file:
                command = file.read().replace(b"\0", b" ").decode(errors="replace")
            with open(f"/proc/{entry}/stat") as file:
                zombie = file.read().rsplit(")", 1)[1].split()[0] == "Z"
        except (OSError, IndexError):
            continue
        if not zombie and "telesplat" in command and folder in command and "tools/lab/soak" not in command:
            out.append((int(entry), command.strip()))
    return out


def rows_of(path):
    try:
        with open(path, newline="", errors="replace") as file:
            return [r for r in csv.DictReader(file) if None not in r and None not in r.values()]
    except OSError:
        return []


def windows(samples, name, column, length_s):
    """Two lists of a figure, after the warm-up: of the first third of what is left, and of the last."""
    warm_s = length_s / 3
    third = (length_s - warm_s) / 3
    of = [(s[0], s[column]) for s in samples if s[1] == name and not s[3]]
    return ([v for t, v in of if warm_s <= t < warm_s + third], [v for t, v in of if t >= length_s - third])


def guests_at(samples):
    """A function: how many guests were there at a time, as far as the samples around it say."""
    times = sorted((s[0], s[1]) for s in samples if s[3])
    return lambda t: len({name for at, name in times if abs(at - t) < SAMPLE_S / 2})


def serves_guests(name):
    """A sampler and a data server hold what one lease or one chunk needs, however many viewers there are."""
    return not name.startswith(("sampler", "data"))


def memory(samples, name, length_s):
    """(MB of a process in the first half of the time after the warm-up, in the second, with how many guests). Each
    guest takes memory, while it is there, of those who serve it: so times with equally many of them are compared, with
    that number of which both halves have most. Of others all times are, and the number is None."""
    warm_s = length_s / 3
    half_s = (warm_s + length_s) / 2
    guests = guests_at(samples) if serves_guests(name) else lambda t: None
    halves = {}
    for s in samples:
        if s[1] == name and not s[3] and s[0] >= warm_s:
            halves.setdefault(guests(s[0]), ([], []))[s[0] >= half_s].append(s[4])
    number = max(halves, key=lambda n: (min(map(len, halves[n])), -(n or 0)), default=0)
    return *halves.get(number, ([], [])), number


def steadiness(soak):
    """Rows (what, measured, demanded, ok) of memory, descriptors and threads."""
    length_s = soak.now()
    names = sorted({s[1] for s in soak.samples if not s[3]})
    out = []
    for name in names:
        # A killed process begins again with little memory: compare the most that it had, not the median. A master goes
        # on with what the one before it recorded.
        lives = len({s[2] for s in soak.samples if s[1] == name and not s[3]})
        begins_anew = lives > 1 and name != "master"
        first, last, guests = memory(soak.samples, name, length_s)
        if len(first) >= 5 and len(last) >= 5:
            a, b = (max(first), max(last)) if begins_anew else (statistics.median(first), statistics.median(last))
            what = f"most memory of {name}, in {lives} lives" if begins_anew else f"memory of {name}"
            what += "" if guests is None else f", guests: {guests}"
            out.append((what, f"{a:.1f} -> {b:.1f} MB ({100 * (b / a - 1):+.1f} %)",
                        f"at most +{100 * GROWTH:.0f} % or {SLACK_MB} MB", b - a <= max(GROWTH * a, SLACK_MB)))
        for what, column in (("descriptors", 5), ("threads", 6)):
            first, last = windows(soak.samples, name, column, length_s)
            if len(first) < 5 or len(last) < 5:
                continue
            a, b = statistics.median(first), statistics.median(last)
            # Guests come and go, and each has up to some connections.
            slack = 0 if what == "threads" else 12
            out.append((f"{what} of {name}", f"{a:.0f} -> {b:.0f}", "as many" if slack == 0 else
                        f"at most {slack} more, of guests' connections", b - a <= slack))
    return out


def deaths_of_masters(soak):
    return [t for t, what in soak.happenings if what == "kill -9 of master"]


def updates(soak):
    """Of every viewer each request is answered once at most; of the one that waits for each, exactly once."""
    rows = rows_of(os.path.join(soak.run_folder, "updates.csv"))
    lives, doubled, lost, allowed = {}, 0, 0, 0
    for row in rows:
        lives.setdefault(row["viewer"], []).append((int(row["request"]), float(row["requested_s"])))
    deaths = deaths_of_masters(soak)
    # The run's clock begins a little after ours.
    near = lambda t: any(-OUTAGE_S[0] - 5 < t - d < OUTAGE_S[1] for d in deaths)
    for viewer, asked in lives.items():
        requests = [r for r, _ in asked]
        doubled += len(requests) - len(set(requests))
        if viewer != "steady":
            continue
        asked.sort()
        for (a, at_s), (b, then_s) in zip(asked, asked[1:]):
            if b > a + 1 and (near(at_s) or near(then_s)):
                allowed += b - a - 1
            elif b > a + 1:
                lost += b - a - 1
    told = f"{lost} lost, {doubled} doubled of {len(rows)}"
    if allowed:
        told += f" ({allowed} rows are missing around the master's deaths)"
    return "view updates", told, "0 lost, 0 doubled", lost == 0 and doubled == 0 and len(rows) > 0


def display(soak):
    rows = rows_of(os.path.join(soak.run_folder, "frames.csv"))
    gaps = [float(r["inter_frame_ms"]) for r in rows if r["viewer"] == "viewer-1" and float(r["t_s"]) > 5]
    told = [s[8] for s in soak.samples if s[1] == "viewer-1" and s[8] != ""]
    # The viewer's own figure has frames that the record lacks; its first seconds, in which all starts, do not count.
    grown = [b for a, b in zip(told[3:], told[4:]) if b > a]
    longest = max(gaps + grown, default=0)
    return ("display: longest time between two frames", f"{longest:.0f} ms of {len(gaps)} frames",
            f"below {MOST_GAP_MS} ms", 0 < longest < MOST_GAP_MS)


def judge(soak):
    """{scene, rows, problems, ok, ...} of a soak that is over."""
    rows = [display(soak), updates(soak)]
    if soak.scene.points:
        compared, differ = sum(d[2] for d in soak.digests), sum(d[3] for d in soak.digests)
        rows.append(("digests of replica and packer", f"{compared:.0f} compared, {differ:.0f} differ",
                     "each viewer's every minute; 0 differ", compared > 0 and differ == 0))
    rows += steadiness(soak)
    rows.append(("problems", f"{len(soak.problems)}", "0", not soak.problems))
    return {"scene": soak.scene.name, "minutes": soak.now() / 60, "happenings": len(soak.happenings), "rows": rows,
            "problems": soak.problems, "ok": all(r[3] for r in rows), "folder": soak.folder, "samples": soak.samples,
            "events": soak.happenings}
