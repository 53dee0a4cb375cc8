"""tools/hooks/commit-msg: which messages a commit may have."""
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@unittest.skipUnless(shutil.which("git"), "git is not installed")
class CommitHook(unittest.TestCase):
    def commit(self, message, lines):
        """Exit code and complaints of a commit of a file with so many lines."""
        with tempfile.TemporaryDirectory() as folder:
            git = ["git", "-C", folder, "-c", f"core.hooksPath={ROOT / 'tools' / 'hooks'}", "-c", "user.name=a",
                   "-c", "user.email=a@example.org"]
            subprocess.run(["git", "init", "-q", folder], check=True)
            pathlib.Path(folder, "file").write_text("line\n" * lines, encoding="utf-8")
            subprocess.run([*git, "add", "file"], check=True)
            done = subprocess.run([*git, "commit", "-q", "-m", message], capture_output=True, text=True, check=False)
            return done.returncode, done.stderr

    def test_takes_an_imperative_subject_and_a_body(self):
        for message, lines in (("Bound the plan of a turning head\n\nIt grew.", 30), ("Bring back the fence", 20),
                               ("fixup! anything", 30)):
            with self.subTest(message=message):
                self.assertEqual(self.commit(message, lines), (0, ""))

    def test_refuses_others_and_says_why(self):
        for message, lines, said in (
            ("Bound the plan of a turning head", 21, "a change of 21 lines, more than 20, has a body"),
            ("Bound " + "x" * 60, 1, "the subject has 66 letters, limit 65"),
            ("Bounded the plan", 1, '"Bounded" is not'),
            ("Adds a plan", 1, '"Adds" is not'),
            ("bound the plan.", 1, "a capital letter"),
            ("Bound the plan\nIt grew.", 1, "an empty line follows"),
        ):
            with self.subTest(message=message):
                code, complaints = self.commit(message, lines)
                self.assertEqual(code, 1)
                self.assertIn(said, complaints)


if __name__ == "__main__":
    unittest.main()
