"""The container engine, as the tests of this folder share it: installed and started where it is missing, and the image of
`packaging/Dockerfile` built of a static binary. The programs of `containers` go on from here."""

import contextlib
import os
import platform
import shutil
import subprocess
import tempfile

from steps import Failed, until

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", ".."))
IMAGE = "ts3100-test"
DAEMON_TIMEOUT = 60
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


@contextlib.contextmanager
def docker():
    """A container engine that answers. If it was started here it ends with the block."""
    daemon = start_docker()
    try:
        yield
    finally:
        if daemon:
            run(*ROOT_COMMAND, "kill", str(daemon.pid))
            daemon.wait(timeout=DAEMON_TIMEOUT)


def start_docker():
    """The daemon, if none answered before."""
    if succeeds("docker", "info"):
        return None
    if not shutil.which("dockerd"):
        install("docker.io")
    print("starting dockerd", flush=True)
    with open(os.path.join(tempfile.gettempdir(), "ts3100-dockerd.log"), "w", encoding="utf-8") as log:
        daemon = subprocess.Popen([*ROOT_COMMAND, "dockerd"], stdout=log, stderr=log, start_new_session=True)
    until("dockerd answers; its log is %s" % log.name, lambda: daemon.poll() is not None or succeeds("docker", "info"), DAEMON_TIMEOUT,
          pause=0.5)
    if daemon.poll() is not None:
        raise Failed("dockerd answers\n     found    its end; its log is %s" % log.name)
    return daemon


def static_binary():
    """A binary without shared libraries, of the sources as they are."""
    target = "%s-unknown-linux-musl" % platform.machine()
    run("rustup", "target", "add", target, cwd=ROOT)
    run("cargo", "build", "--locked", "--profile", "dist", "--target", target, "-p", "ts3100-emulator", "--bin", "ts3100", cwd=ROOT)
    folder = os.environ.get("CARGO_TARGET_DIR") or os.path.join(ROOT, "target")
    return os.path.join(folder, target, "dist", "ts3100")


def build(binary, image=IMAGE, platform_name=None):
    """The image, by the command of docs/how-to/docker.md; of another platform as a release does."""
    # Only BuildKit makes images of other platforms. The client that came with the engine has it; another may lack a plug-in.
    docker_build = "DOCKER_BUILDKIT=1 /usr/bin/docker build --platform " + platform_name if platform_name else "docker build"
    run("sh", "-c", "'%s/packaging/image.sh' context '%s' | %s -q -t %s -" % (ROOT, os.path.abspath(binary), docker_build, image))
