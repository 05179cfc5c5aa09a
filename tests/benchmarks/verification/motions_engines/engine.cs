  // An engine: any Runge-Kutta method, and each mistake.
  static readonly double[] METHOD = {};
  static readonly bool FLOAT = false;
  static readonly string MISTAKE = Environment.GetEnvironmentVariable("MISTAKE") ?? "";
  const string BOTH = "no gyroscopic term + damping 0.05";
  static readonly double[][] One = {new double[] {1, 0, 0}, new double[] {0, 1, 0}, new double[] {0, 0, 1}};
  class Body {
    public double[][] J, K, R0, Damping;
    public double[] Rotor, TorqueB, TorqueW, Arm;
    public double Orbit;
  }
  static double Sign(string zero, string minus) { return MISTAKE == zero ? 0 : MISTAKE == minus ? -1 : 1; }
  static double[][] Transpose(double[][] A) { return A[0].Select((_, i) => A.Select(row => row[i]).ToArray()).ToArray(); }
  static double[] Apply(double[][] A, double[] v) { return A.Select(row => Dot(row, v)).ToArray(); }
  static double[][] Multiply(double[][] A, double[][] B) { return A.Select(row => Apply(Transpose(B), row)).ToArray(); }
  static double[] Add(double[] a, double[] b, double scale = 1) { return a.Select((x, i) => x + scale * b[i]).ToArray(); }
  static double[] Scaled(IEnumerable<double> a, double scale) { return a.Take(3).Select(x => scale * x).ToArray(); }
  static double[][] Square(double[] a) { return new[] {Scaled(a, 1), Scaled(a.Skip(3), 1), Scaled(a.Skip(6), 1)}; }
  static double[][] Inverse(double[][] A) {
    double[][] c = {Cross(A[1], A[2]), Cross(A[2], A[0]), Cross(A[0], A[1])};
    double d = Dot(A[0], c[0]);
    return Transpose(c).Select(row => row.Select(x => x / d).ToArray()).ToArray();
  }
  static double[][] Matrix(double[] q) {
    double size = Math.Sqrt(Dot(q, q));
    return Transpose(One.Select(e => Rotate(q.Select(x => x / size).ToArray(), e)).ToArray());
  }
  static double[] Turning(double[] q, double[] w) {
    double[] u = {q[1], q[2], q[3]}, across = MISTAKE == "wrong side" ? Cross(w, u) : Cross(u, w);
    return new[] {-Dot(u, w)}.Concat(Add(Scaled(w, q[0]), across)).Select(x => x / 2).ToArray();
  }
  static double[] Slope(Body body, double t, double[] y) {
    double[] q = y.Take(4).ToArray(), w = y.Skip(4).ToArray();
    double[][] R = Matrix(q), back = Transpose(R), J = body.J;
    if (MISTAKE == "R I for R I R'") J = Multiply(J, R);
    if (MISTAKE == "inertia in world axes" || MISTAKE == "inertia of the start") {
      var start = MISTAKE == "inertia of the start" ? body.R0 : One;
      J = Multiply(back, Multiply(Multiply(start, Multiply(J, Transpose(start))), R));
    }
    var K = J == body.J ? body.K : Inverse(J);
    var G = J.Select((row, i) => row.Select((x, k) => MISTAKE == "diagonal gyroscopic term" && i != k ? 0 : x).ToArray()).ToArray();
    double gyroscopic = MISTAKE == BOTH ? 0 : Sign("no gyroscopic term", "sign of the gyroscopic term");
    var T = Scaled(Cross(Add(Apply(G, w), body.Rotor), w), gyroscopic);
    T = Add(Add(Add(T, body.TorqueB), Apply(back, body.TorqueW)), Apply(body.Damping, w), -1);
    double field = Sign("without the field", "sign of the field"), n = body.Orbit, angle = MISTAKE == "turning of the field" ? 0 : n * t;
    var u = Apply(back, new[] {Math.Cos(angle), Math.Sin(angle), 0});
    T = Add(Add(T, Cross(R[2], body.Arm), field), Cross(u, Apply(body.J, u)), field * 3 * n * n);
    return Turning(q, w).Concat(Apply(K, T)).ToArray();
  }
  static double[] Step(Body body, double t, double h, double[] y) {
    int s = (int)METHOD[0];
    var A = Enumerable.Range(0, s).Select(i => METHOD.Skip(1 + i * s).Take(s).ToArray()).ToArray();
    var k = Enumerable.Range(0, s).Select(i => new double[7]).ToArray();
    var old = y;
    for (int sweep = 0; sweep < (A[0][0] == 0 && A[s - 1][s - 1] == 0 ? s : 30); sweep++)
      for (int i = 0; i < s; i++) {
        var Y = y;
        for (int j = 0; j < s; j++) Y = Add(Y, k[j], h * A[i][j]);
        k[i] = Slope(body, t + h * A[i].Sum(), Y);
      }
    for (int j = 0; j < s; j++) y = Add(y, k[j], h * METHOD[1 + s * s + j]);
    double[] q0 = old.Take(4).ToArray(), w0 = old.Skip(4).ToArray(), w1 = y.Skip(4).ToArray();
    if (MISTAKE == "attitude by normalisation") y = Add(q0, Turning(q0, w1), h).Concat(w1).ToArray();
    if (MISTAKE == "stale rates") {
      double half = h * Math.Sqrt(Dot(w0, w0)) / 2;
      y = Add(q0.Select(x => Math.Cos(half) * x).ToArray(), Turning(q0, w0), half > 0 ? Math.Sin(half) * h / half : 0).Concat(w1).ToArray();
    }
    double size = Math.Sqrt(Dot(y.Take(4), y.Take(4))), speed = Math.Sqrt(Dot(y.Skip(4), y.Skip(4))), scale = 1;
    if (MISTAKE.Contains("damping 0"))
      scale = Math.Exp(-h * double.Parse(MISTAKE.Substring(MISTAKE.IndexOf("damping 0") + 8), CultureInfo.InvariantCulture));
    if (MISTAKE == "rate limit 100" && speed > 100) scale = 100 / speed;
    if (MISTAKE == "sleep" && speed < 0.5) scale = 0;
    return y.Select((x, i) => i < 4 ? x / size : x * scale).Select(x => FLOAT ? (double)(float)x : x).ToArray();
  }
  static double[][] Simulate(Motion m, double h, int steps, int samples) {
    double products = Sign("no products of inertia", "sign of the products of inertia");
    var J = Square(m["inertia_B"]).Select((row, i) => row.Select((x, k) => i == k ? x : products * x).ToArray()).ToArray();
    if (MISTAKE == "smallest moments" && J[0][0] < 1e-6) J = One.Select(row => Scaled(row, 1e-6)).ToArray();
    double torque = Sign("without the torque", "sign of the torque");
    bool other = MISTAKE == "axes of the torque";
    var body = new Body {
      J = J, K = Inverse(J), R0 = Matrix(m["quaternion_wxyz0"]), Orbit = m["orbit"][0], Arm = Scaled(m["com_B"], m["weight"][0]),
      Rotor = Scaled(m["rotor_momentum_B"], Sign("without the rotor", "sign of the rotor")),
      Damping = Square(MISTAKE == "without the damping" ? new double[9] : m["damping"]),
      TorqueB = Scaled(m[other ? "torque_W" : "torque_B"], torque), TorqueW = Scaled(m[other ? "torque_B" : "torque_W"], torque) };
    var y = m["quaternion_wxyz0"].Concat(m["w_WB_B0"]).ToArray();
    var states = new List<double[]>();
    double t = 0;
    for (int i = 0; i < samples; i++) {
      for (int n = 0; n < steps; n++) {
        double size = MISTAKE == "half a step late" && i + n == 0 ? h / 2 : h;
        y = Step(body, t, size, y);
        t += size;
      }
      double[] q = y.Take(4).ToArray(), w = y.Skip(4).ToArray();
      if (MISTAKE == "world rates") w = Apply(Matrix(q), w);
      if (MISTAKE == "reversed rates") w = Scaled(w, -1);
      if (MISTAKE == "transposed") q = new[] {q[0], -q[1], -q[2], -q[3]};
      if (MISTAKE.Contains("order xyzw")) q = new[] {q[1], q[2], q[3], q[0]};
      states.Add(q.Concat(w).ToArray());
    }
    return states.ToArray();
  }
