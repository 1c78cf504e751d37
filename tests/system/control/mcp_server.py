#!/usr/bin/env python3
"""`ts3100 mcp` with the reference client of the protocol: it starts the server, lists the tools, and works a robot with them.

    python3 tests/system/control/mcp_server.py --serve target/release/ts3100"""

import asyncio
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "lib"))
import python_environment  # noqa: E402
from emulator import Emulator  # noqa: E402
from steps import Failed, equal, program, serving, true  # noqa: E402

CLIENT = ["mcp==1.30.0", "jsonschema==4.26.0"]
SOURCE = "GLOBAL\nN = 0\nEND\nPROGRAM COUNT\nFOR I = 1 TO 10\nN = I\nDELAY 0.1\nNEXT I\nEND\n"


async def session(binary, control):
    """What an assistant does."""
    import jsonschema
    from mcp import ClientSession, StdioServerParameters
    from mcp.client.stdio import stdio_client

    server = StdioServerParameters(command=binary, args=["mcp", "--url", control])
    async with stdio_client(server) as (read, write), ClientSession(read, write) as client:
        hello = await client.initialize()
        equal("the server tells its name", "ts3100", hello.serverInfo.name)
        tools = (await client.list_tools()).tools
        for tool in tools:
            jsonschema.Draft202012Validator.check_schema(tool.inputSchema)
        true("%d tools, each with a schema and a description" % len(tools), all(tool.description for tool in tools))

        async def use(tool, /, **arguments):
            result = await client.call_tool(tool, arguments)
            return result.content[0].text, result.isError

        said, is_error = await use("load_program", name="COUNT", source=SOURCE.replace("DELAY 0.1", "DELY 0.1"))
        true("a wrong program is not stored, and its error is told", is_error and "did you mean DELAY" in said, said)
        said, is_error = await use("load_program", name="COUNT", source=SOURCE)
        true("a right one is", not is_error, said)
        said, is_error = await use("run_program", seconds=5)
        true("it runs to its end", not is_error and json.loads(said)["waited"]["reached"], said)
        said, _ = await use("variables")
        true("its variable has counted to 10", "10" in said, said)
        said, _ = await use("position")
        true("the position is told", "joint" in said, said)
        said, _ = await use("explain", code="answer-early")
        true("a finding is explained", "Wait 50 ms" in said, said)


def main():
    arguments = serving(__doc__).parse_args()
    code = python_environment.run_with(*CLIENT)
    if code is not None:
        return code
    with Emulator(arguments.serve, "--servo-on", "--time", "auto") as emulator:
        try:
            asyncio.run(asyncio.wait_for(session(arguments.serve, emulator.url), 60))
        except BaseExceptionGroup as group:  # of the client's tasks: the reason is the innermost
            reason = group
            while isinstance(reason, BaseExceptionGroup):
                reason = reason.exceptions[0]
            raise Failed(reason) from group


if __name__ == "__main__":
    sys.exit(program(main))
