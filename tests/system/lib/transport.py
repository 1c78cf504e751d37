"""How a host of this folder reaches the robot: a TCP connection, one that the robot itself makes, a serial terminal,
or a serial port behind RFC 2217 (with pyserial). All four send, wait for bytes, and take them."""

import os
import select
import socket
import termios
import time

CONNECT_TIMEOUT = 5.0
SPEEDS = {speed: getattr(termios, "B%d" % speed) for speed in (1200, 2400, 4800, 9600, 19200, 38400, 115200)}


class Settings:
    """Speed and frame of a serial line, as `9600` and `8N1`."""

    def __init__(self, speed=9600, frame="8N1"):
        self.speed, self.bits, self.parity, self.stops = speed, int(frame[0]), frame[1], int(frame[2])

    def parameter(self):
        """The numbers behind the = of [U06]."""
        return b"%d %d %d %d" % (self.speed, self.bits, "NOE".index(self.parity), self.stops)


class Tcp:
    """A TCP connection: made to an address, or given."""

    def __init__(self, address):
        connected = isinstance(address, socket.socket)
        self.socket = address if connected else socket.create_connection(address, timeout=CONNECT_TIMEOUT)
        self.socket.settimeout(CONNECT_TIMEOUT)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data):
        self.socket.sendall(data)

    def receive(self, timeout):
        """Bytes, b"" when none came in time, None when the peer has closed."""
        ready, _, _ = select.select([self.socket], [], [], max(timeout, 0.0))
        return (self.socket.recv(4096) or None) if ready else b""

    def close(self):
        self.socket.close()


class Listener:
    """An address the robot dials, as a channel in client mode does."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.socket.settimeout(CONNECT_TIMEOUT)
        self.port = self.socket.getsockname()[1]

    def accept(self):
        """The robot's connection."""
        return self.socket.accept()[0]


class Descriptor:
    """An open file, such as the other end of a terminal."""

    def __init__(self, file):
        self.file = file

    def send(self, data):
        while data:
            data = data[os.write(self.file, data):]

    def receive(self, timeout):
        ready, _, _ = select.select([self.file], [], [], max(timeout, 0.0))
        return (os.read(self.file, 4096) or None) if ready else b""

    def close(self):
        os.close(self.file)


class Terminal(Descriptor):
    """A serial terminal by its path, opened as programs open one: raw, with its speed and frame."""

    def __init__(self, path, settings):
        super().__init__(os.open(path, os.O_RDWR | os.O_NOCTTY))
        attributes = termios.tcgetattr(self.file)
        frame = termios.CREAD | termios.CLOCAL | (termios.CS8 if settings.bits == 8 else termios.CS7)
        frame |= {"N": 0, "E": termios.PARENB, "O": termios.PARENB | termios.PARODD}[settings.parity]
        frame |= termios.CSTOPB if settings.stops == 2 else 0
        speed = SPEEDS[settings.speed]
        termios.tcsetattr(self.file, termios.TCSANOW, [0, 0, frame, 0, speed, speed, attributes[6]])


class Remote:
    """A serial port behind RFC 2217, by pyserial."""

    def __init__(self, address, settings):
        import serial
        self.port = serial.serial_for_url("rfc2217://%s:%d" % address, baudrate=settings.speed,
                                          bytesize=settings.bits, parity=settings.parity, stopbits=settings.stops)

    def send(self, data):
        self.port.write(data)

    def receive(self, timeout):
        limit = time.monotonic() + timeout
        while True:
            # What has come at once, or one byte within the time that is left.
            self.port.timeout = max(limit - time.monotonic(), 0.0)
            data = self.port.read(max(self.port.in_waiting, 1))
            if data or time.monotonic() >= limit:
                return data

    def close(self):
        self.port.close()
