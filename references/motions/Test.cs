// Exact motions as a test of your engine: fill in Simulate, then   mcs Test.cs && mono Test.exe *.csv   (CC0)
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;

class Motion {
  public Dictionary<string, List<double[]>> Rows = new Dictionary<string, List<double[]>>(); // the numbers of the lines of each key
  public List<string> Features = new List<string>(), Mistakes = new List<string>();
  public double[] Get(string key) { return Rows.ContainsKey(key) ? Rows[key][0] : new double[9]; }
}

static class Test {
  const double ORDER = 2;     // the order of your integrator: 1, 2 or 4
  const double ANGLE = 0.01;  // |w| h, rad: 0.1, 0.03 or 0.01
  const bool SINGLE = false;  // single precision
  static readonly string[] HAS = {"rotor", "torque", "damping", "fixed point", "orbit"}; // other motions are skipped

  // YOUR ENGINE: set up the body of the motion, and return its state after each `steps` steps of h seconds: the quaternion,
  // scalar first, body to world, and the rates in body axes, rad/s.
  static double[][] Simulate(Motion motion, double h, int steps, int samples) {
    double[] inertia_B = motion.Get("inertia_B"), q = motion.Get("quaternion_wxyz0"), w = motion.Get("w_WB_B0");
    var states = new double[samples][];
    for (int i = 0; i < samples; i++) {
      for (int n = 0; n < steps; n++) { } // one step
      states[i] = q.Concat(w).ToArray();
    }
    return states;
  }
  // END

