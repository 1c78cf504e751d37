#!/usr/bin/env python3
"""The robot as a service container, as a CI job has it: the image of `packaging/Dockerfile` is built of a static binary
and started; its health check says so, hosts reach every port from outside, the control interface asks for its token,
files outlive the container on their volume, and `docker stop` ends it in order.

    python3 tests/container.py [--binary STATIC_TS3100]

Without --binary the binary is built for x86_64-unknown-linux-musl or the same of this machine. Docker is installed by
apt and its daemon started where they are missing, which needs root or sudo and is said. Where no registry is in reach
the base image is made of Debian's busybox-static."""

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from wire import Failed, Host, Line, equal, true  # noqa: E402

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
IMAGE, NAME, VOLUME = "ts3100-test", "ts3100-test-robot", "ts3100-test-drive"
TOKEN = "only-for-this-test"
DAEMON_TIMEOUT = 60
PULL_TIMEOUT = 30
HEALTHY_TIMEOUT = 30
STOP_LIMIT = 5.0
ROOT_COMMAND = [] if os.geteuid() == 0 else ["sudo"]


def run(*command, **more):
    """Output of a command that has to succeed."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    if done.returncode:
        raise Failed("%s\n     exit code %d\n%s" % (" ".join(command), done.returncode, done.stdout))
    return done.stdout.strip()


def succeeds(*command, timeout=None):
    """Whether a command does."""
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              timeout=timeout, check=False).returncode == 0
    except (subprocess.TimeoutExpired, FileNotFoundError):
        return False


def install(package):
    """A package of the system."""
    print("installing %s" % package, flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    run(*ROOT_COMMAND, "apt-get", "update", "-q")
    run(*ROOT_COMMAND, "apt-get", "install", "-y", "-q", "--no-install-recommends", package, env=environment)


def start_docker():
    """A container engine that answers. Returns the daemon if it was started here."""
    if succeeds("docker", "info"):
        return None
    if not shutil.which("dockerd"):
        install("docker.io")
    print("starting dockerd", flush=True)
    with open(os.path.join(tempfile.gettempdir(), "ts3100-dockerd.log"), "w", encoding="utf-8") as log:
        daemon = subprocess.Popen([*ROOT_COMMAND, "dockerd"], stdout=log, stderr=log, start_new_session=True)
    end = time.monotonic() + DAEMON_TIMEOUT
    while not succeeds("docker", "info"):
        if time.monotonic() > end or daemon.poll() is not None:
            raise Failed("dockerd does not answer; its log is %s" % log.name)
        time.sleep(0.5)
    return daemon


def base_image():
    """busybox:1, from a registry or of the system's static one."""
    if succeeds("docker", "image", "inspect", "busybox:1") or succeeds("docker", "pull", "-q", "busybox:1",
                                                                       timeout=PULL_TIMEOUT):
        return
    print("no registry in reach: busybox:1 is made of busybox-static", flush=True)
    if not (shutil.which("busybox") and "statically" in run("sh", "-c", "file -L $(command -v busybox) || echo statically")):
        install("busybox-static")
    with tempfile.TemporaryDirectory() as folder:
        for place in ("bin", "etc", "tmp"):
            os.mkdir(os.path.join(folder, place))
        shutil.copy(shutil.which("busybox"), os.path.join(folder, "bin", "busybox"))
        for applet in ("sh", "mkdir", "chown"):
            os.symlink("busybox", os.path.join(folder, "bin", applet))
        run("sh", "-c", "tar -cf - -C '%s' . | docker import - busybox:1" % folder)


def static_binary():
    """A binary without shared libraries, of the sources as they are."""
    target = "%s-unknown-linux-musl" % platform.machine()
    run("rustup", "target", "add", target, cwd=ROOT)
    run("cargo", "build", "--locked", "--release", "--target", target, "-p", "ts3100-emulator", "--bin", "ts3100", cwd=ROOT)
    folder = os.environ.get("CARGO_TARGET_DIR") or os.path.join(ROOT, "target")
    return os.path.join(folder, target, "release", "ts3100")


def build(binary):
    """The image, by the command of docs/how-to/docker.md."""
    base_image()
    run("sh", "-c", "tar -cf - -C '%s/packaging' Dockerfile -C '%s' ts3100 | docker build -q -t %s -"
        % (ROOT, os.path.dirname(os.path.abspath(binary)), IMAGE))


