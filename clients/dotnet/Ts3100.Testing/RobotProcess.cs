using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Linq;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using System.Threading.Tasks;

namespace Ts3100.Testing
{
    /// <summary>The emulator did not start.</summary>
    public sealed class StartException : InvalidOperationException
    {
        /// <summary>An exception with this message.</summary>
        public StartException(string message) : base(message) { }
    }

    /// <summary>A running <c>ts3100 serve</c> on free ports.</summary>
    public sealed class RobotProcess : IDisposable
    {
        /// <summary>The variable that names the binary; without it, <c>ts3100</c> is searched in PATH.</summary>
        public const string BinaryVariable = "TS3100_BINARY";
        const int LogLines = 100, Sigterm = 15;
        // It is up in milliseconds; a machine under load takes longer.
        static readonly TimeSpan StartLimit = TimeSpan.FromSeconds(20), EndLimit = TimeSpan.FromSeconds(5), RunLimit = TimeSpan.FromSeconds(60);

        readonly Process process, guard;
        readonly List<string> log = new List<string>();
        readonly Json ready;

        /// <summary>Starts an emulator and waits until every port accepts connections.</summary>
        /// <param name="arguments">Options of <c>ts3100 serve</c>. Variables that set options have no effect.</param>
        /// <exception cref="StartException">It does not start; the message has its log.</exception>
        public RobotProcess(params string[] arguments)
        {
            string binary = Binary;
            var start = new ProcessStartInfo(binary)
            {
                Arguments = string.Join(" ", new[] { "serve", "--ports", "auto", "--ready-json" }.Concat(arguments).Select(Quoted)),
                UseShellExecute = false,
                CreateNoWindow = true,
                RedirectStandardOutput = true,
                RedirectStandardError = true
            };
            // A variable such as TS3100_DRIVE is a setting too; tests say their settings here.
            foreach (string name in start.EnvironmentVariables.Keys.Cast<string>().Where(IsSetting).ToArray())
                start.EnvironmentVariables.Remove(name);
            try
            {
                process = Process.Start(start);
            }
            catch (System.ComponentModel.Win32Exception error)
            {
                throw new StartException("cannot run " + binary + ": " + error.Message + "; install ts3100, or set "
                    + BinaryVariable + " to its path");
            }
            try
            {
                // Ends the emulator if this process is killed: `read` ends with the pipe from here.
                guard = Process.Start(new ProcessStartInfo("/bin/sh", "-c " + Quoted("read -r _; kill \"$0\" 2>/dev/null") + " " + process.Id)
                {
                    UseShellExecute = false,
                    RedirectStandardInput = true
                });
            }
            catch (System.ComponentModel.Win32Exception)
            {
                // Windows has no such shell, and some containers have none either.
            }
            AppDomain.CurrentDomain.ProcessExit += EndWithUs;
            // NUnit's runner for .NET Framework and Mono unloads the tests before the process ends.
            AppDomain.CurrentDomain.DomainUnload += EndWithUs;
            process.ErrorDataReceived += Keep;
            process.BeginErrorReadLine();
            Task<string> line = process.StandardOutput.ReadLineAsync();
            if (!line.Wait(StartLimit) || line.Result == null)
            {
                Dispose();
                throw new StartException("ts3100 serve did not become ready within " + StartLimit.TotalSeconds + " s:\n" + Log());
            }
            ready = Json.Parse(line.Result);
        }

        /// <summary>The URL of the control interface.</summary>
        public string ControlUrl { get { return ready["control"].AsString(); } }

        /// <summary>The TCP port of a channel: <c>ip0</c> to <c>ip3</c>.</summary>
        public int Port(string channel) { return ready["ports"][channel].AsInt(); }

        /// <summary>The last lines of the log.</summary>
        public string Log()
        {
            lock (log)
                return string.Join("\n", log);
        }

        /// <summary>Ends the emulator. It writes its reports first, except on Windows.</summary>
        public void Dispose()
        {
            AppDomain.CurrentDomain.ProcessExit -= EndWithUs;
            AppDomain.CurrentDomain.DomainUnload -= EndWithUs;
            if (guard != null)
            {
                guard.Kill();
                guard.WaitForExit();
                guard.Dispose();
            }
            if (!process.HasExited && !RuntimeInformation.IsOSPlatform(OSPlatform.Windows) && kill(process.Id, Sigterm) == 0)
                process.WaitForExit((int)EndLimit.TotalMilliseconds);
            EndWithUs(null, null);
            process.Dispose();
        }

        void EndWithUs(object sender, EventArgs e)
        {
            try
            {
                if (!process.HasExited)
                    process.Kill();
            }
            catch (Exception error) when (error is InvalidOperationException || error is System.ComponentModel.Win32Exception)
            {
                // It has ended meanwhile.
            }
            process.WaitForExit(); // its log is complete then
        }

        void Keep(object sender, DataReceivedEventArgs line)
        {
            lock (log)
            {
                if (line.Data != null)
                    log.Add(line.Data);
                if (log.Count > LogLines)
                    log.RemoveAt(0);
            }
        }

        static string Binary { get { return Environment.GetEnvironmentVariable(BinaryVariable) ?? "ts3100"; } }

        /// <summary>Runs another command of the binary. Returns why it failed; null if it has not.</summary>
        internal static string Run(params string[] arguments)
        {
            try
            {
                using (Process command = Process.Start(new ProcessStartInfo(Binary)
                {
                    Arguments = string.Join(" ", arguments.Select(Quoted)),
                    UseShellExecute = false,
                    CreateNoWindow = true,
                    RedirectStandardError = true
                }))
                {
                    Task<string> said = command.StandardError.ReadToEndAsync();
                    if (!said.Wait(RunLimit))
                    {
                        command.Kill();
                        return Binary + " did not end within " + RunLimit.TotalSeconds + " s";
                    }
                    command.WaitForExit();
                    return command.ExitCode == 0 ? null : said.Result.Trim();
                }
            }
            catch (Exception error) when (error is InvalidOperationException || error is System.ComponentModel.Win32Exception)
            {
                return "cannot run " + Binary + ": " + error.Message;
            }
        }

        static bool IsSetting(string name) { return name.StartsWith("TS3100_", StringComparison.OrdinalIgnoreCase); }

        // Process.Kill ends a process before it has written its reports, and .NET has no other call.
        [DllImport("libc", SetLastError = true)]
        static extern int kill(int process, int signal);

        /// <summary>An argument as the command line of Windows and .NET quotes it.</summary>
        static string Quoted(string argument)
        {
            string escaped = Regex.Replace(argument, @"(\\*)""", @"$1$1\""");
            return "\"" + Regex.Replace(escaped, @"(\\+)$", "$1$1") + "\"";
        }
    }
}
