#!/usr/bin/env python3
"""Robots as replicas of a Docker Swarm service: `packaging/swarm.yaml` is deployed on a swarm of this machine alone. Every
replica has a name, an address and a volume of its own; one is killed and comes back under its name with its files, and
its host connects again; the hosts of the others notice nothing.

    python3 tests/system/containers/docker_swarm.py [--binary STATIC_TS3100]

Binary, Docker and base image as in docker_image.py. The host is Python in a container of the overlay network: the Python of
this machine, mounted. It fails where this engine already belongs to a swarm."""

import argparse
import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import transport  # noqa: E402
from container_engine import IMAGE, ROOT, build, docker, run, static_binary, succeeds  # noqa: E402
from emulator import answer  # noqa: E402
from steps import Failed, equal, ok, program, true, until  # noqa: E402
from wire import Host  # noqa: E402

STACK, SECRET, LABEL, PYTHON = "ts3100-test", "ts3100-control-token", "ts3100-test", "ts3100-test-python"
SERVICE, NETWORK = STACK + "_robot", STACK + "_robots"
NAMES = ["robot-1", "robot-2", "robot-3"]
KILLED = 2
TOKEN = "only-for-this-test"
CONTROL = "http://%s:3100"
STARTED_TIMEOUT = 90
BACK_TIMEOUT = 60
REMOVED_TIMEOUT = 60
# What a host tells the outer part of this test.
READY = "every robot has its file"


# The host, inside the network.

def addresses(name):
    """What a name of the network resolves to."""
    try:
        return {found[4][0] for found in socket.getaddrinfo(name, 1000, type=socket.SOCK_STREAM)}
    except socket.gaierror:
        return set()


def content(name):
    """The file that a robot gets."""
    return b"PROGRAM OWN\nPRINT IP1, \"%s\", CR\nEND\n" % name.encode()


def connected_again(name):
    """A new connection by the name, as soon as the robot answers on it."""
    def host():
        try:
            host = Host((name, 1000), True)
            host.status()
            return host
        except (OSError, Failed):
            return None

    return until("%s answers SU again" % name, host, BACK_TIMEOUT, pause=0.2)


def inside():
    """Hosts of all robots; one of them loses its robot."""
    transport.CONNECT_TIMEOUT = 1.0
    equal("tasks.robot resolves to one address a robot", len(NAMES), len(addresses("tasks.robot")))
    equal("each name resolves to one of them", addresses("tasks.robot"), set.union(*map(addresses, NAMES)))
    equal("the control interface without its token", 401, answer(CONTROL % NAMES[0], "/state")[0])
    equal("the control interface with it", 200, answer(CONTROL % NAMES[0], "/state", TOKEN)[0])
    hosts = {name: Host((name, 1000), True) for name in NAMES}
    for name, host in hosts.items():
        true("%s answers SU" % name, len(host.status()) == 6)
        host.download(b"OWN", content(name))
    ok(READY)
    lost = NAMES[KILLED - 1]
    longest = dict.fromkeys(NAMES, 0.0)
    end = time.monotonic() + BACK_TIMEOUT
    while lost in hosts:
        if time.monotonic() > end:
            raise Failed("%s is killed within %d s" % (lost, BACK_TIMEOUT))
        for name, host in list(hosts.items()):
            begun = time.monotonic()
            try:
                host.status()
            except (OSError, Failed) as error:
                if name != lost:
                    raise Failed("the host of %s keeps its connection: %s" % (name, error))
                del hosts[name]
                gone = time.monotonic()
            longest[name] = max(longest[name], time.monotonic() - begun)
    back = connected_again(lost)
    ok("%s answers SU on a new connection by its name, %.1f s after it was lost" % (lost, time.monotonic() - gone))
    equal("its file is as it was", content(lost), back.file(b"UL,OWN"))
    for name, host in hosts.items():
        host.status()
        equal("%s has its own file, on the connection of the beginning" % name, content(name), host.file(b"UL,OWN"))


# The swarm, outside.

@contextlib.contextmanager
def swarm():
    """This machine as a swarm of its own, for as long as the block."""
    if succeeds("docker", "node", "inspect", "self"):
        if LABEL not in json.loads(run("docker", "node", "inspect", "-f", "{{json .Spec.Labels}}", "self")):
            raise Failed("this engine already manages a swarm; leave it first: docker swarm leave --force")
        leave()
    run("docker", "swarm", "init", "--advertise-addr", "127.0.0.1")
    try:
        run("docker", "node", "update", "--label-add", LABEL, run("docker", "info", "-f", "{{.Swarm.NodeID}}"))
        yield
    finally:
        leave()


