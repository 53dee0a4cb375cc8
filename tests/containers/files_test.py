#!/usr/bin/env python3
"""compose.yaml, outside.yaml, stack.yaml and the Dockerfile: they agree with each other, with the programs' flags and
with what documents tell, and nothing in them runs without limits or as root."""

import itertools
import os
import pathlib
import re
import shutil
import subprocess
import unittest

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMPOSE = ROOT / "compose"
PROFILES = ("mesh", "julia", "volume")
SCRIPTS = {"stay", "record", "serve-mesh", "serve-volume"}


def load(name):
    return yaml.safe_load((COMPOSE / name).read_text())["services"]


def words(service):
    """All words of a service's entry point and command."""
    out = []
    for part in (service.get("entrypoint", []), service.get("command", "")):
        out += part.split() if isinstance(part, str) else part
    return out


def image_of(service):
    """telesplat-data of ${TELESPLAT_REGISTRY:-}telesplat-data:${TELESPLAT_TAG:-latest}."""
    return re.sub(r"\$\{[^}]*\}", "", service["image"]).split(":")[0]


def dockerfile_stages():
    stages, name = {}, None
    for line in (COMPOSE / "Dockerfile").read_text().splitlines():
        if match := re.match(r"FROM \S+ AS (\S+)", line):
            name = match[1]
            stages[name] = []
        elif name:
            stages[name].append(line)
    return {name: "\n".join(lines) for name, lines in stages.items()}


