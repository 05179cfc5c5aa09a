// Exact rotations as a test of your engine (CC0). Fill in Simulate, then   mcs RotationTest.cs && mono RotationTest.exe
// With mono RotationTest.exe --record known.txt, today's errors become known errors: a later run fails only if a motion gets worse.
// In a project of xUnit, NUnit or MSTest, define WITHOUT_MAIN, and assert in a test that RotationTest.Run() is 0.
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Linq;

public static class RotationTest {
  const int ORDER = 2;         // the order of your integrator: 1, 2 or 4 (2 for order 3)
  const double ANGLE = 0.01;   // |w| h in rad; 0.03 and 0.1 with the files of all motions
  static readonly bool SINGLE = false; // single precision
  const string HAS = "";       // what Simulate reads of `m`: "rotor, torque, damping, fixed point, orbit"; other motions are skipped

  // YOUR ENGINE: set up the body of the motion, and return its state after each `steps` steps of h seconds: the quaternion,
  // scalar first, body to world, and the rates in body axes, rad/s.
  static double[][] Simulate(Motion m, double h, int steps, int samples) {
    var states = new double[samples][]; // m["inertia_B"] is the inertia, by rows
    for (int i = 0; i < samples; i++) {
      for (int n = 0; n < steps; n++) { } // one step
      states[i] = m["quaternion_wxyz0"].Concat(m["w_WB_B0"]).ToArray();
    }
    return states;
  }
  // END

  class Motion {
    public string Name;
    public List<string> Features = new List<string>();
    public List<double[]> Samples = new List<double[]>(), Tolerance = new List<double[]>(); // a sample: time, quaternion, rates
    public Dictionary<string, double[]> Values = new Dictionary<string, double[]>(), Catches = new Dictionary<string, double[]>();
    public double[] this[string key] { get { return Values.ContainsKey(key) ? Values[key] : new double[9]; } }
  }
  class Result {
    public string Name, Note = "", Mistake = "";
    public bool Free, Failed;
    public double[] Found, Limit;
    public int Most; // which error is largest, of Names
    public Dictionary<string, double> Near = new Dictionary<string, double>(); // the mistakes that explain it, and their distances
    public double? Order;
    public Known Was; // below: of a run with known errors
    public bool New, Same;
    public int[] Worse, Lower;
  }
  class Known {
    public string Name, Mistake;
    public double[] Error;
  }
  class Refused : Exception {
    public Refused(string why) : base(why) { }
  }

  static readonly string[] Names = {"attitude", "rates", "energy", "momentum"};
  const double Near = 0.2;    // mean square of logarithms: errors over the errors of a mistake that explains them
  const double Large = 0.08;  // errors that show two mistakes
  const double Largest = 1e6; // instead of errors that are not finite
  const string Features = "rotor, torque, damping, fixed point, orbit";
  const string Header = "# Known errors on exact motions. A later run fails if a motion is worse or has another mistake. Written by --record.";

  static string Format(string format, params object[] values) { return string.Format(CultureInfo.InvariantCulture, format, values); }
  static bool IsNumber(string text, out double x) { return double.TryParse(text, NumberStyles.Float, CultureInfo.InvariantCulture, out x); }
  static double[] Numbers(IEnumerable<string> texts) {
    double x;
    return texts.Select(text => IsNumber(text, out x) ? x : 0).ToArray();
  }

  // The motions of lines with a key and its values.
  static List<Motion> Read(string text) {
    var motions = new List<Motion>();
    foreach (var fields in text.Split('\n').Select(line => line.Trim().Split(','))) {
      string key = fields[0];
      var row = Numbers(fields.Skip(1));
      var m = motions.LastOrDefault();
      if (key == "name") motions.Add(new Motion { Name = fields[1] });
      else if (m == null) continue;
      else if (key == "mistake") { // a field for each motion
        for (int i = 0; i < motions.Count; i++)
          if (fields[i + 2] != "") motions[i].Catches[fields[1]] = Numbers(fields[i + 2].Split(' '));
      } else if (key == "catches") m.Catches[fields[1]] = row.Skip(1).ToArray();
      else if (key == "features") m.Features.AddRange(fields.Skip(1).Where(part => part != ""));
      else if (key == "tolerance") m.Tolerance.Add(row);
      else if (key == "sample") // files have a matrix before the quaternion, and more after the rates
        m.Samples.Add(row.Take(1).Concat(row.Skip(row.Length > 8 ? 10 : 1).Take(7)).ToArray());
      else m.Values[key] = row;
    }
    return motions;
  }

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

  // The energy, and the momentum in world axes, from a quaternion and rates.
  static double Invariants(Motion m, double[] y, out double[] momentum) {
    var w = y.Skip(4).ToArray();
    var L = Enumerable.Range(0, 3).Select(i => Dot(m["inertia_B"].Skip(3 * i).Take(3), w)).ToArray();
    momentum = Rotate(y, L.Zip(m["rotor_momentum_B"], (a, b) => a + b).ToArray());
    return Dot(L, w) / 2 + m["weight"][0] * Rotate(y, m["com_B"])[2];
  }

