"""tools/test: what its tests' failures lead to, with a ctest and a cmake that only pretend."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "tools" / "test"
END_TO_END = "C.D/e  # GetParam() = 3"
CTEST = """#!/bin/bash
case "$*" in
  *--rerun-failed*) echo again; exit "$AGAIN" ;;
  *-N*) echo '  Test  #22: C.D/e  # GetParam() = 3'; echo '  Test #1: A.B' ;;
  *) mkdir -p build/release/Testing/Temporary
     printf '%b' "$FAILED" >build/release/Testing/Temporary/LastTestsFailed.log
     exit "$CODE" ;;
esac
"""


class ToolsTest(unittest.TestCase):
    def run_script(self, failed="", code=8, again=0, cmake=0):
        with tempfile.TemporaryDirectory() as folder:
            root, programs = pathlib.Path(folder, "tree"), pathlib.Path(folder, "bin")
            (root / "tools").mkdir(parents=True)
            programs.mkdir()
            shutil.copy(SCRIPT, root / "tools" / "test")
            for path, text in [(root / "tools" / "setup", "#!/bin/sh\n"), (programs / "ctest", CTEST),
                               (programs / "cmake", f"#!/bin/sh\nexit {cmake}\n")]:
                path.write_text(text)
                path.chmod(0o755)
            environment = dict(os.environ, PATH=f"{programs}:{os.environ['PATH']}", FAILED=failed, CODE=str(code),
                               AGAIN=str(again))
            done = subprocess.run([root / "tools" / "test"], env=environment, capture_output=True, text=True,
                                  check=False)
            return done.returncode, done.stdout

    def test_passes_if_all_pass(self):
        self.assertEqual(self.run_script(code=0)[0], 0)

    def test_fails_if_the_build_does(self):
        self.assertEqual(self.run_script(code=0, cmake=3)[0], 3)

    def test_fails_if_another_test_does(self):
        for failed in ["7:Unit.X\n", f"22:{END_TO_END}\n7:Unit.X\n", ""]:
            code, out = self.run_script(failed)
            self.assertEqual(code, 8, failed)
            self.assertNotIn("again", out)

    def test_fails_if_many_end_to_end_tests_do(self):
        self.assertEqual(self.run_script("1:A.B\n" * 4)[0], 8)

    def test_runs_a_few_end_to_end_tests_once_more(self):
        code, out = self.run_script(f"22:{END_TO_END}\n1:A.B\n")
        self.assertEqual(code, 0)
        self.assertIn("again", out)
        self.assertIn(f"passed only when alone: {END_TO_END} A.B", out)
        self.assertEqual(self.run_script("1:A.B\n", again=8)[0], 8)


if __name__ == "__main__":
    unittest.main()
