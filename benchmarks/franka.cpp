// franka::limitRate of libfranka (Apache-2.0), as the wheel pylibfranka ships it, over a row of setpoints.
#include <array>
#include <cstring>

namespace franka {
using Seven = std::array<double, 7>;
Seven limitRate(const Seven& up, const Seven& low, const Seven& acceleration, const Seven& jerk, const Seven& wanted,
                const Seven& last, const Seven& velocity, const Seven& last_acceleration);
}  // namespace franka

static franka::Seven of(const double* x) {
  franka::Seven found;
  std::memcpy(found.data(), x, sizeof found);
  return found;
}

// q (n, 7) setpoints a millisecond apart; up, low (n, 7) velocity limits where the last one is; out (n, 7) limited.
extern "C" void limit(long n, const double* q, const double* up, const double* low, const double* a, const double* j,
                      double* out) {
  franka::Seven last = of(q), v{}, acceleration{};
  for (long i = 0; i < n; i++) {
    franka::Seven r = franka::limitRate(of(up + 7 * i), of(low + 7 * i), of(a), of(j), of(q + 7 * i), last, v,
                                        acceleration);
    for (int k = 0; k < 7; k++) {
      double velocity = (r[k] - last[k]) / 1e-3;
      acceleration[k] = (velocity - v[k]) / 1e-3;
      v[k] = velocity;
      last[k] = out[7 * i + k] = r[k];
    }
  }
}
