using System;
using System.Collections;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Text;

namespace Ts3100
{
    /// <summary>A JSON value. The libraries depend on no package, so they also run on .NET Framework and Mono.</summary>
    public sealed class Json : IEnumerable<Json>
    {
        /// <summary>How deep values may be nested in each other.</summary>
        public const int DeepestNesting = 64;

        readonly object value;

        Json(object value)
        {
            this.value = value;
        }

        /// <summary>Whether the value is null.</summary>
        public bool IsNull { get { return value == null; } }

        /// <summary>The number of members or elements.</summary>
        public int Count { get { return value is List<Json> list ? list.Count : Members.Count; } }

        /// <summary>The names of an object's members.</summary>
        public IEnumerable<string> Names { get { return Members.Keys; } }

        /// <summary>A member of an object.</summary>
        /// <exception cref="KeyNotFoundException">There is no such member.</exception>
        public Json this[string name]
        {
            get
            {
                if (Members.TryGetValue(name, out Json member))
                    return member;
                throw new KeyNotFoundException("no member `" + name + "` in " + this);
            }
        }

        /// <summary>An element of an array.</summary>
        public Json this[int index] { get { return Cast<List<Json>>("an array")[index]; } }

        /// <summary>Whether an object has this member.</summary>
        public bool Has(string name)
        {
            return value is Dictionary<string, Json> members && members.ContainsKey(name);
        }

        /// <summary>The text of a string.</summary>
        public string AsString() { return Cast<string>("a string"); }

        /// <summary>The value of a number.</summary>
        public double AsDouble() { return value is ulong whole ? whole : Cast<double>("a number"); }

        /// <summary>The value of a whole number.</summary>
        public int AsInt() { return checked((int)AsDouble()); }

        /// <summary>The value of true or false.</summary>
        public bool AsBool() { return Cast<bool>("true or false"); }

        /// <summary>The numbers of an array.</summary>
        public double[] AsDoubles() { return this.Select(element => element.AsDouble()).ToArray(); }

        /// <summary>The elements of an array.</summary>
        public IEnumerator<Json> GetEnumerator() { return Cast<List<Json>>("an array").GetEnumerator(); }

        IEnumerator IEnumerable.GetEnumerator() { return GetEnumerator(); }

        /// <summary>The value as JSON text.</summary>
        public override string ToString()
        {
            return ToText(value);
        }

        /// <summary>An object as JSON text, from names and values in turn.</summary>
        public static string Object(params object[] namesAndValues)
        {
            var text = new StringBuilder("{");
            for (int at = 0; at + 1 < namesAndValues.Length; at += 2)
            {
                if (at > 0)
                    text.Append(',');
                Write(text, namesAndValues[at]);
                text.Append(':');
                Write(text, namesAndValues[at + 1]);
            }
            return text.Append('}').ToString();
        }

        /// <summary>Reads JSON text.</summary>
        /// <exception cref="FormatException">The text is not JSON; the message names the place.</exception>
        public static Json Parse(string text)
        {
            var reader = new Reader { Text = text };
            object value = reader.Value(0);
            reader.Blanks();
            if (reader.At < text.Length)
                throw reader.Expected("the end");
            return new Json(value);
        }

        /// <summary>A string.</summary>
        internal static Json Text(string text) { return new Json(text); }

        /// <summary>A value as a part of an address.</summary>
        internal static string Plain(object value)
        {
            value = value is Json json ? json.value : value;
            return value is string text ? text : ToText(value);
        }

        Dictionary<string, Json> Members { get { return Cast<Dictionary<string, Json>>("an object"); } }

        T Cast<T>(string expected)
        {
            if (value is T)
                return (T)value;
            throw new InvalidCastException("expected " + expected + ", found " + this);
        }

        static void Write(StringBuilder text, object value)
        {
            if (value is string plain)
                Quote(text, plain);
            else if (value is Json json)
                Write(text, json.value);
            else if (value is Dictionary<string, Json> members)
                text.Append(Object(members.SelectMany(member => new object[] { member.Key, member.Value }).ToArray()));
            else if (value is IEnumerable elements)
                text.Append('[').Append(string.Join(",", elements.Cast<object>().Select(ToText))).Append(']');
            else
                text.Append(value == null ? "null" : value is bool flag ? (flag ? "true" : "false")
                    : string.Format(CultureInfo.InvariantCulture, value is double ? "{0:R}" : "{0}", value));
        }