  // The largest errors of attitude (rad), rates, energy and momentum, with so many steps before each sample.
  static double[] Worst(Motion m, int steps) {
    var states = Simulate(m, m.Samples[0][0] / steps, steps, m.Samples.Count) ?? new double[0][];
    if (states.Length != m.Samples.Count)
      throw new Refused(Format("{0}: simulate returned {1} states, expected {2}", m.Name, states.Length, m.Samples.Count));
    if (states.Any(y => y == null || y.Length != 7))
      throw new Refused(m.Name + ": simulate returned another state, expected a quaternion (4) and rates (3)");
    var found = new double[4];
    for (int i = 0; i < states.Length; i++) {
      double[] y = states[i], exact = m.Samples[i].Skip(1).ToArray(), L, L0;
      double energy = Math.Abs(Invariants(m, y, out L) - Invariants(m, exact, out L0));
      double q = Math.Min(Apart(y.Take(4), exact.Take(4)), Apart(y.Take(4), exact.Take(4), -1));
      double[] scale = m["scale"], now = {4 * Math.Asin(Math.Min(1, q / 2)), Apart(y.Skip(4), exact.Skip(4)) / scale[0],
                                          energy / scale[1], Apart(L, L0) / scale[2]};
      for (int k = 0; k < 4; k++) found[k] = now[k] < Largest ? Math.Max(found[k], now[k]) : Largest;
    }
    return found;
  }

  // Run a motion: its errors, the mistakes that explain them, and the order if the body is free.
  static Result Check(Motion m) {
    var row = m.Tolerance.FirstOrDefault(each => each[0] == ORDER && each[1] == ANGLE);
    if (row == null) throw new Refused(Format("{0} has no tolerance for order {1} and |w| h = {2} rad", m.Name, ORDER, ANGLE));
    double[] found = Worst(m, (int)row[2]), limit = row.Skip(3).Select(x => x + (SINGLE ? m["single"][0] : 0)).ToArray();
    var r = new Result { Name = m.Name, Free = m.Features.Count == 0, Found = found, Limit = limit };
    for (int k = 1; k < 4; k++) if (found[k] / limit[k] > found[r.Most] / limit[r.Most]) r.Most = k;
    double ratio = found[r.Most] / limit[r.Most], falls = 0;
    if (r.Free || ratio > 1) {
      var half = Worst(m, 2 * (int)row[2]);
      if (r.Free && found[0] < Largest && half[0] > (SINGLE ? m["single"][0] : 1e-11)) // above rounding
        r.Order = Math.Max(0, Math.Log(found[0] / half[0], 2));
      if (found[r.Most] < Largest && half[r.Most] > 0) falls = Math.Log(found[r.Most] / half[r.Most], 2);
    }
    if (ratio <= 1) return r;
    foreach (var known in m.Catches) {
      double distance = known.Value.Select((x, k) => Math.Pow(Math.Log(Math.Max(found[k], limit[k]) / Math.Max(x, limit[k])), 2)).Average();
      if (distance < Near) r.Near[known.Key] = distance;
    }
    r.Failed = !(falls >= ORDER - 0.5 && (ratio <= 2 || r.Near.Count == 0));
    if (r.Failed && r.Near.Count == 0) // a large error of the attitude alone, or of the rates alone, is still there beside another mistake
      foreach (var known in m.Catches) {
        int k = known.Value[0] < known.Value[1] ? 1 : 0;
        double large = known.Value[k];
        if (known.Value[1 - k] == 0 && large > Large && Math.Abs(Math.Log(Math.Max(found[k], limit[k]) / large)) < 0.03) r.Near[known.Key] = Near;
      }
    if (!r.Failed) r.Note = Format(": {0:0} % above the tolerance, falls as h^{1:0.0}: right", 100 * (ratio - 1), falls);
    return r;
  }

  // Name the mistake of each motion that fails, those that explain most motions first, and return lines about them.
  static List<string> Summary(List<Result> failing, string whole, double? order) {
    var rest = failing;
    var lines = new List<string>();
    foreach (var r in failing) r.Mistake = r.Near.OrderBy(each => each.Value).Select(each => each.Key).FirstOrDefault() ?? "";
    for (int n = 0; n < 3; n++) {
      var best = rest.SelectMany(each => each.Near).GroupBy(each => each.Key).OrderByDescending(each => each.Count())
                     .ThenBy(each => each.Sum(vote => vote.Value)).FirstOrDefault();
      if (best == null || 10 * best.Count() < failing.Count) break;
      lines.Add(Format("\"{0}\" explains {1} of {2}", best.Key, best.Count(), whole));
      foreach (var r in rest.Where(each => each.Near.ContainsKey(best.Key))) r.Mistake = best.Key;
      rest = rest.Where(each => !each.Near.ContainsKey(best.Key)).ToList();
    }
    if (2 * rest.Count > failing.Count && order >= 0.5 && order < ORDER - 0.5)
      lines.Add(Format("this program has order {0:0.0}, {1} was declared", order, ORDER));
    if (rest.Count > 0) {
      lines.Add(Format("{0} not explained by a mistake: {1}", rest.Count, string.Join(", ", rest.Take(5).Select(r => r.Name))));
      lines.Add("What now: references/motions/my_engine_fails.md of conservative-rotation");
    }
    return lines;
  }

