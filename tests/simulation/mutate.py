#!/usr/bin/env python3
"""Measures what the simulation finds: mutates lines of the cores and lets it look for each mutation.

  python3 tests/simulation/mutate.py --tree DIR [--count 60] [--draw 1] [--rounds 50,200,1000]

Draws lines by seed from all lines of the cores (CORES) that can be mutated, and a mutation of each: a check left out,
`<` for `<=` and so on, `&&` for `||`, a negation dropped, a call left out, a constant + 1, another value returned.
Lines that only log or measure are not drawn (MEASURES): no session could tell.
All mutations are compiled into one telesplat-lab, in a worktree that has build/release; TELESPLAT_MUTANT chooses one
of them. One that does not compile, or overlaps another, is replaced by the next draw. Looks at the figures of the
standard walks first, those of real meshes aside, as tests/simulation/figures_test.cpp does, then at seeds: each must
hold and have its digest. Seeds that fail without any mutation do not count. Prints a table: line, mutation, the check
that found it ("digest" where nothing but a digest did), and where.
"""
import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

MASTER, POINTS, SLICES = 'services/master/', 'services/packer/points/', 'services/packer/slices/'
SAMPLER, VIEWER = 'services/sampler/', 'client/viewer/'
CORES = [
    *(MASTER + n for n in ('master_core', 'views', 'outbox', 'orders', 'idle', 'peers', 'session', 'tiles/*', 'slabs/*',
                           'gate/*')),
    *(POINTS + n for n in ('point_packing', 'packer_core', 'event_log', 'frame_book', 'block_gatherer', 'state_answers',
                           'link_meter', 'obsolescence', 'plan/planner')),
    SLICES + 'gatherer', SLICES + 'slice_packing', 'services/packer/packer_service',
    *(SAMPLER + n for n in ('sampler_service', 'tiles/work', 'mesh/tiles', 'volume/work', 'epoch_book', 'retry_clock')),
    *(VIEWER + n for n in ('viewer_worker', 'points/event_sequencer', 'points/receiver', 'points/received_points',
                           'points/epoch_switch', 'points/update_batches', 'coupling/view_requester',
                           'slices/received_slices', 'slices/cache', 'succession')),
    'common/net/master_link',
]
# Lines and functions that only log, measure, or say what went wrong.
MEASURES = re.compile(r'log::|\bspans?_?\b|figures|status\b|Status|counters?|CHECK|static_assert|Error\{|fmt::|trace|'
                      r'reserve\(|#include|\bcase\b|\boperator|rejected|measure|values\[|\blog_\{')
SILENT_FUNCTIONS = re.compile(r'status|figures|text|columns|row|describe|measure|trace|values')
NUMBERS = {'double', 'float', 'int', 'size_t', 'uint32_t', 'uint64_t', 'int64_t'}
COMPARED = {' < ': ' <= ', ' <= ': ' < ', ' > ': ' >= ', ' >= ': ' > ', ' == ': ' != ', ' != ': ' == '}
NOBODY = 65534
SCRATCH = Path(tempfile.mkdtemp(prefix='telesplat-mutate-'))
MOST_CPU_S = 40  # that one session may take; it takes 1
ASSIGNED = (' = ', ' += ', ' -= ', ' |= ', ' &= ', ' ? ', ' : ')
HEADER = '''#pragma once
#include <fcntl.h>
#include <unistd.h>
#include <cstdlib>
inline bool telesplat_mutant(int n) {
  static const int which = [] {
    const char* text = std::getenv("TELESPLAT_MUTANT");
    return text ? std::atoi(text) : -1;
  }();
  static bool reached = false;
  if (n == which && !reached) {
    reached = true;
    if (const char* path = std::getenv("TELESPLAT_REACHED")) close(open(path, O_CREAT | O_WRONLY, 0600));
  }
  return n == which;
}
'''


@dataclass
class Mutation:
    path: str
    line: int
    what: str
    begin: int  # characters of the file that it replaces
    end: int
    text: str  # with @ for its call of telesplat_mutant()
    number: int = -1
    failures: list = field(default_factory=list)
    seeds: int = 0
    reached: bool = False


