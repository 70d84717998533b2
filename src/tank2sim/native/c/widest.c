/* The widest vectors of doubles that processor and operating system offer, asked when run: a cache of libraries may be
   shared by machines. */
EXPORT int widest(void) {
#if (defined(__x86_64__) || defined(_M_X64)) && defined(__GNUC__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return 8;
  if (__builtin_cpu_supports("avx2")) return 4;
  return 2;
#elif defined(__aarch64__) && defined(__GNUC__)
  return 2;
#else
  return 1;
#endif
}