  static string Scientific(double x, int digits) { return x.ToString("0." + new string('0', digits - 1) + "e+00", CultureInfo.InvariantCulture); }
  static string Short(double x, int digits) { // a number with so many digits
    if (!(x >= 0.01 && x < 10)) return Scientific(x, digits);
    return x.ToString("F" + (digits - 1 - (int)Math.Floor(Math.Log10(x))), CultureInfo.InvariantCulture);
  }
  static string Two(double x, string unit = "") { // an error in two digits of the three that are recorded, so that the same number looks the same
    return x < Largest ? Scientific(double.Parse(Scientific(x, 3), CultureInfo.InvariantCulture), 2) + unit : "not finite";
  }
  static string Error(Result r, int k) { return r.Name + ": " + Names[k] + " error " + Two(r.Found[k], k == 0 ? " rad" : ""); }
  static string Precision { get { return SINGLE ? "single" : "double"; } }
  static string Settings(double order, double angle, string precision) { return Format("order {0}, {1} rad, {2}", order, angle, precision); }
  static string OrNone(string mistake) { return string.IsNullOrEmpty(mistake) ? "no known mistake" : mistake; }

  // The motions of a file of known errors, and the order.
  static List<Known> ReadKnown(string path, out double? order) {
    string[] lines;
    try { lines = File.ReadAllLines(path); } catch (Exception) { throw new Refused(path + ": cannot be read. Write it with --record " + path); }
    string then = null, now = Settings(ORDER, ANGLE, Precision);
    var known = new List<Known>();
    order = null;
    for (int n = 0; n < lines.Length; n++) {
      string line = lines[n].Trim();
      var fields = line.Split(',');
      double a, b;
      if (fields[0] == "settings" && fields.Length == 4 && IsNumber(fields[1], out a) && IsNumber(fields[2], out b)) then = Settings(a, b, fields[3]);
      else if (fields[0] == "order" && fields.Length == 2 && IsNumber(fields[1], out a)) order = a;
      else if (fields[0] == "motions" && fields.Length == 5 && IsNumber(fields[2], out a) && IsNumber(fields[3], out b))
        known.Add(new Known { Name = fields[1], Error = new[] {a, b}, Mistake = fields[4] });
      else if (line != "" && line[0] != '#')
        throw new Refused(Format("{0}: line {1} is not of this test: {2}. Record again: --record {0}", path, n + 1, line));
    }
    if (then == null) throw new Refused(path + ": not a file of known errors. Write another one with --record");
    if (then != now) throw new Refused(Format("{0}: recorded with {1}; now {2}: record again", path, then, now));
    return known;
  }

  static void WriteKnown(string path, List<Result> results, double? order) {
    string old = Header, text = Format("{0}\nsettings,{1},{2},{3}\n", Header, ORDER, ANGLE, Precision);
    try { if (File.Exists(path)) old = File.ReadAllText(path); } catch (Exception) { old = ""; }
    if (!old.StartsWith(Header.Substring(0, 31), StringComparison.Ordinal))
      throw new Refused(path + ": not a file of known errors, and not replaced. Choose another name");
    if (order != null) text += Format("order,{0:0.00}\n", order);
    foreach (var r in results) text += Format("motions,{0},{1},{2},{3}\n", r.Name, Short(r.Found[0], 3), Short(r.Found[1], 3), r.Mistake);
    try { File.WriteAllText(path, text); } catch (Exception) { throw new Refused(path + ": cannot be written"); }
  }

  // Add the lines of a run with known errors, and return the number of motions that are worse.
  static int Compare(List<Result> results, double? order, string path, List<string> skipped, List<string> lines) {
    double? before;
    var known = ReadKnown(path, out before);
    var mistakes = new List<string>();
    foreach (var each in results) {
      var r = each;
      r.Was = known.FirstOrDefault(one => one.Name == r.Name);
      Func<int, double, bool> changed = (k, sign) => // recorded numbers have three digits
        r.Was != null && sign * (r.Found[k] - r.Was.Error[k]) > 0.01 * r.Was.Error[k] + r.Limit[k];
      r.Worse = new[] {0, 1}.Where(k => changed(k, 1)).ToArray();
      r.Lower = new[] {0, 1}.Where(k => r.Worse.Length == 0 && changed(k, -1)).ToArray();
      r.Same = r.Was != null && (r.Was.Mistake != "" ? r.Near.ContainsKey(r.Was.Mistake) : r.Near.Count == 0);
      r.New = r.Failed && (r.Was == null || r.Worse.Length > 0 || !(r.Same || r.Lower.Length > 0));
    }
    var failing = results.Where(r => r.New).ToList();
    var about = Summary(failing, failing.Count + " new failures", order);
    foreach (var r in results) {
      string mistake = OrNone(r.Mistake);
      if (r.New && r.Was == null) lines.Add(Error(r, r.Most) + ", tolerance " + Two(r.Limit[r.Most]) + ", not recorded; " + mistake);
      if (r.Was == null) continue;
      string recorded = OrNone(r.Was.Mistake);
      if (r.New) {
        int k = r.Worse.SequenceEqual(new[] {1}) ? 1 : 0;
        lines.Add(Error(r, k) + ", was " + Two(r.Was.Error[k]) + "; " + mistake + (r.Same ? "" : ", was " + recorded));
      } else if (r.Failed) mistakes.Add(r.Same ? recorded : mistake);
      foreach (int k in r.Lower.Where(k => Two(r.Was.Error[k]) != Two(r.Found[k])).Take(1))
        lines.Add(Format("better: {0}, {1} to {2}{3}: record again to tighten", r.Name, Two(r.Was.Error[k]),
                         k == 0 ? Two(r.Found[k], " rad") : Two(r.Found[k]) + " (rates)", r.Failed && !r.Same ? ", now " + mistake : ""));
    }
    var gone = known.Select(each => each.Name).Where(name => results.All(r => r.Name != name)).ToList();
    foreach (var name in gone) lines.Add(Format("{0}: was tested, is {1} now: record again", name, skipped.Contains(name) ? "skipped" : "not there"));
    int worse = failing.Count + gone.Count;
    var counts = mistakes.GroupBy(name => name).OrderByDescending(each => each.Count()).Select(each => each.Key + ": " + each.Count());
    string text = mistakes.Count > 0 ? " (" + string.Join(", ", counts) + ")" : "";
    lines.AddRange(about);
    lines.Add(Format("known errors of {0}: {1}{2}, new failures: {3}", path, mistakes.Count, text, worse));
    var free = results.Where(r => r.Free && r.Was != null).ToList();
    double a = free.Select(r => r.Was.Error[0]).DefaultIfEmpty(0).Max(), b = free.Select(r => r.Found[0]).DefaultIfEmpty(0).Max();
    var parts = new List<string>();
    if (Short(a, 2) != Short(b, 2) && Math.Abs(b - a) > 0.01 * a && Math.Max(a, b) < Largest && (b > a || worse == 0))
      parts.Add(Format("attitude error {0} to {1} rad", Short(a, 2), Short(b, 2)));
    if (before != null && order != null && Math.Abs(before.Value - order.Value) >= 0.2) parts.Add(Format("order {0:0.0} to {1:0.0}", before, order));
    string numbers = string.Join(", ", parts);
    string first = string.Concat(failing.Take(1).Select(r => "first bad motion: " + r.Name + " (" + OrNone(r.Mistake) + ")"));
    if (numbers + first != "") lines.Add("free rotation at your step: " + numbers + (numbers == "" || first == "" ? "" : "; ") + first);
    return worse;
  }