def mask(text):
    """The text with comments and literals of characters blanked, as long as before."""
    pattern = r'//[^\n]*|"(?:\\.|[^"\\\n])*"|(?<![0-9])\'(?:\\.|[^\'\\\n])\''
    return re.sub(pattern, lambda m: m.group()[0] + 'x' * (len(m.group()) - 2) + m.group()[-1]
                  if m.group()[0] != '/' else '~' * len(m.group()), text)


def span(masked, at, stops):
    """Where the expression around `at` begins and ends: at a bracket that it does not open, or at one of stops."""
    flat = masked.replace('\n', ' ')
    left = right = at
    depth = 0
    while left > 0:
        c = flat[left - 1]
        if depth == 0 and (c in '([{;,' or any(flat.endswith(s, 0, left) for s in (*stops, 'return '))):
            break
        depth += (c in ')]}') - (c in '([{')
        left -= 1
    depth = 0
    while right < len(flat):
        c = flat[right]
        if depth == 0 and (c in ')]};,' or any(flat.startswith(s, right) for s in stops)):
            break
        depth += (c in '([{') - (c in ')]}')
        right += 1
    while flat[left].isspace():
        left += 1
    while flat[right - 1].isspace():
        right -= 1
    return left, right


def closing(masked, at):
    depth = 0
    for n in range(at, len(masked)):
        depth += (masked[n] in '([{') - (masked[n] in ')]}')
        if depth == 0:
            return n
    return len(masked) - 1


def mutations_of(path, text):
    masked = mask(text)
    lines = masked.split('\n')
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line) + 1)
    out, function, returns = [], '', ''

    def add(n, what, begin, end, new):
        if '~' not in masked[begin:end]:
            out.append(Mutation(path, n + 1, what, begin, end, new))

    for n, line in enumerate(lines):
        head = re.match(r'(?:  )?(?:static |inline )*([\w:<>&*, ]+?)[ &*]+((?:\w+::)*~?\w+)\([^;]*$', line)
        if head and not re.match(r'\s*(return|if|for|while|else|switch)\b', line):
            returns, function = head.group(1).strip(), head.group(2)
        if not line.strip() or MEASURES.search(line) or SILENT_FUNCTIONS.search(function.split('::')[-1]):
            continue
        if re.match(r'(#|using|namespace|template|struct|class|enum|friend)', line.strip()):
            continue
        at = starts[n]
        own = lambda b, e: ' '.join(text[b:e].split())
        if m := re.match(r'\s*(?:\} )?(?:else )?if \(', line):
            begin = at + m.end()
            end = closing(masked, begin - 1)
            rest = masked[end + 1:end + 200].lstrip()
            body = rest.split(';')[0]
            if not rest.startswith('{') and not re.match(r'[^;]*;\s*else\b', rest) and not MEASURES.search(body):
                condition = masked[begin:end]
                declared = re.match(r'(?:const )?[\w:<>]+[ *&]+(\w+) = ', condition)
                flat = re.sub(r'\{[^{}]*\}', lambda b: 'x' * len(b.group()), condition)
                cut = begin + condition.rindex(';') + 1 if ';' in flat else begin
                if declared and cut == begin:
                    add(n, f'check left out: {own(at, end + 1)}', end, end, f'; {declared.group(1)} && !@')
                else:
                    add(n, f'check left out: {own(at, end + 1)}', cut, end, f' ({text[cut:end]}) && !@')
        for old, new in COMPARED.items():
            for m in re.finditer(re.escape(old), line + ' '):
                b, e = span(masked, at + m.start(), ASSIGNED + (' && ', ' || ', '<< '))
                one = own(b, at + m.start()) + new + own(at + m.end(), e)
                add(n, f'`{one}` for `{own(b, e)}`', b, e, f'(@ ? ({one}) : ({text[b:e]}))')
        for old, new in ((' && ', ' || '), (' || ', ' && ')):
            for m in re.finditer(re.escape(old), line + ' '):
                stops = ASSIGNED + ((' || ',) if old == ' && ' else ())
                b, e = span(masked, at + m.start(), stops)
                one = f'{own(b, at + m.start())}{new}{own(at + m.end(), e)}'
                add(n, f'`{one}` for `{own(b, e)}`', b, e, f'(@ ? ({one}) : ({text[b:e]}))')
        for m in re.finditer(r'(?<![\w!)])!(?=[\w(])', line):
            add(n, f'negation dropped: {own(at, at + len(line))}', at + m.start(), at + m.end(), '@ != !')
        before = next((p.rstrip() for p in reversed(lines[:n]) if p.strip() and '~' not in p), ';')
        calls = re.match(r'\s+[a-z_][\w.\[\]]*(?:(?:->|\.|::)[\w\[\]]+)*\(', line)
        if calls and before[-1] in ';{})e' and not re.match(
                r'\s*(return|if|for|while|switch|else|catch|delete|do)\b', line):
            begin = at + len(line) - len(line.lstrip())
            end = closing(masked, begin + line.lstrip().index('('))
            if masked[end + 1] == ';' and not MEASURES.search(masked[begin:end]) and len(function) > 0:
                add(n, f'left out: {own(begin, end + 2)}', begin, end + 2, '{ if (!@) ' + text[begin:end + 2] + ' }')
        for m in re.finditer(r"(?<![\w.])(\d[\d']*(?:\.\d+)?(?:e-?\d+)?)(u|f)?(?![\w.])", line):
            if m.group(1) == '0' and re.search(r' = $', line[:m.start()]):
                continue
            if re.search(r'[<\[] ?$|case $', line[:m.start()]):
                continue
            number = m.group(0)
            add(n, f'{number} + 1 for {number}: {own(at, at + len(line))}', at + m.start(), at + m.end(),
                f'(@ ? {number} + 1 : {number})')
        if m := re.search(r'\breturn (true|false);', line):
            add(n, f'another value: {own(at, at + len(line))}', at + m.start(1), at + m.end(1), f'@ != {m.group(1)}')
        elif (m := re.search(r'^\s*(?:if \(.*\) )?return ([^;{}]+);', line)) and returns in NUMBERS and '[' not in line:
            add(n, f'+ 1: {own(at, at + len(line))}', at + m.start(1), at + m.end(1), f'({m.group(1)}) + (@ ? 1 : 0)')
    return out


