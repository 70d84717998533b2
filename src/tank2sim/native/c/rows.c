/* A function for each row of its arguments. Work arrays are on the stack; a stride of 0 keeps an argument constant. */
EXPORT void LOOP(long n, const double** arguments, const long* strides, double** results, const long* lengths) {
  const double* arg[SZ_ARG];
  double* res[SZ_RES];
  casadi_int iw[SZ_IW];
  double w[SZ_W];
  long k, i;
  for (k = 0; k < n; ++k) {
    for (i = 0; i < N_IN; ++i) arg[i] = arguments[i] + k * strides[i];
    for (i = 0; i < N_OUT; ++i) res[i] = results[i] + k * lengths[i];
    FUNCTION(arg, res, iw, w, 0);
  }
}
