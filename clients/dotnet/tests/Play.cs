// Plays the calls of a file at a URL by Robot.Call, and prints an answer a line: tests/system/lib/recorded_calls.py compares them.
using System;
using System.IO;
using System.Linq;
using Ts3100;

static class Play
{
    static void Main(string[] arguments)
    {
        using (var robot = new Robot(arguments[1]))
            foreach (Json call in Json.Parse(File.ReadAllText(arguments[0])))
            {
                Json values = call["arguments"];
                object[] namesAndValues = values.Names.SelectMany(name => new object[] { name, values[name] }).ToArray();
                try
                {
                    Console.WriteLine(robot.Call(call["operation"].AsString(), namesAndValues));
                }
                catch (ControlException error)
                {
                    Console.WriteLine(Json.Object("error", error.Message));
                }
            }
    }
}