class Files(unittest.TestCase):
    def setUp(self):
        self.compose, self.stack, self.outside = load("compose.yaml"), load("stack.yaml"), load("outside.yaml")
        self.stages = dockerfile_stages()
        self.images = {image_of(s): s for s in self.compose.values()}

    def each(self):
        files = (("compose.yaml", self.compose), ("stack.yaml", self.stack))
        return [(file, name, service) for file, services in files for name, service in services.items()]

    def test_nothing_is_root_or_could_become_it(self):
        for file, _, service in self.each():
            user = "${TELESPLAT_USER:-10001:10001}" if file == "compose.yaml" else "10001:10001"
            self.assertEqual(service["user"], user)
            self.assertTrue(service["read_only"])
            self.assertEqual(service["cap_drop"], ["ALL"])
            self.assertNotIn("cap_add", service)
            self.assertNotIn("privileged", service)
            if file == "compose.yaml":  # stacks have no such setting
                self.assertIn("no-new-privileges:true", service["security_opt"])
        for name in self.images:
            self.assertRegex(self.stages["runtime"], "(?m)^USER telesplat$")
            self.assertNotRegex(self.stages[name.removeprefix("telesplat-")], "(?m)^USER root$")

    def test_everything_has_limits(self):
        for file, _, service in self.each():
            self.assertIn("nofile", service["ulimits"])
            for volume in service.get("volumes", []):
                if volume["type"] == "tmpfs":
                    self.assertGreater(volume["tmpfs"]["size"], 0)
            self.assertIn("max-size", service["logging"]["options"])
            if file == "compose.yaml":
                self.assertLessEqual(service["pids_limit"], 1024)
                self.assertTrue(service["mem_limit"])
            else:
                self.assertTrue(service["deploy"]["resources"]["limits"]["memory"])

    def test_everything_comes_back_and_tells_its_health(self):
        for file, _, service in self.each():
            if file == "compose.yaml":
                self.assertRegex(service["restart"], "^on-failure")
            else:
                self.assertEqual(service["deploy"]["restart_policy"]["condition"], "on-failure")
            self.assertNotIn("healthcheck", service, "the image's")
        for name in self.images:
            stage = self.stages[name.removeprefix("telesplat-")]
            self.assertIn("HEALTHCHECK", stage)
            self.assertIn('ENTRYPOINT ["stay", "%s"]' % name, stage)

    def test_nothing_is_open_by_itself(self):
        lines = "\n".join(self.stages.values()).splitlines()
        self.assertNotIn("--insecure", "\n".join(line for line in lines if not line.startswith("#")))
        for _, _, service in self.each():
            links = [w for w in re.findall(r"\$\{TELESPLAT_LINKS[^}]*\}", " ".join(words(service)))]
            self.assertEqual(links, ["${TELESPLAT_LINKS:-}"])
            self.assertEqual(service["environment"]["TELESPLAT_KEYS"], "${TELESPLAT_KEYS_WITHIN-/run/secrets/keys}")
            self.assertNotIn("--insecure", " ".join(words(service)))
        for name, service in self.compose.items():
            self.assertNotIn("ports", service, f"{name}: outside.yaml publishes")

    def test_each_has_its_own_keys_alone(self):
        keys = {
            # A person who may enter the master's container may ask and end the session: telesplat ctl.
            "master": {"server.key", "server.pub", "allowed.toml", "operator.key"},
            "data": {"server.key", "server.pub", "allowed.toml", "data.key"},
            "packer": {"server.key", "server.pub", "allowed.toml", "packer.key"},
            "sampler": {"server.pub", "sampler.key"},
            # When its run is over, the viewer of the main job ends the session.
            "viewer": {"server.pub", "viewer.key", "operator.key"},
        }
        for file, name, service in self.each():
            given = service["secrets"]
            self.assertEqual({s["target"].removeprefix("/run/secrets/keys/") for s in given}, keys[name.split("-")[0]])
            if file == "stack.yaml":
                for secret in given:
                    self.assertEqual(secret["uid"], "10001")
                    self.assertEqual(secret["mode"], 0o400 if secret["target"].endswith(".key") else 0o444)
        for file in ("compose.yaml", "stack.yaml"):
            for name, secret in yaml.safe_load((COMPOSE / file).read_text())["secrets"].items():
                self.assertEqual(secret["file"], "${TELESPLAT_KEYS_FOLDER:-./keys}/" + name)

    def test_ports_agree(self):
        ports = {"master": "7700", "packer": "7701", "data": "7710"}
        for _, name, service in self.each():
            bound = [re.fullmatch(r"tcp://\*:(\d+)", w) for w in words(service)]
            bound = [m[1] for m in bound if m]
            port = ports.get(name.split("-")[0])
            self.assertEqual(bound, [port] if port else [])
        published = {"master": [7700], "packer": [7701, 7702]}
        for name, service in self.outside.items():
            self.assertEqual([int(p.split(":")[-1]) for p in service["ports"]], published[name])
        for name, service in self.stack.items():
            given = service.get("ports", [])
            self.assertEqual([p["target"] for p in given], published.get(name, []))
            for p in given:
                self.assertEqual((p["mode"], p["published"]), ("host", p["target"]))
        self.assertIn("EXPOSE 7700", self.stages["master"])

    def test_images_and_scripts_are_there(self):
        for _, _, service in self.each():
            self.assertIn(image_of(service).removeprefix("telesplat-"), self.stages)
            for word in words(service)[:3]:
                if re.fullmatch("[a-z][a-z-]+", word) and not word.startswith("telesplat-"):
                    self.assertIn(word, SCRIPTS | {"begin", "join", "julia"})
        self.assertEqual({p.name for p in (COMPOSE / "bin").iterdir()}, SCRIPTS)
        for script in (COMPOSE / "bin").iterdir():
            self.assertIn(f"/scripts/{script.name}", self.stages["build"])
            self.assertTrue(os.access(script, os.X_OK), script)

    def test_flags_are_those_of_the_programs(self):
        sources = [f for folder in ("services", "client", "common", "tools") for f in (ROOT / folder).rglob("*.cpp")]
        known = {flag for file in sources for flag in re.findall(r'"!?(--[a-z-]+)', file.read_text())}
        for _, _, service in self.each():
            text = re.sub(r"\$\{[^}]*\}", " ", " ".join(words(service)))
            self.assertLessEqual(set(re.findall(r"--[a-z-]+", text)), known, image_of(service))
        for line in re.findall(r'HEALTHCHECK.*', (COMPOSE / "Dockerfile").read_text()):
            self.assertLessEqual(set(re.findall(r'"(--[a-z-]+)"', line)), known)

    def test_pages_have_the_order_that_works(self):
        """prepare makes keys with what is in the images, and up needs keys."""
        for page in (COMPOSE / "README.md", COMPOSE / "compose.yaml", ROOT / "docs/deploying.md"):
            text = page.read_text()
            prepare = text.index("compose/prepare  ")
            block = text[max(0, prepare - 200):prepare + 300]
            order = [block.index(step) for step in (" build ", "compose/prepare  ", " up ")]
            self.assertEqual(order, sorted(order), page)

    def test_variables_are_told(self):
        told = (COMPOSE / "README.md").read_text() + (ROOT / "docs/deploying.md").read_text()
        told = re.sub(r"TELESPLAT_\{([A-Z,]+)\}_([A-Z]+)",
                      lambda m: " ".join(f"TELESPLAT_{p}_{m[2]}" for p in m[1].split(",")), told)
        for file in ("compose.yaml", "outside.yaml", "stack.yaml"):
            for name in re.findall(r"\$\{(TELESPLAT_[A-Z_]+)", (COMPOSE / file).read_text()):
                self.assertRegex(told, rf"\b{name}\b", f"{name} of {file}")
        sbatch = COMPOSE / "slurm/telesplat.sbatch"
        usage = subprocess.run([sbatch, "--help"], capture_output=True, text=True, check=True).stdout
        usage = usage.replace("{MASTER,PACKER,SAMPLER}", "MASTER_FLAGS TELESPLAT_PACKER_FLAGS TELESPLAT_SAMPLER")
        for name in re.findall(r"\$\{(TELESPLAT_[A-Z_]+)", sbatch.read_text()):
            self.assertRegex(usage, rf"\b{name}\b", name)

    def test_engines_take_them(self):
        """By what is installed of Compose 1.29 and Compose v2; neither needs an engine that runs."""
        commands = []
        if shutil.which("docker-compose"):
            commands.append(["docker-compose"])
        if shutil.which("docker"):
            if subprocess.run(["docker", "compose", "version"], capture_output=True, check=False).returncode == 0:
                commands.append(["docker", "compose"])
        if not commands:
            self.skipTest("neither docker-compose nor docker compose is installed")
        environment = dict(os.environ, TELESPLAT_HOST="front.example.org")
        for command, profile, files in itertools.product(commands, PROFILES, (["compose"], ["compose", "outside"])):
            arguments = [a for f in files for a in ("-f", str(COMPOSE / f"{f}.yaml"))]
            done = subprocess.run([*command, *arguments, "--profile", profile, "config", "-q"], capture_output=True,
                                  text=True, env=environment, check=False)
            self.assertEqual(done.returncode, 0, f"{command} {profile} {files}: {done.stderr}")


if __name__ == "__main__":
    unittest.main()