def ours():
    """Containers of the stack."""
    return run("docker", "ps", "-aq", "--filter", "label=com.docker.stack.namespace=" + STACK)


def leave():
    """No stack, no swarm, no volumes."""
    succeeds("docker", "stack", "rm", STACK)
    try:
        until("the containers of the stack end", lambda: not ours(), REMOVED_TIMEOUT, ours)
    finally:
        succeeds("docker", "swarm", "leave", "--force")
        for name in run("docker", "volume", "ls", "-q", "--filter", "name=" + SERVICE).split():
            until("volume %s can be removed" % name, lambda: succeeds("docker", "volume", "rm", name), REMOVED_TIMEOUT)


def container(slot):
    """The running container of a slot: identity, host name, volume."""
    found = run("docker", "ps", "-q", "--no-trunc", "--filter", "name=%s.%d." % (SERVICE, slot)).split()
    if len(found) != 1:
        return None
    form = "{{.Config.Hostname}} {{range .Mounts}}{{if eq .Destination \"/drive\"}}{{.Name}}{{end}}{{end}}"
    return found[0], *run("docker", "inspect", "-f", form, found[0]).split()


def running():
    """How many replicas run, healthy ones only."""
    return run("docker", "service", "ls", "--filter", "name=" + SERVICE, "--format", "{{.Replicas}}")


def described():
    """What the orchestrator says about its tasks, and the robots about themselves."""
    logs = subprocess.run(["docker", "service", "logs", "--raw", SERVICE], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, timeout=10, check=False).stdout
    return run("docker", "stack", "ps", "--no-trunc", STACK) + "\n" + logs


def deploy():
    """The stack, with an image that no registry has."""
    run("docker", "secret", "create", SECRET, "-", input=TOKEN)
    run("docker", "stack", "deploy", "--resolve-image", "never", "--compose-file", os.path.join(ROOT, "packaging", "swarm.yaml"),
        STACK, env={**os.environ, "TS3100_IMAGE": IMAGE})
    begun = time.monotonic()
    until("3 replicas run", lambda: running() == "3/3", STARTED_TIMEOUT, described)
    ok("3 replicas are healthy, %.1f s after docker stack deploy" % (time.monotonic() - begun))


def host_command(folder):
    """A container of the network with the Python of this machine and nothing else; its Python is at the same place."""
    run("sh", "-c", "tar -cf - -C '%s' . | docker import - %s" % (folder, PYTHON))
    places = [place for place in ("/usr", "/lib", "/lib64") if os.path.exists(place)]
    places += [place for place in (os.path.realpath(sys.base_prefix), os.path.join(ROOT, "tests"), os.path.join(ROOT, "clients"))
               if not place.startswith("/usr")]
    mounts = [word for place in places for word in ("-v", "%s:%s:ro" % (place, place))]
    return ["docker", "run", "--rm", "--name", PYTHON, "--network", NETWORK, *mounts, "--entrypoint",
            os.path.realpath(sys.executable), PYTHON, "-u", "-B", os.path.join(ROOT, "tests", "system", "containers", "docker_swarm.py"), "--inside"]


def job():
    """One robot is killed, and comes back."""
    before = {slot: container(slot) for slot in (1, 2, 3)}
    equal("host name and volume by the slot", [("robot-%d" % slot, "%s-%d" % (SERVICE, slot)) for slot in before],
          [found[1:] for found in before.values()])
    equal("no port is published on the machine", "null",
          run("docker", "service", "inspect", "-f", "{{json .Endpoint.Ports}}", SERVICE))
    with tempfile.TemporaryDirectory() as folder:
        host = subprocess.Popen(host_command(folder), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        for line in host.stdout:
            print("     " + line, end="", flush=True)
            if READY in line:
                run("docker", "kill", before[KILLED][0])
        equal("exit code of the host in the network", 0, host.wait(10))
    finally:
        succeeds("docker", "rm", "-f", PYTHON)
        host.kill()
        host.wait()
    until("3 replicas run again", lambda: running() == "3/3", BACK_TIMEOUT, described)
    after = {slot: container(slot) for slot in (1, 2, 3)}
    equal("the killed one has the same name and volume", before[KILLED][1:], after[KILLED][1:])
    true("in a new container", before[KILLED][0] != after[KILLED][0])
    equal("the other containers are those of the beginning", [before[1], before[3]], [after[1], after[3]])


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", help="a static ts3100 in place of one that is built")
    arguments.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    arguments = arguments.parse_args()
    if arguments.inside:
        inside()
        return
    with docker():
        build(arguments.binary or static_binary())
        with swarm():
            deploy()
            job()


if __name__ == "__main__":
    sys.exit(program(main))
