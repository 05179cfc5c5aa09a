using System; // mcs my_engine.cs && mono my_engine.exe
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
static class MyEngine {
    static double[] Get(string line, string name) { // the numbers of a field
        var rest = line.Substring(line.IndexOf("\"" + name + "\": ") + name.Length + 4).TrimStart('[');
        var numbers = rest.Substring(0, rest.IndexOfAny(new[] { ']', '}', '"' })).TrimEnd(',', ' ').Split(',');
        return numbers.Select(text => double.Parse(text, CultureInfo.InvariantCulture)).ToArray();
    }
    static string Text(IEnumerable<double> list) => "[" + string.Join(", ", list.Select(x => x.ToString("R", CultureInfo.InvariantCulture))) + "]";
    static string Integrate(string line, double calls, bool answer) { // semi-implicit Euler
        double[] q = Get(line, "q0"), w = Get(line, "w0"), J = Get(line, "moments"), steps = Get(line, "steps"), dt = Get(line, "dt");
        List<string> Q = new List<string>(), W = new List<string>();
        for (; calls > 0; calls--) {
            double h = dt[0], a = q[0], b = q[1], c = q[2], d = q[3], x = w[0], y = w[1], z = w[2];
            for (int n = 0, sample = 0; sample < steps.Length; n++) {
                if (n == steps[sample] && sample++ >= 0 && answer) { Q.Add(Text(new[] { a, b, c, d })); W.Add(Text(new[] { x, y, z })); }
                double u = x + h * (J[1] - J[2]) * y * z / J[0], v = y + h * (J[2] - J[0]) * z * x / J[1];
                z += h * (J[0] - J[1]) * x * y / J[2]; x = u; y = v;
                double e = a - h / 2 * (b * x + c * y + d * z), f = b + h / 2 * (a * x + c * z - d * y);
                double g = c + h / 2 * (a * y + d * x - b * z), i = d + h / 2 * (a * z + b * y - c * x);
                double norm = Math.Sqrt(e * e + f * f + g * g + i * i);
                a = e / norm; b = f / norm; c = g / norm; d = i / norm;
            }
        }
        return "{\"q\": [" + string.Join(", ", Q) + "], \"w\": [" + string.Join(", ", W) + "]}";
    }
    static void Main() {
        var runs = new List<string>();
        for (string line; (line = Console.ReadLine()) != null;) {
            var clock = System.Diagnostics.Stopwatch.StartNew();
            if (line.Contains("\"hello\"")) Console.WriteLine("{\"protocol\": 1, \"program\": \"C#\", \"version\": \"1\", \"framing\": \"lines\"}");
            else if (line.Contains("\"free\": false")) Console.WriteLine("{\"error\": \"unsupported\", \"message\": \"only free bodies\"}");
            else if (line.Contains("\"prepare\"")) { Console.WriteLine("{\"run\": " + runs.Count + "}"); runs.Add(line); }
            else if (!line.Contains("\"calls\"")) Console.WriteLine(Integrate(runs[(int)Get(line, "run")[0]], 1, true));
            else { Integrate(runs[(int)Get(line, "run")[0]], Get(line, "calls")[0], false); Console.WriteLine("{\"seconds\": " + clock.Elapsed.TotalSeconds.ToString("R", CultureInfo.InvariantCulture) + "}"); }
        }
    }
}
