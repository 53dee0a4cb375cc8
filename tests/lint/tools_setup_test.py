"""tools/setup: what it asks of apt-get, and that it removes nothing, with an apt-get and a dpkg that only pretend."""
import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "tools" / "setup"
DPKG_QUERY = """#!/bin/bash
exit 0
"""
APT_GET = """#!/bin/bash
echo "$*" >>"$ASKED"
[[ " $* " == *" -s "* && $CONFLICT ]] && { echo "E: $CONFLICT"; exit 100; }
exit 0
"""
SUDO = """#!/bin/bash
exec "$@"
"""


class ToolsSetup(unittest.TestCase):
    def run_script(self, **told):
        with tempfile.TemporaryDirectory() as folder:
            asked = pathlib.Path(folder, "asked")
            for name, text in [("dpkg-query", DPKG_QUERY), ("apt-get", APT_GET), ("sudo", SUDO)]:
                path = pathlib.Path(folder, name)
                path.write_text(text)
                path.chmod(0o755)
            environment = dict(os.environ, PATH=f"{folder}:{os.environ['PATH']}", ASKED=str(asked), CONFLICT="")
            environment.update(told)
            done = subprocess.run([SCRIPT], env=environment, capture_output=True, text=True, check=False)
            return done, asked.read_text().splitlines() if asked.exists() else []

    def test_installs_without_removing(self):
        done, asked = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(" install -y --no-remove ", asked[-1])
        self.assertIn(" libpugixml-dev ", asked[-1])

    def test_installs_nothing_that_takes_the_place_of_others(self):
        done, asked = self.run_script(CONFLICT="Packages need to be removed but remove is disabled.")
        self.assertEqual(done.returncode, 1)
        self.assertIn("need to be removed", done.stderr)
        self.assertFalse(any(" -y " in line for line in asked), asked)


if __name__ == "__main__":
    unittest.main()