  static double Dot(IEnumerable<double> a, IEnumerable<double> b) { return a.Zip(b, (x, y) => x * y).Sum(); }
  static double Apart(IEnumerable<double> a, IEnumerable<double> b, double sign = 1) {
    return Math.Sqrt(a.Zip(b, (x, y) => (x - sign * y) * (x - sign * y)).Sum());
  }
  static double[] Cross(double[] a, double[] b) {
    return new[] {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  }
  static double[] Rotate(double[] q, double[] v) {
    double[] u = {q[1], q[2], q[3]}, uv = Cross(u, v), uuv = Cross(u, uv);
    return Enumerable.Range(0, 3).Select(i => v[i] + 2 * (q[0] * uv[i] + uuv[i])).ToArray();
  }

  // Attitude, rad; rates, energy and momentum relative to the scales of the motion.
  static double[] Errors(Motion m, double[] exact, double[] y) {
    double[] J = m.Get("inertia_B"), h = m.Get("rotor_momentum_B"), scale = m.Get("scale"), w = y.Skip(4).ToArray();
    var L = Enumerable.Range(0, 3).Select(i => Dot(J.Skip(3 * i).Take(3), w)).ToArray();
    double energy = Dot(L, w) / 2 + m.Get("weight")[0] * Rotate(y, m.Get("com_B"))[2];
    var momentum = Rotate(y, L.Zip(h, (a, b) => a + b).ToArray());
    var q = exact.Skip(10).Take(4).ToArray();
    double apart = Math.Min(Apart(y.Take(4), q), Apart(y.Take(4), q, -1));
    return new[] {4 * Math.Asin(Math.Min(1, apart / 2)), Apart(w, exact.Skip(14)) / scale[0],
                  Math.Abs(energy - exact[20]) / scale[1], Apart(momentum, exact.Skip(21)) / scale[2]};
  }

  // The largest errors with so many steps before each sample.
  static double[] Worst(Motion m, int steps) {
    var exact = m.Rows["sample"];
    var states = Simulate(m, exact[0][0] / steps, steps, exact.Count);
    var all = exact.Select((row, i) => Errors(m, row, states[i])).ToArray();
    return Enumerable.Range(0, 4).Select(k => all.Max(e => double.IsNaN(e[k]) ? double.PositiveInfinity : e[k])).ToArray();
  }

  const double NEAR = 0.8; // sum of the squares of four logarithms, of errors over those of a mistake that explains them
  class Failure {
    public string Name;
    public Dictionary<string, double> Near = new Dictionary<string, double>(); // the mistakes that explain it, and their distances
    public double Falls;                                                       // the exponent with which the error falls with the step
  }
  static void Print(string format, params object[] values) {
    Console.WriteLine(string.Format(CultureInfo.InvariantCulture, format, values));
  }

  static int Main(string[] files) {
    string[] names = {"attitude", "rates", "energy", "momentum"};
    var failing = new List<Failure>();
    int tested = 0;
    foreach (var file in files) {
      var m = new Motion();
      foreach (var fields in File.ReadAllLines(file).Select(line => line.Split(','))) {
        if (fields[0] == "features") m.Features.AddRange(fields.Skip(1));
        if (fields[0] == "catches") m.Mistakes.Add(fields[1]);
        if (!m.Rows.ContainsKey(fields[0])) m.Rows[fields[0]] = new List<double[]>();
        double x;
        m.Rows[fields[0]].Add(fields.Skip(1).Select(
            each => double.TryParse(each, NumberStyles.Float, CultureInfo.InvariantCulture, out x) ? x : 0).ToArray());
      }
      var part = m.Features.FirstOrDefault(each => !HAS.Contains(each));
      if (part != null) { Console.WriteLine(file + ": skipped, it has " + part); continue; }
      tested++;
      var allowed = m.Rows["tolerance"].First(row => row[0] == ORDER && row[1] == ANGLE);
      var limit = allowed.Skip(3).Select(x => x + (SINGLE ? m.Get("single")[0] : 0)).ToArray();
      var found = Worst(m, (int)allowed[2]);
      int most = Enumerable.Range(0, 4).OrderByDescending(k => found[k] / limit[k]).First();
      double ratio = found[most] / limit[most];
      if (ratio <= 1) continue;
      var failure = new Failure { Name = file };
      for (int n = 0; n < m.Mistakes.Count; n++) {
        var known = m.Rows["catches"][n];
        double apart = Enumerable.Range(0, 4).Sum(
            k => Math.Pow(Math.Log(Math.Max(found[k], limit[k]) / Math.Max(known[1 + k], limit[k])), 2));
        if (apart < NEAR) failure.Near[m.Mistakes[n]] = apart;
      }
      double half = Worst(m, 2 * (int)allowed[2])[most];
      if (found[most] < double.PositiveInfinity && half > 0) failure.Falls = Math.Log(found[most] / half, 2);
      var text = string.Format(CultureInfo.InvariantCulture, "{0}: {1} error {2:0.0e+00}, tolerance {3:0.0e+00}",
                               file, names[most], found[most], limit[most]);
      if (failure.Falls >= ORDER - 0.5 && (ratio <= 2 || failure.Near.Count == 0)) {
        Print("{0}: {1:0} % above the tolerance, falls as h^{2:0.0}: right", text, 100 * (ratio - 1), failure.Falls);
        continue;
      }
      Console.WriteLine(text);
      failing.Add(failure);
    }

    Print("{0} of {1} motions failed", failing.Count, tested);
    var rest = failing.ToList();
    for (int n = 0; n < 3; n++) { // the mistakes that explain most of the failing motions
      var best = rest.SelectMany(each => each.Near).GroupBy(each => each.Key).OrderByDescending(each => each.Count())
                     .ThenBy(each => each.Sum(vote => vote.Value)).FirstOrDefault();
      if (best == null || 10 * best.Count() < failing.Count) break;
      Print("\"{0}\" explains {1} of them", best.Key, best.Count());
      rest = rest.Where(each => !each.Near.ContainsKey(best.Key)).ToList();
    }
    if (failing.Count == 0) return 0;
    double order = failing.Select(each => each.Falls).OrderBy(x => x).ElementAt(failing.Count / 2);
    if (2 * rest.Count > failing.Count && order >= 0.5 && order < ORDER - 0.5)
      Print("this program has order {0:0.0}, {1} was declared", order, ORDER);
    if (rest.Count > 0)
      Print("{0} not explained by a mistake of the list: {1}", rest.Count, string.Join(", ", rest.Take(5).Select(each => each.Name)));
    return 1;
  }
}