def draw(tree, seed):
    """All lines that can be mutated, in an order drawn by the seed, with one mutation of each."""
    lines = {}
    for core in CORES:
        for path in sorted(p for p in tree.glob(core + '.*' if not core.endswith('*') else core)
                           if p.suffix in ('.h', '.cpp')):
            name = str(path.relative_to(tree))
            for m in mutations_of(name, path.read_text()):
                lines.setdefault((name, m.line), []).append(m)
    dice = random.Random(seed)
    keys = sorted(lines)
    print(f'{len(keys)} lines can be mutated, in {len({k[0] for k in keys})} files', flush=True)
    dice.shuffle(keys)
    return [dice.choice(lines[k]) for k in keys]


def write(tree, originals, chosen):
    for path, text in originals.items():
        out = text
        for m in sorted((m for m in chosen if m.path == path), key=lambda m: -m.begin):
            new = m.text.replace('@', f'::telesplat_mutant({m.number})')
            begin = out.rfind('\n', 0, m.begin) + 1
            declares = out[begin:m.begin]
            out = out[:m.begin] + new + out[m.end:]
            if 'constexpr' in declares:
                made = declares.replace('static constexpr', 'static inline const').replace('constexpr', 'const')
                out = out[:begin] + made + out[m.begin:]
        if out != text:
            out = '#include "telesplat_mutant.h"\n#line 1\n' + out
        if (tree / path).read_text() != out:
            (tree / path).write_text(out)
    header = tree / 'telesplat_mutant.h'
    if not header.exists() or header.read_text() != HEADER:
        header.write_text(HEADER)