  // Test the motions and return the exit code: 0, 1 if a motion fails, 2 if the test is not possible.
  public static int Run(params string[] arguments) {
    try { return Test(arguments); } catch (Refused e) { Console.WriteLine(e.Message); }
    return 2;
  }
  static int Test(string[] arguments) {
    string record = Environment.GetEnvironmentVariable("ROTATION_RECORD"), known = Environment.GetEnvironmentVariable("ROTATION_KNOWN");
    var texts = new List<string>();
    var has = HAS.Split(',').Select(part => part.Trim()).ToList();
    foreach (var part in has.Where(part => part != "" && !Features.Split(new[] {", "}, StringSplitOptions.None).Contains(part)))
      throw new Refused(Format("HAS: got {0}; allowed: {1}", part, Features));
    for (int i = 0; i < arguments.Length; i++) {
      string each = arguments[i];
      if (each == "--record" || each == "--known") {
        if (++i == arguments.Length) throw new Refused(each + ": expected the name of a file");
        if (each == "--record") record = arguments[i]; else known = arguments[i];
      } else if (Directory.Exists(each)) texts.AddRange(Directory.GetFiles(each, "*.csv").OrderBy(path => path, StringComparer.Ordinal).Select(File.ReadAllText));
      else if (File.Exists(each)) texts.Add(File.ReadAllText(each));
      else throw new Refused(each + ": expected --record FILE, --known FILE, a folder of motions or CSV files");
    }
    if (!string.IsNullOrEmpty(record) && !string.IsNullOrEmpty(known)) throw new Refused("record and known are both given: give one of them");
    if (string.IsNullOrEmpty(record) && string.IsNullOrEmpty(known) && File.Exists("known.txt")) known = "known.txt";
    if (texts.Count == 0) texts.Add(Motions);
    if (texts.Any(text => Read(text).Count == 0)) throw new Refused("a file without a motion");
    var results = new List<Result>();
    var skipped = new List<string>();
    foreach (var m in texts.SelectMany(Read)) {
      var part = m.Features.FirstOrDefault(each => !has.Contains(each));
      if (part == null) { results.Add(Check(m)); continue; }
      Console.WriteLine(m.Name + ": skipped, it has " + part);
      skipped.Add(m.Name);
    }
    var orders = results.Where(r => r.Order != null).Select(r => r.Order).OrderBy(x => x).ToList();
    double? order = orders.Count > 0 ? orders[orders.Count / 2] : null;
    var failing = results.Where(r => r.Failed).ToList();
    var lines = Summary(failing, "them", order);
    bool compare = !string.IsNullOrEmpty(known);
    foreach (var r in results.Where(r => r.Note != "" || (r.Failed && !compare)))
      Console.WriteLine(Error(r, r.Most) + ", tolerance " + Two(r.Limit[r.Most]) + (r.Failed ? "; " + OrNone(r.Mistake) : r.Note));
    int worse = failing.Count;
    if (compare) {
      lines.Clear();
      worse = Compare(results, order, known, skipped, lines);
    } else Console.WriteLine(Format("{0} of {1} motions failed", worse, results.Count));
    lines.ForEach(Console.WriteLine);
    if (!string.IsNullOrEmpty(record)) {
      WriteKnown(record, results, order);
      string hint = Path.GetFullPath(record) == Path.GetFullPath("known.txt") ? "" : ". The next run needs --known " + record + " (or ROTATION_KNOWN)";
      Console.WriteLine(Format("{0}: {1} motions recorded, {2} known errors{3}", record, results.Count, worse, hint));
      return 0;
    }
    if (worse > 0 && !compare) Console.WriteLine("Known and accepted? --record known.txt (or ROTATION_RECORD=known.txt): then only new failures fail");
    return worse > 0 ? 1 : 0;
  }