        static string ToText(object value)
        {
            var text = new StringBuilder();
            Write(text, value);
            return text.ToString();
        }

        static void Quote(StringBuilder text, string plain)
        {
            text.Append('"');
            foreach (char letter in plain)
                if (letter == '"' || letter == '\\')
                    text.Append('\\').Append(letter);
                else if (letter < ' ')
                    text.Append("\\u").Append(((int)letter).ToString("x4"));
                else
                    text.Append(letter);
            text.Append('"');
        }

        sealed class Reader
        {
            /// <summary>2 to the power of 53.</summary>
            const double LargestExact = 9007199254740992;

            public string Text;
            public int At;

            public void Blanks()
            {
                while (At < Text.Length && " \t\r\n".IndexOf(Text[At]) >= 0)
                    At++;
            }

            public FormatException Expected(string what)
            {
                string found = At < Text.Length ? "`" + Text[At] + "`" : "the end";
                return new FormatException("JSON, character " + (At + 1) + ": expected " + what + ", found " + found);
            }

            public object Value(int depth)
            {
                if (depth > DeepestNesting)
                    throw Expected("at most " + DeepestNesting + " values in each other");
                Blanks();
                if (Take('{'))
                    return Object(depth);
                if (Take('['))
                    return Array(depth);
                if (Take('"'))
                    return String();
                if (Word("true"))
                    return true;
                if (Word("false"))
                    return false;
                return Word("null") ? (object)null : Number();
            }

            Dictionary<string, Json> Object(int depth)
            {
                var members = new Dictionary<string, Json>();
                Blanks();
                if (Take('}'))
                    return members;
                do
                {
                    Blanks();
                    Need('"');
                    string name = String();
                    Blanks();
                    Need(':');
                    members[name] = new Json(Value(depth + 1));
                    Blanks();
                } while (Take(','));
                Need('}');
                return members;
            }

            List<Json> Array(int depth)
            {
                var elements = new List<Json>();
                Blanks();
                if (Take(']'))
                    return elements;
                do
                {
                    elements.Add(new Json(Value(depth + 1)));
                    Blanks();
                } while (Take(','));
                Need(']');
                return elements;
            }

            string String()
            {
                var text = new StringBuilder();
                while (!Take('"'))
                {
                    if (At == Text.Length)
                        throw Expected("`\"`");
                    text.Append(Take('\\') ? Escaped() : Text[At++]);
                }
                return text.ToString();
            }

            char Escaped()
            {
                const string Letters = "\"\\/bfnrt", Meanings = "\"\\/\b\f\n\r\t";
                int which = At < Text.Length ? Letters.IndexOf(Text[At]) : -1;
                if (which >= 0)
                {
                    At++;
                    return Meanings[which];
                }
                Need('u');
                if (At + 4 > Text.Length || !ushort.TryParse(Text.Substring(At, 4), NumberStyles.AllowHexSpecifier,
                    CultureInfo.InvariantCulture, out ushort code))
                    throw Expected("four hexadecimal digits");
                At += 4;
                return (char)code;
            }

            object Number()
            {
                int from = At;
                while (At < Text.Length && "+-.0123456789Ee".IndexOf(Text[At]) >= 0)
                    At++;
                string digits = Text.Substring(from, At - from);
                if (double.TryParse(digits, NumberStyles.Float, CultureInfo.InvariantCulture, out double number))
                    // Seeds in a snapshot have 64 bits, a double has 53.
                    return number > LargestExact && ulong.TryParse(digits, NumberStyles.None, CultureInfo.InvariantCulture, out ulong whole)
                        ? (object)whole : number;
                At = from;
                throw Expected("a value");
            }

            bool Word(string word)
            {
                bool here = string.CompareOrdinal(Text, At, word, 0, word.Length) == 0;
                At += here ? word.Length : 0;
                return here;
            }

            bool Take(char letter)
            {
                bool here = At < Text.Length && Text[At] == letter;
                At += here ? 1 : 0;
                return here;
            }

            void Need(char letter)
            {
                if (!Take(letter))
                    throw Expected("`" + letter + "`");
            }
        }
    }
}
