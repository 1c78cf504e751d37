#!/usr/bin/env python3
"""The robot as a service container, as a CI job has it: the image of `packaging/Dockerfile` is built of a static binary
and started; its health check says so, hosts reach every port from outside, the control interface asks for its token,
files outlive the container on their volume, and `docker stop` ends it in order.

    python3 tests/system/containers/docker_image.py [--binary STATIC_TS3100] [--other STATIC_TS3100]

Without --binary the binary is built for x86_64-unknown-linux-musl or the same of this machine. --other is one for the
other processor: its image is built as the release does, and its robot run by qemu. Docker is installed by
apt and its daemon started where they are missing, which needs root or sudo and is said."""

import argparse
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import pages  # noqa: E402
from container_engine import IMAGE, ROOT, build, docker, install, run, static_binary, succeeds  # noqa: E402
from emulator import answer  # noqa: E402
from steps import Failed, equal, ok, program, true, until  # noqa: E402
from wire import Host, Line  # noqa: E402

NAME, VOLUME, OTHER = "ts3100-test-robot", "ts3100-test-drive", "ts3100-test-other"
TOKEN = "only-for-this-test"
NETWORK = "ts3100-test-network"
HEALTHY_TIMEOUT = 30
MOST_BYTES = 9_000_000
STOP_LIMIT = 5.0


class Container:
    """The service, its ports mapped to free ones of the loopback."""

    def __init__(self, *arguments, environment=(), engine=()):
        ports = [word for port in (1000, 1001, 1002, 1003, 2217, 3100) for word in ("-p", "127.0.0.1::%d" % port)]
        settings = [word for pair in environment for word in ("-e", pair)]
        run("docker", "run", "-d", "--name", NAME, "--health-interval", "1s", "-v", VOLUME + ":/drive", *ports, *settings,
            *engine, IMAGE, *arguments)
        self.wait_until_healthy()

    @classmethod
    def wait_until_healthy(cls):
        def healthy():
            if cls.inspect("{{.State.Running}}") != "true":
                raise Failed("the container runs\n     found    %s" % run("docker", "logs", NAME))
            return cls.inspect("{{.State.Health.Status}}") == "healthy"

        until("the container is healthy", healthy, HEALTHY_TIMEOUT,
              lambda: cls.inspect("{{json .State}}") + "\n" + run("docker", "logs", NAME), pause=0.2)

    @staticmethod
    def inspect(form):
        return run("docker", "inspect", "-f", form, NAME)

    @staticmethod
    def address(port):
        host, number = run("docker", "port", NAME, "%d/tcp" % port).splitlines()[0].rsplit(":", 1)
        return host, int(number)

    def call(self, path, token=None):
        """Status and document of a GET of the control interface."""
        return answer("http://%s:%d" % self.address(3100), path, token)

    def health_checked_again(self):
        """What the next health check says."""
        checks = "{{range .State.Health.Log}}{{.Start}} {{end}}"
        before = self.inspect(checks)
        until("the next health check", lambda: self.inspect(checks) != before, HEALTHY_TIMEOUT, pause=0.2)
        return self.inspect("{{.State.Health.Status}}")

    @staticmethod
    def stop():
        """Seconds that `docker stop` took, and the exit code."""
        begun = time.monotonic()
        run("docker", "stop", NAME)
        code = Container.inspect("{{.State.ExitCode}}")
        run("docker", "rm", NAME)
        return time.monotonic() - begun, code


def job():
    """What a CI job does with its robot."""
    robot = Container(environment=["TS3100_CONTROL_TOKEN=" + TOKEN])
    ip0, ip1 = Host(robot.address(1000), True), Line(robot.address(1001))
    ip0.command(b"SO")
    ip0.download(b"HELLO", b"PROGRAM HELLO\nPRINT IP1, \"HELLO\", CR\nEND\n")
    ip0.command(b"SL,HELLO")
    ip0.command(b"RN")
    equal("what the program prints comes over the mapped port 1001", b"HELLO\r", ip1.until(b"\r"))
    equal("the control interface without its token", 401, robot.call("/state")[0])
    status, state = robot.call("/state", TOKEN)
    equal("the control interface with it", (200, "HELLO"), (status, state["file"]))
    equal("with a host on IP0 it stays healthy", "healthy", robot.health_checked_again())
    equal("its user has no rights", "1000:1000", robot.inspect("{{.Config.User}}"))
    seconds, code = robot.stop()
    equal("exit code behind docker stop", "0", code)
    true("docker stop took %.1f s" % seconds, seconds < STOP_LIMIT)
    robot = Container()
    directory = Host(robot.address(1000), False).file(b"CA")
    true("the file is on the volume for the next container", b"HELLO" in directory, directory)
    robot.stop()


def image():
    """What the image holds, and how it is described."""
    size = int(run("docker", "image", "inspect", "-f", "{{.Size}}", IMAGE))
    true("the image has %.2f MB, at most %.0f" % (size / 1e6, MOST_BYTES / 1e6), size < MOST_BYTES)
    run("docker", "create", "--name", NAME, IMAGE)
    exported = subprocess.Popen(["docker", "export", NAME], stdout=subprocess.PIPE)
    with tarfile.open(fileobj=exported.stdout, mode="r|") as archive:
        # What the engine itself adds to every container is empty.
        found = sorted(entry.name for entry in archive if entry.isfile() and entry.size)
    exported.wait()
    run("docker", "rm", NAME)
    equal("one file is in it", ["usr/local/bin/ts3100"], found)
    labels = json.loads(run("docker", "image", "inspect", "-f", "{{json .Config.Labels}}", IMAGE))
    for name in ("title", "description", "licenses", "version", "revision"):
        true("label %s: %s" % (name, labels.get("org.opencontainers.image." + name)),
             labels.get("org.opencontainers.image." + name))


