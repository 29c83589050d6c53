#include <algorithm>
#include <cmath>
#include <cstdint>

struct Filter {
  double x[3], p[3][3];

  void predict(double gap, double noise, int order) {
    const double square = gap * gap, move[3] = {1, gap, square / 2}, factorial[3] = {1, 1, 2};
    const double power[6] = {1, gap, square, square * gap, square * square, square * square * gap};
    for (int i = 0; i < 3; i++)
      for (int k = i + 1; k < 3; k++) {
        x[i] += move[k - i] * x[k];
        for (int j = 0; j < 3; j++) p[i][j] += move[k - i] * p[k][j];
      }
    for (int j = 0; j < 3; j++)
      for (int k = j + 1; k < 3; k++)
        for (int i = 0; i < 3; i++) p[i][j] += move[k - j] * p[i][k];
    for (int a = 0; a < order; a++)  // white noise changes the last state
      for (int b = 0; b < order; b++)
        p[order - 1 - a][order - 1 - b] += noise * power[a + b + 1] / ((a + b + 1) * factorial[a] * factorial[b]);
  }
  double update(double place, double variance) {  // it returns the logarithm of the likelihood
    double total = p[0][0] + variance, error = place - x[0], first[3] = {p[0][0], p[0][1], p[0][2]};
    for (int i = 0; i < 3; i++) {
      x[i] += first[i] / total * error;
      for (int j = 0; j < 3; j++) p[i][j] -= first[i] * first[j] / total;
    }
    for (int j = 0; j < 3; j++) p[0][j] = p[j][0] = first[j] * variance / total;  // without a difference of large numbers
    return -(error * error / total + std::log(total)) / 2;
  }
};

static void mix(Filter *filters, double *weight, double change) {
  const Filter old[2] = {filters[0], filters[1]};
  const double was[2] = {weight[0], weight[1]};
  for (int to = 0; to < 2; to++) {
    weight[to] = was[to] * (1 - change) + was[1 - to] * change;
    const double share = was[1 - to] * change / weight[to], both = share * (1 - share);
    const Filter &own = old[to], &other = old[1 - to];
    for (int i = 0; i < 3; i++) {
      filters[to].x[i] += share * (other.x[i] - own.x[i]);
      for (int j = 0; j < 3; j++)
        filters[to].p[i][j] += share * (other.p[i][j] - own.p[i][j]) + both * (other.x[i] - own.x[i]) * (other.x[j] - own.x[j]);
    }
  }
}

extern "C" __attribute__((visibility("default"))) void slopes(
    int64_t readings, const int64_t *latest, const double *silence, const double *stamp, const double *place,
    int models, const double *noise, int order, double variance, double speed, double acceleration, double dwell,
    double timeout, double *slope) {
  Filter filters[2];
  double weight[2], likely[2];
  for (int64_t edge = 0, reading = 0; reading < readings; reading++) {
    for (; edge <= latest[reading]; edge++) {
      const double gap = edge ? stamp[edge] - stamp[edge - 1] : 0;
      const bool anew = !edge || gap > timeout;
      if (models == 2 && !anew) mix(filters, weight, (1 - std::exp(-2 * gap / dwell)) / 2);
      for (int m = 0; m < models; m++) {
        if (anew) filters[m] = {{place[edge]}, {{variance}, {0, speed}, {0, 0, acceleration}}}, weight[m] = likely[m] = 1;
        else filters[m].predict(gap, noise[m], order), likely[m] = filters[m].update(place[edge], variance);
      }
      double sum = 0, most = *std::max_element(likely, likely + models);
      for (int m = 0; m < models; m++) sum += weight[m] *= std::exp(likely[m] - most);
      for (int m = 0; m < models; m++) weight[m] = std::max(weight[m] / sum, 1e-9);
    }
    for (int m = 0; edge && m < models; m++)  // slopes begin with 0
      slope[reading] += weight[m] * (filters[m].x[1] + filters[m].x[2] * silence[reading]);
  }
}
