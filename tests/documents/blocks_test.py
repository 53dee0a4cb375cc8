#!/usr/bin/env python3
"""Tests of what runs the documents' commands: it finds all of them, and fails where one fails."""

import os
import shutil
import tempfile
import unittest

import blocks
import run_blocks

PAGE = """Text.

```
telesplat run a.ply \\
  --samplers 2     # with two
TELESPLAT_MASTER=x telesplat ctl tf "30%:#000000:0"   # a colour is no comment
for s in a b; do
  echo $s
done
```

<!-- beside: telesplat run julia -->
```toml
[scene]
```
"""


class Blocks(unittest.TestCase):
    def test_commands_are_found_whole(self):
        first, second = blocks.blocks(PAGE)
        self.assertEqual([c.text for c in blocks.commands(first)],
                         ["telesplat run a.ply   --samplers 2",
                          'TELESPLAT_MASTER=x telesplat ctl tf "30%:#000000:0"',
                          "for s in a b; do\n  echo $s\ndone"])
        self.assertEqual([c.line for c in blocks.commands(first)], [4, 6, 7])
        self.assertEqual(blocks.commands(first)[1].words[:3], ["telesplat", "ctl", "tf"])
        self.assertEqual((second.language, second.beside, first.beside), ("toml", "telesplat run julia", ""))

    def test_a_block_without_end_is_an_error(self):
        with self.assertRaises(ValueError):
            blocks.blocks("```\ntelesplat run\n")

    def test_runs_are_short_and_small_unless_they_say_otherwise(self):
        self.assertEqual(run_blocks.shortened("telesplat run a"), "telesplat run a --duration 0.7 --size 320x240")
        self.assertEqual(run_blocks.shortened("telesplat run a --duration=60 --size 9x9"),
                         "telesplat run a --duration 0.7 --size 9x9")
        self.assertEqual(run_blocks.shortened("telesplat run a --size 2560x800 --verify 20"),
                         "telesplat run a --size 320x100 --verify 100 --duration 0.7")


class Pages(unittest.TestCase):
    def run_page(self, text):
        folder = tempfile.mkdtemp()
        programs = os.path.join(folder, "programs")
        os.mkdir(programs)
        work = os.path.join(folder, "work")
        os.mkdir(work)
        page = run_blocks.Page(folder, programs, work, "")
        try:
            page.run(text)
        finally:
            page.close()
            shutil.rmtree(folder)
        return page.ran, page.failures

    def test_every_command_must_succeed(self):
        self.assertEqual(self.run_page("```\ntrue\n```\n"), (1, 0))
        self.assertEqual(self.run_page("```\ntrue\nfalse\ntelesplat-nonsense\n```\n"), (3, 2))

    def test_what_needs_a_network_is_left_out_and_unknown_languages_are_not(self):
        self.assertEqual(self.run_page("```\ndocker compose up\napt-get install x\n```\n"), (0, 0))
        self.assertEqual(self.run_page("```text\nfalse\n```\n"), (0, 0))
        self.assertEqual(self.run_page("```yaml\nfalse\n```\n"), (0, 1))

    def test_python_runs_beside_a_record(self):
        record = "```\nmkdir -p runs/latest\n```\n"
        self.assertEqual(self.run_page(record + "```python\nopen('runs/latest/a', 'w')\n```\n"), (2, 0))
        self.assertEqual(self.run_page(record + "```python\nopen('runs/none/a')\n```\n"), (2, 1))


if __name__ == "__main__":
    unittest.main()