def only_static():
    """An image of a program with shared libraries would only say that there is no such file."""
    script = os.path.join(ROOT, "packaging", "image.sh")
    refused = subprocess.run([script, "context", sys.executable], capture_output=True, text=True, check=False)
    true("a program that is not static is refused", refused.returncode == 1 and "cargo build" in refused.stderr and not refused.stdout,
         refused.stderr)


def flags():
    """The health check finds the robot whatever its flags are."""
    for arguments in (["serve", "--listen", "0.0.0.0", "--port-offset", "10000"], ["serve", "--ports", "auto"],
                      ["serve", "--listen", "0.0.0.0", "--control", "off"]):
        robot = Container(*arguments)
        equal("healthy with %s" % " ".join(arguments[1:]), "healthy", robot.inspect("{{.State.Health.Status}}"))
        robot.stop()
    robot = Container("serve", "--listen", "0.0.0.0", "--ports", "auto", engine=["--read-only"])
    equal("healthy with a read-only root", "healthy", robot.inspect("{{.State.Health.Status}}"))
    robot.stop()
    robot = Container()
    problem = None
    try:
        robot.call("/state")
    except OSError as error:
        problem = error
    true("without a token the control interface is closed to the outside: %s" % problem, problem)
    robot.stop()


def by_name():
    """Another container reaches the control interface by the name of the service, with one variable."""
    run("docker", "network", "create", NETWORK)
    for variable, words in (("TS3100_CONTROL_OPEN=1", []), ("TS3100_CONTROL_TOKEN=" + TOKEN, ["--token", TOKEN])):
        run("docker", "run", "-d", "--name", NAME, "--network", NETWORK, "--network-alias", "robot", "-e", variable, IMAGE)
        Container.wait_until_healthy()
        said = run("docker", "run", "--rm", "--network", NETWORK, IMAGE, "ctl", "--url", "http://robot:3100", *words, "state")
        true("ctl state by the name of the service, with %s" % variable.split("=")[0], "run_state" in said or "mode" in said, said)
        said = run("docker", "run", "--rm", "--network", NETWORK, IMAGE, "host", "robot:1000", "so")
        equal("and a host by its name", "OK", said)
        banner = run("docker", "logs", NAME)
        equal("the banner warns of an open interface", not words, "without a token" in banner or "every call" in banner)
        true("and names no page, which has another address outside", "is ready" in banner and "in a browser" not in banner, banner)
        run("docker", "rm", "-f", NAME)


def compose():
    """packaging/compose.yaml: a robot, and tests that wait until it is healthy and find it by its name."""
    if not shutil.which("docker-compose"):
        install("docker-compose")
    command = ["docker-compose", "-f", os.path.join(ROOT, "packaging", "compose.yaml"), "-p", NAME]
    environment = {**os.environ, "TS3100_IMAGE": IMAGE}
    try:
        said = run(*command, "up", "--no-color", "--exit-code-from", "tests", env=environment)
        true("the tests of compose.yaml pass", re.search(r"tests_1 .*OK", said), said)
    finally:
        run(*command, "down", env=environment)


def page(binary):
    """The commands of docs/how-to/docker.md, with the image, ports and names that they give to their reader."""
    try:
        pages.run("containers/docker_image", os.path.abspath(binary))
    finally:
        succeeds("docker", "rm", "-f", "robot", "guarded")
        succeeds("docker", "volume", "rm", "robot-drive")
        succeeds("docker", "rmi", "ts3100")


def other_processor(binary):
    """The image for the other processor: so it says, it is as small, and a host reaches its robot."""
    machine, architecture = {"x86_64": ("aarch64", "arm64"), "aarch64": ("x86_64", "amd64")}[platform.machine()]
    emulator = shutil.which("qemu-%s-static" % machine)
    if not emulator:
        install("qemu-user-static")
        emulator = shutil.which("qemu-%s-static" % machine)
    build(binary, OTHER, "linux/" + architecture)
    found = run("docker", "image", "inspect", "-f", "{{.Os}}/{{.Architecture}} {{.Size}}", OTHER)
    name, size = found.split()
    equal("the platform of the other image", "linux/" + architecture, name)
    true("it has %.2f MB" % (int(size) / 1e6), int(size) < MOST_BYTES)
    # The kernel would start qemu by itself where binfmt_misc is set up; the health check of the image needs that.
    run("docker", "run", "-d", "--name", NAME, "--platform", "linux/" + architecture, "--no-healthcheck", "-p", "127.0.0.1::1000",
        "-v", emulator + ":/qemu:ro", "--entrypoint", "/qemu", OTHER, "/usr/local/bin/ts3100", "serve", "--listen", "0.0.0.0")
    until("the other robot starts", lambda: "ready" in run("docker", "logs", NAME), HEALTHY_TIMEOUT, lambda: run("docker", "logs", NAME),
          pause=0.2)
    host = Host(Container.address(1000), True)
    host.command(b"SO")
    ok("a host talks to it")
    run("docker", "rm", "-f", NAME)


def clean():
    """Nothing of ours is left, of this run or of one that was killed."""
    succeeds("docker", "rm", "-f", NAME)
    succeeds("docker", "volume", "rm", VOLUME)
    succeeds("docker", "network", "rm", NETWORK)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", help="a static ts3100 in place of one that is built")
    arguments.add_argument("--other", help="a static ts3100 for the other processor")
    arguments = arguments.parse_args()
    binary = arguments.binary or static_binary()
    with docker():
        build(binary)
        clean()
        try:
            for part in (only_static, image, job, flags, by_name, compose):
                part()
            page(binary)
            if arguments.other:
                other_processor(arguments.other)
        finally:
            clean()


if __name__ == "__main__":
    sys.exit(program(main))
