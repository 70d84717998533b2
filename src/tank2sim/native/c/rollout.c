/* The loop around the generated step; work arrays are on the stack. */
EXPORT void rollout(long n, long every, double h, const double* u, const double* p, double* x) {
  const double* arg[SZ_ARG];
  double* res[SZ_RES];
  casadi_int iw[SZ_IW];
  double w[SZ_W];
  double between[2][NX], c[NC];
  long k, j;
  arg[0] = p;
  res[0] = c;
  constants(arg, res, iw, w, 0);
  for (k = 0; k < n; k += every, x += NX) {
    const long last = every < n - k ? every : n - k;
    const double* from = x;
    for (j = 1; j <= last; ++j) {
      double* to = j == last ? x + NX : between[j & 1];
      arg[0] = from; arg[1] = u; arg[2] = p; arg[3] = c; arg[4] = &h;
      res[0] = to;
      step(arg, res, iw, w, 0);
      from = to;
    }
  }
}
EXPORT void outputs(long n, const double* u, const double* p, const double* x, double* y) {
  const double* arg[SZ_ARG];
  double* res[SZ_RES];
  casadi_int iw[SZ_IW];
  double w[SZ_W];
  long k;
  for (k = 0; k < n; ++k, x += NX, u += NU, y += NY) {
    arg[0] = x; arg[1] = u; arg[2] = p;
    res[0] = y;
    output(arg, res, iw, w, 0);
  }
}