  // BEGIN MOTIONS
  const string Motions = @"
name,brick_flip
inertia_B,13,0,0,0,5,0,0,0,10
quaternion_wxyz0,1,0,0,0
w_WB_B0,0,.05,10
sample,.04,.980066080285,-7.7260487e-5,.00099432641,.198669282028,-.00773973082,.05092592027,9.99999377004
sample,.08,.921059033938,-.000313002448,.001953836648,.389417950989,-.01576610603,.0537379694,9.99997414868
sample,.12,.825331324351,-.00071844221,.002839874903,.564641146212,-.02437638132,.05854028038,9.99993820218
sample,.16,.696699404582,-.001310044891,.003606267964,.717352924487,-.03388942615,.06551068157,9.99988055599
sample,.2,.540291612426,-.002106144642,.004195995668,.841464753461,-.0446575226,.07490727032,9.99979259124
scale,10.0002,500.006,100
tolerance,1,.01,40,.00022,.00028,1.9e-6,.00015
tolerance,2,.01,40,.00017,5.6e-6,1.1e-6,2e-6
tolerance,4,.01,40,2.8e-9,1.7e-10,1.1e-10,1.4e-10
single,.00035
name,golden_4
features,fixed point
inertia_B,37.569567086791935,0,0,0,24.42047900665016,0,0,0,49.74541379718716
quaternion_wxyz0,.080676695026,.243425168124,.406750890403,.87680623376
w_WB_B0,-.493501866735,1.039660622419,.000416869186
weight,3010
com_B,.02361198596771947,-.01514681660749079,.003072647492940911
sample,.092,.067689278842,.195298596414,.39279062573,.896098289312,-.406698404626,1.185777743939,-.137063569628
sample,.184,.056257799272,.13796008191,.383108854263,.911608293954,-.302613112942,1.352292838003,-.26434224599
sample,.276,.045877224471,.070871031907,.377762999676,.922045385644,-.180760141687,1.534728636918,-.378906739634
sample,.368,.036109081052,-.006128208929,.376666328191,.925624684485,-.041787400584,1.726675384467,-.477850895476
scale,1.79206,42.116,48.4305
tolerance,1,.01,20,.022,.017,.051,.026
tolerance,2,.01,20,7.2e-5,5.8e-5,.00014,9.3e-5
tolerance,4,.01,20,8e-10,6.3e-10,5.7e-10,1.1e-9
single,.00013
name,golden_9
inertia_B,3.330073724153789,0,0,0,1.354784666276132,0,0,0,4.479344421805398
quaternion_wxyz0,-.470821233501,-.862831436986,-.037843352356,-.180047655126
w_WB_B0,-34.32588597222,21.20929544084,-40.60791817033
sample,.0034,-.527739029423,-.822765111727,-.106497802656,-.182228718314,-31.28011371377,25.10961113494,-41.7482365852
sample,.0068,-.574569851351,-.776359009178,-.180150498896,-.186230965562,-27.63998986798,28.71238447059,-42.9385064686
sample,.0102,-.609868156415,-.724654963895,-.258141186148,-.19052334006,-23.42419341637,31.92228858191,-44.10092148237
sample,.0136,-.632536701804,-.668800542901,-.339402991611,-.19341345344,-18.6776624159,34.63677355977,-45.15319950195
scale,59.8947,5959.8,216.745
tolerance,1,.01,20,.0066,.0087,.0043,.0065
tolerance,2,.01,20,8.6e-5,.00015,4.7e-5,6.4e-5
tolerance,4,.01,20,2.9e-9,3.8e-9,6.4e-10,2.3e-9
single,.00017
name,separatrix_turned
inertia_B,.8316,-.005554,-.1469,-.005554,.8775,-.0191,-.1469,-.0191,.5895
quaternion_wxyz0,.393215738015,.327179507203,.169092772836,-.842462217324
w_WB_B0,1.062,.1578,-.1296
sample,.092,.370537960828,.350827234519,.132385642469,-.849762268386,1.063966219695,.143831719492,-.12971383988
scale,1.08145,.504512,.941297
tolerance,1,.01,10,.00065,.0011,.00017,.00064
tolerance,2,.01,10,6.6e-5,.00011,1.8e-5,6.5e-5
tolerance,4,.01,10,2.7e-10,2.6e-10,1.1e-10,1.6e-10
single,3.6e-5
name,tiny
inertia_B,9.455e-10,0,0,0,9.151e-10,0,0,0,1.048e-9
quaternion_wxyz0,.112992486249,.491967285263,-.845943746611,.171988563141
w_WB_B0,.5509,-.6398,-.5359
sample,.1,.076857449693,.522644337516,-.830603856008,.176162036983,.546063583369,-.643095463524,-.536920557978
scale,1.00002,4.81258e-10,9.64116e-10
tolerance,1,.01,10,.00057,.00061,6.4e-5,.00055
tolerance,2,.01,10,5.7e-5,6.2e-5,7.3e-6,5.6e-5
tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.1e-10
single,3.4e-5
name,tiny_fast
inertia_B,4.48e-8,5.651e-11,2.137e-9,5.651e-11,4.274e-8,-8.16e-10,2.137e-9,-8.16e-10,5.324e-8
quaternion_wxyz0,-.024905367561,-.782168571581,-.416089674908,-.463099806448
w_WB_B0,215.5,128.8,-164.2
sample,.00033,-.00078849058,-.761066699215,-.453804148479,-.463506906585,216.6216023664,126.641690707,-164.3938800226
scale,299.986,.0020557,1.37463e-5
tolerance,1,.01,10,.00011,2e-4,1.8e-5,.00012
tolerance,2,.01,10,1.5e-5,2.1e-5,2.7e-6,1.3e-5
tolerance,4,.01,10,2.4e-10,1.4e-10,1.1e-10,1.2e-10
single,3.4e-5
name,walking_pace
inertia_B,.8099,-.00586,-.01041,-.00586,.8089,.00958,-.01041,.00958,.8239
quaternion_wxyz0,-.775127906658,-.185030532557,.286047201683,-.532087801732
w_WB_B0,.02244,.04795,.08484
sample,1,-.756401363967,-.168592678297,.268959227751,-.571921689762,.0224224698228,.0481121522205,.0847527934615
scale,.100003,.00411182,.0822474
tolerance,1,.01,10,.00051,5e-4,1.2e-5,.00051
tolerance,2,.01,10,5.2e-5,5.1e-5,2.1e-6,5.2e-5
tolerance,4,.01,10,2.4e-10,1.5e-10,1.1e-10,1.1e-10
single,3.3e-5
name,fast
inertia_B,.8812,-.0299,.109,-.0299,.9868,.1588,.109,.1588,1.207
quaternion_wxyz0,-.748155258326,.58612163286,.282058533219,-.131027190963
w_WB_B0,-326,908.1,-262.8
sample,1e-4,-.752123997076,.599878943248,.257661233843,-.089807767175,-330.0531090618,906.0350244243,-264.6289699644
scale,999.993,475678,952.836
tolerance,1,.01,10,.00017,.00021,1.3e-5,.00017
tolerance,2,.01,10,2e-5,2.2e-5,2.1e-6,1.8e-5
tolerance,4,.01,10,2.4e-10,1.3e-10,1.1e-10,1.3e-10
single,3.4e-5
name,half_turn_slow
inertia_B,.8868,.09572,.03171,.09572,1.127,.2494,.03171,.2494,1.132
quaternion_wxyz0,.054096488981,.264982801849,.646958010553,-.71295372724
w_WB_B0,.005301,.01296,-.01428
sample,5,.004123912615,.265435626072,.64790674323,-.713963426117,.00529663916983,.01300048427984,-.01424508416235
sample,10,-.045859203428,.265354494612,.647223701313,-.713151741293,.00528941417733,.0130418683854,-.01421027297955
sample,15,-.095727662301,.264741949711,.644910498133,-.710519784476,.00527932133719,.01308415605275,-.01417555321288
sample,20,-.145356520806,.263602261347,.640972580665,-.706073282675,.00526635597919,.01312735022887,-.01414091067625
scale,.0200007,.000180543,.0180695
tolerance,1,.01,10,.0022,.0021,8.6e-5,.0022
tolerance,2,.01,10,6e-5,5.5e-5,3.6e-6,5.6e-5
tolerance,4,.01,10,6.4e-10,1.8e-10,1.1e-10,1.6e-10
single,7.5e-5
name,torque_and_rotor
features,rotor,torque
inertia_B,.7859,-.2539,-.175,-.2539,.8081,.01264,-.175,.01264,1.181
quaternion_wxyz0,-.707928824874,.085291424805,-.209978888734,-.668932745538
w_WB_B0,-.3308,.6182,-.7131
rotor_momentum_B,-.102,.0889,.47
torque_B,.415,-.334,.578
sample,.1,-.722566984008,.123621717508,-.216671594833,-.644723230987,-.321777720106,.557187444228,-.663801945577
scale,1.00006,.502762,.830319
tolerance,1,.01,10,.0013,.00094,.00065,.0011
tolerance,2,.01,10,8.2e-5,5.5e-5,2e-5,8.2e-5
tolerance,4,.01,10,3.1e-10,2.4e-10,1.9e-10,3.1e-10
single,3.5e-5
name,damped
features,damping
inertia_B,.3919,0,0,0,.6702,0,0,0,.3418
quaternion_wxyz0,-.703884220568,-.509916125695,-.336944577175,.36194046569
w_WB_B0,.7249,-.6706,.1575
damping,.087,0,0,0,.0821,0,0,0,.0739
sample,.2,-.694208072664,-.53896732184,-.253645539906,.404046182908,.6725306120189,-.6563486944512,.2247339429246
sample,.4,-.683130717889,-.56136133328,-.167784848617,.435951970232,.6162510995068,-.6428799957858,.281943256633
sample,.6,-.671374170726,-.576391227855,-.080927296902,.458781699669,.5575043008933,-.6299750719911,.3295339541524
sample,.8,-.659420129594,-.583672711928,.005496016773,.473773207174,.4975540271041,-.6174486138359,.3680137969515
scale,.999995,.257903,.534413
tolerance,1,.01,20,.0058,.0072,.0021,.0037
tolerance,2,.01,20,.00011,.00011,2.8e-5,6.7e-5
tolerance,4,.01,20,1.7e-9,1.5e-9,2.5e-10,1.3e-9
single,.00014
name,orbit_flat
features,orbit
inertia_B,104.1,1.335,20.02,1.335,76.02,42.43,20.02,42.43,97.28
quaternion_wxyz0,-.720623572499,-.295845461109,-.611680480402,-.137927951463
w_WB_B0,-.001075,.0008884,.0005521
orbit,.00105
sample,148,-.694082227649,-.248358277242,-.631339741757,-.240786540042,-.001273515980661,.000938316138226,.000609189917618
sample,296,-.656902752666,-.188432003709,-.638726835542,-.353553649501,-.001489004095649,.000988056039612,.000679054139937
sample,444,-.605308317068,-.116451664536,-.628716422745,-.474084919488,-.00171701448256,.001033393421464,.000767229301881
sample,592,-.535115395503,-.034671454685,-.595876556406,-.597813125694,-.001938955150609,.001065491586751,.000877124747801
scale,.00237995,.000279105,.23499
tolerance,1,.01,40,.0054,.0057,.0013,.0035
tolerance,2,.01,40,8.1e-5,8.3e-5,9.5e-5,6.9e-5
tolerance,4,.01,40,7.8e-10,7.9e-10,9.3e-10,6.4e-10
single,.00031
mistake,inertia about the centre of mass,,.0014 .0046,,,,,,,,,,
mistake,sign of the torque,,,,,,,,,,.0086 .17,,
mistake,axes of the torque,,,,,,,,,,.0078 .16,,
mistake,without the torque,,,,,,,,,,.0043 .086,,
mistake,sign of the rotor,,,,,,,,,,.0078 .15,,
mistake,without the rotor,,,,,,,,,,.0039 .077,,
mistake,size of the rotor 0.98,,,,,,,,,,7.8e-5 .0015,,
mistake,sign of the damping,,,,,,,,,,,.12 .3,
mistake,without the damping,,,,,,,,,,,.055 .14,
mistake,turning of the field,,,,,,,,,,,,.024 .093
mistake,dead band 0.001,.0042 .0051,,,,,,,,,,,.7 .59
mistake,sign of the field,,.33 1,,,,,,,,,,.51 .74
mistake,without the field,,.16 .51,,,,,,,,,,.26 .39
mistake,smallest moments,,,,,3e-4 .0059,4e-4 .0081,,,,,,
mistake,rate limit 100,,,,,,.059 .67,,.081 .9,,,,
mistake,rate limit 47,,,.16 .22,,,.075 .84,,.086 .95,,,,
mistake,rate limit 7,.6 .3,,.69 .89,,,.087 .98,,.089 .99,,,,
mistake,dead band 0.01,.0042 .0051,.093 .27,,,,,,,.1 .26,,,1.1 1
mistake,attitude by normalisation,3e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,4e-4 0,.0015 0,.0017 0
mistake,stale rates,2.4e-5 0,.0022 0,.0017 0,,,4e-5 0,,,,.00039 0,.0015 0,.0017 0
mistake,sign of the products of inertia,,,,.0016 .033,,.00026 .0053,.00017 .0033,.0013 .027,.017 .083,.0024 .047,,.54 .77
mistake,no products of inertia,,,,.00081 .016,,.00012 .0025,8.3e-5 .0017,6e-4 .012,.0066 .033,.001 .02,,.28 .41
mistake,diagonal gyroscopic term,,,,.00081 .016,,.00011 .0023,8.3e-5 .0017,.00058 .012,.0059 .03,.00091 .018,,.23 .4
mistake,damping 0.02,.004 .004,.0018 .0059,.00011 .00028,9.1e-5 .0018,1e-4 .002,3.3e-7 6.6e-6,.00099 .02,,.07 .33,9.7e-5 .0019,.0058 .014,1 1
mistake,inertia of the start,.003 .005,.0088 .043,.037 .14,2.2e-5 .00065,9.9e-6 3e-4,1.3e-5 4e-4,,8.2e-6 .00024,.00029 .0022,2.4e-5 .00071,.028 .098,.048 .11
mistake,damping 0.01,.002 .002,9e-4 .003,5.5e-5 .00014,4.6e-5 .00092,5e-5 .001,1.6e-7 3.3e-6,5e-4 .01,,.037 .18,4.9e-5 .00096,.0029 .0071,.94 .98
mistake,rates half a step late,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013
mistake,rates half a step early,0 2e-5,0 .0036,0 .0024,0 .00065,0 3e-4,0 .00041,,0 .00024,0 .00014,0 .0039,0 .0021,0 .0013
mistake,start in world rates,,.83 1.3,1.1 1.5,.16 1.6,.14 1.4,.17 1.7,.1 1,.13 1.3,.00027 .00068,.13 1.3,.99 1.3,1.5 1.4
mistake,inertia in world axes,,.073 .25,.21 .53,.0014 .028,3.6e-5 .00079,.00057 .012,.00018 .0036,.00088 .018,.0043 .022,.0033 .067,.16 .4,.31 .49
mistake,start transposed,,.32 .0059,2 0,1.6 0,.45 0,.1 0,2.7 0,2.9 0,.22 0,3.1 0,3.1 0,3.1 .63
mistake,rates in degrees,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 56,0 52,0 54,0 56
mistake,transposed,3.1 0,.27 0,2.7 0,1.5 0,.31 0,.0032 0,2.9 0,2.9 0,.58 0,3.1 0,3.1 0,3.1 0
mistake,start in order xyzw,3.1 0,2 .29,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .16
mistake,start in order wxyz,3.1 0,2 .99,2 0,2.6 0,2.1 0,2 0,2.4 0,2.7 0,2.5 0,2 0,2.8 0,1.9 .4
mistake,order xyzw,2.7 0,2.4 0,1.8 0,2.6 0,2 0,2 0,2.4 0,2.6 0,2.7 0,2.1 0,3 0,1.7 0
mistake,axes y up,2.5 1.4,3.1 1.4,1.1 1.3,2.6 .25,2.6 1.2,1.9 .98,1.9 1.4,.78 1.3,3 1.4,2 1.2,1.4 1,2.6 .82
mistake,reversed rates,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 2,0 1.8,0 1.9,0 2
mistake,start in degrees,2 .98,.43 .69,.78 .98,.098 .98,.098 .98,.097 .98,.098 .98,.098 .98,.39 .98,.098 .98,.73 .95,.97 .82
mistake,factor one half,2 0,.54 .065,.79 0,.099 0,.1 0,.099 0,.1 0,.1 0,.4 0,.096 0,.75 0,1 .2
mistake,sleep,2 1,.52 1,.79 1,.099 1,.1 1,.099 1,.1 1,.1 1,.4 1,.096 .92,.75 .97,1.1 1
mistake,frozen motion,2 .0051,.52 .53,.79 .35,.099 .013,.1 .0059,.099 .0081,.1 .0018,.1 .0049,.4 .011,.096 .079,.75 .31,1.1 .39
mistake,world y up,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0
mistake,world turned the wrong way,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0
mistake,start in a world with y up,1.6 0,1.6 .44,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 0,1.6 .18
mistake,damping 0.2,.039 .039,.018 .057,.0011 .0028,.00091 .018,.00099 .02,3.3e-6 6.6e-5,.0094 .18,1e-6 2e-5,.3 .98,.00097 .019,.056 .13,1.1 1
mistake,damping 0.1,.02 .02,.0089 .029,.00055 .0014,.00046 .0092,5e-4 .01,1.6e-6 3.3e-5,.0048 .095,5e-7 1e-5,.23 .86,.00049 .0096,.029 .068,1.1 1
mistake,R I for R I R',.0082 .02,.28 .89,.6 1.2,.0052 .1,.0051 .1,.0048 .098,.0045 .09,.0078 .16,.0044 .022,.0051 .1,.23 .52,1.1 1.4
mistake,damping 0.05,.01 .01,.0045 .015,.00028 7e-4,.00023 .0046,.00025 .005,8.2e-7 1.6e-5,.0025 .049,2.5e-7 5e-6,.15 .63,.00024 .0048,.014 .035,1.1 1
mistake,no gyroscopic term + damping 0.05,.011 .011,.014 .057,.14 .35,.00069 .014,.00039 .0078,4e-4 .0081,.0025 .049,.00025 .0049,.15 .63,.0031 .062,.11 .26,1.1 1
mistake,inverted inertia,.016 .019,2.7 36,.29 .72,.0017 .035,.00057 .011,.00072 .015,.00018 .0036,6e-4 .012,.0073 .037,.001 .019,.17 .42,1.1 65
mistake,a step late,.01 3.9e-5,.0082 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0093 .0079,.0097 .0042,.0088 .0027
mistake,a step early,.01 3.9e-5,.0083 .0072,.01 .0047,.0099 .0013,.01 .00059,.0099 .00081,.01 .00018,.01 .00048,.01 .00029,.0092 .0079,.0097 .0042,.0088 .0027
mistake,sign of the gyroscopic term,.0074 .0089,.026 .1,.26 .64,.0013 .026,.00059 .012,.00081 .016,.00018 .0037,5e-4 .0099,.0042 .021,.0062 .12,.22 .5,.24 .4
mistake,world rates,0 .0054,0 2,0 1.5,0 1.6,0 1.4,0 1.7,0 1,0 1.3,0 .022,0 1.2,0 1.4,0 1.4
mistake,no gyroscopic term,.0042 .0051,.014 .056,.14 .35,.00065 .013,3e-4 .0059,4e-4 .0081,9.2e-5 .0018,.00025 .0049,.0022 .011,.0031 .062,.11 .26,.11 .18
mistake,half a step late,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013
mistake,half a step early,.005 2e-5,.0041 .0036,.0051 .0024,.005 .00065,.005 3e-4,.0049 .00041,.005 9.2e-5,.005 .00024,.005 .00014,.0046 .0039,.0048 .0021,.0044 .0013
mistake,wrong side,.003 0,.99 .21,1.1 0,.16 0,.14 0,.17 0,.1 0,.13 0,.0044 0,.12 0,1.1 0,1.5 .31
";
  // END MOTIONS

#if !WITHOUT_MAIN
  static int Main(string[] arguments) { return Run(arguments); }
#endif
}