def compile_all(tree, order, count, originals):
    """The mutations that compile, `count` of them, in a telesplat-lab."""
    rest, chosen, spare = iter(order), [], max(4, count // 5)
    while True:
        while len(chosen) < count + spare:
            m = next(rest)
            if any(c.path == m.path and c.begin < m.end + 3 and m.begin < c.end + 3 for c in chosen):
                continue
            m.number = order.index(m)
            chosen.append(m)
            originals.setdefault(m.path, (tree / m.path).read_text())
        write(tree, originals, chosen)
        began = time.monotonic()
        made = subprocess.run(['ninja', '-k', '0', '-j', '2', '-C', str(tree / 'build/release'), 'telesplat-lab'],
                              capture_output=True, text=True)
        print(f'built in {time.monotonic() - began:.0f} s, code {made.returncode}', flush=True)
        if made.returncode == 0:
            return sorted(chosen, key=order.index)[:count]
        bad = set()
        for path, line in re.findall(r'([\w/.]+\.(?:cpp|h)):(\d+):\d*:? *(?:error|required from|note)', made.stdout):
            near = [m for m in chosen if path.endswith(m.path) and -1 <= int(line) - m.line <= 4]
            bad |= {m.number for m in near}
        if not bad:
            sys.exit('it does not compile, for no mutation that is known: ' + made.stdout[-3000:])
        spare = max(0, spare - len(bad))
        for m in chosen:
            if m.number in bad:
                print(f'does not compile: {m.path}:{m.line} {m.what}', flush=True)
        chosen = [m for m in chosen if m.number not in bad]


def restore(tree, originals):
    for path, text in originals.items():
        if (tree / path).read_text() != text:
            (tree / path).write_text(text)
    (tree / 'telesplat_mutant.h').unlink(missing_ok=True)


def call(number, words, limit_s):
    """What simulate prints, and its exit code; a number in place of both: it did not end within so many seconds."""
    env = dict(os.environ) | {'TELESPLAT_DATA': '/nonexistent'}
    env.pop('TELESPLAT_MUTANT', None)
    if number is not None:
        env |= {'TELESPLAT_MUTANT': str(number), 'TELESPLAT_REACHED': str(SCRATCH / f'reached-{number}')}
    words = [str(SCRATCH / 'telesplat-lab'), 'simulate', *words]

    def limits():  # a session that never ends is killed, and fails by that
        resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))
        if os.getuid() == 0:  # a mutation may write anywhere, as one did to /
            os.setgid(NOBODY)
            os.setuid(NOBODY)
    child = subprocess.Popen(words, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=SCRATCH,
                             start_new_session=True, preexec_fn=limits)
    try:
        out, err = child.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        return limit_s
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
    return out, err, child.returncode


def digests_of(text):
    return dict(re.findall(r'^([^:\n]+): digest ([0-9a-f]+)', text, re.M))


def walk(number, golden):
    """(walk, check, text) of the first figure that differs by more than 1 %, else of the first digest that differs.

    golden: figures and digests without any mutation."""
    said = call(number, ['--figures'], 600)
    if isinstance(said, float | int):
        return ('walk', 'hang', f'no end within {said:.0f} s')
    out, err, code = said
    if found := re.search(r'(\S+): seed \d+ FAILS at [\d.]+ s: ([\w-]+): (.*)', err):
        return found.groups()
    try:
        now = json.loads(out)
    except ValueError:
        return ('walk', 'crash', f'code {code}')
    for name, figures in golden[0].items():
        for figure, was in figures.items():
            most = 0.1 if 'holes' in figure or 'psnr' in figure else 0.01 * abs(was)
            if abs(now[name].get(figure, 1e9) - was) > most + 1e-9:
                return (name, 'figures', f'{figure} {now[name].get(figure)}, golden {was}')
    return differing(digests_of(err), golden[1])


def differing(now, golden):
    """(name, 'digest', text) of the first session whose digest is not the golden one."""
    for name, was in golden.items():
        if now.get(name, was) != was:
            return (name, 'digest', f'{now[name]}, golden {was}')
    return None


