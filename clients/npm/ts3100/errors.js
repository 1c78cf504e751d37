"use strict";
// What can go wrong between a test and a robot.

class Refused extends Error {
  name = "Refused";
  constructor(command) {
    super(`the robot answered NG to ${command}; the log of the emulator gives the reason`);
    this.command = command;
  }
}

class ControlError extends Error {
  name = "ControlError";
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

class FindingsError extends Error {
  name = "FindingsError";
  constructor(findings, message) {
    super(message);
    this.findings = findings;
  }
}

class ProtocolError extends Error { name = "ProtocolError"; }
class Disconnected extends Error { name = "Disconnected"; }
class NoReply extends Error { name = "NoReply"; }
class NotReached extends Error { name = "NotReached"; }

module.exports = { Refused, ControlError, FindingsError, ProtocolError, Disconnected, NoReply, NotReached };