class Container:
    """The service, its ports mapped to free ones of the loopback."""

    def __init__(self, *arguments, environment=()):
        ports = [word for port in (1000, 1001, 1002, 1003, 2217, 3100) for word in ("-p", "127.0.0.1::%d" % port)]
        settings = [word for pair in environment for word in ("-e", pair)]
        run("docker", "run", "-d", "--name", NAME, "--health-interval", "1s", "-v", VOLUME + ":/drive", *ports, *settings,
            IMAGE, *arguments)
        self.wait_until_healthy()

    def wait_until_healthy(self):
        end = time.monotonic() + HEALTHY_TIMEOUT
        while self.inspect("{{.State.Health.Status}}") != "healthy":
            if time.monotonic() > end or self.inspect("{{.State.Running}}") != "true":
                raise Failed("the container is not healthy\n%s\n%s"
                             % (self.inspect("{{json .State}}"), run("docker", "logs", NAME)))
            time.sleep(0.2)

    @staticmethod
    def inspect(form):
        return run("docker", "inspect", "-f", form, NAME)

    @staticmethod
    def address(port):
        host, number = run("docker", "port", NAME, "%d/tcp" % port).splitlines()[0].rsplit(":", 1)
        return host, int(number)

    def call(self, path, token=None):
        """Status and body of a GET of the control interface."""
        request = urllib.request.Request("http://%s:%d%s" % (*self.address(3100), path))
        if token:
            request.add_header("Authorization", "Bearer " + token)
        try:
            with urllib.request.urlopen(request, timeout=5) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, error.read().decode()

    def health_checked_again(self):
        """What the next health check says."""
        checks = "{{range .State.Health.Log}}{{.Start}} {{end}}"
        before, end = self.inspect(checks), time.monotonic() + HEALTHY_TIMEOUT
        while self.inspect(checks) == before and time.monotonic() < end:
            time.sleep(0.2)
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
    robot = Container(environment=["TS3100_CONTROL=0.0.0.0:3100", "TS3100_CONTROL_TOKEN=" + TOKEN])
    ip0, ip1 = Host(robot.address(1000), True), Line(robot.address(1001))
    ip0.command(b"SO")
    ip0.download(b"HELLO", b"PROGRAM HELLO\nPRINT IP1, \"HELLO\", CR\nEND\n")
    ip0.command(b"SL,HELLO")
    ip0.command(b"RN")
    equal("what the program prints comes over the mapped port 1001", b"HELLO\r", ip1.until(b"\r"))
    equal("the control interface without its token", 401, robot.call("/state")[0])
    status, body = robot.call("/state", TOKEN)
    equal("the control interface with it", (200, "HELLO"), (status, json.loads(body)["file"]))
    equal("with a host on IP0 it stays healthy", "healthy", robot.health_checked_again())
    equal("its user has no rights", "1000:1000", robot.inspect("{{.Config.User}}"))
    seconds, code = robot.stop()
    equal("exit code behind docker stop", "0", code)
    true("docker stop took %.1f s" % seconds, seconds < STOP_LIMIT)
    robot = Container()
    directory = Host(robot.address(1000), False).file(b"CA")
    true("the file is on the volume for the next container", b"HELLO" in directory, directory)
    robot.stop()


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", help="a static ts3100 in place of one that is built")
    arguments = arguments.parse_args()
    daemon = None
    try:
        daemon = start_docker()
        build(arguments.binary or static_binary())
        succeeds("docker", "rm", "-f", NAME)
        succeeds("docker", "volume", "rm", VOLUME)
        job()
    except (Failed, OSError) as failed:
        print("FAILED %s" % failed, file=sys.stderr)
        return 1
    finally:
        succeeds("docker", "rm", "-f", NAME)
        succeeds("docker", "volume", "rm", VOLUME)
        if daemon:
            run(*ROOT_COMMAND, "kill", str(daemon.pid))
            daemon.wait(timeout=DAEMON_TIMEOUT)
    print("the container serves, is looked after, and ends in order")
    return 0


if __name__ == "__main__":
    sys.exit(main())
