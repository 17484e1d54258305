// The fastest plan on a grid, from rest to rest at most as fast as `cap`: backwards what can still be braked, then forwards
// what can be reached. All axes have the acceleration `a`.
#include <math.h>

enum { AXES = 2 };

typedef struct {
  double at_rest, slope;
} line; // a bound of the acceleration along the path: at_rest + slope * x

// The bounds of the acceleration on an interval, and of the squared speed where an axis does not move.
static int bounds(const double *tangent, const double *curvature, double a, line *low, line *high, double *most) {
  int count = 0;
  for (int axis = 0; axis < AXES; axis++) {
    double p = fabs(tangent[axis]), k = tangent[axis] > 0 ? curvature[axis] : -curvature[axis];
    if (p < 1e-9) {
      if (fabs(k) > 1e-12) *most = fmin(*most, a / fabs(k));
      continue;
    }
    low[count] = (line){-a / p, -k / p};
    high[count] = (line){a / p, -k / p};
    count++;
  }
  return count;
}

// The highest x at which `low` is below `high`.
static double meet(line low, line high) {
  double apart = low.slope - high.slope;
  return apart > 1e-15 ? (high.at_rest - low.at_rest) / apart : INFINITY;
}

// n intervals: length[n], tangent[2n], curvature[2n]; n + 1 nodes: cap, and the squared speed x. Answers the time.
double topp(int n, const double *length, const double *tangent, const double *curvature, const double *cap, double a, double *x) {
  line low[AXES], high[AXES];
  x[n] = cap[n];
  for (int i = n - 1; i >= 0; i--) {
    double most = cap[i];
    int count = bounds(tangent + AXES * i, curvature + AXES * i, a, low, high, &most);
    line brake = {x[i + 1] / (2 * length[i]), -1 / (2 * length[i])}; // u leads to x[i + 1]
    for (int j = 0; j < count; j++) {
      for (int l = 0; l < count; l++) most = fmin(most, meet(low[j], high[l]));
      most = fmin(most, meet(low[j], brake));
    }
    x[i] = fmax(most, 0);
  }
  double time = 0;
  x[0] = fmin(x[0], cap[0]);
  for (int i = 0; i < n; i++) {
    double most = INFINITY, u = INFINITY;
    int count = bounds(tangent + AXES * i, curvature + AXES * i, a, low, high, &most);
    for (int j = 0; j < count; j++) u = fmin(u, high[j].at_rest + high[j].slope * x[i]);
    x[i + 1] = fmax(fmin(x[i + 1], x[i] + 2 * length[i] * u), 0);
    time += 2 * length[i] / (sqrt(x[i]) + sqrt(x[i + 1]) + 1e-300);
  }
  return time;
}