def simulate(number, first, seeds, limit_s):
    """(seed, check, text) of the first failure from seed `first` on, None: all hold; and the digests, by name."""
    said = call(number, ['--seed', str(first), '--seeds', str(max(2, seeds)), '--digests'], limit_s)
    if isinstance(said, float | int):
        return (first, 'hang', f'no end within {said:.0f} s'), {}
    out, _, code = said
    found = [(int(a), b, c) for a, b, c in re.findall(r'seed (\d+) FAILS at [\d.]+ s: ([\w-]+): (.*)', out)]
    if found:
        return min(found), digests_of(out)
    return None if code == 0 else (first, 'crash', f'code {code}'), digests_of(out)


def look_for(m, until, plain, limit_s):
    """Runs more seeds, to `until`, unless it was found. plain: failure and digests of all of them without mutations."""
    failure, golden = plain
    first = m.seeds + 1
    found, now = simulate(m.number, first, until - m.seeds, 120 + limit_s * (until - m.seeds))
    m.seeds = until
    if found and found[0] not in failure:
        m.failures = [found]
    elif not m.failures and (found := differing(now, golden)):
        m.failures.append(found)
    m.reached = (SCRATCH / f'reached-{m.number}').exists()


def table(chosen):
    found = sum(bool(m.failures) for m in chosen)
    alone = sum(m.failures[0][1] == 'digest' for m in chosen if m.failures)
    out = [f'{found} of {len(chosen)} found, {alone} of them by a digest alone', '',
           '| line | mutation | check | seed or walk |', '|---|---|---|---|']
    for m in sorted(chosen, key=lambda m: (m.path, m.line)):
        check, seed = (m.failures[0][1], m.failures[0][0]) if m.failures else (
            'survived' if m.reached else 'survived, never reached' if m.seeds else '', f'> {m.seeds}')
        what = m.what.replace('|', '\\|')
        out.append(f'| {m.path}:{m.line} | {m.number}: {what} | {check} | {seed} |')
    return '\n'.join(out) + '\n'


def main():
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--tree', type=Path, required=True, help='a worktree with build/release; its sources change')
    parser.add_argument('--count', type=int, default=60)
    parser.add_argument('--draw', type=int, default=1, help='the seed of the draw')
    parser.add_argument('--rounds', default='20,300,1000', help='seeds of each round')
    parser.add_argument('--limit', type=float, default=20, help='seconds a session, until it is taken for dead')
    parser.add_argument('--out', type=Path, default=Path('build/mutations.md'), help='the table')
    parser.add_argument('--list', action='store_true', help='print the draw, and end')
    a = parser.parse_args()
    order = draw(a.tree, a.draw)
    if a.list:
        for m in order[:a.count]:
            print(f'{m.path}:{m.line} {m.what}')
        return
    originals = {}
    SCRATCH.chmod(0o777)
    try:
        chosen = compile_all(a.tree, order, a.count, originals)
        shutil.copy(a.tree / 'build/release/bin/telesplat-lab', SCRATCH)
        restore(a.tree, originals)
        rounds = [int(r) for r in a.rounds.split(',')]
        figures, digests, _ = call(None, ['--figures'], 600)
        golden = json.loads(figures), digests_of(digests)
        failing, plain = simulate(None, 1, rounds[-1], 3600)
        plain = {failing[0]} if failing else set(), plain
        with ThreadPoolExecutor(2) as pool:
            for m, found in zip(chosen, pool.map(lambda m: walk(m.number, golden), chosen)):
                m.failures += [found] if found else []
                m.reached = (SCRATCH / f'reached-{m.number}').exists()
                print(m.path, m.line, m.number, m.what, m.failures or 'has the golden figures', flush=True)
        for until in rounds:
            for m in chosen:
                # A property that fails says more than a digest: the first round looks for one.
                if m.failures and (m.failures[0][1] != 'digest' or until != rounds[0]):
                    continue
                look_for(m, until, plain, a.limit)
                print(m.path, m.line, m.number, m.what, m.failures or f'survives {m.seeds}', flush=True)
                a.out.write_text(table(chosen))
    finally:
        restore(a.tree, originals)
        shutil.rmtree(SCRATCH)
    print(table(chosen))


if __name__ == '__main__':
    main()
