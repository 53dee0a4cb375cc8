#!/usr/bin/env python3
"""The scripts that programs run in: those of containers (compose/bin), and the batch job (compose/slurm) as far as it
goes without Slurm. Programs are stand-ins here; tests/e2e has real ones."""

import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

COMPOSE = pathlib.Path(__file__).resolve().parents[2] / "compose"


class Scripts(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        self.addCleanup(self.folder.cleanup)
        (self.path / "bin").mkdir()
        self.environment = dict(os.environ, PATH=f"{self.path}/bin:{os.environ['PATH']}",
                                TELESPLAT_RUNS=f"{self.path}/runs")
        self.program("telesplat-health", "exit 0")

    def program(self, name, text):
        file = self.path / "bin" / name
        file.write_text(f"#!/bin/sh\ncd {self.path}\n{text}\n")
        file.chmod(0o755)
        return str(file)

    def run_script(self, *arguments, **environment):
        return subprocess.run([str(a) for a in arguments], capture_output=True, text=True, timeout=30,
                              env=dict(self.environment, **environment))

    def record(self, *arguments, **environment):
        (self.path / "runs").mkdir(exist_ok=True)
        return self.run_script(COMPOSE / "bin/record", *arguments, **environment)

    def lines(self, name):
        file = self.path / name
        return file.read_text().splitlines() if file.exists() else []

    # ---- prepare -----------------------------------------------------------------------------------------------------

    def prepare(self, image):
        tree = self.path / "tree/compose"
        tree.mkdir(parents=True)
        shutil.copy(COMPOSE / "prepare", tree / "prepare")
        self.program("docker", f"""echo "$*" >> asked
case $1 in image) exit {0 if image else 1} ;; run) touch tree/compose/keys/server.key ;; esac""")
        return self.run_script(tree / "prepare"), tree

    def test_prepare_says_how_the_images_are_made(self):
        done, tree = self.prepare(image=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("docker compose -f compose/compose.yaml --profile julia build", done.stderr)
        self.assertFalse((tree / ".env").exists())

    def test_prepare_makes_keys_with_the_image(self):
        done, tree = self.prepare(image=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(self.lines("asked")[-1], r"^run .*--entrypoint telesplat telesplat-master keys /keys$")
        self.assertIn("TELESPLAT_USER=", (tree / ".env").read_text())

    # ---- stay --------------------------------------------------------------------------------------------------------

    def test_stay_ends_as_its_program_does(self):
        for code in (0, 1, 2):
            done = self.run_script(COMPOSE / "bin/stay", self.program("p", f'echo life >> lives\nexit {code}'))
            self.assertEqual((done.returncode, done.stderr), (code, ""))
        self.assertEqual(len(self.lines("lives")), 3, "none was started again")

    def test_stay_hands_arguments_on_as_they_are(self):
        program = self.program("p", 'printf "%s\\n" "$@" > arguments')
        self.run_script(COMPOSE / "bin/stay", program, "a b", "", "--flag=*", "$HOME")
        self.assertEqual(self.lines("arguments"), ["a b", "", "--flag=*", "$HOME"])

    def test_stay_starts_again_what_was_killed(self):
        program = self.program("p", 'echo life >> lives\n[ "$(wc -l < lives)" -ge 3 ] || kill -KILL $$')
        done = self.run_script(COMPOSE / "bin/stay", program)
        self.assertEqual(done.returncode, 0)
        self.assertEqual(len(self.lines("lives")), 3)
        self.assertEqual(done.stderr.count("was killed by signal 9 and is started again"), 2)

    def test_stay_gives_up_what_is_killed_all_the_time(self):
        done = self.run_script(COMPOSE / "bin/stay", self.program("p", "echo life >> lives\nkill -ABRT $$"))
        self.assertEqual(done.returncode, 128 + signal.SIGABRT)
        self.assertEqual(len(self.lines("lives")), 6)
        self.assertIn("given up", done.stderr)

    def test_stay_passes_the_signal_on_and_waits(self):
        program = self.program("p", "trap 'echo told > told; sleep 0.5; echo done >> told; exit 0' TERM\n"
                                    "echo up > up\nwhile :; do sleep 0.1; done")
        stay = subprocess.Popen([COMPOSE / "bin/stay", program], env=self.environment)
        self.wait_for("up")
        stay.send_signal(signal.SIGTERM)
        self.assertEqual(stay.wait(timeout=10), 0)
        self.assertEqual(self.lines("told"), ["told", "done"])

    def test_stay_does_not_start_again_what_was_told_to_stop(self):
        program = self.program("p", "echo life >> up\nexec sleep 60")
        stay = subprocess.Popen([COMPOSE / "bin/stay", program], env=self.environment, stderr=subprocess.DEVNULL)
        self.wait_for("up")
        stay.send_signal(signal.SIGTERM)
        self.assertEqual(stay.wait(timeout=10), 128 + signal.SIGTERM)
        self.assertEqual(len(self.lines("up")), 1)

    def wait_for(self, name):
        end = time.monotonic() + 20
        while not self.lines(name):
            self.assertLess(time.monotonic(), end)
            time.sleep(0.02)

    # ---- record ------------------------------------------------------------------------------------------------------

    def test_record_makes_a_folder_and_points_at_it(self):
        program = self.program("master", 'echo "$@" > arguments')
        self.assertEqual(self.record("begin", program, "--bind", "x", TELESPLAT_RUN="first").returncode, 0)
        self.assertEqual(self.lines("arguments"), [f"--out {self.path}/runs/first --bind x"])
        self.assertEqual(os.readlink(self.path / "runs/latest"), "first")
        self.assertEqual(os.listdir(self.path / "runs/.lives"), [], "all is well")

    def test_record_refuses_what_is_no_folders_name(self):
        for name in ("a/b", "..", ".x", "a b", "$(id)"):
            self.assertEqual(self.record("begin", self.program("master", ""), TELESPLAT_RUN=name).returncode, 2, name)

    def test_record_tells_of_a_folder_that_cannot_be_written(self):
        done = self.record("begin", self.program("master", ""), TELESPLAT_RUNS="/proc/runs")
        self.assertEqual(done.returncode, 2)
        self.assertIn("compose/prepare", done.stderr)

    def test_record_goes_on_after_a_kill(self):
        program = self.program("master", '[ "$1" != --help ] || exit 0\necho "$2" >> lives\n'
                                         '[ "$(wc -l < lives)" -ge 3 ] || kill -KILL $$')
        for code in (137, 137, 0):
            self.assertEqual(self.record("begin", program, TELESPLAT_RUN="r", TELESPLAT_SESSION="s").returncode, code)
            for out in self.lines("lives"):
                pathlib.Path(out).mkdir(exist_ok=True)
        self.assertEqual(self.lines("lives"), [f"{self.path}/runs/{n}" for n in ("r", "r-2", "r-3")])
        self.assertEqual(os.readlink(self.path / "runs/latest"), "r-3")

    def test_record_goes_on_in_the_same_folder_where_the_master_can(self):
        program = self.program("master", '[ "$1" != --help ] || { echo "  --continue  go on"; exit; }\n'
                                         'echo "$@" >> lives\n[ "$(wc -l < lives)" -ge 2 ] || kill -KILL $$')
        for code in (137, 0):
            self.assertEqual(self.record("begin", program, "--bind", "x", TELESPLAT_RUN="r").returncode, code)
        out = f"--out {self.path}/runs/r"
        self.assertEqual(self.lines("lives"), [f"{out} --bind x", f"{out} --continue --bind x"])

    def test_record_ends_again_what_has_ended(self):
        program = self.program("master", "echo life >> lives\nexit 1")
        first, second = (self.record("begin", program, TELESPLAT_SESSION="s") for _ in range(2))
        self.assertEqual((first.returncode, second.returncode), (1, 1))
        self.assertEqual(len(self.lines("lives")), 1)
        # Later a person starts the same container again.
        life = self.path / "runs/.lives/begin-s"
        os.utime(life, (time.time() - 20, time.time() - 20))
        self.record("begin", program, TELESPLAT_SESSION="s")
        self.assertEqual(len(self.lines("lives")), 2)

    def test_record_gives_a_viewer_the_masters_folder_and_its_next_life_its_own(self):
        (self.path / "runs/r").mkdir(parents=True)
        (self.path / "runs/latest").symlink_to("r")
        program = self.program("viewer", 'echo "$2" >> lives\nmkdir -p "$2/images"')
        for _ in range(3):
            self.assertEqual(self.record("join", program).returncode, 0)
        runs = f"{self.path}/runs/r"
        self.assertEqual(self.lines("lives"), [runs, f"{runs}/viewer-again", f"{runs}/viewer-again-2"])

    # ---- serve-volume ------------------------------------------------------------------------------------------------

    def test_servers_of_a_volume_share_its_parts(self):
        cache = self.path / "cache"
        cache.mkdir()
        self.program("telesplat-data", 'echo "$2" >> parts\n[ ! -f stop ] || exit 0\nexec sleep 60')
        environment = dict(self.environment, TELESPLAT_VOLUME="head", TELESPLAT_PARTS="2", TELESPLAT_CACHE=str(cache))
        serve = [COMPOSE / "bin/serve-volume"]
        first = subprocess.Popen(serve, env=environment)
        self.wait_for("parts")
        second = subprocess.Popen(serve, env=environment)
        self.addCleanup(second.kill)
        end = time.monotonic() + 20
        while len(self.lines("parts")) < 2 and time.monotonic() < end:
            time.sleep(0.02)
        self.assertEqual(self.lines("parts"), ["--part=0/2", "--part=1/2"])
        third = self.run_script(*serve, **environment)
        self.assertEqual(third.returncode, 2)
        self.assertIn("all 2 parts are served", third.stderr)
        first.kill()  # its part is free at once
        first.wait()
        (self.path / "stop").touch()
        self.assertEqual(self.run_script(*serve, **environment).returncode, 0)
        self.assertEqual(self.lines("parts")[-1], "--part=0/2")
        # A swarm names the part.
        self.run_script(*serve, **dict(environment, TELESPLAT_PART="2"))
        self.assertEqual(self.lines("parts")[-1], "--part=1/2")

    # ---- the batch job -----------------------------------------------------------------------------------------------

    def test_a_dry_run_of_the_batch_job_tells_what_goes_where(self):
        done = self.run_script(COMPOSE / "slurm/telesplat.sbatch", "--dry-run", "crater.ply", "--up", "z")
        self.assertEqual(done.returncode, 0, done.stderr)
        lines = done.stdout.splitlines()
        self.assertIn("as if node001 to node003 were given", lines[0])
        self.assertRegex(lines[1], r"telesplat-master' '--bind' 'tcp://\*:20000'")
        self.assertRegex(lines[2], r"telesplat-data' 'crater.ply' '--up' 'z' .*'--advertise' 'node001'")
        self.assertRegex(lines[3], r"telesplat-packer' '--bind' 'tcp://\*:20001' '--advertise' 'node001' "
                                   r"'--advertise-to-viewers' '127.0.0.1'")
        self.assertRegex(lines[4], r"'srun' '--nodes=2' '--relative=1' '--ntasks=2'.*telesplat-sampler'")
        self.assertIn("ssh -N -L 20000:node001:20000 -L 20001:node001:20001 -L 20002:node001:20002 ", done.stdout)
        self.assertIn("telesplat view --master tcp://127.0.0.1:20000", done.stdout)

    def test_the_batch_job_refuses_bad_usage(self):
        for arguments in ([], ["--dry-run"]):
            self.assertEqual(self.run_script(COMPOSE / "slurm/telesplat.sbatch", *arguments).returncode, 2)
        self.environment.pop("SLURM_JOB_NODELIST", None)
        done = self.run_script(COMPOSE / "slurm/telesplat.sbatch", "crater.ply")
        self.assertEqual(done.returncode, 2)
        self.assertIn("start it with sbatch", done.stderr)


if __name__ == "__main__":
    unittest.main()
